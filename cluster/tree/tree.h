/* cluster/tree/tree.h: the inside of an fct_tree. */
#ifndef FCT_CLUSTER_TREE_H
#define FCT_CLUSTER_TREE_H

#include <stdatomic.h>

#include "base/env.h"
#include "base/io/file.h"
#include "base/math/vec.h"
#include "facetree/cluster.h"

/* The members of an inner node that ordering sets; the description sets the others. */
typedef struct fct_node_link {
    uint32_t child[2];
    uint32_t first, count;
    float cost;
} fct_node_link;

struct fct_tree {
    const fct_env *env;
    fct_tree_view view;
    const fct_cluster *nodes; /* view.node_count records; code outside cluster/ reads them by node.h */
    /* The arrays that `view` and `nodes` point to, if the tree owns them; NULL if they are in the file. */
    fct_cluster *clusters;
    fct_node_link *links; /* by id, between ordering and description */
    uint32_t *roots, *face_ids, *vertex_ids, *triangles, *materials;
    float *positions, *colors;
    char **names;
    char *source;
    /* only for a tree from a file */
    fct_file file;
    char *path; /* for messages */
    /* The partition into cut_count clusters, by ascending id, with copies of their records near the beginning
     * of the file. Nodes below cut_count - root_count are above it. NULL and 0 if there is none. */
    const uint32_t *cut_ids;
    const fct_cluster *cut;
    uint32_t cut_count;
    atomic_bool unchecked; /* fct_tree_check has not passed yet */
};

/* An empty tree that can be destroyed; NULL if memory is exhausted. */
fct_tree *fct_tree_new(const fct_env *env);

/* Sets view.bounds from the positions. */
void fct_tree_measure_bounds(fct_tree *tree);

/* Sums over the faces of a surface. volume: six times the volume inside, if the surface is closed; magnitude:
 * the sum of the terms' magnitudes. vector: twice the area vector, which is 0 for a closed surface whose
 * faces wind alike; area: the sum of the terms' lengths. */
typedef struct fct_enclosed {
    double volume, magnitude, area;
    v3 vector;
} fct_enclosed;
/* Adds the faces of the view. origin: any point, the same for all faces of a surface. */
void fct_enclosed_add(fct_enclosed *sum, const fct_tree_view *view, v3 origin);
/* The value of view.inward. Sums below 1e-9 of their terms are 0. */
bool fct_enclosed_is_inward(const fct_enclosed *sum, const fct_tree_view *view);
/* The value of view.inward for a whole mesh. O(F) for a closed one. */
bool fct_tree_is_inward(const fct_tree_view *view);

/* Copies links and cost into a node's record. */
static inline void fct_node_link_store(const fct_node_link *link, fct_cluster *out) {
    out->cost = link->cost;
    out->child[0] = link->child[0], out->child[1] = link->child[1];
    out->first = link->first, out->count = link->count;
}

#endif
