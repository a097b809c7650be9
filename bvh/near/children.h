/* bvh/near/children.h: the children of a packed node of either kind. */
#ifndef FCT_BVH_CHILDREN_H
#define FCT_BVH_CHILDREN_H

#include "bvh/model.h"

/* The references of the eight children; bit i of *present: child i exists. */
static inline const uint32_t *fct_bvh_children(const fct_bvh *bvh, uint32_t ref, uint32_t *present) {
    if (ref & FCT_REF_ORIENTED) {
        const fct_oriented_node *node = fct_bvh_node(bvh, ref);
        *present = node->present;
        return node->child;
    }
    const fct_axis_node *node = fct_bvh_node(bvh, ref);
    *present = node->present;
    return node->child;
}

#endif
