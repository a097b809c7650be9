/* cluster/tree/describe/upper.c: the records of the clusters above the blocks: a few per thousand clusters,
 * each with many faces.
 *
 * Boxes. The vertices of a cluster are one run of the tree's order (those that it is the first to use) and a
 * few older ones along its border. A pass over its triangles finds the older ones, so about F / 2 vertices
 * are measured instead of 3 F corners. Blocks whose box does not reach beyond the extents so far are skipped.
 * Four frames compete for the least surface area: the principal frame, the axes of the world, and the frames
 * of the two children. Cones. A branch and bound search: the block whose cone may reach farthest comes first,
 * and only nodes that may reach beyond the farthest normal so far are opened. O(F) per level above the blocks
 * at worst.
 */
#include "cluster/tree/describe/upper.h"

#include <string.h>

#include "base/math/simd.h"
#include "base/parallel.h"
#include "cluster/shape/box.h"
#include "cluster/shape/cone.h"
#include "cluster/shape/octet.h"

enum {
    OLD = 256,    /* older vertices measured at a time */
    FRAMES = 4,   /* candidates for the axes of a box */
    SAMPLES = 64, /* points that turn the principal frame */
    TRIALS = 256  /* points that choose among the frames; 128 gave half a percent more box area */
};

typedef struct upper_job {
    fct_tree *tree;
    fct_outline *outline;
    float *positions[3]; /* x, y and z of the vertices */
} upper_job;

/* --- Vertices --- */

static void stream_positions(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    upper_job *job = user;
    for (size_t v = begin; v < end; ++v)
        for (size_t k = 0; k < 3; ++k) job->positions[k][v] = job->tree->positions[3 * v + k];
}

/* Widens the extents to the vertices of faces [first, end) of a cluster whose own vertices begin at `begin`.
 * Of the others this adds those below `begin` and leaves out those from `begin` on: other faces of the
 * cluster were the first to use them, and add_blocks adds them there. */
static void add_faces(const upper_job *job, size_t first, size_t end, uint32_t begin, const float axes[3][3],
                      fct_extents *out) {
    const fct_tree *tree = job->tree;
    const fct_points all = {job->positions[0], job->positions[1], job->positions[2]};
    float old[3][OLD];
    size_t waiting = 0, last = 3 * end, corners = 3 * (size_t)tree->view.face_count; /* more than 8 */
    fct_extents_add(out, all, fct_vertices_before(tree, job->outline, first),
                    fct_vertices_before(tree, job->outline, end), axes);
    for (size_t i = 3 * first; i < last; i += 8) {
        size_t at = i + 8 <= corners ? i : corners - 8;
        uint32_t mask = i8_lt(i8_load(tree->triangles + at), i8_set(begin)) >> (i - at) << (i - at);
        if (at + 8 > last) mask &= (1u << (last - at)) - 1;
        for (; mask; mask &= mask - 1) {
            uint32_t v = tree->triangles[at + (uint32_t)__builtin_ctz(mask)];
            for (int k = 0; k < 3; ++k) old[k][waiting] = job->positions[k][v];
            ++waiting;
        }
        if (waiting + 8 <= OLD && i + 8 < last) continue;
        fct_extents_add(out, (fct_points){old[0], old[1], old[2]}, 0, waiting, axes);
        waiting = 0;
    }
}

/* Whether the cluster's box may reach beyond the extents. The margin covers axes that are orthonormal only to
 * the rounding of floats. */
static bool may_reach_beyond(const fct_cluster *c, const float axes[3][3], const fct_extents *e) {
    fct_box box;
    v3 own[3];
    double size = 0;
    fct_cluster_box(c, &box);
    for (int i = 0; i < 3; ++i) {
        own[i] = v3_scale(v3_load(box.axes[i]), (double)box.half[i]);
        size += (double)box.half[i];
    }
    for (int k = 0; k < 3; ++k) {
        v3 a = v3_load(axes[k]);
        double middle = v3_dot(v3_load(box.center), a), reach = 1e-6 * size + 1e-14 * fabs(middle);
        for (int i = 0; i < 3; ++i) reach += fabs(v3_dot(own[i], a));
        if (middle - reach < e->low[k] || middle + reach > e->high[k]) return true;
    }
    return false;
}

/* Widens the extents to all vertices of the cluster. */
static void add_blocks(const upper_job *job, const fct_upper *u, const float axes[3][3], fct_extents *out) {
    const fct_tree *tree = job->tree;
    uint32_t nodes = tree->view.node_count;
    uint32_t begin = fct_vertices_before(tree, job->outline, tree->clusters[u->id].first);
    for (uint32_t i = u->first_block; i < u->first_block + u->block_count; ++i) {
        uint32_t root = job->outline->blocks[i];
        const fct_cluster *c = &tree->clusters[root];
        if (root >= nodes)
            add_faces(job, root - nodes, root - nodes + 1, begin, axes, out);
        else if (may_reach_beyond(c, axes, out))
            add_faces(job, c->first, (size_t)c->first + c->count, begin, axes, out);
    }
}

