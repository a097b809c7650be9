/* radiosity/output/blend.h: indirect irradiance at any point of a surface, blended from its anchors. */
#ifndef FCT_RADIOSITY_BLEND_H
#define FCT_RADIOSITY_BLEND_H

#include "radiosity/output/anchor_tree.h"
#include "radiosity/solve/element.h"

/* Indirect irradiance (RGB) at a point with a unit normal. flat: the surface around the point lies in one
 * plane. There, anchors whose light differs from the others' must be visible from the point, or light would
 * pass under walls that stand on one continuous floor; each such test adds 1 to *rays. Without any anchor the
 * irradiance is 0. */
void fct_anchors_irradiance(const fct_anchors *anchors, const fct_elements *set, const float point[3],
                            const float normal[3], float offset, bool flat, double irradiance[3],
                            uint64_t *rays);

#endif
