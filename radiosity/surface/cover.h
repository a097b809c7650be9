/* radiosity/surface/cover.h: vertices that other surfaces cover, such as those of a floor under a crate. */
#ifndef FCT_RADIOSITY_COVER_H
#define FCT_RADIOSITY_COVER_H

#include "facetree/scene.h"

/* True if the point sees nothing but the backs of one-sided surfaces: it is inside a closed body or under
 * one. Rays start at point + offset * normal (unit). *rays grows by the number of rays, 1 for most points.
 * *nearest (may be NULL): the least distance to a hit of these rays, infinity without a hit. */
bool fct_point_is_covered(const fct_scene *scene, const float point[3], const float normal[3], float offset,
                          uint64_t seed, float *nearest, uint64_t *rays);

#endif
