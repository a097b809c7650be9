/* cluster/file.h: the hierarchy file from memory, and the checks on what came out of one. */
#ifndef FCT_CLUSTER_FILE_H
#define FCT_CLUSTER_FILE_H

#include "cluster/tree.h"

/* Reads a whole hierarchy file of `size` bytes at `data`, which it copies. `name` stands in messages. Errors:
 * DATA, MEMORY. */
fct_result fct_tree_parse(const fct_env *env, const char *name, const void *data, size_t size,
                          fct_tree **out);

/* Whether links, ranges, permutations and indices are such that no traversal can leave the arrays or run in
 * circles; sets depth and mean depth. O(F), parallel. `name` stands in messages. Errors: DATA, MEMORY. */
fct_result fct_tree_check_structure(const fct_env *env, const char *name, fct_tree *tree);

/* The sections' checksums, if the tree came from a file. Errors: DATA. */
fct_result fct_tree_check_sums(const fct_env *env, const fct_tree *tree);

#endif
