/* bvh/ray/ray.h: a caller's ray made ready for traversal: scaled like the model, its direction's largest
 * component in [1, 2), and its origin near the model.
 */
#ifndef FCT_BVH_RAY_H
#define FCT_BVH_RAY_H

#include "bvh/bvh.h"

typedef struct fct_prepared_ray {
    float origin[3], direction[3];
    float t_min, t_max;   /* 0 <= t_min */
    float inverse[3];     /* of the direction, finite */
    uint32_t side[3];     /* 1 where the direction is negative: which bound is met last */
    uint32_t axis[3];     /* the last is that of the largest direction component */
    float shear[3];       /* Woop's: x/z, y/z, 1/z */
    double factor, shift; /* the caller's t = (shift + t) factor */
    bool moved;
} fct_prepared_ray;

/* False where the ray cannot hit anything: malformed, or passing by the model's bounds from afar. */
bool fct_ray_prepare(const fct_bvh *bvh, const fct_ray *ray, fct_prepared_ray *out);

/* The caller's t, within the caller's limits. */
float fct_ray_t(const fct_prepared_ray *prepared, const fct_ray *ray, float t);

#endif
