/* bvh/build/frame.c: see frame.h.
 *
 * Along the coordinate axes, the boxes of beams that run diagonally are large and overlap. No plane separates
 * them, and their areas do not tell good splits from bad ones. Along the beams, their boxes are small and lie
 * side by side.
 *
 * Several frames compete with the coordinate axes:
 *
 *   1. the principal axes of the directions in which the boxes of the leaves extend, for beams;
 *   2. the axes of the box of the leaf of largest area;
 *   3. the axes of the largest face of that leaf and of some other leaves. A cube has no principal axes, but
 *      each of its faces shows its axes.
 *
 * The least sum of the areas of boxes around the vertices of some leaves wins. O(leaves).
 */
#include "bvh/build/frame.h"

#include "base/math/eigen.h"
#include "base/parallel.h"
#include "bvh/build/slabs.h"
#include "cluster/tree/node.h"

/* A frame is used if its boxes have less than this share of the area of those along the coordinate axes: .1
 * on diagonal beams, .4 on turned cubes, .64 on boxes that are turned about one axis by 30 degrees, .96 and
 * more on scans, needles, gears and stacked blocks. Then rays visit .5 to .8 times the nodes. */
#define MOST_AREA .8
/* A frame later in the list must be better by this factor than one before. */
#define BETTER .95

enum {
    MOST_SAMPLES = 256,
    FACE_SAMPLES = 4, /* leaves whose largest faces show axes, beside the leaf of largest area */
    FRAMES = 3 + FACE_SAMPLES,
    LEAF_CHUNK = 256 /* leaves per task */
};

/* Some leaves, all over the model. */
typedef struct samples {
    uint32_t count, largest; /* `largest`: the leaf of largest area among them */
    uint32_t numbers[MOST_SAMPLES];
} samples;

typedef v3 frame[3];

static const fct_cluster *leaf_cluster(const fct_bvh *bvh, const fct_leaf_list *leaves, uint32_t number,
                                       fct_cluster *room) {
    return fct_node_cluster(bvh->tree, leaves->nodes[number], room);
}

static void sample_leaves(const fct_bvh *bvh, const fct_leaf_list *leaves, samples *s) {
    float area = -1;
    s->count = leaves->count < MOST_SAMPLES ? leaves->count : MOST_SAMPLES;
    s->largest = 0; /* also if the areas of a damaged file are no numbers */
    for (uint32_t i = 0; i < s->count; ++i) {
        fct_cluster room;
        const uint32_t number = (uint32_t)((uint64_t)i * leaves->count / s->count);
        const fct_cluster *cluster = leaf_cluster(bvh, leaves, number, &room);
        s->numbers[i] = number;
        if (cluster->area > area) area = cluster->area, s->largest = number;
    }
}

static void find_box_axes(const fct_bvh *bvh, const fct_leaf_list *leaves, const samples *s, frame principal,
                          frame largest) {
    double m[6] = {0}, values[3];
    for (uint32_t i = 0; i < s->count; ++i) {
        fct_cluster room;
        fct_box box;
        fct_cluster_box(leaf_cluster(bvh, leaves, s->numbers[i], &room), &box);
        for (int k = 0; k < 3; ++k) {
            const v3 axis = v3_load(box.axes[k]);
            const double half = bvh->scale * (double)box.half[k];
            sym3_add_outer(m, half * half, axis);
            if (s->numbers[i] == s->largest) largest[k] = axis;
        }
    }
    fct_eigen3(m, values, principal);
}

static bool find_face_axes(const fct_bvh *bvh, const fct_leaf_list *leaves, uint32_t number, frame axes) {
    return fct_slabs_face_axes(fct_bvh_leaf(bvh, leaves->offsets[number]), axes);
}

/* Returns the number of frames. */
static uint32_t list_frames(const fct_bvh *bvh, const fct_leaf_list *leaves, const samples *s,
                            frame frames[FRAMES]) {
    uint32_t count = 2;
    find_box_axes(bvh, leaves, s, frames[0], frames[1]);
    count += find_face_axes(bvh, leaves, s->largest, frames[count]);
    for (uint32_t i = 0; i < FACE_SAMPLES; ++i)
        count += find_face_axes(bvh, leaves, s->numbers[i * s->count / FACE_SAMPLES], frames[count]);
    return count;
}

/* The sum of the areas of boxes along `axes` around the vertices of the samples, or of the first of them if
 * it exceeds `most`. */
static double sum_areas(const fct_bvh *bvh, const fct_leaf_list *leaves, const samples *s, const frame axes,
                        double most) {
    double sum = 0;
    for (uint32_t i = 0; i < s->count && sum <= most; ++i) {
        fct_slabs slabs = {.axes = {axes[0], axes[1], axes[2]}};
        fct_slabs_clear(&slabs);
        fct_slabs_hold(bvh, leaves->offsets, &s->numbers[i], 1, &slabs);
        sum += fct_slabs_area(&slabs);
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

/* Returns whether another frame than the coordinate axes is much better. */
static bool choose_frame(const fct_bvh *bvh, const fct_leaf_list *leaves, frame best) {
    static const frame coordinate_axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    samples s;
    frame frames[FRAMES];
    bool found = false;
    sample_leaves(bvh, leaves, &s);
    const uint32_t count = list_frames(bvh, leaves, &s, frames);
    double most = MOST_AREA * sum_areas(bvh, leaves, &s, coordinate_axes, INFINITY);
    for (uint32_t i = 0; i < count; ++i) {
        const double sum = sum_areas(bvh, leaves, &s, frames[i], most);
        if (!(sum >= 0 && sum < most)) continue; /* numbers of a damaged file may be infinite or none */
        most = BETTER * sum, found = true;
        for (int k = 0; k < 3; ++k) best[k] = frames[i][k];
    }
    return found;
}

fct_result fct_frame_choose(const fct_bvh *bvh, fct_leaf_list *leaves) {
    if (!choose_frame(bvh, leaves, leaves->frame)) return FCT_OK;
    leaves->frame_bounds = fct_allocate(bvh->env, leaves->count, 6 * sizeof *leaves->frame_bounds);
    if (!leaves->frame_bounds) return fct_fail_memory(bvh->env, "the axes of a ray structure");
    frame_job job = {bvh, leaves};
    fct_parallel_for(bvh->env, leaves->count, LEAF_CHUNK, measure_leaves, &job);
    return FCT_OK;
}
