/* radiosity/output/smooth.h: reduces the noise of light on flat surfaces.
 *
 * Flat vertices at one position in one plane, such as those of triangles without common vertices, count as
 * one with their mean light, unless their light differs by 10 % of the sum or more: a wall may stand between
 * them.
 */
#ifndef FCT_RADIOSITY_SMOOTH_H
#define FCT_RADIOSITY_SMOOTH_H

#include "radiosity/light/lamp.h"
#include "radiosity/surface/surface.h"

/* Replaces the light (per vertex x 3) of flat vertices that are not covered, twice, by a weighted mean with
 * their neighbours:
 *   c_v = (c_v + sum w c_u) / (1 + sum w),  w = (1 - x^2)^2 for x = |c_v - c_u| / (10 % of |c_v| + |c_u|) <
 * 1, else 0, with |.| summed over channels. An edge of two faces counts twice. Neighbours whose light differs
 * by 10 % or more do not mix. Errors: MEMORY. */
fct_result fct_light_smooth(const fct_env *env, const fct_surface *surface, const uint8_t *covered,
                            float *light);

/* Reduces the noise of shadow rays in wide penumbrae. The direct light of a flat vertex and of its flat
 * neighbours, all of them not covered, has known variances: those of the sights, and (.5 % of the light)^2.
 * If a linear function over the plane explains the light within these, by chi-square per degree of freedom
 * of at most 2.5, the vertex receives its value, by weighted least squares. So a change of light that is
 * larger than the noise stays as it is. An edge of two faces counts twice, and so does the vertex itself.
 * Light is per vertex x 3; a vertex without variance keeps it. Errors: MEMORY. */
fct_result fct_direct_smooth(const fct_env *env, const fct_surface *surface, const uint8_t *covered,
                             const fct_sight *sights, float *light);

#endif
