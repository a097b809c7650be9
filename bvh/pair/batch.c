/* bvh/pair/batch.c: two models under many poses, on several threads. */
#include "base/parallel.h"
#include "bvh/model.h"
#include "facetree/collide.h"

enum { POSE_CHUNK = 64 /* poses per task: one word of answers */ };

typedef struct pose_batch {
    const fct_bvh *a, *b;
    const fct_pose *poses;
    const fct_distance_def *def;
    uint64_t *touching;
    fct_distance *distances;
} pose_batch;

static void find_overlaps(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    const pose_batch *batch = user;
    fct_pair_hint hint = fct_pair_hint_none();
    uint64_t word = 0;
    for (size_t i = begin; i < end; ++i)
        word |= (uint64_t)fct_bvh_overlap(batch->a, batch->b, &batch->poses[i], &hint, NULL) << (i - begin);
    batch->touching[chunk] = word;
}

void fct_bvh_overlaps(const fct_bvh *a, const fct_bvh *b, size_t count, const fct_pose *poses,
                      uint64_t *touching) {
    pose_batch batch = {.a = a, .b = b, .poses = poses, .touching = touching};
    fct_parallel_for(a->env, count, POSE_CHUNK, find_overlaps, &batch);
}

static void find_distances(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const pose_batch *batch = user;
    fct_pair_hint hint = fct_pair_hint_none();
    for (size_t i = begin; i < end; ++i) {
        fct_distance *out = &batch->distances[i];
        if (!fct_bvh_distance(batch->a, batch->b, &batch->poses[i], batch->def, &hint, out, NULL))
            *out = (fct_distance){.distance = INFINITY, .pair = fct_face_pair_none()};
    }
}

void fct_bvh_distances(const fct_bvh *a, const fct_bvh *b, size_t count, const fct_pose *poses,
                       const fct_distance_def *def, fct_distance *out) {
    pose_batch batch = {.a = a, .b = b, .poses = poses, .def = def, .distances = out};
    fct_parallel_for(a->env, count, POSE_CHUNK, find_distances, &batch);
}
