/* bvh/near/triangle.h: the point of a triangle that is nearest to a given point. */
#ifndef FCT_BVH_TRIANGLE_H
#define FCT_BVH_TRIANGLE_H

#include "base/math/vec.h"

/* Returns the nearest point of triangle a b c; *u and *v receive its barycentric weights of b and c. A
 * triangle without area counts as its three sides. */
v3 fct_triangle_closest(v3 p, v3 a, v3 b, v3 c, double *u, double *v);

#endif
