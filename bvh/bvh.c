/* bvh/bvh.c: creation of the structure with either backend. */
#include <string.h>

#include "bvh/build/frame.h"
#include "bvh/build/leaves.h"
#include "bvh/build/nodes.h"
#include "bvh/build/pairs.h"
#include "bvh/build/refit.h"
#include "bvh/near/sign/moments.h"
#include "bvh/ray/embree.h"

static fct_result build_packed(fct_bvh *bvh, uint32_t parts) {
    fct_leaf_list leaves = {0};
    fct_top top = {0};
    fct_wide_list wide = {0};
    fct_result result = fct_progress(bvh->env, "ray structure", 0);
    if (result == FCT_OK) result = fct_leaves_build(bvh, &leaves);
    if (result == FCT_OK) result = fct_progress(bvh->env, "ray structure", .2);
    if (result == FCT_OK) result = fct_frame_choose(bvh, &leaves);
    if (result == FCT_OK) result = fct_top_build(bvh->env, &leaves, 1, &top);
    if (result == FCT_OK) result = fct_progress(bvh->env, "ray structure", .5);
    if (result == FCT_OK) result = fct_wide_build(bvh, &leaves, &top, &wide);
    if (result == FCT_OK) result = fct_progress(bvh->env, "ray structure", .9);
    if (result == FCT_OK) result = fct_nodes_build(bvh, &leaves, &top, &wide);
    if (result == FCT_OK && (parts & FCT_BVH_PAIRS)) result = fct_pairs_build(bvh, &leaves, &top, &wide);
    if (result == FCT_OK && parts & FCT_BVH_SIGN) result = fct_moments_build(bvh);
    if (result == FCT_OK) result = fct_progress(bvh->env, "ray structure", 1);
    fct_wide_release(bvh->env, &wide);
    fct_top_release(bvh->env, &top);
    fct_leaf_list_release(bvh->env, &leaves);
    return result;
}

fct_bvh_def fct_bvh_def_default(void) {
    return (fct_bvh_def){.size = sizeof(fct_bvh_def)};
}

fct_result fct_bvh_build(const fct_env *env, const fct_tree *tree, const fct_bvh_def *def, fct_bvh **out) {
    *out = NULL;
    fct_bvh_def standard = fct_bvh_def_default();
    if (!def) def = &standard;
    if (def->size != sizeof *def) return fct_fail(env, FCT_ERROR_DATA, "fct_bvh_def has an unexpected size");
    fct_result result = fct_tree_check(env, tree);
    if (result != FCT_OK) return result;
    fct_bvh *bvh = fct_allocate_zero(env, 1, sizeof *bvh);
    if (!bvh) return fct_fail_memory(env, "a ray structure");
    bvh->env = env;
    bvh->tree = tree;
    bvh->view = fct_tree_get(tree);
    bvh->backend = def->backend;
    fct_bvh_measure(bvh);
    result = def->backend == FCT_BACKEND_EMBREE ? fct_embree_create(bvh) : build_packed(bvh, def->parts);
    if (result == FCT_OK)
        *out = bvh;
    else
        fct_bvh_destroy(bvh);
    return result;
}

fct_result fct_bvh_create(const fct_env *env, const fct_tree *tree, fct_backend backend, fct_bvh **out) {
    fct_bvh_def def = fct_bvh_def_default();
    def.backend = backend;
    return fct_bvh_build(env, tree, &def, out);
}

/* Copies an array of the old structure, if there is one. */
static bool copy_array(const fct_env *env, const void *from, size_t bytes, void *to) {
    void *memory = from ? fct_allocate(env, bytes, 1) : NULL;
    if (memory) memcpy(memory, from, bytes);
    memcpy(to, &memory, sizeof memory);
    return memory || !from;
}

