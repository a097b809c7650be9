/* bvh/near/points.h: closest points for many points. */
#ifndef FCT_BVH_POINTS_H
#define FCT_BVH_POINTS_H

#include "facetree/bvh.h"

/* Completes an answer that has a face. */
typedef void fct_finish_point(const fct_bvh *bvh, const float point[3], fct_closest *out, fct_visits *visits);

/* Finds the closest points of `count` points (count x 3), on the threads of the environment, and calls
 * `finish` for each, unless it is NULL. */
void fct_ask_points(const fct_bvh *bvh, size_t count, const float *points, float max_distance,
                    fct_closest *out, fct_finish_point *finish);

#endif
