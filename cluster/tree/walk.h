/* cluster/tree/walk.h: opening the nodes of a tree that may be unchecked. */
#ifndef FCT_CLUSTER_WALK_H
#define FCT_CLUSTER_WALK_H

#include "cluster/tree/tree.h"

/* The children of an inner node. In an unchecked tree this reads and checks the records that it needs and no
 * others; see walk.c. Errors: DATA. */
fct_result fct_tree_open_node(const fct_env *env, const fct_tree *tree, uint32_t node, uint32_t child[2]);

/* Whether the face at a place, which is in range, has vertices at finite positions. The record of a leaf may
 * come from the cut, which does not tell. Errors: DATA. */
fct_result fct_tree_check_face(const fct_env *env, const fct_tree *tree, uint32_t place);

/* Whether the roots of an unchecked tree partition the places, in order. Errors: DATA. */
fct_result fct_tree_check_roots(const fct_env *env, const fct_tree *tree);

#endif
