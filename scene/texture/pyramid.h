/* scene/texture/pyramid.h: the reflectance that an image gives to a surface, at all resolutions.
 *
 * A texel reflects factor * linear, at most FCT_SCENE_MOST_REFLECTANCE. All factors that leave every texel
 * below that share the pyramid of the factor 1, which its users scale. Level 0 is the image, whose bytes a
 * table translates. Level k + 1 has half of the width and height of level k, rounded down, and the same mean:
 * each of its texels is the mean of the area that it covers, also where sizes are odd. Lookups are bilinear,
 * between texel centres, and between two levels.
 */
#ifndef FCT_SCENE_PYRAMID_H
#define FCT_SCENE_PYRAMID_H

#include "facetree/scene.h"
#include "scene/texture/image.h"

enum { FCT_PYRAMID_LEVELS = 32 };

typedef struct fct_pyramid_level {
    uint32_t width, height;
    uint16_t *texels; /* height x width x 3, 65535 is 1; NULL at level 0 */
} fct_pyramid_level;

typedef struct fct_pyramid {
    uint32_t texture; /* of the scene */
    float factor[3];
    const uint8_t *pixels; /* of the image */
    float table[3][256];
    bool clamped; /* a texel would reflect more; the values are those of the factor */
    fct_pyramid_level levels[FCT_PYRAMID_LEVELS];
    uint32_t level_count;
} fct_pyramid;

/* The image's pixels must outlive the pyramid. Errors: MEMORY; call fct_pyramid_release also then. */
fct_result fct_pyramid_build(const fct_env *env, const fct_image *image, const float factor[3], bool clamped,
                             fct_pyramid *out);
/* Whether a texel would reflect more than FCT_SCENE_MOST_REFLECTANCE. O(pixels). */
bool fct_pyramid_would_clamp(const fct_image *image, const float factor[3]);
void fct_pyramid_release(const fct_env *env, fct_pyramid *pyramid);

/* The level, with a fraction, whose texels have this width in texels of level 0. */
double fct_pyramid_level_of(const fct_pyramid *pyramid, double width);
/* The reflectance at an image point; (0, 0) and (1, 1) are the outer corners of the first and the last texel.
 */
void fct_pyramid_sample(const fct_pyramid *pyramid, const fct_wrap wrap[2], const double point[2],
                        double level, double out[3]);

#endif
