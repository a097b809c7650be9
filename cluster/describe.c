/* cluster/describe.c: area, moments, cone, plane and box of every cluster.
 *
 * Sums over the surface are combined from the leaves up in double, about each cluster's own centroid.
 * Subtrees of at most FCT_BLOCK faces are one task each, whose corners and normals stay in the cache; extents
 * and cones run over a cluster's faces, which are consecutive there: O(F log FCT_BLOCK). What is above is
 * upper.c's. Frame of a box: PCA of the surface, turned in its plane to the least area of eight angles.
 *
 * Degenerate answers. A face without area weighs 1e-20 of its longest side squared in centroid and frame, so
 * that clusters of such faces still have both. Cancelled normals: cone pi, the plane's sign is the
 * eigenvector's. Areas beyond a float's range end at its largest value with S and M scaled alike, below it at
 * 0 (cone pi then); boxes, planes and centroids depend on neither.
 */
#include "cluster/describe.h"

#include <float.h>
#include <string.h>

#include "base/eigen.h"
#include "base/parallel.h"
#include "cluster/cone.h"

enum { AHEAD = 12 };

/* Room for one block; corners and normals by place. */
typedef struct block_scratch {
    uint32_t order[FCT_BLOCK]; /* ids of inner nodes */
    const fct_sums *parts[FCT_BLOCK][2];
    float corners[3][3 * FCT_BLOCK], normals[3][FCT_BLOCK];
    fct_sums leaves[FCT_BLOCK], nodes[FCT_BLOCK];
    v3 frames[FCT_BLOCK][3];
    double sizes[FCT_BLOCK];
    fct_cluster records[FCT_BLOCK];
} block_scratch;

typedef struct describer {
    fct_tree *tree;
    fct_outline outline;
    block_scratch *scratch; /* one a thread */
} describer;

void fct_sums_face(const float *positions, const uint32_t triangle[3], fct_sums *s) {
    v3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = v3_load(positions + 3 * (size_t)triangle[k]);
    v3 u = v3_sub(p[1], p[0]), v = v3_sub(p[2], p[0]);
    *s = (fct_sums){.vector = v3_scale(v3_cross(u, v), 0.5)};
    s->area = s->weight = v3_norm(s->vector);
    s->center = v3_mad(p[0], 1.0 / 3, v3_add(u, v));
    if (s->area > 0)
        sym3_add_outer(s->moment, 1 / s->area, s->vector);
    else
        s->weight = 1e-20 * fmax(v3_norm2(u), fmax(v3_norm2(v), v3_norm2(v3_sub(v, u))));
    for (int k = 0; k < 3; ++k) sym3_add_outer(s->covariance, s->weight / 12, v3_sub(p[k], s->center));
}

void fct_sums_join(const fct_sums *a, const fct_sums *b, fct_sums *out) {
    double weight = a->weight + b->weight, share = weight > 0 ? b->weight / weight : 0.5;
    v3 d = v3_sub(b->center, a->center);
    out->area = a->area + b->area;
    out->weight = weight;
    out->vector = v3_add(a->vector, b->vector);
    out->center = v3_mad(a->center, share, d);
    for (int i = 0; i < 6; ++i) {
        out->moment[i] = a->moment[i] + b->moment[i];
        out->covariance[i] = a->covariance[i] + b->covariance[i];
    }
    sym3_add_outer(out->covariance, a->weight * share, d);
}

