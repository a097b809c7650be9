/* bvh/near/region.h: the faces that touch a region. A kernel: region.c is compiled per processor. */
#ifndef FCT_BVH_REGION_H
#define FCT_BVH_REGION_H

#include "base/variant.h"
#include "bvh/model.h"
#include "bvh/near/clip.h"
#include "bvh/near/list.h"

/* Adds the faces within `radius` (>= 0) of the point to the list. OBB backend. */
#define fct_region_ball FCT_KERNEL(fct_region_ball)
FCT_DECLARE_KERNEL(void, fct_region_ball,
                   (const fct_bvh *bvh, v3 point, double radius, fct_face_list *list, fct_visits *visits));

/* Adds the faces that touch all `count` half-spaces at one point. They are unscaled and finite, their normals
 * are not 0, and count is at most FCT_BVH_PLANES. OBB backend. */
#define fct_region_planes FCT_KERNEL(fct_region_planes)
FCT_DECLARE_KERNEL(void, fct_region_planes,
                   (const fct_bvh *bvh, uint32_t count, const fct_half_space *half_spaces,
                    fct_face_list *list, fct_visits *visits));

#endif
