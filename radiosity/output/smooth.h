/* radiosity/output/smooth.h: reduces the noise of indirect light on flat surfaces. */
#ifndef FCT_RADIOSITY_SMOOTH_H
#define FCT_RADIOSITY_SMOOTH_H

#include "radiosity/surface/surface.h"

/* Replaces the light (per vertex x 3) of flat vertices that are not covered, twice, by a weighted mean with
 * their neighbours:
 *   c_v = (c_v + sum w c_u) / (1 + sum w),  w = (1 - x^2)^2 for x = |c_v - c_u| / (10 % of |c_v| + |c_u|) <
 * 1, else 0, with |.| summed over channels. An edge of two faces counts twice. Neighbours whose light differs
 * by 10 % or more do not mix. Errors: MEMORY. */
fct_result fct_light_smooth(const fct_env *env, const fct_surface *surface, const uint8_t *covered,
                            float *light);

#endif