double fct_sums_store(const fct_sums *s, v3 frame[3], fct_cluster *out) {
    double factor = s->area > (double)FLT_MAX ? (double)FLT_MAX / s->area : 1;
    out->area = (float)(s->area * factor);
    v3_store(out->area_vector, v3_scale(s->vector, factor));
    for (int i = 0; i < 6; ++i) out->moment[i] = (float)(s->moment[i] * factor);
    v3_store(out->centroid, s->center);
    v3 normal = v3_dot(frame[0], s->vector) < 0 ? v3_scale(frame[0], -1) : frame[0];
    v3_store(out->plane, normal);
    double offset = -v3_dot(normal, s->center);
    out->plane[3] = (float)(fabs(offset) < (double)FLT_MAX ? offset : copysign((double)FLT_MAX, offset));
    frame[0] = frame[2], frame[1] = v3_cross(normal, frame[2]), frame[2] = normal;
    double radius = sqrt((s->covariance[0] + s->covariance[3] + s->covariance[5]) / s->weight);
    return radius > 0 && radius < (double)FLT_MAX ? radius : 1;
}

/* The world's axes, for a model that is wider than half the range of floats: a turned box may not have one.
 */
static void fit_world(fct_points corners, size_t begin, size_t end, v3 point, fct_cluster *out) {
    static const float world[4] = {0, 0, 0, 1};
    float axes[3][3];
    fct_extents extents = fct_extents_none();
    fct_box_axes(world, axes);
    fct_extents_add(&extents, corners, begin, end, (const float(*)[3])axes);
    memcpy(out->box_rotation, world, sizeof world);
    fct_box_set(&extents, (const float(*)[3])axes, point, out);
}

/* Cone and rotation, from the corners and normals of faces [first, end) of a stream. */
static void orient(fct_points corners, fct_points normals, size_t first, size_t end, double size, v3 frame[3],
                   fct_cluster *out) {
    v3 cone = v3_unit(v3_load(out->area_vector));
    float axis[3];
    v3_store(axis, cone);
    out->cone_angle = fct_cone_angle(v3_norm2(cone) > 0 ? fct_cone_widen(0, normals, first, end, axis) : 4);
    fct_box_turn(corners, 3 * first, 3 * end, size, frame);
    fct_box_rotation((const v3 *)frame, out->box_rotation);
}

/* The box, of its rotation if that can be. */
static void fit(fct_points corners, size_t first, size_t end, fct_cluster *out) {
    float axes[3][3];
    fct_extents extents = fct_extents_none();
    fct_box_axes(out->box_rotation, axes);
    fct_extents_add(&extents, corners, 3 * first, 3 * end, (const float(*)[3])axes);
    v3 point = {(double)corners.x[3 * first], (double)corners.y[3 * first], (double)corners.z[3 * first]};
    if (!fct_box_set(&extents, (const float(*)[3])axes, point, out))
        fit_world(corners, 3 * first, 3 * end, point, out);
}

void fct_faces_describe(fct_points corners, fct_points normals, const fct_sums *sums, size_t first,
                        size_t end, fct_cluster *out) {
    double values[3];
    v3 frame[3];
    fct_eigen3(sums->covariance, values, frame);
    double size = fct_sums_store(sums, frame, out);
    orient(corners, normals, first, end, size, frame, out);
    fit(corners, first, end, out);
}

void fct_cluster_describe_face(const fct_tree_view *view, uint32_t place, fct_cluster *out) {
    const uint32_t *triangle = view->triangles + 3 * (size_t)place;
    float x[3], y[3], z[3], normal[3];
    for (int k = 0; k < 3; ++k) {
        const float *p = view->positions + 3 * (size_t)triangle[k];
        x[k] = p[0], y[k] = p[1], z[k] = p[2];
    }
    fct_unit_normal(view->positions, triangle, normal);
    fct_sums s;
    fct_sums_face(view->positions, triangle, &s);
    fct_faces_describe((fct_points){x, y, z}, (fct_points){normal, normal + 1, normal + 2}, &s, 0, 1, out);
    out->first = place, out->count = 1;
}

/* Inner nodes of the subtree level by level, and where their parts are: the memory of a level's nodes is
 * asked for while the level above is walked. */
