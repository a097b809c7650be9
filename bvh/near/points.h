/* bvh/near/points.h: a query for many points. */
#ifndef FCT_BVH_POINTS_H
#define FCT_BVH_POINTS_H

#include "facetree/bvh.h"

/* Such as fct_bvh_closest_point. */
typedef bool fct_point_query(const fct_bvh *bvh, const float point[3], float max_distance, fct_closest *out,
                             fct_visits *visits);

/* Asks for `count` points (count x 3), on the threads of the environment. */
void fct_ask_points(const fct_bvh *bvh, fct_point_query *query, size_t count, const float *points,
                    float max_distance, fct_closest *out);

#endif
