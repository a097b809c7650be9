/* cluster/tree/check/structure.h: checks that a tree can be walked safely. */
#ifndef FCT_CLUSTER_STRUCTURE_H
#define FCT_CLUSTER_STRUCTURE_H

#include "cluster/tree/tree.h"

/* Describes the first fault in the record of a node or leaf; NULL: none. Reads no other record. */
const char *fct_tree_node_fault(const fct_tree_view *view, uint32_t node, const fct_cluster *c);
/* Describes the first fault in the ranges of the two children of a node; NULL: none. */
const char *fct_tree_parts_fault(const fct_cluster *c, const uint32_t first[2], const uint32_t count[2]);

/* Largest and mean depth of the leaves. Children must have larger ids than their parents. Errors: MEMORY. */
fct_result fct_tree_find_depth(const fct_env *env, const fct_tree *tree, uint32_t *depth, double *mean);

/* Checks links, ranges, roots, cut, permutations, indices, finite numbers and depth, so that no walk can
 * read outside of the arrays or run in circles. O(F), parallel. Errors: DATA, MEMORY. */
fct_result fct_tree_check_structure(const fct_env *env, const fct_tree *tree);

#endif
