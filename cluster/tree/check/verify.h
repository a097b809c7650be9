/* cluster/tree/check/verify.h: compares every number of a tree with its triangles. */
#ifndef FCT_CLUSTER_VERIFY_H
#define FCT_CLUSTER_VERIFY_H

#include "cluster/tree/tree.h"

/* Checks the structure, the counts and bounds of the view, and every record, those of the cut too. Errors:
 * DATA, MEMORY, CANCELLED. */
fct_result fct_tree_verify_contents(const fct_env *env, const fct_tree *tree);

#endif
