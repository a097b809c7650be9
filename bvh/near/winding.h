/* bvh/near/winding.h: the winding number of the surface about a point. A kernel: winding.c is compiled per
 * processor. */
#ifndef FCT_BVH_WINDING_H
#define FCT_BVH_WINDING_H

#include "base/variant.h"
#include "bvh/model.h"

/* The winding number about a finite point, for a bvh with has_sign. A cluster of faces counts by its moments
 * if the point is farther from its centre than `reach` times its radius; with INFINITY, every face is
 * measured. visits may be NULL. */
#define fct_winding_sum FCT_KERNEL(fct_winding_sum)
FCT_DECLARE_KERNEL(double, fct_winding_sum, (const fct_bvh *bvh, v3 point, float reach, fct_visits *visits));

/* Whether the winding number is above .5 or below -.5 (sign.c). */
bool fct_winding_is_inside(const fct_bvh *bvh, v3 point, fct_visits *visits);

#endif
