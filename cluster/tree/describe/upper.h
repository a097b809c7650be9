/* cluster/tree/describe/upper.h: records of the clusters above the blocks. */
#ifndef FCT_CLUSTER_UPPER_H
#define FCT_CLUSTER_UPPER_H

#include "base/variant.h"
#include "cluster/tree/describe/outline.h"

/* Describes the upper clusters of a tree whose blocks are described. Errors: MEMORY, CANCELLED. */
#define fct_tree_describe_upper FCT_KERNEL(fct_tree_describe_upper)
FCT_DECLARE_KERNEL(fct_result, fct_tree_describe_upper, (fct_tree * tree, fct_outline *outline));

#endif
