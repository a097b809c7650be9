/* cluster/upper.c: the clusters above the blocks of describe.c, a few in a thousand, each with many faces.
 *
 * A cluster's vertices are one run of the tree's vertex order (those it is the first to use) and a few older
 * ones along its border, which a pass over its triangles finds: half a vertex a face instead of three
 * corners. Four frames compete for the least surface area: its own, the world's, and its children's own.
 * Cones come by pruning: only blocks, and nodes of blocks, whose own cone may reach farther than the farthest
 * normal so far are opened. O(F) for each level above the blocks.
 */
#include <string.h>

#include "base/eigen.h"
#include "base/parallel.h"
#include "base/simd.h"
#include "cluster/cone.h"
#include "cluster/describe.h"

enum { SPAN = 64, SLICE = 1024, OLD = 256, FRAMES = 4, SAMPLES = 64 };

typedef struct upper_job {
    fct_tree *tree;
    fct_outline *outline;
    float *positions[3];  /* by vertex, as streams */
    uint32_t *introduced; /* per SPAN faces: vertices used by faces before them */
} upper_job;

/* --- Vertices --- */

static void stream_positions(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    upper_job *job = user;
    for (size_t v = begin; v < end; ++v)
        for (size_t k = 0; k < 3; ++k) job->positions[k][v] = job->tree->positions[3 * v + k];
}

static uint32_t highest_vertex(const fct_tree *tree, size_t begin, size_t end, uint32_t count) {
    for (size_t i = 3 * begin; i < 3 * end; ++i) {
        uint32_t next = tree->triangles[i] + 1;
        count = next > count ? next : count;
    }
    return count;
}

static void find_highest(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    upper_job *job = user;
    size_t faces = job->tree->view.face_count;
    for (size_t i = begin; i < end; ++i)
        job->introduced[i + 1] =
            highest_vertex(job->tree, i * SPAN, (i + 1) * SPAN < faces ? (i + 1) * SPAN : faces, 0);
}

static uint32_t vertices_before(const upper_job *job, size_t place) {
    return highest_vertex(job->tree, place - place % SPAN, place, job->introduced[place / SPAN]);
}

/* Extents of the cluster's vertices along the axes of several frames. */
static void measure(const upper_job *job, const fct_cluster *c, int frames, float axes[][3][3],
                    fct_extents *out) {
    const fct_tree *tree = job->tree;
    fct_points all = {job->positions[0], job->positions[1], job->positions[2]};
    uint32_t begin = vertices_before(job, c->first), end = vertices_before(job, (size_t)c->first + c->count);
    float old[3][OLD];
    size_t waiting = 0;
    for (int f = 0; f < frames; ++f) out[f] = fct_extents_none();
    for (size_t from = begin; from < end; from += SLICE)
        for (int f = 0; f < frames; ++f)
            fct_extents_add(&out[f], all, from, from + SLICE < end ? from + SLICE : end,
                            (const float(*)[3])axes[f]);
    size_t last = 3 * ((size_t)c->first + c->count); /* more than 8 */
    for (size_t i = 3 * (size_t)c->first; i < last; i += 8) {
        if (i + 8 > last) i = last - 8;
        uint32_t mask = i8_lt(i8_load(tree->triangles + i), i8_set(begin));
        for (; mask; mask &= mask - 1) {
            uint32_t v = tree->triangles[i + (uint32_t)__builtin_ctz(mask)];
            for (int k = 0; k < 3; ++k) old[k][waiting] = job->positions[k][v];
            ++waiting;
        }
        if (waiting + 8 <= OLD && i + 8 < last) continue;
        for (int f = 0; f < frames; ++f)
            fct_extents_add(&out[f], (fct_points){old[0], old[1], old[2]}, 0, waiting,
                            (const float(*)[3])axes[f]);
        waiting = 0;
    }
}

/* --- Frames --- */

/* The cluster's own frame, by corners spread over its faces. */
static void choose_frames(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    upper_job *job = user;
    const fct_tree *tree = job->tree;
    for (size_t i = begin; i < end; ++i) {
        fct_upper *u = &job->outline->upper[i];
        fct_cluster *c = &tree->clusters[u->id];
        v3 frame[3];
        fct_node_link_store(&tree->links[u->id], c);
        double values[3];
        fct_eigen3(u->sums.covariance, values, frame);
        double size = fct_sums_store(&u->sums, frame, c);
        float corners[3][SAMPLES];
        size_t first = 3 * (size_t)c->first, count = 3 * (size_t)c->count;
        for (size_t s = 0; s < SAMPLES; ++s) {
            uint32_t v = tree->triangles[first + s * count / SAMPLES];
            for (int k = 0; k < 3; ++k) corners[k][s] = job->positions[k][v];
        }
        fct_box_turn((fct_points){corners[0], corners[1], corners[2]}, 0, SAMPLES, size, frame);
        fct_box_rotation((const v3 *)frame, u->rotation);
    }
}

static const float *rotation_of(const upper_job *job, uint32_t part) {
    static const float world[4] = {0, 0, 0, 1};
    if (!(part & FCT_IS_BLOCK)) return job->outline->upper[part].rotation;
    uint32_t node = job->outline->blocks[part & ~FCT_IS_BLOCK];
    return node < job->tree->view.node_count ? job->tree->clusters[node].box_rotation : world;
}

