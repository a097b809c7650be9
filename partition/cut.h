/* partition/cut.h: cutting a tree from the top by a test of single nodes. */
#ifndef FCT_CLUSTER_CUT_H
#define FCT_CLUSTER_CUT_H

#include "cluster/tree/node.h"

/* Whether an inner node stays whole. A function of the node alone, called from several threads at once for
 * nodes without a common face; `thread` is for scratch space. Leaves always stay. */
typedef bool fct_cut_test(void *user, uint32_t node, uint32_t thread);

/* The highest nodes that pass, in order of their first place: from the roots down, a node that fails is
 * opened. `nodes` holds face_count. Each node is tested at most once. Errors: MEMORY, CANCELLED. */
fct_result fct_cut_tree(const fct_env *env, const fct_tree *tree, const char *phase, fct_cut_test *test,
                        void *user, uint32_t *nodes, uint32_t *count);

#endif
