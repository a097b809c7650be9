/* cluster/tree/order.h: turns a finished clustering into a tree with its numbering. */
#ifndef FCT_CLUSTER_ORDER_H
#define FCT_CLUSTER_ORDER_H

#include "cluster/merge/work.h"
#include "cluster/tree/tree.h"

/* Numbers the nodes, sets links, roots, depth and face order, and copies the mesh in the tree's order.
 * Releases the work. Errors: MEMORY, CANCELLED. */
fct_result fct_tree_order(fct_work *work, const fct_mesh *mesh, const fct_tree_def *def, fct_tree *tree);

#endif
