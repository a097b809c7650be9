/* bvh/near/closest.c: the public queries for the closest point, single and in batches, and for the k nearest
 * faces. */
#include "base/parallel.h"
#include "bvh/near/nearest.h"
#include "bvh/near/points.h"
#include "bvh/near/several.h"

bool fct_bvh_closest_point(const fct_bvh *bvh, const float point[3], float max_distance, fct_closest *out,
                           fct_visits *visits) {
    fct_near near;
    if (!fct_nearest_search(bvh, v3_load(point), NULL, (double)max_distance, &near, visits)) {
        *out = (fct_closest){.distance = INFINITY, .face = FCT_NONE};
        return false;
    }
    *out = (fct_closest){.distance = (float)sqrt(near.distance2),
                         .face = bvh->view.face_ids[near.place],
                         .place = near.place,
                         .u = (float)near.u,
                         .v = (float)near.v};
    v3_store(out->point, near.point);
    return true;
}

enum { CHUNK = 256 }; /* points per task */

typedef struct point_batch {
    const fct_bvh *bvh;
    fct_point_query *query;
    const float *points;
    float max_distance;
    fct_closest *out;
} point_batch;

static void ask_points(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const point_batch *b = user;
    for (size_t i = begin; i < end; ++i)
        b->query(b->bvh, b->points + 3 * i, b->max_distance, &b->out[i], NULL);
}

void fct_ask_points(const fct_bvh *bvh, fct_point_query *query, size_t count, const float *points,
                    float max_distance, fct_closest *out) {
    point_batch batch = {bvh, query, points, max_distance, out};
    fct_parallel_for(bvh->env, count, CHUNK, ask_points, &batch);
}

void fct_bvh_closest_points(const fct_bvh *bvh, size_t count, const float *points, float max_distance,
                            fct_closest *out) {
    fct_ask_points(bvh, fct_bvh_closest_point, count, points, max_distance, out);
}

uint32_t fct_bvh_nearest(const fct_bvh *bvh, const float point[3], uint32_t k, float max_distance,
                         fct_closest *out, fct_visits *visits) {
    v3 p = v3_load(point);
    if (bvh->embree || k == 0 || !(fabs(p.x) + fabs(p.y) + fabs(p.z) < INFINITY) || !(max_distance >= 0))
        return 0;
    return fct_several_search(bvh, p, k, (double)max_distance, out, visits);
}