static void fit_box(const upper_job *job, const fct_upper *u, fct_cluster *c) {
    static const float world[4] = {0, 0, 0, 1};
    const float *rotations[FRAMES] = {u->rotation, world, rotation_of(job, u->parts[0]),
                                      rotation_of(job, u->parts[1])};
    float axes[FRAMES][3][3];
    fct_extents extents[FRAMES];
    for (int f = 0; f < FRAMES; ++f) fct_box_axes(rotations[f], axes[f]);
    measure(job, c, FRAMES, axes, extents);
    int best = 0;
    for (int f = 1; f < FRAMES; ++f)
        if (fct_box_area(&extents[f]) < fct_box_area(&extents[best])) best = f;
    v3 point = v3_load(job->tree->positions + 3 * (size_t)job->tree->triangles[3 * (size_t)c->first]);
    memcpy(c->box_rotation, rotations[best], sizeof c->box_rotation);
    if (fct_box_set(&extents[best], (const float(*)[3])axes[best], point, c)) return;
    memcpy(c->box_rotation, world, sizeof world);
    fct_box_set(&extents[1], (const float(*)[3])axes[1], point, c);
}

/* --- Cones --- */

/* Whether normals of the node may lie farther from the axis than the squared chord `widest`. */
static bool may_widen(const fct_cluster *c, v3 axis, double widest) {
    v3 own = v3_unit(v3_load(c->area_vector));
    if (v3_norm2(own) == 0) return true;
    double reach = 2 * asin(fmin(0.5 * v3_norm(v3_sub(own, axis)), 1)) + (double)c->cone_angle;
    return reach >= 3.14159 || 2 * sin(0.5 * reach) > sqrt(widest);
}

static float widen_by_block(const fct_tree *tree, uint32_t root, v3 axis, float widest) {
    uint32_t nodes = tree->view.node_count, top = 0, stack[FCT_BLOCK];
    float direction[3], normal[3];
    v3_store(direction, axis);
    stack[top++] = root;
    while (top > 0) {
        uint32_t node = stack[--top];
        if (node < nodes) {
            const fct_cluster *c = &tree->clusters[node];
            if (!may_widen(c, axis, (double)widest)) continue;
            stack[top++] = c->child[1], stack[top++] = c->child[0];
        } else {
            fct_unit_normal(tree->positions, tree->triangles + 3 * (size_t)(node - nodes), normal);
            widest = fct_cone_widen(widest, (fct_points){normal, normal + 1, normal + 2}, 0, 1, direction);
        }
    }
    return widest;
}

static float cone_of(const upper_job *job, const fct_upper *u, const fct_cluster *c) {
    v3 axis = v3_unit(u->sums.vector);
    if (v3_norm2(v3_load(c->area_vector)) == 0) return fct_cone_angle(4);
    float widest = 0;
    for (uint32_t i = 0; i < u->block_count; ++i)
        widest = widen_by_block(job->tree, job->outline->blocks[u->first_block + i], axis, widest);
    return fct_cone_angle(widest);
}

static void describe_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    upper_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        const fct_upper *u = &job->outline->upper[i];
        fct_cluster *c = &job->tree->clusters[u->id];
        c->cone_angle = cone_of(job, u, c);
        fit_box(job, u, c);
    }
}

/* --- All --- */

static void sum_up(fct_outline *o) {
    for (uint32_t i = o->upper_count; i-- > 0;) {
        fct_upper *u = &o->upper[i];
        const fct_sums *parts[2];
        for (int k = 0; k < 2; ++k) {
            uint32_t part = u->parts[k];
            parts[k] = part & FCT_IS_BLOCK ? &o->sums[part & ~FCT_IS_BLOCK] : &o->upper[part].sums;
        }
        fct_sums_join(parts[0], parts[1], &u->sums);
    }
}

static fct_result run(const fct_env *env, upper_job *job) {
    size_t faces = job->tree->view.face_count, spans = fct_chunk_count(faces, SPAN);
    uint32_t count = job->outline->upper_count;
    fct_parallel_for(env, job->tree->view.vertex_count, 1 << 14, stream_positions, job);
    job->introduced[0] = 0;
    fct_parallel_for(env, spans, 1 << 8, find_highest, job);
    for (size_t i = 0; i < spans; ++i)
        if (job->introduced[i + 1] < job->introduced[i]) job->introduced[i + 1] = job->introduced[i];
    sum_up(job->outline);
    fct_parallel_for(env, count, 16, choose_frames, job);
    return fct_parallel_for_progress(env, "boxes of large clusters", count, 1, describe_chunk, job);
}

fct_result fct_tree_describe_upper(fct_tree *tree, fct_outline *outline) {
    const fct_env *env = tree->env;
    if (outline->upper_count == 0) return FCT_OK;
    upper_job job = {.tree = tree, .outline = outline};
    for (int k = 0; k < 3; ++k) job.positions[k] = fct_allocate(env, tree->view.vertex_count, sizeof(float));
    job.introduced =
        fct_allocate(env, fct_chunk_count(tree->view.face_count, SPAN) + 1, sizeof *job.introduced);
    fct_result result;
    if (!job.positions[0] || !job.positions[1] || !job.positions[2] || !job.introduced)
        result = fct_fail_memory(env, "boxes");
    else
        result = run(env, &job);
    for (int k = 0; k < 3; ++k) fct_release(env, job.positions[k]);
    fct_release(env, job.introduced);
    return result;
}
