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

/* An estimate of the variance of this irradiance, per channel, from how much the anchors differ from the
 * light that the blend fits to them: from the noise of their rays, and from changes that the fit does not
 * follow. 0 with one anchor. The visibility is tested again and adds to *rays. */
void fct_anchors_variance(const fct_anchors *anchors, const fct_elements *set, const float point[3],
                          const float normal[3], float offset, bool flat, double variance[3], uint64_t *rays);

#endif
