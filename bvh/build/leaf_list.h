/* bvh/build/leaf_list.h: the leaves of a structure that is being built. */
#ifndef FCT_BVH_LEAF_LIST_H
#define FCT_BVH_LEAF_LIST_H

#include "bvh/model.h"

/* In the order in which bvh->leaves holds them. */
typedef struct fct_leaf_list {
    uint32_t count;
    /* Per leaf, an id in the cluster tree: the cluster that it is; if bvh->places is set, the cluster of
     * largest area of those that it is put together of. */
    uint32_t *nodes;
    uint32_t *firsts;  /* count + 1: the number of triangles in all leaves before leaf i */
    uint32_t *offsets; /* count, units of 64 bytes in bvh->leaves */
    float *bounds;     /* count x 6, lower then upper, scaled */
    /* NULL, unless the top is split along other axes than those of the coordinates, see frame.h: the bounds
     * along the axes of `frame`, relative to fct_bvh.center; count x 6, lower then upper. */
    float *frame_bounds;
    v3 frame[3];
} fct_leaf_list;

#endif
