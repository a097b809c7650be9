/* bvh/ray/embree.h: Embree as the second backend. */
#ifndef FCT_BVH_EMBREE_H
#define FCT_BVH_EMBREE_H

#include "bvh/ray/ray.h"

typedef struct fct_embree fct_embree;

/* Sets bvh->embree, also after a failure; fct_embree_destroy frees it. Errors: MEMORY, CANCELLED, INTERNAL.
 */
fct_result fct_embree_create(fct_bvh *bvh);
void fct_embree_destroy(const fct_env *env, fct_embree *embree);
size_t fct_embree_bytes(const fct_embree *embree);

/* Nothing of ray.c prepares these rays, so that fct_bvh_check also finds the faults of ray.c. *hit and *t,
 * the caller's t, are unchanged on a miss. */
bool fct_embree_closest(const fct_bvh *bvh, const fct_ray *ray, fct_raw_hit *hit, double *t);
bool fct_embree_any(const fct_bvh *bvh, const fct_ray *ray);

#endif
