/* bvh/build/boxes.h: how boxes are packed, for structures that are built or refitted. */
#ifndef FCT_BVH_BUILD_BOXES_H
#define FCT_BVH_BUILD_BOXES_H

#include "bvh/build/slabs.h"

/* Each sets box i of a node. bounds: lower then upper, scaled. */
void fct_pack_axis_box(const float bounds[6], uint32_t i, fct_axis_node *out);
void fct_pack_oriented_box(const fct_slabs *s, uint32_t i, fct_oriented_node *out);
void fct_pack_pair_box(const fct_slabs *s, uint32_t i, fct_pair_node *out);

#endif
