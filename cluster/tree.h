/* cluster/tree.h: what an fct_tree is inside, for the files that build, load and save one. */
#ifndef FCT_CLUSTER_TREE_H
#define FCT_CLUSTER_TREE_H

#include "base/env.h"
#include "base/file.h"
#include "cluster/work.h"

struct fct_tree {
    const fct_env *env;
    fct_tree_view view;
    /* What view points to and the tree owns; NULL where it points into the mapped file. */
    fct_cluster *clusters;
    uint32_t *roots, *face_ids, *vertex_ids, *triangles, *materials;
    float *positions, *colors;
    char **names;
    char *source;
    fct_file file;
};

/* An empty tree that can be destroyed. NULL when memory is out. */
fct_tree *fct_tree_new(const fct_env *env);

/* Numbers the nodes of a finished clustering, sets children, ranges, costs, roots, depth and face order, and
 * copies the mesh into the tree's order. The work's merges are used up. Errors: MEMORY. */
fct_result fct_tree_order(fct_work *work, const fct_mesh *mesh, const fct_tree_def *def, fct_tree *tree);

/* Fills area, moments, cone, plane and box of all inner nodes. Errors: MEMORY, CANCELLED. */
fct_result fct_tree_describe(fct_tree *tree);

/* The attributes of the leaf at a place, but for cost and links. */
void fct_cluster_describe_face(const fct_tree_view *view, uint32_t place, fct_cluster *out);

/* Depths from the children links; view->depth and view->mean_depth. Errors: MEMORY. */
fct_result fct_tree_measure_depth(fct_tree *tree);

#endif
