/* bvh/build/refit.c: see refit.h.
 *
 * 1. Leaves take the new positions of their vertices.
 * 2. Each box is fitted to the vertices of the leaves below it. An oriented box keeps its axes, or takes the
 *    coordinate axes if these are better by now.
 *
 * A box keeps its bytes if no vertex below it has moved and the scaled space is the same. O(F) per level of
 * the tree, in parallel.
 */
#include "bvh/build/refit.h"

#include <string.h>

#include "base/parallel.h"
#include "bvh/build/boxes.h"
#include "bvh/build/pairs.h"

enum { LEAF_CHUNK = 1024, NODE_CHUNK = 64 /* per task */ };

typedef struct refit_job {
    fct_bvh *bvh;
    const fct_bvh *old;
    uint32_t *leaves; /* leaf_count offsets, in units of FCT_REF_UNIT */
    uint32_t leaf_count;
    uint32_t *nodes; /* node_count references */
    uint32_t node_count;
    bool *moved; /* per unit of the leaves; set for the first of a leaf */
} refit_job;

static void list_leaves(refit_job *job) {
    const fct_bvh *bvh = job->bvh;
    for (size_t at = 0; at < bvh->leaf_bytes; ++job->leaf_count) {
        const fct_leaf *leaf = fct_bvh_leaf(bvh, (uint32_t)(at / FCT_REF_UNIT));
        job->leaves[job->leaf_count] = (uint32_t)(at / FCT_REF_UNIT);
        at += fct_leaf_bytes(leaf->count, leaf->vertex_octets);
    }
}

static void list_nodes(refit_job *job) {
    const fct_bvh *bvh = job->bvh;
    if (!(bvh->root & FCT_REF_LEAF)) job->nodes[job->node_count++] = bvh->root;
    for (uint32_t i = 0; i < job->node_count; ++i) {
        uint32_t present;
        const uint32_t *child = fct_bvh_children(bvh, job->nodes[i], &present);
        for (uint32_t k = 0; k < 8; ++k)
            if ((present >> k & 1) && !(child[k] & FCT_REF_LEAF)) job->nodes[job->node_count++] = child[k];
    }
}

/* Sets the vertices of a leaf and its mask. */
static void move_leaf(const fct_bvh *bvh, fct_leaf *leaf) {
    uint8_t *corners = (uint8_t *)(leaf + 1);
    float *rows = (float *)(void *)(corners + 24 * (size_t)fct_leaf_octets(leaf));
    uint32_t stride = 8u * leaf->vertex_octets, vertices[FCT_LEAF_VERTICES];
    for (uint32_t i = 0; i < stride; ++i) vertices[i] = FCT_NONE;
    leaf->mask = 0;
    for (uint32_t i = 0; i < leaf->count; ++i) {
        uint32_t place = fct_leaf_place(bvh, leaf, i);
        if (!fct_bvh_degenerate(bvh, place)) leaf->mask |= (uint16_t)(1u << i);
        for (uint32_t c = 0; c < 3; ++c)
            vertices[corners[24 * (i / 8) + 8 * c + i % 8]] = bvh->view.triangles[3 * (size_t)place + c];
    }
    for (uint32_t i = 0; i < stride; ++i) {
        float p[3];
        fct_bvh_position(bvh, vertices[i] == FCT_NONE ? vertices[0] : vertices[i], p);
        for (uint32_t k = 0; k < 3; ++k) rows[k * stride + i] = p[k];
    }
}

static void move_leaves(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    refit_job *job = user;
    const fct_bvh *a = job->bvh, *b = job->old;
    bool same_space = a->scale == b->scale && !memcmp(a->offset, b->offset, sizeof a->offset) &&
                      !memcmp(a->center, b->center, sizeof a->center);
    for (size_t i = begin; i < end; ++i) {
        size_t at = (size_t)job->leaves[i] * FCT_REF_UNIT;
        fct_leaf *leaf = (fct_leaf *)(void *)(job->bvh->leaves + at);
        move_leaf(job->bvh, leaf);
        size_t bytes = fct_leaf_bytes(leaf->count, leaf->vertex_octets);
        job->moved[job->leaves[i]] = !same_space || memcmp(leaf, b->leaves + at, bytes) != 0;
    }
}

