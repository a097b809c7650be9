/* bvh/build/frame.c: see frame.h.
 *
 * Along the coordinate axes, the boxes of beams that run diagonally are large and overlap. No plane separates
 * them, and their areas do not tell good splits from bad ones. Along the beams, their boxes are small and lie
 * side by side.
 *
 * Two frames compete with the coordinate axes: the principal axes of the directions in which the boxes of the
 * leaves extend, and the axes of the leaf of largest area. The least sum of the areas of boxes wins.
 * O(leaves).
 */
#include "bvh/build/frame.h"

#include "base/math/eigen.h"
#include "base/parallel.h"
#include "bvh/build/slabs.h"
#include "cluster/tree/node.h"

/* A frame is used if its boxes have less than this share of the area of those along the coordinate axes:
 * .1 on diagonal beams, over 1 on scans, needles and stacked blocks. */
#define MOST_AREA .6

enum { MOST_SAMPLES = 4096, LEAF_CHUNK = 256 /* leaves per task */ };

/* The boxes of some leaves, all over the model. */
typedef struct samples {
    uint32_t count;
    struct {
        v3 axes[3];
        double half[3];
    } box[MOST_SAMPLES];
} samples;

/* Returns the axes of the leaf of largest area among them. */
static void sample_boxes(const fct_bvh *bvh, const fct_leaf_list *leaves, samples *s, v3 largest[3]) {
    float area = -1;
    s->count = leaves->count < MOST_SAMPLES ? leaves->count : MOST_SAMPLES;
    for (uint32_t i = 0; i < s->count; ++i) {
        fct_cluster room;
        fct_box box;
        const uint32_t leaf = (uint32_t)((uint64_t)i * leaves->count / s->count);
        const fct_cluster *cluster = fct_node_cluster(bvh->tree, leaves->nodes[leaf], &room);
        fct_cluster_box(cluster, &box);
        for (int k = 0; k < 3; ++k) {
            s->box[i].axes[k] = v3_load(box.axes[k]);
            s->box[i].half[k] = bvh->scale * (double)cluster->box_half[k];
            if (cluster->area > area) largest[k] = s->box[i].axes[k];
        }
        if (cluster->area > area) area = cluster->area;
    }
}

static void find_principal_axes(const samples *s, v3 axes[3]) {
    double m[6] = {0}, values[3];
    for (uint32_t i = 0; i < s->count; ++i)
        for (int k = 0; k < 3; ++k)
            sym3_add_outer(m, s->box[i].half[k] * s->box[i].half[k], s->box[i].axes[k]);
    fct_eigen3(m, values, axes);
}

/* The sum of the areas of boxes along `axes` around the boxes of the samples. */
static double sum_areas(const samples *s, const v3 axes[3]) {
    double sum = 0;
    for (uint32_t i = 0; i < s->count; ++i) {
        double side[3] = {0};
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 3; ++j)
                side[k] += 2 * s->box[i].half[j] * fabs(v3_dot(axes[k], s->box[i].axes[j]));
        sum += fct_half_area(side[0], side[1], side[2]);
    }
    return sum;
}

typedef struct frame_job {
    const fct_bvh *bvh;
    fct_leaf_list *leaves;
} frame_job;

static void measure_leaves(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const frame_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        const uint32_t number = (uint32_t)i;
        fct_slabs s;
        for (int k = 0; k < 3; ++k) s.axes[k] = job->leaves->frame[k];
        fct_slabs_clear(&s);
        fct_slabs_hold(job->bvh, job->leaves->offsets, &number, 1, &s);
        float *bounds = job->leaves->frame_bounds + 6 * i;
        for (int k = 0; k < 3; ++k) bounds[k] = (float)s.lower[k], bounds[3 + k] = (float)s.upper[k];
    }
}

fct_result fct_frame_choose(const fct_bvh *bvh, fct_leaf_list *leaves) {
    static const v3 coordinate_axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    v3 axes[2][3];
    samples *s = fct_allocate(bvh->env, 1, sizeof *s);
    if (!s) return fct_fail_memory(bvh->env, "the axes of a ray structure");
    sample_boxes(bvh, leaves, s, axes[0]);
    find_principal_axes(s, axes[1]);
    double least = MOST_AREA * sum_areas(s, coordinate_axes);
    const v3 *best = NULL;
    for (int i = 0; i < 2; ++i) {
        const double sum = sum_areas(s, axes[i]);
        if (sum < least) least = sum, best = axes[i];
    }
    fct_release(bvh->env, s);
    if (!best) return FCT_OK;
    leaves->frame_bounds = fct_allocate(bvh->env, leaves->count, 6 * sizeof *leaves->frame_bounds);
    if (!leaves->frame_bounds) return fct_fail_memory(bvh->env, "the axes of a ray structure");
    for (int k = 0; k < 3; ++k) leaves->frame[k] = best[k];
    frame_job job = {bvh, leaves};
    fct_parallel_for(bvh->env, leaves->count, LEAF_CHUNK, measure_leaves, &job);
    return FCT_OK;
}
