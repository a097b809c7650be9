/* scene/texture/budget.c: memory for an image, in proportion to its file. */
#include "scene/texture/image.h"

/* Deflate writes at most 1032 bytes per byte, and a grey pixel becomes three bytes. JPEG has a bit at least
 * per block of 64 pixels. */
#define MOST_RATIO 3100

fct_result fct_image_allocate(fct_image_job *job, uint32_t width, uint32_t height, uint64_t free) {
    const uint64_t bytes = 3 * (uint64_t)width * height;
    if (!bytes || width > INT32_MAX / 3 || bytes > free + MOST_RATIO * (uint64_t)job->size)
        return fct_fail(job->env, FCT_ERROR_DATA,
                        "%s: a file of %zu bytes cannot hold an image of %u x %u pixels", job->name,
                        job->size, width, height);
    job->image.pixels = fct_allocate(job->env, (size_t)height, 3 * (size_t)width);
    if (!job->image.pixels) return fct_fail_memory(job->env, "an image");
    job->image.width = width, job->image.height = height;
    return FCT_OK;
}
