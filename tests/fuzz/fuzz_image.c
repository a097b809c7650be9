/* Whatever the bytes are: an error, or an image whose levels keep within its values. */
#include <math.h>

#include "fuzz/fuzz.h"
#include "scene/texture/pyramid.h"

static void use_image(const fct_env *env, const fct_image *image) {
    static const float factor[3] = {1, .5F, 2};
    static const fct_wrap wrap[2] = {FCT_WRAP_REPEAT, FCT_WRAP_MIRROR};
    fct_pyramid pyramid;
    uint8_t low = 255, high = 0;
    for (size_t i = 0; i < 3 * (size_t)image->width * image->height; ++i) {
        if (image->pixels[i] < low) low = image->pixels[i];
        if (image->pixels[i] > high) high = image->pixels[i];
    }
    if (fct_pyramid_build(env, image, factor, true, &pyramid) == FCT_OK)
        for (int k = 0; k < 20; ++k) {
            const double point[2] = {k * 1.7 - 9, k * -.9 + 4};
            double color[3];
            fct_pyramid_sample(&pyramid, wrap, point, fct_pyramid_level_of(&pyramid, k), color);
            for (int c = 0; c < 3; ++c)
                fuzz_require(color[c] >= (double)pyramid.table[c][low] - 1e-4 &&
                                 color[c] <= (double)pyramid.table[c][high] + 1e-4,
                             "means lie between the values");
        }
    fct_pyramid_release(env, &pyramid);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    fct_image image;
    limit.largest += FUZZ_IMAGE + 1100 * size;
    if (fct_image_decode(&env, "image", data, size, &image) == FCT_OK) {
        fuzz_require(image.width > 0 && image.height > 0 && image.pixels, "an image has pixels");
        /* Levels take time. */
        if ((uint64_t)image.width * image.height <= 1 << 16) use_image(&env, &image);
    } else {
        fuzz_require(!image.pixels && !image.width && !image.height, "a failed read leaves nothing behind");
    }
    fct_release(&env, image.pixels);
    fuzz_end();
    return 0;
}