/* The references of the children of a node: of the nodes for rays, or, if `pairs`, of pair nodes. Returns
 * their number. */
static uint32_t list_children(const fct_bvh *bvh, bool pairs, uint32_t ref, uint32_t out[8]) {
    uint32_t count = 0, present = 0xff;
    const uint32_t *child = pairs ? bvh->pairs[ref].child : fct_bvh_children(bvh, ref, &present);
    for (uint32_t k = 0; k < 8; ++k)
        if ((present >> k & 1) && child[k] != FCT_NONE) out[count++] = child[k];
    return count;
}

/* Fits two slabs to the leaves below a reference. Returns whether a vertex has moved. */
static bool fit_below(const refit_job *job, bool pairs, uint32_t ref, fct_slabs slabs[2]) {
    uint32_t stack[FCT_STACK_SIZE + 8], height = 1;
    bool moved = false;
    fct_slabs_clear(&slabs[0]), fct_slabs_clear(&slabs[1]);
    stack[0] = ref;
    while (height) {
        ref = stack[--height];
        if (!(ref & FCT_REF_LEAF)) {
            height += list_children(job->bvh, pairs, ref, stack + height);
            continue;
        }
        const uint32_t offset = ref & ~FCT_REF_LEAF, only = 0;
        moved |= job->moved[offset];
        for (int i = 0; i < 2; ++i) fct_slabs_hold(job->bvh, &offset, &only, 1, &slabs[i]);
    }
    return moved;
}

static const fct_slabs coordinate_slabs = {.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

static const fct_slabs *choose_smaller(const fct_slabs slabs[2]) {
    return fct_slabs_area(&slabs[0]) <= fct_slabs_area(&slabs[1]) ? &slabs[0] : &slabs[1];
}

static void refit_axis_box(const refit_job *job, uint32_t child, uint32_t i, fct_axis_node *node) {
    fct_slabs slabs[2] = {coordinate_slabs, coordinate_slabs};
    if (!fit_below(job, false, child, slabs)) return;
    float bounds[6];
    for (int k = 0; k < 3; ++k) {
        double center = (double)job->bvh->center[k];
        bounds[k] = (float)(slabs[0].lower[k] + center), bounds[3 + k] = (float)(slabs[0].upper[k] + center);
    }
    fct_pack_axis_box(bounds, i, node);
}

static void refit_oriented_box(const refit_job *job, uint32_t child, uint32_t i, fct_oriented_node *node) {
    fct_slabs slabs[2] = {coordinate_slabs, coordinate_slabs};
    for (int k = 0; k < 3; ++k)
        slabs[0].axes[k] = v3_unit(
            v3_make((double)node->map[k][0][i], (double)node->map[k][1][i], (double)node->map[k][2][i]));
    if (fit_below(job, false, child, slabs)) fct_pack_oriented_box(choose_smaller(slabs), i, node);
}

static void refit_pair_box(const refit_job *job, uint32_t child, uint32_t i, fct_pair_node *node) {
    fct_slabs slabs[2] = {coordinate_slabs, coordinate_slabs};
    for (int k = 0; k < 3; ++k)
        slabs[0].axes[k] =
            v3_make((double)node->axes[k][0][i], (double)node->axes[k][1][i], (double)node->axes[k][2][i]);
    if (fit_below(job, true, child, slabs)) fct_pack_pair_box(choose_smaller(slabs), i, node);
}

/* The empty slots of a node repeat child 0. */
static void refit_nodes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const refit_job *job = user;
    for (size_t n = begin; n < end; ++n) {
        char *at = job->bvh->nodes + (size_t)(job->nodes[n] & ~FCT_REF_ORIENTED) * FCT_REF_UNIT;
        uint32_t present;
        const uint32_t *child = fct_bvh_children(job->bvh, job->nodes[n], &present);
        for (uint32_t i = 0; i < 8; ++i) {
            uint32_t ref = child[present >> i & 1 ? i : 0];
            if (job->nodes[n] & FCT_REF_ORIENTED)
                refit_oriented_box(job, ref, i, (fct_oriented_node *)(void *)at);
            else
                refit_axis_box(job, ref, i, (fct_axis_node *)(void *)at);
        }
    }
}

