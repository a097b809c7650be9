/* bvh/bvh.c: creation of the structure with either backend. */
#include "bvh/build/nodes.h"
#include "bvh/build/pairs.h"
#include "bvh/near/moments.h"
#include "bvh/ray/embree.h"

static fct_result build_packed(fct_bvh *bvh, uint32_t parts) {
    fct_leaf_list leaves = {0};
    fct_top top = {0};
    fct_wide_list wide = {0};
    fct_result result = fct_progress(bvh->env, "ray structure", 0);
    if (result == FCT_OK) result = fct_leaves_build(bvh, &leaves);
    if (result == FCT_OK) result = fct_progress(bvh->env, "ray structure", .2);
    if (result == FCT_OK) result = fct_top_build(bvh->env, &leaves, &top);
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

void fct_bvh_destroy(fct_bvh *bvh) {
    if (!bvh) return;
    fct_embree_destroy(bvh->env, bvh->embree);
    fct_release(bvh->env, bvh->nodes);
    fct_release(bvh->env, bvh->leaves);
    fct_release(bvh->env, bvh->pairs);
    fct_release(bvh->env, bvh->parts);
    fct_release(bvh->env, bvh->moments);
    fct_release(bvh->env, bvh);
}

size_t fct_bvh_bytes(const fct_bvh *bvh) {
    if (bvh->embree) return sizeof *bvh + fct_embree_bytes(bvh->embree);
    return sizeof *bvh + bvh->node_bytes + bvh->leaf_bytes + bvh->moment_bytes +
           bvh->pair_count * sizeof *bvh->pairs + bvh->part_count * sizeof *bvh->parts;
}

fct_bounds fct_bvh_bounds(const fct_bvh *bvh) {
    return bvh->bounds;
}

const fct_tree *fct_bvh_tree(const fct_bvh *bvh) {
    return bvh->tree;
}
