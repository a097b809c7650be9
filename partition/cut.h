/* partition/cut.h: cuts of a tree from the roots down, by a test of single nodes. */
#ifndef FCT_PARTITION_CUT_H
#define FCT_PARTITION_CUT_H

#include "cluster/tree/node.h"

/* Whether an inner node stays whole. The answer may depend only on the node. Several threads call this at
 * once, for nodes without a common face; `thread` selects scratch space. Leaves always stay. */
typedef bool fct_cut_test(void *user, uint32_t node, uint32_t thread);

/* The highest nodes that pass the test, in order of their first place. `nodes` holds face_count. Each node is
 * tested at most once. Errors: MEMORY, CANCELLED. */
fct_result fct_cut_tree(const fct_env *env, const fct_tree *tree, const char *phase, fct_cut_test *test,
                        void *user, uint32_t *nodes, uint32_t *count);

#endif