/* A copy of everything but the positions, which are new, and the moments. */
static fct_result copy_structure(const fct_env *env, const fct_bvh *old, const float *positions,
                                 fct_bvh *bvh) {
    const fct_tree_view *view = &old->view;
    *bvh = *old;
    bvh->env = env;
    bvh->nodes = bvh->leaves = NULL, bvh->places = NULL, bvh->pairs = NULL, bvh->parts = NULL,
    bvh->moments = NULL, bvh->embree = NULL;
    bvh->moved = fct_allocate(env, view->vertex_count, 3 * sizeof *bvh->moved);
    if (!bvh->moved || !copy_array(env, old->nodes, old->node_bytes, &bvh->nodes) ||
        !copy_array(env, old->leaves, old->leaf_bytes, &bvh->leaves) ||
        !copy_array(env, old->places, view->face_count * sizeof *old->places, &bvh->places) ||
        !copy_array(env, old->pairs, old->pair_count * sizeof *old->pairs, &bvh->pairs) ||
        !copy_array(env, old->parts, old->part_count * sizeof *old->parts, &bvh->parts))
        return fct_fail_memory(env, "a ray structure");
    for (size_t v = 0; v < view->vertex_count; ++v)
        memcpy(bvh->moved + 3 * v, positions + 3 * (size_t)view->vertex_ids[v], 3 * sizeof *positions);
    bvh->view.positions = bvh->moved;
    return FCT_OK;
}

static fct_result check_positions(const fct_env *env, const fct_bvh *bvh, const float *positions) {
    for (size_t i = 0; i < 3 * (size_t)bvh->view.vertex_count; ++i)
        if (!(fabsf(positions[i]) < INFINITY))
            return fct_fail(env, FCT_ERROR_DATA, "vertex %zu: coordinate %g, expected a finite one", i / 3,
                            (double)positions[i]);
    return FCT_OK;
}

fct_result fct_bvh_refit(const fct_env *env, const fct_bvh *old, const float *positions, fct_bvh **out,
                         double *work) {
    *out = NULL;
    fct_result result = check_positions(env, old, positions);
    if (result != FCT_OK) return result;
    fct_bvh *bvh = fct_allocate_zero(env, 1, sizeof *bvh);
    if (!bvh) return fct_fail_memory(env, "a ray structure");
    result = copy_structure(env, old, positions, bvh);
    if (result == FCT_OK) {
        fct_bvh_measure(bvh);
        if (old->built_cost == 0 && !old->embree) bvh->built_cost = fct_bvh_cost(old);
        result = old->embree ? fct_embree_create(bvh) : fct_refit_boxes(bvh, old);
    }
    if (result == FCT_OK && old->has_sign) result = fct_moments_build(bvh);
    if (result == FCT_OK) {
        if (work) *work = old->embree ? 1 : fct_bvh_cost(bvh) / bvh->built_cost;
        *out = bvh;
    } else {
        fct_bvh_destroy(bvh);
    }
    return result;
}

void fct_bvh_destroy(fct_bvh *bvh) {
    if (!bvh) return;
    fct_embree_destroy(bvh->env, bvh->embree);
    fct_release(bvh->env, bvh->nodes);
    fct_release(bvh->env, bvh->leaves);
    fct_release(bvh->env, bvh->places);
    fct_release(bvh->env, bvh->pairs);
    fct_release(bvh->env, bvh->parts);
    fct_release(bvh->env, bvh->moments);
    fct_release(bvh->env, bvh->moved);
    fct_release(bvh->env, bvh);
}

size_t fct_bvh_bytes(const fct_bvh *bvh) {
    if (bvh->embree) return sizeof *bvh + fct_embree_bytes(bvh->embree);
    return sizeof *bvh + bvh->node_bytes + bvh->leaf_bytes + bvh->moment_bytes +
           bvh->pair_count * sizeof *bvh->pairs + bvh->part_count * sizeof *bvh->parts +
           (bvh->places ? sizeof *bvh->places * bvh->view.face_count : 0) +
           (bvh->moved ? 3 * sizeof *bvh->moved * bvh->view.vertex_count : 0);
}

fct_bounds fct_bvh_bounds(const fct_bvh *bvh) {
    return bvh->bounds;
}

const fct_tree *fct_bvh_tree(const fct_bvh *bvh) {
    return bvh->tree;
}
