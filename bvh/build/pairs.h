/* bvh/build/pairs.h: the packed nodes for queries on two models. */
#ifndef FCT_BVH_PAIRS_H
#define FCT_BVH_PAIRS_H

#include "bvh/build/wide.h"

/* Fills bvh->pairs and bvh->parts. Errors: MEMORY. */
fct_result fct_pairs_build(fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                           const fct_wide_list *wide);
/* Sets bvh->pair_stamp. */
void fct_pairs_stamp(fct_bvh *bvh);

#endif
