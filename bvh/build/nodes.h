/* bvh/build/nodes.h: the packed nodes of eight children. */
#ifndef FCT_BVH_NODES_H
#define FCT_BVH_NODES_H

#include "bvh/build/top.h"

/* Collapses the binary top to nodes of eight children and packs them: fills bvh->nodes and bvh->root.
 * Errors: MEMORY. */
fct_result fct_nodes_build(fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top);

#endif
