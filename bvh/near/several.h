/* bvh/near/several.h: the search for the k nearest faces. A kernel: several.c is compiled per processor. */
#ifndef FCT_BVH_SEVERAL_H
#define FCT_BVH_SEVERAL_H

#include "base/variant.h"
#include "bvh/model.h"

/* fct_bvh_nearest without its checks: point and max_distance are finite or infinite numbers as documented
 * there, k is at least 1, and the backend is OBB. */
#define fct_several_search FCT_KERNEL(fct_several_search)
FCT_DECLARE_KERNEL(uint32_t, fct_several_search,
                   (const fct_bvh *bvh, v3 point, uint32_t k, double max_distance, fct_closest *out,
                    fct_visits *visits));

#endif
