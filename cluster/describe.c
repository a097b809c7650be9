/* cluster/describe.c: area, moments, cone, plane and box of every cluster.
 *
 * Sums over the surface are combined from the leaves up in double, about each cluster's own centroid.
 * Subtrees of at most BLOCK faces are one task each and stay in the cache; the nodes above are summed in
 * order and then described in parallel. Extents and cones run over the cluster's faces, which are
 * consecutive: O(F log F). Frame of a box: PCA of the surface, turned in its plane to the least area of eight
 * angles; above the blocks the children's frames and the world axes compete too (half a percent less area,
 * all of it near the root).
 *
 * Degenerate answers. A face without area weighs 1e-20 of its longest side squared in centroid and frame, so
 * that clusters of such faces still have both. Cancelled normals: cone pi, the plane's sign is the
 * eigenvector's. Areas beyond a float's range end at its largest value with S and M scaled alike, below it at
 * 0 (cone pi then); boxes, planes and centroids depend on neither.
 */
#include <float.h>
#include <string.h>

#include "base/eigen.h"
#include "base/parallel.h"
#include "cluster/box.h"
#include "cluster/tree.h"

enum { BLOCK = 512 };

/* Sums of a cluster; center and covariance by `weight`. */
typedef struct sums {
    double area, weight, moment[6], covariance[6];
    v3 vector, center;
} sums;

typedef struct describer {
    fct_tree *tree;
    fct_soup soup;
    uint32_t *upper, upper_count;  /* ids of nodes of more than BLOCK faces, ascending */
    uint32_t *blocks, block_count; /* ids of the subtrees' roots, ascending */
    sums *upper_sums, *block_sums;
    float (*rotations)[4]; /* of the nodes above the blocks */
    sums *scratch;         /* BLOCK for each thread */
    uint32_t *order;       /* BLOCK for each thread */
} describer;

static void face_sums(const float *positions, const uint32_t triangle[3], sums *s) {
    v3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = v3_load(positions + 3 * (size_t)triangle[k]);
    v3 u = v3_sub(p[1], p[0]), v = v3_sub(p[2], p[0]);
    *s = (sums){.vector = v3_scale(v3_cross(u, v), 0.5)};
    s->area = s->weight = v3_norm(s->vector);
    s->center = v3_mad(p[0], 1.0 / 3, v3_add(u, v));
    if (s->area > 0)
        sym3_add_outer(s->moment, 1 / s->area, s->vector);
    else
        s->weight = 1e-20 * fmax(v3_norm2(u), fmax(v3_norm2(v), v3_norm2(v3_sub(v, u))));
    for (int k = 0; k < 3; ++k) sym3_add_outer(s->covariance, s->weight / 12, v3_sub(p[k], s->center));
}

