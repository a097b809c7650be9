/* bvh/pair/orient.h: on which side of a plane or a line a point lies, by exact arithmetic. */
#ifndef FCT_BVH_ORIENT_H
#define FCT_BVH_ORIENT_H

#include "base/math/vec.h"

/* The sign of det(b - a, c - a, d - a): 1 if d lies on the side of the plane a b c to which its normal
 * (b - a) x (c - a) points, -1 on the other side, 0 on the plane. Coordinates are zero or have magnitudes
 * from 2^-300 to 2^300. */
int fct_orient_space(v3 a, v3 b, v3 c, v3 d);
/* The same for the plane of p and each corner of t. */
void fct_orient_corners(const v3 p[3], const v3 t[3], int side[3]);

/* The sign of the component `axis` (0 x, 1 y, 2 z) of (b - a) x (c - a): the turn a b c seen along this axis.
 */
int fct_orient_plane(int axis, v3 a, v3 b, v3 c);

#endif
