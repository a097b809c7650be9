/* bvh/near/mapped.h: the nearest point of a model under an affine map that may change its shape, by distance
 * in the space that the map leads to. A kernel: mapped.c is compiled per processor. */
#ifndef FCT_BVH_MAPPED_H
#define FCT_BVH_MAPPED_H

#include "base/variant.h"
#include "bvh/model.h"

/* Measures distances under a map x -> R x + t: |R y| = |rows y| / unit. The rows are those of R in an
 * orthonormal frame along its principal axes, so that they are orthogonal, times the power of two `unit`
 * that brings the largest singular value near 1. A map that scales along the axes and rotates has one number
 * other than 0 in each row. */
typedef struct fct_mapped_frame {
    double unit;
    float rows[9];
} fct_mapped_frame;

/* map: rows of R|t. R has an inverse. */
void fct_mapped_frame_make(const float map[12], fct_mapped_frame *out);

typedef struct fct_map {
    const float *forward;   /* rows of R|t */
    const double *backward; /* its inverse */
    const fct_mapped_frame *frame;
} fct_map;

typedef struct fct_mapped_near {
    v3 point; /* mapped */
    double distance, u, v;
    uint32_t place;
} fct_mapped_near;

/* The nearest face to `point`, which is in the mapped space, within max_distance; equal distances: the lower
 * face id. Triangles are mapped and measured in double. Returns false if no face is that near, or for the
 * Embree backend, and then leaves *out unchanged. The point is finite and max_distance at least 0. visits may
 * be NULL. */
#define fct_mapped_search FCT_KERNEL(fct_mapped_search)
FCT_DECLARE_KERNEL(bool, fct_mapped_search,
                   (const fct_bvh *bvh, const fct_map *map, v3 point, double max_distance,
                    fct_mapped_near *out, fct_visits *visits));

#endif
