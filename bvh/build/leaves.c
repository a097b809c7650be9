/* bvh/build/leaves.c: chooses the face clusters that become leaves, and packs them.
 *
 * Input: the cluster tree. Output: leaves in order of place; each face is in one leaf. A leaf is the largest
 * cluster of at most 16 faces and 16 vertices. It stores each vertex once and its corners as bytes: at most
 * 256 bytes, about 22 bytes per triangle on a scan. O(F).
 */
#include "bvh/build/leaves.h"

#include <string.h>

#include "base/parallel.h"
#include "cluster/tree/node.h"

/* Lists the vertices of a leaf in order of first use and returns their number, or FCT_LEAF_VERTICES + 1 if
 * there are too many. `corners` receives 3 * count indices into `vertices`. */
static uint32_t gather_vertices(const fct_tree_view *view, uint32_t first, uint32_t count,
                                uint32_t vertices[FCT_LEAF_VERTICES], uint8_t *corners) {
    uint32_t vertex_count = 0;
    for (uint32_t i = 0; i < 3 * count; ++i) {
        uint32_t vertex = view->triangles[3 * (size_t)first + i], at = 0;
        while (at < vertex_count && vertices[at] != vertex) ++at;
        if (at == vertex_count) {
            if (vertex_count == FCT_LEAF_VERTICES) return FCT_LEAF_VERTICES + 1;
            vertices[vertex_count++] = vertex;
        }
        corners[i] = (uint8_t)at;
    }
    return vertex_count;
}

/* Groups of eight vertices in the leaf of a cluster, or 0 if the cluster does not fit a leaf. */
static uint32_t count_vertex_octets(const fct_tree *tree, uint32_t node) {
    uint32_t vertices[FCT_LEAF_VERTICES], count = fct_node_faces(tree, node);
    uint8_t corners[3 * FCT_LEAF_FACES];
    if (count > FCT_LEAF_FACES) return 0;
    uint32_t vertex_count =
        gather_vertices(&tree->view, fct_node_first(tree, node), count, vertices, corners);
    return vertex_count > FCT_LEAF_VERTICES ? 0 : (vertex_count + 7) / 8;
}

/* Descends from the roots, left child first, to the clusters that fit a leaf. If list->nodes is NULL, it only
 * counts them. `stack` has room for depth + root_count + 1 entries. *units receives the size of all leaves in
 * units of FCT_REF_UNIT bytes. */
static void choose_leaves(const fct_tree *tree, uint32_t *stack, fct_leaf_list *list, uint64_t *units) {
    const fct_tree_view *view = &tree->view;
    uint32_t height = 0, found = 0;
    *units = 0;
    for (uint32_t r = view->root_count; r-- > 0;) stack[height++] = view->roots[r];
    while (height) {
        uint32_t node = stack[--height], octets = count_vertex_octets(tree, node);
        if (octets == 0) {
            stack[height++] = fct_node_child(tree, node, 1);
            stack[height++] = fct_node_child(tree, node, 0);
            continue;
        }
        if (list->nodes) {
            list->nodes[found] = node;
            list->offsets[found] = (uint32_t)*units;
        }
        *units += fct_leaf_bytes(fct_node_faces(tree, node), octets) / FCT_REF_UNIT;
        ++found;
    }
    list->count = found;
}

enum { PACK_CHUNK = 1024 }; /* leaves per task */

typedef struct pack_job {
    fct_bvh *bvh;
    fct_leaf_list *list;
} pack_job;

static void pack_leaf(const fct_bvh *bvh, uint32_t node, fct_leaf *leaf, float bounds[6]) {
    uint32_t vertices[FCT_LEAF_VERTICES];
    uint32_t first = fct_node_first(bvh->tree, node), count = fct_node_faces(bvh->tree, node);
    uint8_t corners[3 * FCT_LEAF_FACES];
    uint32_t vertex_count = gather_vertices(&bvh->view, first, count, vertices, corners);
    *leaf = (fct_leaf){
        .first = first, .count = (uint8_t)count, .vertex_octets = (uint8_t)((vertex_count + 7) / 8)};
    uint8_t *bytes = (uint8_t *)(leaf + 1);
    memset(bytes, 0, 24 * (size_t)fct_leaf_octets(leaf));
    for (uint32_t i = 0; i < count; ++i) {
        if (!fct_bvh_degenerate(bvh, first + i)) leaf->mask |= (uint16_t)(1u << i);
        for (uint32_t c = 0; c < 3; ++c) bytes[24 * (i / 8) + 8 * c + i % 8] = corners[3 * i + c];
    }
    float *rows = (float *)(void *)(bytes + 24 * (size_t)fct_leaf_octets(leaf));
    uint32_t stride = 8u * leaf->vertex_octets;
    for (uint32_t i = 0; i < stride; ++i) {
        float p[3];
        fct_bvh_position(bvh, vertices[i < vertex_count ? i : 0], p);
        for (uint32_t k = 0; k < 3; ++k) {
            rows[k * stride + i] = p[k];
            if (i == 0) bounds[k] = bounds[3 + k] = p[k];
            if (p[k] < bounds[k]) bounds[k] = p[k];
            if (p[k] > bounds[3 + k]) bounds[3 + k] = p[k];
        }
    }
}

static void pack_leaves(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    pack_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        char *at = job->bvh->leaves + (size_t)job->list->offsets[i] * FCT_REF_UNIT;
        pack_leaf(job->bvh, job->list->nodes[i], (fct_leaf *)(void *)at, job->list->bounds + 6 * i);
    }
}

fct_result fct_leaves_build(fct_bvh *bvh, fct_leaf_list *out) {
    const fct_env *env = bvh->env;
    *out = (fct_leaf_list){0};
    fct_leaf_list list = {0};
    uint64_t units;
    fct_result result = FCT_ERROR_MEMORY;
    uint32_t *stack = fct_allocate(env, (size_t)bvh->view.depth + bvh->view.root_count + 2, sizeof *stack);
    if (!stack) return fct_fail_memory(env, "the leaves of a ray structure");
    choose_leaves(bvh->tree, stack, &list, &units);
    list.nodes = fct_allocate(env, list.count, sizeof *list.nodes);
    list.offsets = fct_allocate(env, list.count, sizeof *list.offsets);
    list.bounds = fct_allocate(env, list.count, 6 * sizeof *list.bounds);
    bvh->leaves = units < FCT_REF_LEAF ? fct_allocate(env, (size_t)units, FCT_REF_UNIT) : NULL;
    if (list.nodes && list.offsets && list.bounds && bvh->leaves) {
        choose_leaves(bvh->tree, stack, &list, &units);
        bvh->leaf_bytes = (size_t)units * FCT_REF_UNIT;
        pack_job job = {bvh, &list};
        fct_parallel_for(env, list.count, PACK_CHUNK, pack_leaves, &job);
        result = FCT_OK;
    }
    fct_release(env, stack);
    if (result == FCT_OK) {
        *out = list;
        return FCT_OK;
    }
    fct_leaf_list_release(env, &list);
    return fct_fail_memory(env, "the leaves of a ray structure");
}

void fct_leaf_list_release(const fct_env *env, fct_leaf_list *list) {
    fct_release(env, list->nodes);
    fct_release(env, list->offsets);
    fct_release(env, list->bounds);
    *list = (fct_leaf_list){0};
}
