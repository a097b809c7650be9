/* tools/render/picture.c: see picture.h. Cost: linear in the pixels. */
#include "tools/render/picture.h"

#include <math.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

#include "tools/kit/file.h"

/* Values above the knee approach 1: the slope is 1 at the knee. */
static float compress_peak(float peak, float knee) {
    float room = 1 - knee;
    return 1 - room * room / (peak + room - knee);
}

static void apply_soft_tone(float rgb[3]) {
    const float knee = .7F, fade = .12F;
    float peak = fmaxf(rgb[0], fmaxf(rgb[1], rgb[2]));
    if (peak <= knee) return;
    float bent = compress_peak(peak, knee), white = 1 - 1 / (1 + fade * (peak - bent));
    for (int k = 0; k < 3; ++k) rgb[k] = rgb[k] * (bent / peak) * (1 - white) + bent * white;
}

/* A rational fit of the ACES curve (Narkowicz 2015). */
static float apply_filmic_tone(float x) {
    return x * (2.51F * x + .03F) / (x * (2.43F * x + .59F) + .14F);
}

void picture_apply_tone(picture_tone tone, float rgb[3]) {
    for (int k = 0; k < 3; ++k) rgb[k] = fminf(fmaxf(rgb[k], 0), 1e6F);
    if (tone == PICTURE_TONE_SOFT) apply_soft_tone(rgb);
    for (int k = 0; k < 3; ++k) {
        if (tone == PICTURE_TONE_FILMIC) rgb[k] = apply_filmic_tone(rgb[k]);
        rgb[k] = fminf(rgb[k], 1);
    }
}

static float convert_srgb(float s) {
    return s <= .04045F ? s / 12.92F : powf((s + .055F) / 1.055F, 2.4F);
}

bool picture_parse_background(const char *text, picture_background *out) {
    if (strcmp(text, "none") == 0) {
        *out = (picture_background){.transparent = true};
        return true;
    }
    if (text[0] != '#' || strlen(text) != 7 || strspn(text + 1, "0123456789abcdefABCDEF") != 6) return false;
    unsigned long value = strtoul(text + 1, NULL, 16);
    for (int k = 0; k < 3; ++k)
        out->top[k] = out->bottom[k] = convert_srgb((float)(value >> (16 - 8 * k) & 255) / 255);
    out->transparent = false;
    return true;
}

/* From linear light in 4095 steps to sRGB bytes. A step is finer than a byte, except in the first three
 * bytes. */
static void fill_srgb_table(unsigned char table[4096]) {
    for (int i = 0; i < 4096; ++i) {
        double x = i / 4095., s = x <= .0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - .055;
        table[i] = (unsigned char)lrint(255 * s);
    }
}

static unsigned char encode_byte(const unsigned char table[4096], float x) {
    return table[(int)(4095 * fminf(fmaxf(x, 0), 1) + .5F)];
}

static void encode_row(const unsigned char table[4096], const float *pixels, uint32_t width,
                       const picture_background *background, float down, unsigned char *row) {
    for (uint32_t x = 0; x < width; ++x, pixels += 4) {
        float cover = pixels[3];
        if (background->transparent) {
            for (int k = 0; k < 3; ++k) *row++ = encode_byte(table, cover > 0 ? pixels[k] / cover : 0);
            *row++ = (unsigned char)lrintf(255 * fminf(cover, 1));
        } else {
            for (int k = 0; k < 3; ++k) {
                float behind = background->top[k] + down * (background->bottom[k] - background->top[k]);
                *row++ = encode_byte(table, pixels[k] + (1 - cover) * behind);
            }
        }
    }
}

/* False if libpng fails. It then jumps out of this function, which owns no memory. */
static bool write_png(png_structp png, png_infop info, FILE *stream, uint32_t width, uint32_t height,
                      const float *image, const picture_background *background, unsigned char *row) {
    unsigned char table[4096];
    fill_srgb_table(table);
    if (setjmp(png_jmpbuf(png))) return false;
    png_init_io(png, stream);
    png_set_IHDR(png, info, width, height, 8,
                 background->transparent ? PNG_COLOR_TYPE_RGBA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    for (uint32_t y = 0; y < height; ++y) {
        encode_row(table, image + 4 * (size_t)y * width, width, background, ((float)y + .5F) / (float)height,
                   row);
        png_write_row(png, row);
    }
    png_write_end(png, NULL);
    return true;
}

/* The result of the call reports errors; libpng must not print. */
static void png_error_jump(png_structp png, png_const_charp text) {
    (void)text;
    png_longjmp(png, 1);
}

static void png_warning_drop(png_structp png, png_const_charp text) {
    (void)png;
    (void)text;
}

int picture_save(tool *t, const char *path, uint32_t width, uint32_t height, const float *image,
                 const picture_background *background) {
    unsigned char *row = tool_allocate(t, width, 4);
    if (!row) return TOOL_MEMORY;
    tool_writer writer;
    int code = tool_writer_open(t, path, &writer);
    if (code != TOOL_DONE) {
        tool_release(t, row);
        return code;
    }
    png_infop info = NULL;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, png_error_jump, png_warning_drop);
    if (png) info = png_create_info_struct(png);
    if (!info) code = tool_fail(t, TOOL_MEMORY, "%s: out of memory for the picture", path);
    if (code == TOOL_DONE && !write_png(png, info, writer.stream, width, height, image, background, row))
        code = tool_fail(t, TOOL_OUTPUT, "%s: cannot be written", path);
    png_destroy_write_struct(&png, &info);
    tool_release(t, row);
    return tool_writer_close(t, &writer, code);
}
