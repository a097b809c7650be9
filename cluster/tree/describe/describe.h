/* cluster/tree/describe/describe.h: records of all inner nodes. */
#ifndef FCT_CLUSTER_DESCRIBE_H
#define FCT_CLUSTER_DESCRIBE_H

#include "cluster/tree/tree.h"

/* Writes the records of all inner nodes into tree->clusters, which it allocates where it is NULL, and
 * releases the links. Errors: MEMORY, CANCELLED. */
fct_result fct_tree_describe(fct_tree *tree);

#endif
