/* bvh/build/top.h: a binary tree over the leaves, split by surface-area cost. */
#ifndef FCT_BVH_TOP_H
#define FCT_BVH_TOP_H

#include "bvh/build/leaf_list.h"

typedef struct fct_top_node {
    float bounds[6];      /* lower then upper, scaled */
    float area;           /* half of the surface of the box along the axes of the splits */
    uint32_t left, right; /* nodes; left is FCT_NONE in a node that is not split */
    uint32_t begin, end;  /* range of fct_top.order */
} fct_top_node;

typedef struct fct_top {
    uint32_t node_count;
    fct_top_node *nodes; /* node 0 is the root */
    uint32_t *order;     /* indices into fct_leaf_list */
} fct_top;

/* At most FCT_TOP_DEPTH levels. A node of at most `most` leaves is not split; if `most` is above 1, nodes
 * without leaves may lie between the others. fct_top_release frees *out. Errors: MEMORY. */
fct_result fct_top_build(const fct_env *env, const fct_leaf_list *leaves, uint32_t most, fct_top *out);
void fct_top_release(const fct_env *env, fct_top *top);

#endif
