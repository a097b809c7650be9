/* bvh/build/wide.h: the nodes of eight children before they are packed. */
#ifndef FCT_BVH_WIDE_H
#define FCT_BVH_WIDE_H

#include "bvh/build/collapse.h"
#include "bvh/build/slabs.h"

typedef struct fct_wide_list {
    uint32_t count;       /* 0 if the model is one leaf */
    fct_wide_node *nodes; /* node 0 is the root; a node comes before its children */
    fct_slabs *boxes;     /* count x 8: the boxes of the children */
    fct_span *spans;      /* per node of the top */
} fct_wide_list;

/* Collapses the binary top, and fits a box to each child. fct_wide_release frees *out. Errors: MEMORY. */
fct_result fct_wide_build(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                          fct_wide_list *out);
void fct_wide_release(const fct_env *env, fct_wide_list *list);

#endif
