/* bvh/ray/ray.h: a caller's ray prepared for traversal, and the hit that a traversal reports.
 *
 * The prepared ray is scaled like the model. The largest component of its direction is in [1, 2), and its
 * origin is within FCT_REACH of the model's centre.
 */
#ifndef FCT_BVH_RAY_H
#define FCT_BVH_RAY_H

#include "bvh/model.h"

typedef struct fct_prepared_ray {
    float origin[3], direction[3];
    float t_min, t_max; /* 0 <= t_min */
    float inverse[3];   /* 1 / direction, finite */
    uint32_t side[3];   /* per axis, the bound where the ray enters a slab: 1 if the direction is negative */
    uint32_t axis[3];   /* x, y, z of the shear; z is the axis of the largest direction component */
    float shear[3];     /* x/z, y/z, 1/z of the direction along these axes (Woop et al. 2013) */
    double factor, shift; /* the caller's t = (shift + t) factor */
    bool moved;           /* the origin is not the caller's */
    uint32_t except;      /* input id of a face that the ray passes through; fct_ray_prepare sets FCT_NONE */
} fct_prepared_ray;

/* In scaled space. */
typedef struct fct_raw_hit {
    float t, u, v;
    uint32_t place; /* FCT_NONE on a miss */
    v3 normal;      /* (p1 - p0) x (p2 - p0) */
} fct_raw_hit;

/* Returns false if the ray cannot hit anything: it is malformed, or it misses the model's bounds from outside
 * FCT_REACH. */
bool fct_ray_prepare(const fct_bvh *bvh, const fct_ray *ray, fct_prepared_ray *out);

/* The caller's t of a prepared t. */
double fct_ray_unscale_t(const fct_prepared_ray *prepared, float t);
/* Rounds the caller's t and clamps it to [ray->t_min, ray->t_max]. */
float fct_ray_clamp_t(const fct_ray *ray, double t);

/* The closest hit with either backend. Returns whether there is one. *t receives the caller's t, unrounded.
 * visits may be NULL. */
bool fct_ray_closest(const fct_bvh *bvh, const fct_ray *ray, fct_raw_hit *hit, double *t, fct_visits *visits);

/* Receives every hit of a ray once, in any order, without its normal. */
typedef void fct_visit_hit(void *user, const fct_hit *hit);
/* Visits all hits of the caller's ray. The Embree backend visits none. */
void fct_ray_visit_hits(const fct_bvh *bvh, const fct_ray *ray, fct_visit_hit *visit, void *user,
                        fct_visits *visits);
/* Sets hit->normal from hit->place. */
void fct_hit_set_normal(const fct_bvh *bvh, fct_hit *hit);

#endif
