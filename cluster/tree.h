/* cluster/tree.h: what an fct_tree is inside, for the files that build, load and save one. */
#ifndef FCT_CLUSTER_TREE_H
#define FCT_CLUSTER_TREE_H

#include "base/env.h"
#include "base/file.h"
#include "cluster/work.h"

/* Inner nodes by id, between ordering and description: what a node's record will hold of other nodes. */
typedef struct fct_node_links {
    uint32_t (*children)[2];
    float *costs;
    uint32_t *counts, *firsts;
} fct_node_links;

struct fct_tree {
    const fct_env *env;
    fct_tree_view view;
    /* What view points to and the tree owns; NULL where it points into the mapped file. */
    fct_cluster *clusters;
    fct_node_links links;
    uint32_t *roots, *face_ids, *vertex_ids, *triangles, *materials;
    float *positions, *colors;
    char **names;
    char *source;
    fct_file file;
};

/* An empty tree that can be destroyed. NULL when memory is out. */
fct_tree *fct_tree_new(const fct_env *env);

/* Numbers the nodes of a finished clustering, sets links, roots, depth and face order, and copies the mesh
 * into the tree's order. The work is released. Errors: MEMORY, CANCELLED. */
fct_result fct_tree_order(fct_work *work, const fct_mesh *mesh, const fct_tree_def *def, fct_tree *tree);

/* Writes the records of all inner nodes; the links are released. Errors: MEMORY, CANCELLED. */
fct_result fct_tree_describe(fct_tree *tree);
void fct_node_links_release(const fct_env *env, fct_node_links *links);
/* A node's links and cost into its record. */
void fct_node_links_store(const fct_node_links *links, uint32_t id, fct_cluster *out);

/* The attributes of the leaf at a place, but for cost and links. */
void fct_cluster_describe_face(const fct_tree_view *view, uint32_t place, fct_cluster *out);

/* Depths from the children links; view->depth and view->mean_depth. Errors: MEMORY. */
fct_result fct_tree_measure_depth(fct_tree *tree);

#endif
