/* bvh/near/clip.h: whether a triangle touches a convex region. */
#ifndef FCT_BVH_CLIP_H
#define FCT_BVH_CLIP_H

#include "base/math/vec.h"
#include "facetree/bvh.h"

/* The points x with n.x + d >= 0. */
typedef struct fct_half_space {
    v3 n;
    double d;
} fct_half_space;

/* Whether a point of the triangle lies in every half-space whose bit is set in `planes`. Clips the triangle
 * by one after the other (Sutherland and Hodgman 1974), in double. Touching counts. */
bool fct_clip_touches(const v3 triangle[3], const fct_half_space *half_spaces, uint32_t planes);

#endif