static uint32_t list_subtree(const fct_tree *tree, uint32_t root, uint32_t first, block_scratch *s) {
    uint32_t nodes = tree->view.node_count, count = 0;
    if (root < nodes) s->order[count++] = root;
    for (uint32_t i = 0; i < count; ++i) {
        const fct_node_link *link = &tree->links[s->order[i]];
        fct_node_link_store(link, &s->records[i]);
        for (int k = 0; k < 2; ++k) {
            uint32_t child = link->child[k];
            s->parts[i][k] = child < nodes ? &s->nodes[count] : &s->leaves[child - nodes - first];
            if (child >= nodes) continue;
            __builtin_prefetch(&tree->links[child]);
            s->order[count++] = child;
        }
    }
    return count;
}

/* Corners, normals and sums of the block's faces. */
static void load_faces(const fct_tree_view *view, size_t first, size_t count, block_scratch *s) {
    for (size_t i = 0; i < count; ++i) {
        const uint32_t *triangle = view->triangles + 3 * (first + i);
        for (size_t k = 0; k < 3; ++k) {
            const float *p = view->positions + 3 * (size_t)triangle[k];
            for (int j = 0; j < 3; ++j) s->corners[j][3 * i + k] = p[j];
        }
        fct_sums *sums = &s->leaves[i];
        fct_sums_face(view->positions, triangle, sums);
        double invert = sums->area > 0 ? 1 / sums->area : (double)NAN;
        s->normals[0][i] = (float)(sums->vector.x * invert);
        s->normals[1][i] = (float)(sums->vector.y * invert);
        s->normals[2][i] = (float)(sums->vector.z * invert);
    }
}

/* Frames of four nodes, or of what is left. */
static void frame_nodes(uint32_t begin, uint32_t count, block_scratch *s) {
    const double *matrices[4];
    double values[4][3];
    v3 frames[4][3];
    for (uint32_t i = 0; i < 4; ++i) matrices[i] = s->nodes[begin + i < count ? begin + i : begin].covariance;
    fct_eigen3_four(matrices, values, frames);
    for (uint32_t i = begin; i < count && i < begin + 4; ++i) {
        memcpy(s->frames[i], frames[i - begin], sizeof s->frames[i]);
        s->sizes[i] = fct_sums_store(&s->nodes[i], s->frames[i], &s->records[i]);
    }
}

static inline void ask_for_record(const fct_cluster *c) {
    for (size_t at = 0; at < sizeof *c; at += 64) __builtin_prefetch((const char *)c + at, 1);
}

/* In passes over its nodes, so that what one node waits for overlaps with another's work. */
static void describe_block(const describer *d, size_t block, block_scratch *s) {
    const fct_tree *tree = d->tree;
    uint32_t nodes = tree->view.node_count, root = d->outline.blocks[block];
    uint32_t first = root < nodes ? tree->links[root].first : root - nodes;
    uint32_t faces = root < nodes ? tree->links[root].count : 1;
    uint32_t count = list_subtree(tree, root, first, s);
    load_faces(&tree->view, first, faces, s);
    fct_points corners = {s->corners[0], s->corners[1], s->corners[2]};
    fct_points normals = {s->normals[0], s->normals[1], s->normals[2]};
    for (uint32_t i = count; i-- > 0;) fct_sums_join(s->parts[i][0], s->parts[i][1], &s->nodes[i]);
    for (uint32_t i = 0; i < count; i += 4) frame_nodes(i, count, s);
    for (uint32_t i = 0; i < count; ++i) {
        fct_cluster *c = &s->records[i];
        orient(corners, normals, c->first - first, c->first - first + c->count, s->sizes[i], s->frames[i], c);
    }
    for (uint32_t i = 0; i < count; ++i) {
        fct_cluster *c = &s->records[i];
        fit(corners, c->first - first, c->first - first + c->count, c);
    }
    for (uint32_t i = 0; i < count; ++i) {
        if (i + AHEAD < count) ask_for_record(&tree->clusters[s->order[i + AHEAD]]);
        tree->clusters[s->order[i]] = s->records[i];
    }
    d->outline.sums[block] = count ? s->nodes[0] : s->leaves[0];
}