/* --- Frames --- */

/* Writes the sums and the principal frames, turned on corners that are spread over the faces. Eight clusters
 * per chunk, a lane each. */
static void choose_frames(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const upper_job *job = user;
    const fct_tree *tree = job->tree;
    fct_octet o;
    fct_octet_row points[SAMPLES];
    const fct_sums *sums[8];
    for (size_t l = 0; l < 8; ++l) {
        const fct_upper *u = &job->outline->upper[begin + l < end ? begin + l : begin];
        size_t first = 3 * (size_t)tree->links[u->id].first, count = 3 * (size_t)tree->links[u->id].count;
        for (size_t s = 0; s < SAMPLES; ++s) {
            const float *p = tree->positions + 3 * (size_t)tree->triangles[first + s * count / SAMPLES];
            points[s].x[l] = p[0], points[s].y[l] = p[1], points[s].z[l] = p[2];
        }
        sums[l] = &u->sums;
    }
    fct_octet_sum(&o, sums);
    fct_octet_turn(&o, points, SAMPLES);
    for (size_t i = begin; i < end; ++i) {
        fct_upper *u = &job->outline->upper[i];
        fct_cluster *c = &tree->clusters[u->id];
        fct_octet_store(&o, (uint32_t)(i - begin), c);
        memcpy(u->rotation, c->box_rotation, sizeof u->rotation);
        fct_node_link_store(&tree->links[u->id], c);
    }
}

static const float *get_rotation(const upper_job *job, uint32_t part) {
    static const float world[4] = {0, 0, 0, 1};
    if (!(part & FCT_IS_BLOCK)) return job->outline->upper[part].rotation;
    uint32_t node = job->outline->blocks[part & ~FCT_IS_BLOCK];
    return node < job->tree->view.node_count ? job->tree->clusters[node].box_rotation : world;
}

/* The frame with the least box around vertices that are spread over the cluster. *out receives their extents.
 */
static int choose_frame(const upper_job *job, const fct_cluster *c, float axes[FRAMES][3][3],
                        fct_extents *out) {
    float points[3][TRIALS];
    size_t first = 3 * (size_t)c->first, count = 3 * (size_t)c->count;
    for (size_t i = 0; i < TRIALS; ++i) {
        uint32_t v = job->tree->triangles[first + i * count / TRIALS];
        for (int k = 0; k < 3; ++k) points[k][i] = job->positions[k][v];
    }
    int best = 0;
    double least = INFINITY;
    for (int f = 0; f < FRAMES; ++f) {
        fct_extents extents = fct_extents_none();
        fct_extents_add(&extents, (fct_points){points[0], points[1], points[2]}, 0, TRIALS,
                        (const float(*)[3])axes[f]);
        double area = fct_box_area(&extents);
        if (area < least) least = area, best = f, *out = extents;
    }
    return best;
}

static void fit_box(const upper_job *job, const fct_upper *u, fct_cluster *c) {
    static const float world[4] = {0, 0, 0, 1};
    const float *rotations[FRAMES] = {u->rotation, world, get_rotation(job, u->parts[0]),
                                      get_rotation(job, u->parts[1])};
    float axes[FRAMES][3][3];
    for (int f = 0; f < FRAMES; ++f) fct_box_axes(rotations[f], axes[f]);
    fct_extents extents;
    int best = choose_frame(job, c, axes, &extents);
    v3 point = v3_load(job->tree->positions + 3 * (size_t)job->tree->triangles[3 * (size_t)c->first]);
    add_blocks(job, u, (const float(*)[3])axes[best], &extents);
    memcpy(c->box_rotation, rotations[best], sizeof c->box_rotation);
    if (fct_box_set(&extents, (const float(*)[3])axes[best], point, c)) return;
    extents = fct_extents_none();
    add_blocks(job, u, (const float(*)[3])axes[1], &extents);
    memcpy(c->box_rotation, world, sizeof world);
    fct_box_set(&extents, (const float(*)[3])axes[1], point, c);
}

/* --- Cones --- */

/* The half chord by which a cone may exceed the smallest one, so that the search ends early. */
static const double slack = 5e-7;
/* A half chord of 169 degrees. A wider cone becomes all directions, because the search over loose triangles
 * with arbitrary normals would open every node. */
static const double nearly_all = 0.995;

