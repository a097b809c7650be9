/* bvh/build/refit.h: the structure of a model whose vertices have moved. */
#ifndef FCT_BVH_REFIT_H
#define FCT_BVH_REFIT_H

#include "bvh/model.h"

/* The expected work of a ray: the area of all boxes of the nodes over the area of the model's bounds
 * (MacDonald and Booth 1990), and 1 for the root. Not for Embree. */
double fct_bvh_cost(const fct_bvh *bvh);

/* Fits leaves, nodes and pair nodes of `bvh` to its positions. Its arrays are copies of those of `old`, which
 * has the same faces. Errors: MEMORY. */
fct_result fct_refit_boxes(fct_bvh *bvh, const fct_bvh *old);

#endif
