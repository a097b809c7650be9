/* bvh/ray/traverse.h: one ray through the packed nodes. A kernel: traverse.c is compiled per processor. */
#ifndef FCT_BVH_TRAVERSE_H
#define FCT_BVH_TRAVERSE_H

#include "bvh/ray/ray.h"

/* Return whether the ray hits. *hit is set in every case. visits may be NULL. */
bool fct_traverse_closest(const fct_bvh *bvh, const fct_prepared_ray *ray, fct_raw_hit *hit,
                          fct_visits *visits);
bool fct_traverse_any(const fct_bvh *bvh, const fct_prepared_ray *ray, fct_visits *visits);

#endif
