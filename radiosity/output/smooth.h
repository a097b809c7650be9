/* radiosity/output/smooth.h: reduces the noise of colours on flat surfaces. */
#ifndef FCT_RADIOSITY_SMOOTH_H
#define FCT_RADIOSITY_SMOOTH_H

#include "radiosity/surface/surface.h"

/* Replaces the colours of flat vertices, twice, by a weighted mean with their neighbours:
 *   c_v = (c_v + sum w c_u) / (1 + sum w),  w = (1 - x^2)^2 for x = |c_v - c_u| / (4 % of |c_v| + |c_u|) < 1,
 * else 0, with |.| summed over channels. An edge of two faces counts twice. Neighbours whose light differs by
 * 4 % or more, as across a shadow border, do not mix. The filter acts on the whole colour, direct light
 * included: with it, weak gradients on coarse meshes get flatter. Errors: MEMORY. */
fct_result fct_colors_smooth(const fct_env *env, fct_surface *surface);

#endif
