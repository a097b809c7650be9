/* bvh/build/leaf_list.h: the leaves of a structure that is being built. */
#ifndef FCT_BVH_LEAF_LIST_H
#define FCT_BVH_LEAF_LIST_H

#include "bvh/model.h"

/* In the order in which bvh->leaves holds them. */
typedef struct fct_leaf_list {
    uint32_t count;
    uint32_t *
        nodes; /* count, ids in the cluster tree: the cluster, or, if bvh->places is set, a large one in it */
    uint32_t *firsts;  /* count + 1: triangles in the leaves before each */
    uint32_t *offsets; /* count, units of 64 bytes in bvh->leaves */
    float *bounds;     /* count x 6, lower then upper, scaled */
    /* If the top is split along other axes than those of the coordinates, see frame.h; else NULL: */
    float
        *frame_bounds; /* count x 6, lower then upper along the axes of `frame`, relative to fct_bvh.center */
    v3 frame[3];
} fct_leaf_list;

#endif
