/* cluster/tree/node.h: the one accessor of nodes for code outside cluster/.
 *
 * Node ids below view.node_count are inner nodes; node_count + p is the leaf of the face at place p. The tree
 * must be built or have passed fct_tree_check: these functions check nothing.
 *
 * Only ranges and children are stored facts that a caller may read without room for a record. The record of
 * any node comes through fct_node_cluster, so that a later version can compute the records of small clusters
 * when they are asked for. Therefore no caller keeps the pointer longer than `room` lives.
 */
#ifndef FCT_CLUSTER_NODE_H
#define FCT_CLUSTER_NODE_H

#include "cluster/tree/describe/single.h"
#include "cluster/tree/tree.h"

static inline bool fct_node_is_leaf(const fct_tree *tree, uint32_t node) {
    return node >= tree->view.node_count;
}

/* The first place of the node's faces. */
static inline uint32_t fct_node_first(const fct_tree *tree, uint32_t node) {
    return fct_node_is_leaf(tree, node) ? node - tree->view.node_count : tree->nodes[node].first;
}

/* The number of the node's faces: places [first, first + count). */
static inline uint32_t fct_node_faces(const fct_tree *tree, uint32_t node) {
    return fct_node_is_leaf(tree, node) ? 1 : tree->nodes[node].count;
}

/* The cost of the merge that made an inner node. */
static inline double fct_node_cost(const fct_tree *tree, uint32_t node) {
    return (double)tree->nodes[node].cost;
}

/* A child of an inner node; k is 0 or 1. */
static inline uint32_t fct_node_child(const fct_tree *tree, uint32_t node, int k) {
    return tree->nodes[node].child[k];
}

/* The record of any node. `room` receives it where the tree does not store it (today: leaves). */
static inline const fct_cluster *fct_node_cluster(const fct_tree *tree, uint32_t node, fct_cluster *room) {
    if (!fct_node_is_leaf(tree, node)) return &tree->nodes[node];
    fct_leaf_describe(&tree->view, node - tree->view.node_count, room);
    return room;
}

/* The area of any node. */
static inline float fct_node_area(const fct_tree *tree, uint32_t node) {
    if (!fct_node_is_leaf(tree, node)) return tree->nodes[node].area;
    return fct_leaf_area(&tree->view, node - tree->view.node_count);
}

#endif
