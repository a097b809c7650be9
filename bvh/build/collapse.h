/* bvh/build/collapse.h: which nodes of the binary top become nodes of eight children. */
#ifndef FCT_BVH_COLLAPSE_H
#define FCT_BVH_COLLAPSE_H

#include "bvh/build/top.h"

typedef struct fct_wide_node {
    uint32_t top[8]; /* `count` nodes of the binary top */
    uint32_t count;
    uint32_t parent, slot; /* this node is child `slot` of node `parent` */
} fct_wide_node;

/* Fills `nodes`, which has room for one node per leaf; a node comes before its children, and node 0 is the
 * root. *count receives their number. The top has at least two leaves. Errors: MEMORY. */
fct_result fct_collapse(const fct_env *env, const fct_top *top, fct_wide_node *nodes, uint32_t *count);

#endif
