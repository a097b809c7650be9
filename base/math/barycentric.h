/* base/math/barycentric.h: barycentrics of a point in a triangle. */
#ifndef FCT_BASE_BARYCENTRIC_H
#define FCT_BASE_BARYCENTRIC_H

#include "base/math/vec.h"

/* Weights of the second and third corner for the projection of a point onto the plane of the triangle; 0 if
 * its area is 0. */
static inline void fct_barycentrics(const v3 p[3], v3 point, double uv[2]) {
    const v3 e = v3_sub(p[1], p[0]), f = v3_sub(p[2], p[0]), d = v3_sub(point, p[0]), n = v3_cross(e, f);
    const double scale = v3_norm2(n);
    uv[0] = scale > 0 ? v3_dot(v3_cross(d, f), n) / scale : 0;
    uv[1] = scale > 0 ? v3_dot(v3_cross(e, d), n) / scale : 0;
}

#endif