static void describe_blocks(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk;
    describer *d = user;
    for (size_t block = begin; block < end; ++block) describe_block(d, block, &d->scratch[thread]);
}

/* Notes where a part of its parent went. */
typedef struct visit {
    uint32_t node, parent, side;
} visit;

static void close_upper(fct_outline *o, uint32_t parent, uint32_t side, uint32_t part) {
    if (parent == FCT_NONE) return;
    if (o->upper) o->upper[parent].parts[side] = part;
}

/* Walks the tree from the root to its blocks; counts them where the lists are NULL. Heights are bounded, and
 * so is the stack. */
static void walk(const fct_tree *tree, fct_outline *o) {
    const fct_tree_view *view = &tree->view;
    visit stack[256];
    o->upper_count = o->block_count = 0;
    for (uint32_t r = 0; r < view->root_count; ++r) {
        uint32_t top = 0;
        stack[top++] = (visit){tree->roots[r], FCT_NONE, 0};
        while (top > 0) {
            visit v = stack[--top];
            if (v.node >= view->node_count || tree->links[v.node].count <= FCT_BLOCK) {
                close_upper(o, v.parent, v.side, FCT_IS_BLOCK | o->block_count);
                if (o->blocks) o->blocks[o->block_count] = v.node;
                ++o->block_count;
                continue;
            }
            close_upper(o, v.parent, v.side, o->upper_count);
            if (o->upper) {
                o->upper[o->upper_count].id = v.node;
                o->upper[o->upper_count].first_block = o->block_count;
            }
            stack[top++] = (visit){tree->links[v.node].child[1], o->upper_count, 1};
            stack[top++] = (visit){tree->links[v.node].child[0], o->upper_count, 0};
            ++o->upper_count;
        }
    }
}

static void count_blocks(fct_outline *o) {
    for (uint32_t i = o->upper_count; i-- > 0;) {
        fct_upper *u = &o->upper[i];
        u->block_count = 0;
        for (int k = 0; k < 2; ++k)
            u->block_count += u->parts[k] & FCT_IS_BLOCK ? 1 : o->upper[u->parts[k]].block_count;
    }
}

static fct_result prepare(const fct_env *env, describer *d) {
    fct_outline *o = &d->outline;
    walk(d->tree, o);
    o->upper = fct_allocate(env, o->upper_count, sizeof *o->upper);
    o->blocks = fct_allocate(env, o->block_count, sizeof *o->blocks);
    o->sums = fct_allocate(env, o->block_count, sizeof *o->sums);
    d->scratch = fct_allocate(env, fct_env_threads(env), sizeof *d->scratch);
    if (!d->tree->clusters)
        d->tree->clusters = fct_allocate(env, d->tree->view.node_count, sizeof *d->tree->clusters);
    d->tree->view.clusters = d->tree->clusters;
    if (!o->upper || !o->blocks || !o->sums || !d->scratch || !d->tree->clusters)
        return fct_fail_memory(env, "boxes");
    walk(d->tree, o);
    count_blocks(o);
    return FCT_OK;
}

fct_result fct_tree_describe(fct_tree *tree) {
    const fct_env *env = tree->env;
    describer d = {.tree = tree};
    fct_result result = prepare(env, &d);
    if (result == FCT_OK)
        result = fct_parallel_for_progress(env, "boxes", d.outline.block_count, 4, describe_blocks, &d);
    if (result == FCT_OK) result = fct_tree_describe_upper(tree, &d.outline);
    fct_release(env, tree->links);
    tree->links = NULL;
    fct_release(env, d.outline.upper);
    fct_release(env, d.outline.blocks);
    fct_release(env, d.outline.sums);
    fct_release(env, d.scratch);
    return result;
}
