/* tests/scene/texture/pictures.h: PNG and JPEG files in memory. */
#ifndef FCT_TESTS_PICTURES_H
#define FCT_TESTS_PICTURES_H

#include "support.h"

#include <jpeglib.h>
#include <png.h>

typedef struct picture {
    unsigned char *data;
    size_t size;
} picture;

static inline void picture_append(png_structp png, png_bytep data, size_t size) {
    picture *p = png_get_io_ptr(png);
    p->data = realloc(p->data, p->size + size);
    memcpy(p->data + p->size, data, size);
    p->size += size;
}

/* A PNG of rows in libpng's own layout. type: PNG_COLOR_TYPE_*. */
static inline picture make_png(uint32_t width, uint32_t height, int depth, int type, bool interlaced,
                               const unsigned char *rows, size_t row_size) {
    picture out = {0};
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_set_write_fn(png, &out, picture_append, NULL);
    png_set_IHDR(png, info, width, height, depth, type, interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (type == PNG_COLOR_TYPE_PALETTE) {
        png_color palette[256];
        for (int k = 0; k < 256; ++k)
            palette[k] = (png_color){(png_byte)k, (png_byte)(255 - k), (png_byte)(k / 2)};
        png_set_PLTE(png, info, palette, 1 << depth);
    }
    png_write_info(png, info);
    const int passes = interlaced ? png_set_interlace_handling(png) : 1;
    for (int pass = 0; pass < passes; ++pass)
        for (uint32_t y = 0; y < height; ++y) png_write_row(png, rows + y * row_size);
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    return out;
}

static inline picture make_rgb_png(uint32_t width, uint32_t height, const unsigned char *pixels) {
    return make_png(width, height, 8, PNG_COLOR_TYPE_RGB, false, pixels, 3 * (size_t)width);
}

static inline picture make_jpeg(uint32_t width, uint32_t height, int components, bool progressive,
                                const unsigned char *pixels) {
    picture out = {0};
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    unsigned long size = 0;
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &out.data, &size);
    jpeg.image_width = width, jpeg.image_height = height;
    jpeg.input_components = components;
    jpeg.in_color_space = components == 1 ? JCS_GRAYSCALE : components == 4 ? JCS_CMYK : JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 98, TRUE);
    if (progressive) jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    while (jpeg.next_scanline < height) {
        JSAMPROW row =
            (JSAMPROW)(uintptr_t)(pixels + (size_t)jpeg.next_scanline * width * (size_t)components);
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    out.size = size;
    return out;
}

#endif
