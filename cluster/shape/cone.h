/* cluster/shape/cone.h: cones of normals. */
#ifndef FCT_CLUSTER_CONE_H
#define FCT_CLUSTER_CONE_H

#include "base/variant.h"
#include "cluster/shape/box.h"

/* The unit normal of a triangle; NaN if its area is 0. */
#define fct_unit_normal FCT_KERNEL(fct_unit_normal)
FCT_DECLARE_KERNEL(void, fct_unit_normal,
                   (const float *positions, const uint32_t triangle[3], float normal[3]));

/* The angle (radians, at most pi) between unit vectors whose squared distance is `widest`, enlarged by the
 * rounding of floats. */
#define fct_cone_angle FCT_KERNEL(fct_cone_angle)
FCT_DECLARE_KERNEL(float, fct_cone_angle, (float widest));
#define fct_cone_angles FCT_KERNEL(fct_cone_angles)
FCT_DECLARE_KERNEL(void, fct_cone_angles, (const float widest[8], float angles[8]));

#endif