static void refit_pair_nodes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const refit_job *job = user;
    for (size_t n = begin; n < end; ++n) {
        fct_pair_node *node = &job->bvh->pairs[n];
        for (uint32_t i = 0; i < 8 && node->child[i] != FCT_NONE; ++i)
            refit_pair_box(job, node->child[i], i, node);
    }
}

fct_result fct_refit_boxes(fct_bvh *bvh, const fct_bvh *old) {
    const fct_env *env = bvh->env;
    refit_job job = {.bvh = bvh, .old = old};
    size_t units = bvh->leaf_bytes / FCT_REF_UNIT;
    job.leaves = fct_allocate(env, units, sizeof *job.leaves);
    job.nodes = fct_allocate(env, units, sizeof *job.nodes);
    job.moved = fct_allocate_zero(env, units, sizeof *job.moved);
    fct_result result = FCT_OK;
    if (job.leaves && job.nodes && job.moved) {
        list_leaves(&job);
        list_nodes(&job);
        fct_parallel_for(env, job.leaf_count, LEAF_CHUNK, move_leaves, &job);
        fct_parallel_for(env, job.node_count, NODE_CHUNK, refit_nodes, &job);
        fct_parallel_for(env, bvh->pair_count, NODE_CHUNK, refit_pair_nodes, &job);
        if (bvh->pairs) fct_pairs_stamp(bvh);
    } else {
        result = fct_fail_memory(env, "the boxes of a moved model");
    }
    fct_release(env, job.leaves);
    fct_release(env, job.nodes);
    fct_release(env, job.moved);
    return result;
}

static double find_child_area(const fct_bvh *bvh, uint32_t ref, uint32_t i) {
    double side[3];
    for (int k = 0; k < 3; ++k) {
        if (ref & FCT_REF_ORIENTED) {
            const fct_oriented_node *node = fct_bvh_node(bvh, ref);
            side[k] = 2 / v3_norm(v3_make((double)node->map[k][0][i], (double)node->map[k][1][i],
                                          (double)node->map[k][2][i]));
        } else {
            const fct_axis_node *node = fct_bvh_node(bvh, ref);
            side[k] = (double)node->bounds[k][1][i] - (double)node->bounds[k][0][i];
        }
    }
    return fct_half_area(side[0], side[1], side[2]);
}

double fct_bvh_cost(const fct_bvh *bvh) {
    const fct_bounds *b = &bvh->bounds;
    double side[3], sum = 0;
    uint32_t stack[FCT_STACK_SIZE + 8], height = 0;
    for (int k = 0; k < 3; ++k)
        side[k] = bvh->scale * ((double)b->upper[k] - (double)b->lower[k]) + 2 * (double)FCT_AXIS_PAD;
    if (!(bvh->root & FCT_REF_LEAF)) stack[height++] = bvh->root;
    while (height) {
        uint32_t ref = stack[--height], present;
        const uint32_t *child = fct_bvh_children(bvh, ref, &present);
        for (uint32_t i = 0; i < 8; ++i) {
            if (!(present >> i & 1)) continue;
            sum += find_child_area(bvh, ref, i);
            if (!(child[i] & FCT_REF_LEAF)) stack[height++] = child[i];
        }
    }
    return 1 + sum / fct_half_area(side[0], side[1], side[2]);
}
