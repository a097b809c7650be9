/* scene/texture/png.c: decodes PNG with libpng. libpng jumps out of run_png after an error; that function
 * owns nothing, and all state is in the job.
 */
#include <png.h>
#include <stdio.h>
#include <string.h>

#include "scene/texture/image.h"

/* A file of fewer than 8 bits per pixel may exceed the usual proportion up to this. */
#define FREE_SIZE ((uint64_t)64 << 20)

typedef struct reader {
    fct_image_job *job;
    size_t at; /* in the file */
    bool no_memory;
    fct_result result;
} reader;

static void jump_out(png_structp png, png_const_charp text) {
    reader *r = png_get_error_ptr(png);
    snprintf(r->job->text, sizeof r->job->text, "%s", text);
    png_longjmp(png, 1);
}

static void drop_warning(png_structp png, png_const_charp text) {
    (void)png;
    (void)text;
}

static void *allocate_png(png_structp png, png_alloc_size_t size) {
    reader *r = png_get_mem_ptr(png);
    void *memory = fct_allocate(r->job->env, size, 1);
    r->no_memory |= !memory;
    return memory;
}

static void release_png(png_structp png, void *memory) {
    const reader *r = png_get_mem_ptr(png);
    fct_release(r->job->env, memory);
}

static void read_bytes(png_structp png, png_bytep to, size_t count) {
    reader *r = png_get_io_ptr(png);
    if (count > r->job->size - r->at) png_error(png, "the file ends too early");
    memcpy(to, r->job->data + r->at, count);
    r->at += count;
}

/* Makes every kind of pixel three bytes of RGB. */
static void choose_pixels(png_structp png, png_infop info) {
    const int type = png_get_color_type(png, info);
    png_set_expand(png);
    png_set_scale_16(png);
    png_set_strip_alpha(png);
    if (type == PNG_COLOR_TYPE_GRAY || type == PNG_COLOR_TYPE_GRAY_ALPHA) png_set_gray_to_rgb(png);
}

static bool run_png(png_structp png, png_infop info, reader *r) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_set_read_fn(png, r, read_bytes);
    png_read_info(png, info);
    choose_pixels(png, info);
    const int passes = png_set_interlace_handling(png);
    png_read_update_info(png, info);
    const uint32_t width = png_get_image_width(png, info), height = png_get_image_height(png, info);
    r->result = fct_image_allocate(r->job, width, height, FREE_SIZE);
    if (r->result != FCT_OK) return true;
    if (png_get_rowbytes(png, info) != 3 * (size_t)width) png_error(png, "its pixels are of an unknown kind");
    for (int pass = 0; pass < passes; ++pass)
        for (uint32_t y = 0; y < height; ++y)
            png_read_row(png, r->job->image.pixels + 3 * (size_t)y * width, NULL);
    png_read_end(png, NULL);
    return true;
}

fct_result fct_png_decode(fct_image_job *job) {
    reader r = {.job = job, .result = FCT_OK};
    png_infop info = NULL;
    png_structp png = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, &r, jump_out, drop_warning, &r,
                                               allocate_png, release_png);
    if (png) info = png_create_info_struct(png);
    if (!info) {
        png_destroy_read_struct(&png, NULL, NULL);
        return fct_fail_memory(job->env, "an image");
    }
    if (!run_png(png, info, &r))
        r.result = r.no_memory
                       ? fct_fail_memory(job->env, "an image")
                       : fct_fail(job->env, FCT_ERROR_DATA, "%s: a damaged PNG: %s", job->name, job->text);
    png_destroy_read_struct(&png, &info, NULL);
    return r.result;
}
