/* scene/texture/image.h: decodes PNG and JPEG. */
#ifndef FCT_SCENE_IMAGE_H
#define FCT_SCENE_IMAGE_H

#include "base/env.h"

/* Pixels as sRGB bytes, by rows from the top. */
typedef struct fct_image {
    uint32_t width, height;
    uint8_t *pixels; /* height x width x 3; fct_release frees it */
} fct_image;

/* Decodes a file in memory, by its first bytes. Grey and palettes become RGB, 16 bits become 8, and alpha is
 * left out. Colour profiles are left out too: base colours are sRGB. `name` begins every message. A damaged
 * JPEG that can be decoded gives a warning. Errors: DATA (another format, damage, a size out of proportion to
 * that of the file), MEMORY; then *out is all zero. */
fct_result fct_image_decode(const fct_env *env, const char *name, const unsigned char *data, size_t size,
                            fct_image *out);

/* ---- For the decoders ---- */

/* A decoder reports its error as a text. */
enum { FCT_IMAGE_TEXT = 200 };
typedef struct fct_image_job {
    const fct_env *env;
    const char *name;
    const unsigned char *data;
    size_t size;
    fct_image image;
    char text[FCT_IMAGE_TEXT];
} fct_image_job;

/* Allocates the pixels. A false size in a short file must not take all memory: beyond `free` bytes, the image
 * is in proportion to the file. Errors: DATA, MEMORY. */
fct_result fct_image_allocate(fct_image_job *job, uint32_t width, uint32_t height, uint64_t free);
/* Both leave job->image for the caller to release. Errors: as above. */
fct_result fct_png_decode(fct_image_job *job);
fct_result fct_jpeg_decode(fct_image_job *job);

#endif
