/* cluster/tree/walk.c: reading single nodes of a tree, checked or not.
 *
 * Nodes of an unchecked file are checked when they are read. A record is checked alone: finite numbers, a
 * range within the faces, children with larger ids. An opened node is checked against its children: their
 * ranges are the two parts of its own. Therefore ranges shrink from parent to child, the ranges of an open
 * front are disjoint, and no walk visits a node twice. A node that has a copy in the cut is read there,
 * because the copies lie together near the beginning of the file.
 */
#include "cluster/tree/walk.h"

#include <math.h>
#include <string.h>

#include "cluster/tree/check/structure.h"
#include "cluster/tree/describe/single.h"

static fct_result fail_node(const fct_env *env, const fct_tree *tree, uint32_t node, const char *fault) {
    return fct_fail(env, FCT_ERROR_DATA, "%s: node %u: %s", tree->path, node, fault);
}

/* The copy of a node in the cut, or NULL. */
static const fct_cluster *find_in_cut(const fct_tree *tree, uint32_t node) {
    uint32_t low = 0, high = tree->cut_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (tree->cut_ids[middle] == node) return tree->cut + middle;
        if (tree->cut_ids[middle] < node)
            low = middle + 1;
        else
            high = middle;
    }
    return NULL;
}

/* The stored record of an unchecked node; NULL for a leaf that is not in the cut. */
static const fct_cluster *find_record(const fct_tree *tree, uint32_t node) {
    const fct_cluster *record = NULL;
    if (tree->cut_count && node >= tree->cut_count - tree->view.root_count) record = find_in_cut(tree, node);
    return record || node >= tree->view.node_count ? record : tree->nodes + node;
}

static void find_range(const fct_tree *tree, uint32_t node, uint32_t *first, uint32_t *count) {
    const fct_cluster *record = find_record(tree, node);
    *first = record ? record->first : node - tree->view.node_count;
    *count = record ? record->count : 1;
}

/* Describes the first fault in the corners of the face at a place; NULL: none. */
static const char *corners_fault(const fct_tree_view *view, uint32_t place) {
    const uint32_t *t = view->triangles + 3 * (size_t)place;
    for (int k = 0; k < 3; ++k) {
        if (t[k] >= view->vertex_count) return "vertex out of range";
        const float *p = view->positions + 3 * (size_t)t[k];
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) return "a position that is not finite";
    }
    return NULL;
}

static const char *read_unchecked(const fct_tree *tree, uint32_t node, fct_cluster *out) {
    const fct_cluster *record = find_record(tree, node);
    const char *fault;
    if (record) {
        *out = *record;
        fault = fct_tree_node_fault(&tree->view, node, out);
    } else {
        uint32_t place = node - tree->view.node_count;
        fault = corners_fault(&tree->view, place);
        if (!fault) fct_leaf_describe(&tree->view, place, out);
    }
    if (fault) {
        memset(out, 0, sizeof *out);
        out->child[0] = out->child[1] = FCT_NONE;
    }
    return fault;
}

fct_result fct_tree_cluster(const fct_tree *tree, uint32_t node, fct_cluster *out) {
    const fct_tree_view *view = &tree->view;
    if (atomic_load_explicit(&tree->unchecked, memory_order_acquire)) {
        const char *fault = read_unchecked(tree, node, out);
        return fault ? fail_node(tree->env, tree, node, fault) : FCT_OK;
    }
    if (node < view->node_count)
        *out = tree->nodes[node];
    else
        fct_leaf_describe(view, node - view->node_count, out);
    return FCT_OK;
}

fct_result fct_tree_check_face(const fct_env *env, const fct_tree *tree, uint32_t place) {
    if (!atomic_load_explicit(&tree->unchecked, memory_order_acquire)) return FCT_OK;
    const char *fault = corners_fault(&tree->view, place);
    return fault ? fct_fail(env, FCT_ERROR_DATA, "%s: place %u: %s", tree->path, place, fault) : FCT_OK;
}

fct_result fct_tree_children(const fct_tree *tree, uint32_t node, fct_cluster out[2]) {
    fct_cluster own;
    fct_result result = fct_tree_cluster(tree, node, &own);
    memset(out, 0, 2 * sizeof *out);
    for (int k = 0; k < 2 && result == FCT_OK; ++k) result = fct_tree_cluster(tree, own.child[k], &out[k]);
    if (result != FCT_OK) return result;
    const uint32_t first[2] = {out[0].first, out[1].first}, count[2] = {out[0].count, out[1].count};
    const char *fault = fct_tree_parts_fault(&own, first, count);
    return fault ? fail_node(tree->env, tree, node, fault) : FCT_OK;
}

static const char *open_unchecked(const fct_tree *tree, uint32_t node, uint32_t child[2]) {
    fct_cluster own;
    const char *fault = read_unchecked(tree, node, &own);
    uint32_t first[2], count[2];
    if (fault) return fault;
    for (int k = 0; k < 2; ++k) {
        child[k] = own.child[k];
        find_range(tree, child[k], &first[k], &count[k]);
    }
    return fct_tree_parts_fault(&own, first, count);
}

fct_result fct_tree_open_node(const fct_env *env, const fct_tree *tree, uint32_t node, uint32_t child[2]) {
    if (atomic_load_explicit(&tree->unchecked, memory_order_acquire)) {
        const char *fault = open_unchecked(tree, node, child);
        return fault ? fail_node(env, tree, node, fault) : FCT_OK;
    }
    memcpy(child, tree->nodes[node].child, 2 * sizeof *child);
    return FCT_OK;
}

fct_result fct_tree_check_roots(const fct_env *env, const fct_tree *tree) {
    const fct_tree_view *view = &tree->view;
    uint32_t place = 0;
    if (!atomic_load_explicit(&tree->unchecked, memory_order_acquire)) return FCT_OK;
    for (uint32_t r = 0; r < view->root_count; ++r) {
        uint32_t root = view->roots[r], first, count;
        if (root >= view->node_count + view->face_count)
            return fct_fail(env, FCT_ERROR_DATA, "%s: root %u is out of range", tree->path, r);
        find_range(tree, root, &first, &count);
        if (first != place || count == 0 || count > view->face_count - place)
            return fct_fail(env, FCT_ERROR_DATA, "%s: root %u does not begin where the one before it ends",
                            tree->path, r);
        place += count;
    }
    if (place == view->face_count) return FCT_OK;
    return fct_fail(env, FCT_ERROR_DATA, "%s: the roots hold %u of %u faces", tree->path, place,
                    view->face_count);
}
