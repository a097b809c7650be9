/* bvh/near/nearest.h: the search for the nearest face. A kernel: nearest.c is compiled per processor. */
#ifndef FCT_BVH_NEAREST_H
#define FCT_BVH_NEAREST_H

#include "base/variant.h"
#include "bvh/model.h"

typedef struct fct_near {
    v3 point;         /* unscaled */
    double distance2; /* squared, unscaled */
    double u, v;      /* barycentric weights of corners 1 and 2 */
    uint32_t place;
} fct_near;

/* The nearest face within max_distance of the point; equal distances: the lower face id.
 *
 * If `normal` (a unit vector) is not NULL, the faces within max_distance compete by their normals instead:
 * the result is the face whose normal has the largest cosine to it; equal cosines: the nearest; equal
 * distances: the lower face id. A face without area ranks last.
 *
 * Visits count the triangles that are measured in double.
 *
 * Returns false if no face is that near, if the point or max_distance is not a number, or for the Embree
 * backend, and then leaves *out unchanged. visits may be NULL. */
#define fct_nearest_search FCT_KERNEL(fct_nearest_search)
FCT_DECLARE_KERNEL(bool, fct_nearest_search,
                   (const fct_bvh *bvh, v3 point, const v3 *normal, double max_distance, fct_near *out,
                    fct_visits *visits));

/* The same for `count` points (count x 3), without normals, in turns: faster on models that the caches do not
 * hold. The place of a point without a face is FCT_NONE. */
#define fct_nearest_many FCT_KERNEL(fct_nearest_many)
FCT_DECLARE_KERNEL(void, fct_nearest_many,
                   (const fct_bvh *bvh, size_t count, const float *points, double max_distance,
                    fct_near *out));

#endif
