/* bvh/build/leaves.h: the face clusters that become leaves. */
#ifndef FCT_BVH_LEAVES_H
#define FCT_BVH_LEAVES_H

#include "bvh/build/leaf_list.h"

/* Fills bvh->leaves and *out; fct_leaf_list_release frees *out. Errors: MEMORY. */
fct_result fct_leaves_build(fct_bvh *bvh, fct_leaf_list *out);
void fct_leaf_list_release(const fct_env *env, fct_leaf_list *list);

#endif
