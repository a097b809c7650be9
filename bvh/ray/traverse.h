/* bvh/ray/traverse.h: one ray through the packed nodes. A kernel: traverse.c is compiled per processor. */
#ifndef FCT_BVH_TRAVERSE_H
#define FCT_BVH_TRAVERSE_H

#include "base/variant.h"
#include "bvh/ray/ray.h"

/* Return whether the ray hits. *hit is set in every case. visits may be NULL. */
#define fct_traverse_closest FCT_KERNEL(fct_traverse_closest)
FCT_DECLARE_KERNEL(bool, fct_traverse_closest,
                   (const fct_bvh *bvh, const fct_prepared_ray *ray, fct_raw_hit *hit, fct_visits *visits));
#define fct_traverse_any FCT_KERNEL(fct_traverse_any)
FCT_DECLARE_KERNEL(bool, fct_traverse_any,
                   (const fct_bvh *bvh, const fct_prepared_ray *ray, fct_visits *visits));
/* Several rays, in turns: the closest hit of each, or, with `any`, one whose place alone counts. The place of
 * a miss is FCT_NONE. */
#define fct_traverse_many FCT_KERNEL(fct_traverse_many)
FCT_DECLARE_KERNEL(void, fct_traverse_many,
                   (const fct_bvh *bvh, size_t count, const fct_prepared_ray *rays, bool any,
                    fct_raw_hit *hits));
/* Visits every hit. */
#define fct_traverse_all FCT_KERNEL(fct_traverse_all)
FCT_DECLARE_KERNEL(void, fct_traverse_all,
                   (const fct_bvh *bvh, const fct_ray *caller, const fct_prepared_ray *ray,
                    fct_visit_hit *visit, void *user, fct_visits *visits));

#endif
