/* tests/cluster/file/mend.h: hierarchy files whose bytes are changed: corrects their checksums, and uses
 * whatever tree they give. */
#ifndef FCT_TESTS_MEND_H
#define FCT_TESTS_MEND_H

#include <math.h>
#include <string.h>

#include "cluster/file/format.h"
#include "cluster/tree/coarse.h"
#include "facetree/bvh.h"
#include "facetree/partition.h"
#include "fuzz/fuzz.h"

/* Corrects the size and the checksums, because otherwise every change would fail there. */
static inline void mend_checksums(const fct_env *env, uint8_t *data, size_t size) {
    fct_format_header h;
    uint64_t hash;
    if (size < sizeof h) return;
    memcpy(&h, data, sizeof h);
    h.file_size = size;
    for (int i = 0; i < FCT_SECTION_COUNT; ++i) {
        fct_format_section *s = &h.sections[i];
        if (s->offset > size || s->size > size - s->offset || s->size > FCT_FORMAT_BLOCK) continue;
        fct_format_hash_blocks(env, data + s->offset, s->size, &hash);
        s->checksum = fct_format_fold(&hash, fct_format_block_count(s->size));
    }
    memcpy(data, &h, sizeof h);
    if (h.head_size < sizeof h || h.head_size > size) return;
    h.checksum = fct_format_head_checksum(data, h.head_size);
    memcpy(data, &h, sizeof h);
}

static inline void mend_shoot(const fct_env *env, const fct_tree *tree) {
    fct_bvh *bvh;
    if (fct_bvh_create(env, tree, FCT_BACKEND_OBB, &bvh) != FCT_OK) return;
    uint32_t faces = fct_tree_get(tree).face_count;
    fct_ray ray = {{.1F, .2F, 3}, 0, {.01F, .02F, -1}, INFINITY};
    fct_hit hit;
    if (fct_bvh_closest_hit(bvh, &ray, &hit, NULL))
        fuzz_require(hit.face < faces && hit.t >= 0, "a hit is a face");
    fct_closest closest;
    if (fct_bvh_closest_point(bvh, ray.origin, INFINITY, &closest, NULL))
        fuzz_require(closest.face < faces, "a nearest point lies on a face");
    fct_bvh_destroy(bvh);
}

/* Partitions and their clusters, one by one. `sound`: the tree has been checked. */
static inline void mend_cut(const fct_env *env, const fct_tree *tree, uint32_t *nodes, bool sound) {
    fct_tree_view view = fct_tree_get(tree);
    for (uint32_t k = 1; k <= view.face_count; k += 1 + k / 2) {
        uint32_t count, places = 0;
        fct_result result = fct_tree_partition(env, tree, k, nodes, &count);
        fuzz_require(result == FCT_OK ? count >= k : count == 0 && !sound, "a partition is one or none");
        for (uint32_t i = 0; i < count && result == FCT_OK; ++i) {
            fct_cluster cluster, child[2];
            fct_box box;
            result = fct_tree_cluster(tree, nodes[i], &cluster);
            fuzz_require(result == FCT_OK || !sound, "a checked tree has all clusters");
            if (result != FCT_OK) break;
            fct_cluster_box(&cluster, &box);
            fuzz_require(cluster.first == places, "clusters follow one another");
            places += cluster.count;
            if (cluster.count < 2) continue;
            result = fct_tree_children(tree, nodes[i], child);
            fuzz_require(result == FCT_OK ? child[0].count + child[1].count == cluster.count : !sound,
                         "two children make their parent");
            result = FCT_OK;
        }
        if (result == FCT_OK) fuzz_require(places == view.face_count, "a partition has every face once");
    }
    fuzz_require(fct_tree_count_at_cost(tree, .01) <= view.face_count, "there are no more than all");
}

/* Coarse trees and rays through them. */
static inline void mend_coarsen(const fct_env *env, const fct_tree *tree, bool sound) {
    const fct_tree_view view = fct_tree_get(tree);
    for (uint32_t k = view.root_count; k <= view.face_count; k += 1 + k) {
        fct_coarse coarse;
        const fct_result result = fct_tree_coarsen(env, tree, k, &coarse);
        fuzz_require(result == FCT_OK || (!sound && !coarse.tree), "a checked tree has coarse ones");
        if (result != FCT_OK) continue;
        const fct_tree_view small = fct_tree_get(coarse.tree);
        fuzz_require(small.face_count >= k && small.face_count <= 2 * (uint64_t)k, "patches have triangles");
        for (uint32_t node = 0; node < small.node_count + small.face_count; ++node)
            fuzz_require(fct_coarse_origin(&coarse, node) < view.node_count + view.face_count,
                         "a patch is a node");
        mend_shoot(env, coarse.tree);
        fct_coarse_release(env, &coarse);
    }
}

static inline void mend_use_all(const fct_env *env, const fct_tree *tree, uint32_t *nodes, uint32_t *labels) {
    fct_tree_view view = fct_tree_get(tree);
    for (uint32_t k = 1; k <= view.face_count; k += 1 + k / 2) {
        uint32_t count;
        fuzz_require(fct_tree_partition(env, tree, k, nodes, &count) == FCT_OK, "a partition comes out");
        fuzz_require(fct_tree_labels(env, tree, nodes, count, labels) == FCT_OK, "labels come out");
        for (uint32_t f = 0; f < view.face_count; ++f) fuzz_require(labels[f] < count, "labels are in range");
        fct_partition_quality quality;
        fct_tree_quality(env, tree, nodes, count, &quality);
    }
    fct_mesh mesh;
    fuzz_require(fct_tree_mesh(env, tree, &mesh) == FCT_OK, "a tree holds a mesh");
    fct_mesh_release(env, &mesh);
    mend_shoot(env, tree);
}

/* How far a file comes: the bytes are no tree; a tree; its structure holds; its geometry holds too. */
typedef enum mend_outcome {
    MEND_REFUSED,
    MEND_OPENED,
    MEND_SOUND,
    MEND_VERIFIED,
    MEND_OUTCOMES
} mend_outcome;

/* Any bytes give an error, or a tree on which no public call crashes or hangs, with and without a check of
 * the tree. Corrects the checksums in place. */
static inline mend_outcome mend_try(const fct_env *env, uint8_t *data, size_t size) {
    fct_tree *tree;
    mend_outcome outcome = MEND_OPENED;
    mend_checksums(env, data, size);
    fct_result result = fct_tree_parse(env, "input", data, size, &tree);
    fuzz_require((result == FCT_OK) == (tree != NULL), "a failed read leaves no tree");
    if (!tree) return MEND_REFUSED;
    uint32_t faces = fct_tree_get(tree).face_count;
    uint32_t *nodes = fct_allocate(env, faces, 4), *labels = fct_allocate(env, faces, 4);
    mend_cut(env, tree, nodes, false);
    mend_coarsen(env, tree, false);
    if (fct_tree_check(env, tree) == FCT_OK) {
        outcome = MEND_SOUND;
        mend_cut(env, tree, nodes, true);
        mend_coarsen(env, tree, true);
        mend_use_all(env, tree, nodes, labels);
    }
    if (fct_tree_verify(env, tree) == FCT_OK) {
        fuzz_require(outcome == MEND_SOUND, "a verified tree is sound");
        outcome = MEND_VERIFIED;
    }
    fct_release(env, nodes);
    fct_release(env, labels);
    fct_tree_destroy(tree);
    return outcome;
}

#endif
