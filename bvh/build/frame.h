/* bvh/build/frame.h: the axes along which the top over the leaves is split. */
#ifndef FCT_BVH_FRAME_H
#define FCT_BVH_FRAME_H

#include "bvh/build/leaf_list.h"

/* Sets leaves->frame and leaves->frame_bounds where another frame than the coordinate axes makes smaller
 * boxes. Errors: MEMORY. */
fct_result fct_frame_choose(const fct_bvh *bvh, fct_leaf_list *leaves);

#endif
