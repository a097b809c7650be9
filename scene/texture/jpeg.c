/* scene/texture/jpeg.c: decodes JPEG with libjpeg. libjpeg jumps out of run_jpeg after an error; that
 * function owns nothing, and all state is in the reader.
 */
#include <setjmp.h>
#include <stdio.h>
#include <string.h>

/* jpeglib.h needs stdio.h and size_t. */
#include <jerror.h>
#include <jpeglib.h>

#include "scene/texture/image.h"

/* A progressive file may repeat short scans without end, each of which goes through the whole image. */
enum { MOST_SCANS = 500 };
/* Headers and tables leave few bytes of a small file to its pixels. */
#define FREE_SIZE ((uint64_t)1 << 20)

typedef struct reader {
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr errors;
    struct jpeg_progress_mgr progress;
    jmp_buf jump;
    fct_image_job *job;
    void *reserved; /* memory that libjpeg takes beside the environment */
    bool no_memory;
    fct_result result;
} reader;

static void jump_out(j_common_ptr jpeg) {
    reader *r = jpeg->client_data;
    char text[JMSG_LENGTH_MAX];
    r->no_memory = jpeg->err->msg_code == JERR_OUT_OF_MEMORY;
    jpeg->err->format_message(jpeg, text);
    snprintf(r->job->text, sizeof r->job->text, "%s", text);
    longjmp(r->jump, 1);
}

/* Keeps the first warning (level -1); others are traces. */
static void keep_warning(j_common_ptr jpeg, int level) {
    reader *r = jpeg->client_data;
    char text[JMSG_LENGTH_MAX];
    if (level >= 0 || r->errors.num_warnings++) return;
    jpeg->err->format_message(jpeg, text);
    snprintf(r->job->text, sizeof r->job->text, "%s", text);
}

static void drop_output(j_common_ptr jpeg) {
    (void)jpeg;
}

static void count_scans(j_common_ptr jpeg) {
    reader *r = jpeg->client_data;
    if (r->jpeg.input_scan_number <= MOST_SCANS) return;
    r->errors.msg_code = JERR_BAD_PROGRESSION;
    jump_out(jpeg);
}

/* A file of several scans keeps all its coefficients, of two bytes each. */
static fct_result reserve_coefficients(reader *r) {
    const size_t count = (size_t)r->jpeg.image_width * r->jpeg.image_height;
    if (!jpeg_has_multiple_scans(&r->jpeg)) return FCT_OK;
    r->reserved = fct_allocate(r->job->env, count, 2 * (size_t)r->jpeg.num_components);
    return r->reserved ? FCT_OK : fct_fail_memory(r->job->env, "an image");
}

static bool run_jpeg(reader *r) {
    struct jpeg_decompress_struct *jpeg = &r->jpeg;
    if (setjmp(r->jump)) return false;
    jpeg_create_decompress(jpeg);
    jpeg->client_data = r;
    jpeg->progress = &r->progress;
    jpeg_mem_src(jpeg, r->job->data, (unsigned long)r->job->size);
    jpeg_read_header(jpeg, TRUE);
    r->result = fct_image_allocate(r->job, jpeg->image_width, jpeg->image_height, FREE_SIZE);
    if (r->result == FCT_OK) r->result = reserve_coefficients(r);
    if (r->result != FCT_OK) return true;
    jpeg->out_color_space = JCS_RGB;
    jpeg->dct_method = JDCT_ISLOW;
    jpeg_start_decompress(jpeg);
    while (jpeg->output_scanline < jpeg->output_height) {
        JSAMPROW row = r->job->image.pixels + 3 * (size_t)jpeg->output_scanline * jpeg->output_width;
        jpeg_read_scanlines(jpeg, &row, 1);
    }
    jpeg_finish_decompress(jpeg);
    return true;
}

fct_result fct_jpeg_decode(fct_image_job *job) {
    const fct_env *env = job->env;
    reader *r = fct_allocate_zero(env, 1, sizeof *r); /* its address must not change */
    if (!r) return fct_fail_memory(env, "an image");
    r->job = job;
    r->result = FCT_OK;
    r->jpeg.err = jpeg_std_error(&r->errors);
    r->jpeg.client_data = r;
    r->errors.error_exit = jump_out;
    r->errors.emit_message = keep_warning;
    r->errors.output_message = drop_output;
    r->progress.progress_monitor = count_scans;
    const bool whole = run_jpeg(r);
    jpeg_destroy_decompress(&r->jpeg);
    fct_result result = r->result;
    if (!whole && r->no_memory)
        result = fct_fail_memory(env, "an image");
    else if (!whole)
        result = fct_fail(env, FCT_ERROR_DATA, "%s: a damaged JPEG: %s", job->name, job->text);
    else if (result == FCT_OK && r->errors.num_warnings)
        fct_note(env, FCT_MESSAGE_WARNING, "%s: a damaged JPEG: %s", job->name, job->text);
    fct_release(env, r->reserved);
    fct_release(env, r);
    return result;
}
