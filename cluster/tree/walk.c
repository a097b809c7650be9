/* cluster/tree/walk.c: going down a tree: single clusters, children, partitions.
 *
 * What comes from a file nobody has checked yet is checked as it is read: a record by itself (numbers, range,
 * children behind it), and where a node is opened, that its children's ranges are the two parts of its own.
 * Then ranges shrink from parent to child and those of an open front are disjoint and fill the faces, so that
 * no walk meets a node twice. Records of the cut near the file's beginning stand for the nodes' own.
 */
#include <string.h>

#include "cluster/tree/tree.h"

/* By their exponents, for that is done for many at once. */
static bool all_finite(const void *floats, size_t count) {
    const uint32_t exponent = 0x7F800000;
    const uint32_t *bits = floats;
    uint32_t endless = 0;
    for (size_t i = 0; i < count; ++i) endless |= (bits[i] & exponent) == exponent;
    return endless == 0;
}

const char *fct_tree_node_fault(const fct_tree_view *view, uint32_t node, const fct_cluster *c) {
    uint32_t nodes = view->node_count, faces = view->face_count;
    if (!all_finite(c, offsetof(fct_cluster, child) / sizeof(float))) return "a number that is not finite";
    if (node >= nodes)
        return c->first == node - nodes && c->count == 1 && c->child[0] == FCT_NONE && c->child[1] == FCT_NONE
                   ? NULL
                   : "a face that is not its own";
    if (c->count < 2 || c->count > faces || c->first > faces - c->count) return "range outside the faces";
    for (int k = 0; k < 2; ++k)
        if (c->child[k] <= node || c->child[k] >= nodes + faces) return "child out of order";
    return NULL;
}

const char *fct_tree_parts_fault(const fct_cluster *c, const uint32_t first[2], const uint32_t count[2]) {
    if (first[0] != c->first || count[0] >= c->count || first[1] != c->first + count[0] || count[1] == 0)
        return "child's range is not part of its own";
    return count[0] + count[1] == c->count && count[0] ? NULL : "children do not fill its range";
}

static fct_result fail(const fct_env *env, const fct_tree *tree, uint32_t node, const char *fault) {
    return fct_fail(env, FCT_ERROR_DATA, "%s: node %u: %s", tree->path, node, fault);
}

/* The record that stands for a node in the cut, or NULL. */
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

/* The record of an unchecked node; NULL where a leaf is not in the cut. */
static const fct_cluster *find(const fct_tree *tree, uint32_t node) {
    const fct_cluster *record = NULL;
    if (tree->cut_count && node >= tree->cut_count - tree->view.root_count) record = find_in_cut(tree, node);
    return record || node >= tree->view.node_count ? record : tree->nodes + node;
}

static void find_range(const fct_tree *tree, uint32_t node, uint32_t *first, uint32_t *count) {
    const fct_cluster *record = find(tree, node);
    *first = record ? record->first : node - tree->view.node_count;
    *count = record ? record->count : 1;
}

/* Whether the corners of the face at a place are there. */
static const char *corners_fault(const fct_tree_view *view, uint32_t place) {
    const uint32_t *t = view->triangles + 3 * (size_t)place;
    for (int k = 0; k < 3; ++k) {
        if (t[k] >= view->vertex_count) return "vertex out of range";
        if (!all_finite(view->positions + 3 * (size_t)t[k], 3)) return "a position that is not finite";
    }
    return NULL;
}

static const char *read_unchecked(const fct_tree *tree, uint32_t node, fct_cluster *out) {
    const fct_cluster *record = find(tree, node);
    const char *fault;
    if (record) {
        *out = *record;
        fault = fct_tree_node_fault(&tree->view, node, out);
    } else {
        uint32_t place = node - tree->view.node_count;
        fault = corners_fault(&tree->view, place);
        if (!fault) fct_cluster_describe_leaf(&tree->view, place, out);
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
        return fault ? fail(tree->env, tree, node, fault) : FCT_OK;
    }
    if (node < view->node_count)
        *out = tree->nodes[node];
    else
        fct_cluster_describe_leaf(view, node - view->node_count, out);
    return FCT_OK;
}

fct_result fct_tree_children(const fct_tree *tree, uint32_t node, fct_cluster out[2]) {
    fct_cluster own;
    fct_result result = fct_tree_cluster(tree, node, &own);
    memset(out, 0, 2 * sizeof *out);
    for (int k = 0; k < 2 && result == FCT_OK; ++k) result = fct_tree_cluster(tree, own.child[k], &out[k]);
    if (result != FCT_OK) return result;
    const uint32_t first[2] = {out[0].first, out[1].first}, count[2] = {out[0].count, out[1].count};
    const char *fault = fct_tree_parts_fault(&own, first, count);
    return fault ? fail(tree->env, tree, node, fault) : FCT_OK;
}

/* The children of a node of an unchecked tree that is about to be opened. */
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

/* Whether the roots fill the faces, in order. */
static fct_result check_roots(const fct_env *env, const fct_tree *tree) {
    const fct_tree_view *view = &tree->view;
    uint32_t place = 0;
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

/* Opens all nodes below id `count` - root_count. What is written and what is still to be visited are disjoint
 * clusters of the partition's size at most: the stack grows from the far end of the same array. */
static fct_result cut(const fct_env *env, const fct_tree *tree, bool unchecked, uint32_t count,
                      uint32_t *nodes, uint32_t *written) {
    const fct_tree_view *view = &tree->view;
    uint32_t opened = count - view->root_count, top = count;
    for (uint32_t r = view->root_count; r-- > 0;) nodes[--top] = view->roots[r];
    while (top < count) {
        uint32_t node = nodes[top++], child[2];
        if (node >= opened) {
            nodes[(*written)++] = node;
            continue;
        }
        if (unchecked) {
            const char *fault = open_unchecked(tree, node, child);
            if (fault) return fail(env, tree, node, fault);
        } else {
            memcpy(child, tree->nodes[node].child, sizeof child);
        }
        nodes[--top] = child[1];
        nodes[--top] = child[0];
    }
    if (*written == count) return FCT_OK;
    return fct_fail(env, FCT_ERROR_DATA, "%s: the partition into %u clusters has %u", tree->path, count,
                    *written);
}

fct_result fct_tree_partition(const fct_env *env, const fct_tree *tree, uint32_t count, uint32_t *nodes,
                              uint32_t *written) {
    const fct_tree_view *view = &tree->view;
    bool unchecked = atomic_load_explicit(&tree->unchecked, memory_order_acquire);
    *written = 0;
    if (count < view->root_count) count = view->root_count;
    if (count > view->face_count) count = view->face_count;
    fct_result result = unchecked ? check_roots(env, tree) : FCT_OK;
    if (result == FCT_OK) result = cut(env, tree, unchecked, count, nodes, written);
    if (result != FCT_OK) *written = 0;
    return result;
}

uint32_t fct_tree_count_at_cost(const fct_tree *tree, double max_cost) {
    const fct_tree_view *view = &tree->view;
    uint32_t low = 0, high = view->node_count; /* nodes from `low` on are done */
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if ((double)tree->nodes[middle].cost <= max_cost)
            high = middle;
        else
            low = middle + 1;
    }
    return view->root_count + low;
}
