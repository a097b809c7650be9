/* cluster/tree/tree.h: what an fct_tree is inside, for the files that build, load and save one. */
#ifndef FCT_CLUSTER_TREE_H
#define FCT_CLUSTER_TREE_H

#include <stdatomic.h>

#include "base/env.h"
#include "base/io/file.h"
#include "base/variant.h"
#include "cluster/merge/work.h"

/* What an inner node's record will hold of other nodes, between ordering and description. */
typedef struct fct_node_link {
    uint32_t child[2];
    uint32_t first, count;
    float cost;
} fct_node_link;

struct fct_tree {
    const fct_env *env;
    fct_tree_view view;
    const fct_cluster *nodes; /* view.node_count records; code outside cluster/ reads them by node.h */
    /* What `view` and `nodes` point to and the tree owns; NULL where they point into the mapped file. */
    fct_cluster *clusters;
    fct_node_link *links; /* by id */
    uint32_t *roots, *face_ids, *vertex_ids, *triangles, *materials;
    float *positions, *colors;
    char **names;
    char *source;
    /* Of a tree from a file. */
    fct_file file;
    char *path; /* for messages */
    /* The cut into cut_count clusters, by ascending id, or NULL: they lie together near the file's beginning.
     * Nodes below cut_count - root_count are above it. */
    const uint32_t *cut_ids;
    const fct_cluster *cut;
    uint32_t cut_count;
    atomic_bool unchecked; /* the structure of what is in the file has not been looked at */
};

/* What is wrong with the record of a node, leaves included, by itself, or NULL. */
const char *fct_tree_node_fault(const fct_tree_view *view, uint32_t node, const fct_cluster *c);
/* What is wrong with the places of its two children, or NULL. */
const char *fct_tree_parts_fault(const fct_cluster *c, const uint32_t first[2], const uint32_t count[2]);

/* An empty tree that can be destroyed. NULL when memory is out. */
fct_tree *fct_tree_new(const fct_env *env);

/* Size, weights (larger ones would make costs that a float cannot hold), costs. Errors: DATA. */
fct_result fct_tree_check_def(const fct_env *env, const fct_tree_def *def);

/* Numbers the nodes of a finished clustering, sets links, roots, depth and face order, and copies the mesh
 * into the tree's order. The work is released. Errors: MEMORY, CANCELLED. */
fct_result fct_tree_order(fct_work *work, const fct_mesh *mesh, const fct_tree_def *def, fct_tree *tree);

/* Writes the records of all inner nodes; the links are released. Errors: MEMORY, CANCELLED. */
#define fct_tree_describe FCT_KERNEL(fct_tree_describe)
FCT_DECLARE_KERNEL(fct_result, fct_tree_describe, (fct_tree * tree));
/* A node's links and cost into its record. */
static inline void fct_node_link_store(const fct_node_link *link, fct_cluster *out) {
    out->cost = link->cost;
    out->child[0] = link->child[0], out->child[1] = link->child[1];
    out->first = link->first, out->count = link->count;
}

/* The record of the leaf at a place. */
#define fct_cluster_describe_leaf FCT_KERNEL(fct_cluster_describe_leaf)
FCT_DECLARE_KERNEL(void, fct_cluster_describe_leaf,
                   (const fct_tree_view *view, uint32_t place, fct_cluster *out));

/* Largest and mean depth of the leaves, from the children links. Errors: MEMORY. */
fct_result fct_tree_find_depth(const fct_env *env, const fct_tree *tree, uint32_t *depth, double *mean);
/* view->bounds from the positions. */
void fct_tree_measure_bounds(fct_tree *tree);

/* Of the mesh's dual graph; components are the parts that edges connect. */
typedef struct fct_edge_counts {
    uint32_t boundary, nonmanifold, components;
} fct_edge_counts;
enum { FCT_EDGE_PORTION = 1 << 24 };
/* Counts them anew, about `portion` sides of faces at a time. Errors: MEMORY, CANCELLED. */
fct_result fct_tree_count_edges(const fct_env *env, const fct_tree_view *view, uint32_t portion,
                                fct_edge_counts *out);

#endif
