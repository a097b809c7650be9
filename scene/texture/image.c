/* scene/texture/image.c: see image.h. */
#include "scene/texture/image.h"

#include <string.h>

fct_result fct_image_decode(const fct_env *env, const char *name, const unsigned char *data, size_t size,
                            fct_image *out) {
    fct_image_job job = {.env = env, .name = name, .data = data, .size = size};
    fct_result result;
    if (size >= 8 && !memcmp(data, "\x89PNG\r\n\x1a\n", 8))
        result = fct_png_decode(&job);
    else if (size >= 3 && !memcmp(data, "\xff\xd8\xff", 3))
        result = fct_jpeg_decode(&job);
    else
        result = fct_fail(env, FCT_ERROR_DATA, "%s: expected a PNG or JPEG image", name);
    if (result != FCT_OK) {
        fct_release(env, job.image.pixels);
        job.image = (fct_image){0};
    }
    *out = job.image;
    return result;
}
