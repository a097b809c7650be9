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

/* Reduces the noise of shadow rays in penumbrae. The direct light of flat vertices that are not covered has
 * known variances: those of the sights, (.5 % of the light)^2, and a tenth of that of the vertex to smooth.
 * Twice, by weighted least squares, a linear function over the plane is fitted to the light around a vertex:
 * that of its neighbours and its own, and that of all vertices within two edges (at most 64). The light of
 * the vertex moves towards the value of each function, by the share min(1, 6 / M)^2, M: chi-square per degree
 * of freedom, n - 3 for n vertices. So noise disappears along the border of a shadow, and a change of light
 * that is larger than the noise stays. Light is per vertex x 3; a vertex without variance keeps it. Errors:
 * MEMORY. */
fct_result fct_direct_smooth(const fct_env *env, const fct_surface *surface, const uint8_t *covered,
                             const fct_sight *sights, float *light);

#endif