/* An upper bound of half the chord between `axis` and the farthest normal of a cone of `angle` around `own`:
 * sin((between + angle) / 2), by series that are cut on the safe side; 1 from pi on. */
static double bound_reach(v3 own, double angle, v3 axis) {
    double half = 0.5 * v3_norm(v3_sub(own, axis)), x = 0.5 * angle, xx = x * x;
    if (half >= 1 - xx / 2 || v3_norm2(own) == 0) return 1;
    double cosine = 1 - xx / 2 * (1 - xx / 12), sine = x * (1 - xx / 6 * (1 - xx / 20));
    return half * cosine + sqrt(1 - half * half) * sine;
}

typedef struct branch {
    uint32_t node;
    double reach;
} branch;

static branch make_branch(const fct_tree *tree, uint32_t node, v3 axis) {
    if (node >= tree->view.node_count) return (branch){node, 1};
    const fct_cluster *c = &tree->clusters[node];
    return (branch){node, bound_reach(v3_unit(v3_load(c->area_vector)), (double)c->cone_angle, axis)};
}

/* Half the chord to the farthest normal of the block, or `widest` if that is larger. */
static double widen_by_block(const fct_tree *tree, uint32_t root, v3 axis, double widest) {
    uint32_t nodes = tree->view.node_count, top = 0;
    branch stack[FCT_BLOCK];
    stack[top++] = (branch){root, 1};
    while (top > 0) {
        branch b = stack[--top];
        if (b.reach <= widest + slack) continue;
        if (b.node < nodes) {
            const uint32_t *child = tree->clusters[b.node].child;
            branch near = make_branch(tree, child[0], axis), far = make_branch(tree, child[1], axis);
            bool turned = far.reach < near.reach;
            stack[top++] = turned ? far : near, stack[top++] = turned ? near : far;
        } else {
            float normal[3];
            fct_unit_normal(tree->positions, tree->triangles + 3 * (size_t)(b.node - nodes), normal);
            double half = 0.5 * v3_norm(v3_sub(v3_load(normal), axis)); /* NaN where the face has no area */
            widest = half > widest ? half : widest;
            if (widest > nearly_all) return 1;
        }
    }
    return widest;
}

/* Starts with the block that may reach farthest, so that few other blocks need a search. */
static float find_cone(const upper_job *job, const fct_upper *u, const fct_cluster *c) {
    const fct_outline *o = job->outline;
    v3 axis = v3_unit(u->sums.vector);
    if (v3_norm2(v3_load(c->area_vector)) == 0) return fct_cone_angle(4);
    uint32_t first = u->first_block, end = first + u->block_count, farthest = first;
    double most = -1, widest = 0;
    for (uint32_t i = first; i < end; ++i) {
        double reach = bound_reach(v3_load(o->caps[i].axis), (double)o->caps[i].angle, axis);
        if (reach > most) most = reach, farthest = i;
    }
    widest = widen_by_block(job->tree, o->blocks[farthest], axis, widest);
    for (uint32_t i = first; i < end; ++i)
        if (bound_reach(v3_load(o->caps[i].axis), (double)o->caps[i].angle, axis) > widest + slack)
            widest = widen_by_block(job->tree, o->blocks[i], axis, widest);
    if (widest == 1) return fct_cone_angle(4);
    widest = 2 * (widest + slack);
    return fct_cone_angle((float)(widest * widest));
}

static void describe_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    upper_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        const fct_upper *u = &job->outline->upper[i];
        fct_cluster *c = &job->tree->clusters[u->id];
        c->cone_angle = find_cone(job, u, c);
        fit_box(job, u, c);
    }
}

static void sum_outline(fct_outline *o) {
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

static fct_result run_job(const fct_env *env, upper_job *job) {
    uint32_t count = job->outline->upper_count;
    fct_parallel_for(env, job->tree->view.vertex_count, 1 << 14, stream_positions, job);
    sum_outline(job->outline);
    fct_parallel_for(env, count, 8, choose_frames, job);
    return fct_parallel_for_progress(env, "boxes of large clusters", count, 1, describe_chunk, job);
}

fct_result fct_tree_describe_upper(fct_tree *tree, fct_outline *outline) {
    const fct_env *env = tree->env;
    size_t vertices = tree->view.vertex_count;
    if (outline->upper_count == 0) return FCT_OK;
    upper_job job = {.tree = tree, .outline = outline};
    const fct_array arrays[] = {FCT_ARRAY(job.positions[0], vertices), FCT_ARRAY(job.positions[1], vertices),
                                FCT_ARRAY(job.positions[2], vertices)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "boxes");
    if (result == FCT_OK) result = run_job(env, &job);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}