static void join_sums(const sums *a, const sums *b, sums *out) {
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

static void store_areas(const sums *s, fct_cluster *out) {
    double factor = s->area > (double)FLT_MAX ? (double)FLT_MAX / s->area : 1;
    out->area = (float)(s->area * factor);
    v3_store(out->area_vector, v3_scale(s->vector, factor));
    for (int i = 0; i < 6; ++i) out->moment[i] = (float)(s->moment[i] * factor);
}

/* Takes the frame if its box is smaller than the cluster's. Nothing but the box is written: other threads
 * read the rest. */
static void try_rotation(const fct_soup *soup, const float rotation[4], fct_cluster *out) {
    fct_cluster other = *out;
    memcpy(other.box_rotation, rotation, sizeof other.box_rotation);
    fct_box_fit(soup, out->first, out->count, &other);
    if (!(fct_box_area(&other) < fct_box_area(out))) return;
    memcpy(out->box_center, other.box_center, sizeof out->box_center);
    memcpy(out->box_rotation, other.box_rotation, sizeof out->box_rotation);
    memcpy(out->box_half, other.box_half, sizeof out->box_half);
}

/* All but cost and links; first and count are set. */
static void describe(const fct_soup *soup, const sums *s, fct_cluster *out) {
    store_areas(s, out);
    v3_store(out->centroid, s->center);
    out->cone_angle = fct_cone_angle(soup, out->first, out->count, out->area_vector);
    double values[3];
    v3 axes[3];
    fct_eigen3(s->covariance, values, axes);
    v3 normal = v3_dot(axes[0], s->vector) < 0 ? v3_scale(axes[0], -1) : axes[0];
    v3_store(out->plane, normal);
    double offset = -v3_dot(normal, s->center);
    out->plane[3] = (float)fmax(fmin(offset, (double)FLT_MAX), -(double)FLT_MAX);
    v3 frame[3] = {axes[2], v3_cross(normal, axes[2]), normal};
    fct_box_turn(soup, out->first, out->count, frame);
    fct_box_rotation(frame, out->box_rotation);
    fct_box_fit(soup, out->first, out->count, out);
}

void fct_cluster_describe_face(const fct_tree_view *view, uint32_t place, fct_cluster *out) {
    float streams[12];
    fct_soup soup = {{streams, streams + 3, streams + 6}, {streams + 9, streams + 10, streams + 11}};
    const uint32_t *triangle = view->triangles + 3 * (size_t)place;
    sums s;
    fct_soup_face(&soup, 0, view->positions, triangle);
    face_sums(view->positions, triangle, &s);
    out->first = 0, out->count = 1;
    describe(&soup, &s, out);
    out->first = place;
}

static void fill_soup(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    describer *d = user;
    const fct_tree_view *view = &d->tree->view;
    for (size_t i = begin; i < end; ++i) fct_soup_face(&d->soup, i, view->positions, view->triangles + 3 * i);
}

/* Inner nodes of the subtree in preorder, in which a node's left child follows it and the right one comes
 * after the left's count - 1 inner nodes. */
static uint32_t list_subtree(const describer *d, uint32_t root, uint32_t *order) {
    const fct_cluster *clusters = d->tree->clusters;
    uint32_t nodes = d->tree->view.node_count, count = 0, top = 0, stack[BLOCK];
    stack[top++] = root;
    while (top > 0) {
        uint32_t node = stack[--top];
        order[count++] = node;
        for (int k = 1; k >= 0; --k)
            if (clusters[node].child[k] < nodes) stack[top++] = clusters[node].child[k];
    }
    return count;
}

static void describe_block(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk;
    describer *d = user;
    const fct_tree_view *view = &d->tree->view;
    fct_cluster *clusters = d->tree->clusters;
    uint32_t *order = d->order + (size_t)thread * BLOCK;
    sums *scratch = d->scratch + (size_t)thread * BLOCK;
    for (size_t block = begin; block < end; ++block) {
        uint32_t count = list_subtree(d, d->blocks[block], order);
        for (uint32_t i = count; i-- > 0;) {
            fct_cluster *c = &clusters[order[i]];
            uint32_t at = i + 1;
            sums leaves[2];
            const sums *parts[2];
            for (int k = 0; k < 2; ++k) {
                uint32_t child = c->child[k];
                parts[k] = &scratch[at];
                if (child < view->node_count) {
                    at += clusters[child].count - 1;
                } else {
                    size_t place = child - view->node_count;
                    face_sums(view->positions, view->triangles + 3 * place, &leaves[k]);
                    parts[k] = &leaves[k];
                }
            }
            join_sums(parts[0], parts[1], &scratch[i]);
            describe(&d->soup, &scratch[i], c);
        }
        d->block_sums[block] = scratch[0];
    }
}

static uint32_t index_of(const uint32_t *ids, uint32_t count, uint32_t id) {
    uint32_t low = 0;
    while (low < count) {
        uint32_t middle = low + (count - low) / 2;
        if (ids[middle] == id) return middle;
        if (ids[middle] < id)
            low = middle + 1;
        else
            count = middle;
    }
    return FCT_NONE;
}

static void sum_upper(describer *d) {
    const fct_tree_view *view = &d->tree->view;
    for (uint32_t i = d->upper_count; i-- > 0;) {
        const fct_cluster *c = &d->tree->clusters[d->upper[i]];
        sums leaves[2];
        const sums *parts[2] = {&leaves[0], &leaves[1]};
        for (int k = 0; k < 2; ++k) {
            uint32_t child = c->child[k];
            if (child >= view->node_count)
                face_sums(view->positions, view->triangles + 3 * (size_t)(child - view->node_count),
                          &leaves[k]);
            else if (d->tree->clusters[child].count > BLOCK)
                parts[k] = &d->upper_sums[index_of(d->upper, d->upper_count, child)];
            else
                parts[k] = &d->block_sums[index_of(d->blocks, d->block_count, child)];
        }
        join_sums(parts[0], parts[1], &d->upper_sums[i]);
    }
}

static void describe_upper(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    describer *d = user;
    static const float world[4] = {0, 0, 0, 1};
    for (size_t i = begin; i < end; ++i) {
        fct_cluster *c = &d->tree->clusters[d->upper[i]];
        describe(&d->soup, &d->upper_sums[i], c);
        try_rotation(&d->soup, world, c);
        memcpy(d->rotations[i], c->box_rotation, sizeof d->rotations[i]);
    }
}

/* The frames that the children had before any was handed up, so that the order of nodes does not matter. */
static void try_children(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    describer *d = user;
    const fct_cluster *clusters = d->tree->clusters;
    for (size_t i = begin; i < end; ++i) {
        fct_cluster *c = &d->tree->clusters[d->upper[i]];
        for (int k = 0; k < 2; ++k) {
            uint32_t child = c->child[k];
            if (child >= d->tree->view.node_count) continue;
            bool upper = clusters[child].count > BLOCK;
            try_rotation(&d->soup,
                         upper ? d->rotations[index_of(d->upper, d->upper_count, child)]
                               : clusters[child].box_rotation,
                         c);
        }
    }
}

/* Finds blocks and the nodes above them; the lists have room, or are NULL to count. */
static void list_nodes(describer *d, uint8_t *inside) {
    const fct_tree_view *view = &d->tree->view;
    memset(inside, 0, view->node_count);
    d->upper_count = d->block_count = 0;
    for (uint32_t i = 0; i < view->node_count; ++i) {
        const fct_cluster *c = &view->clusters[i];
        if (c->count > BLOCK) {
            if (d->upper) d->upper[d->upper_count] = i;
            ++d->upper_count;
            continue;
        }
        if (!inside[i]) {
            if (d->blocks) d->blocks[d->block_count] = i;
            ++d->block_count;
        }
        for (int k = 0; k < 2; ++k)
            if (c->child[k] < view->node_count) inside[c->child[k]] = 1;
    }
}

static fct_result prepare(const fct_env *env, describer *d) {
    const fct_tree_view *view = &d->tree->view;
    uint8_t *inside = fct_allocate(env, view->node_count, 1);
    for (int k = 0; k < 3; ++k) {
        d->soup.corner[k] = fct_allocate(env, view->face_count, 3 * sizeof(float));
        d->soup.normal[k] = fct_allocate(env, view->face_count, sizeof(float));
    }
    if (inside) list_nodes(d, inside);
    d->upper = fct_allocate(env, d->upper_count, sizeof *d->upper);
    d->blocks = fct_allocate(env, d->block_count, sizeof *d->blocks);
    d->upper_sums = fct_allocate(env, d->upper_count, sizeof *d->upper_sums);
    d->block_sums = fct_allocate(env, d->block_count, sizeof *d->block_sums);
    d->rotations = fct_allocate(env, d->upper_count, sizeof *d->rotations);
    d->scratch = fct_allocate(env, (size_t)fct_env_threads(env) * BLOCK, sizeof *d->scratch);
    d->order = fct_allocate(env, (size_t)fct_env_threads(env) * BLOCK, sizeof *d->order);
    bool complete = inside && d->upper && d->blocks && d->upper_sums && d->block_sums && d->rotations &&
                    d->scratch && d->order;
    for (int k = 0; k < 3; ++k) complete = complete && d->soup.corner[k] && d->soup.normal[k];
    if (complete) list_nodes(d, inside);
    fct_release(env, inside);
    return complete ? FCT_OK : fct_fail_memory(env, "boxes");
}

fct_result fct_tree_describe(fct_tree *tree) {
    const fct_env *env = tree->env;
    describer d = {.tree = tree};
    fct_result result = prepare(env, &d);
    if (result == FCT_OK) {
        fct_parallel_for(env, tree->view.face_count, 1 << 14, fill_soup, &d);
        result = fct_parallel_for_progress(env, "boxes", d.block_count, 4, describe_block, &d);
    }
    if (result == FCT_OK) {
        sum_upper(&d);
        fct_parallel_for(env, d.upper_count, 1, describe_upper, &d);
        fct_parallel_for(env, d.upper_count, 1, try_children, &d);
    }
    for (int k = 0; k < 3; ++k) {
        fct_release(env, d.soup.corner[k]);
        fct_release(env, d.soup.normal[k]);
    }
    fct_release(env, d.upper);
    fct_release(env, d.blocks);
    fct_release(env, d.upper_sums);
    fct_release(env, d.block_sums);
    fct_release(env, d.rotations);
    fct_release(env, d.scratch);
    fct_release(env, d.order);
    return result;
}
