/* cluster/shape/cone.h: cones of normals. */
#ifndef FCT_CLUSTER_CONE_H
#define FCT_CLUSTER_CONE_H

#include "base/variant.h"
#include "cluster/shape/box.h"

/* A triangle's unit normal in floats; NaN where it has no area. */
#define fct_unit_normal FCT_KERNEL(fct_unit_normal)
FCT_DECLARE_KERNEL(void, fct_unit_normal,
                   (const float *positions, const uint32_t triangle[3], float normal[3]));

/* The angle of a squared chord, enlarged by what floats may have lost, at most pi; of one, of eight. */
#define fct_cone_angle FCT_KERNEL(fct_cone_angle)
FCT_DECLARE_KERNEL(float, fct_cone_angle, (float widest));
#define fct_cone_angles FCT_KERNEL(fct_cone_angles)
FCT_DECLARE_KERNEL(void, fct_cone_angles, (const float widest[8], float angles[8]));

#endif
