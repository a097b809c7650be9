/* bvh/near/closest.c: the public queries for the closest point, single and in batches, and for the k nearest
 * faces. */
#include "base/parallel.h"
#include "bvh/near/nearest.h"
#include "bvh/near/points.h"
#include "bvh/near/several.h"

static void report_point(const fct_bvh *bvh, const fct_near *near, fct_closest *out) {
    *out = (fct_closest){.distance = (float)sqrt(near->distance2),
                         .face = bvh->view.face_ids[near->place],
                         .place = near->place,
                         .u = (float)near->u,
                         .v = (float)near->v};
    v3_store(out->point, near->point);
}

bool fct_bvh_closest_point(const fct_bvh *bvh, const float point[3], float max_distance, fct_closest *out,
                           fct_visits *visits) {
    fct_near near;
    *out = (fct_closest){.distance = INFINITY, .face = FCT_NONE};
    if (!fct_nearest_search(bvh, v3_load(point), NULL, (double)max_distance, &near, visits)) return false;
    report_point(bvh, &near, out);
    return true;
}

enum { CHUNK = 256 }; /* points per task */

/* Points take turns on a model above this size. Random points take .55 of the time of single queries near a
 * torso of a million triangles, .7 in its bounds; with 100,000 triangles .97 and 1.07. */
#define TURNS_BYTES ((size_t)4 << 20)

/* Points are alike if most are this close to the one before, in scaled space. Then the caches hold what they
 * need: those of a grid of spacing .04 take 1.25 times as long in turns. */
#define ALIKE .06

typedef struct point_batch {
    const fct_bvh *bvh;
    const float *points;
    float max_distance;
    fct_closest *out;
    fct_finish_point *finish;
} point_batch;

static bool are_alike(const fct_bvh *bvh, size_t count, const float *points) {
    size_t close = 0;
    for (size_t i = 3; i < 3 * count; i += 3) {
        v3 step = v3_sub(v3_load(points + i), v3_load(points + i - 3));
        close += v3_norm(step) * bvh->scale < ALIKE;
    }
    return 4 * close >= 3 * count;
}

static void ask_points(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const point_batch *b = user;
    const fct_bvh *bvh = b->bvh;
    fct_near near[CHUNK];
    const float *points = b->points + 3 * begin;
    const size_t count = end - begin;
    const bool turns = bvh->node_bytes + bvh->leaf_bytes > TURNS_BYTES && !are_alike(bvh, count, points);
    if (turns) fct_nearest_many(bvh, count, points, (double)b->max_distance, near);
    for (size_t i = begin; i < end; ++i) {
        const float *point = b->points + 3 * i;
        fct_closest *out = &b->out[i];
        if (!turns) {
            fct_bvh_closest_point(bvh, point, b->max_distance, out, NULL);
        } else {
            *out = (fct_closest){.distance = INFINITY, .face = FCT_NONE};
            if (near[i - begin].place != FCT_NONE) report_point(bvh, &near[i - begin], out);
        }
        if (b->finish && out->face != FCT_NONE) b->finish(bvh, point, out, NULL);
    }
}

void fct_ask_points(const fct_bvh *bvh, size_t count, const float *points, float max_distance,
                    fct_closest *out, fct_finish_point *finish) {
    point_batch batch = {bvh, points, max_distance, out, finish};
    fct_parallel_for(bvh->env, count, CHUNK, ask_points, &batch);
}

void fct_bvh_closest_points(const fct_bvh *bvh, size_t count, const float *points, float max_distance,
                            fct_closest *out) {
    fct_ask_points(bvh, count, points, max_distance, out, NULL);
}

uint32_t fct_bvh_nearest(const fct_bvh *bvh, const float point[3], uint32_t k, float max_distance,
                         fct_closest *out, fct_visits *visits) {
    v3 p = v3_load(point);
    if (bvh->embree || k == 0 || !(fabs(p.x) + fabs(p.y) + fabs(p.z) < INFINITY) || !(max_distance >= 0))
        return 0;
    return fct_several_search(bvh, p, k, (double)max_distance, out, visits);
}
