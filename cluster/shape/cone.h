/* cluster/shape/cone.h: cones of normals. */
#ifndef FCT_CLUSTER_CONE_H
#define FCT_CLUSTER_CONE_H

#include "cluster/shape/box.h"

/* A triangle's unit normal in floats; NaN where it has no area. */
void fct_unit_normal(const float *positions, const uint32_t triangle[3], float normal[3]);

/* The angle of a squared chord, enlarged by what floats may have lost, at most pi; of one, of eight. */
float fct_cone_angle(float widest);
void fct_cone_angles(const float widest[8], float angles[8]);

#endif
