/* bvh/build/pairs.c: packs oriented boxes for queries on two models, and lists the connected parts.
 *
 * The tree of wide nodes and its boxes are those of the nodes for rays; here every box is oriented. Node 0
 * has one child, the root, so that the root has a box too. O(F).
 */
#include "bvh/build/pairs.h"

#include <xxhash.h>

#include "base/parallel.h"
#include "base/union_find.h"
#include "bvh/build/boxes.h"

enum { NODE_CHUNK = 256 /* nodes per task */ };

/* Half extents of the empty slots: separated from everything, and their squares are floats. */
#define EMPTY_HALF (-1e18f)

static void clear_node(fct_pair_node *out) {
    *out = (fct_pair_node){0};
    for (int i = 0; i < 8; ++i) {
        out->child[i] = FCT_NONE;
        for (int k = 0; k < 3; ++k) out->half[k][i] = EMPTY_HALF, out->axes[k][k][i] = 1;
    }
}

typedef struct pair_job {
    fct_bvh *bvh;
    const fct_leaf_list *leaves;
    const fct_top *top;
    const fct_wide_list *wide;
} pair_job;

/* Wide node i becomes node i + 1. */
static void pack_pair_nodes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const pair_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        const fct_wide_node *wide = &job->wide->nodes[i];
        fct_pair_node *out = &job->bvh->pairs[i + 1];
        clear_node(out);
        for (uint32_t k = 0; k < wide->count; ++k) {
            const fct_top_node *child = &job->top->nodes[wide->top[k]];
            fct_pack_pair_box(&job->wide->boxes[8 * i + k], k, out);
            if (child->left == FCT_NONE)
                out->child[k] = FCT_REF_LEAF | job->leaves->offsets[job->top->order[child->begin]];
        }
    }
}

/* Lists one vertex of each connected part. Faces that share a vertex are connected. */
static fct_result list_parts(fct_bvh *bvh) {
    const fct_env *env = bvh->env;
    const fct_tree_view *view = &bvh->view;
    uint32_t *sets = fct_allocate(env, view->vertex_count, sizeof *sets), count = 0;
    if (!sets) return fct_fail_memory(env, "the parts of a model");
    fct_sets_create(sets, view->vertex_count);
    for (size_t f = 0; f < view->face_count; ++f)
        for (int c = 1; c < 3; ++c) fct_sets_join(sets, view->triangles[3 * f], view->triangles[3 * f + c]);
    /* The root of a set with faces is a vertex of one of them. Mark it. */
    for (size_t i = 0; i < 3 * (size_t)view->face_count; ++i) {
        uint32_t vertex = view->triangles[i];
        if (sets[vertex] == vertex) sets[vertex] = FCT_NONE, ++count;
    }
    bvh->parts = fct_allocate(env, count, sizeof *bvh->parts);
    if (bvh->parts)
        for (uint32_t v = 0; v < view->vertex_count; ++v)
            if (sets[v] == FCT_NONE) bvh->parts[bvh->part_count++] = v;
    fct_release(env, sets);
    return bvh->parts ? FCT_OK : fct_fail_memory(env, "the parts of a model");
}

void fct_pairs_stamp(fct_bvh *bvh) {
    const fct_tree_view *view = &bvh->view;
    uint64_t hash = XXH3_64bits(bvh->pairs, bvh->pair_count * sizeof *bvh->pairs);
    hash = XXH3_64bits_withSeed(view->positions, 3 * sizeof(float) * view->vertex_count, hash);
    hash = XXH3_64bits_withSeed(view->triangles, 3 * sizeof(uint32_t) * view->face_count, hash);
    bvh->pair_stamp = hash | 1;
}

fct_result fct_pairs_build(fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                           const fct_wide_list *wide) {
    bvh->pair_count = wide->count + 1;
    bvh->pairs = fct_allocate(bvh->env, bvh->pair_count, sizeof *bvh->pairs);
    if (!bvh->pairs) return fct_fail_memory(bvh->env, "the nodes of a pair structure");
    fct_slabs root = fct_slabs_fit(bvh, leaves, top, &top->nodes[0], &wide->spans[0]);
    clear_node(&bvh->pairs[0]);
    fct_pack_pair_box(&root, 0, &bvh->pairs[0]);
    bvh->pairs[0].child[0] = wide->count ? 1 : FCT_REF_LEAF | leaves->offsets[0];
    pair_job job = {.bvh = bvh, .leaves = leaves, .top = top, .wide = wide};
    fct_parallel_for(bvh->env, wide->count, NODE_CHUNK, pack_pair_nodes, &job);
    for (uint32_t i = 1; i < wide->count; ++i)
        bvh->pairs[wide->nodes[i].parent + 1].child[wide->nodes[i].slot] = i + 1;
    fct_pairs_stamp(bvh);
    return list_parts(bvh);
}
