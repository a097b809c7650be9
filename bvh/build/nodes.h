/* bvh/build/nodes.h: the packed nodes for rays and points. */
#ifndef FCT_BVH_NODES_H
#define FCT_BVH_NODES_H

#include "bvh/build/wide.h"

/* Fills bvh->nodes and bvh->root. Errors: MEMORY. */
fct_result fct_nodes_build(fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                           const fct_wide_list *wide);

#endif
