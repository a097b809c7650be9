/* bvh/near/triangle.c: the point of a triangle that is nearest to a given point, in double.
 *
 * If the foot of the perpendicular lies inside, it is the answer; else the nearest point of the three sides
 * is.
 */
#include "bvh/near/triangle.h"

/* Parameter in [0, 1] of the point of segment a b that is nearest to the origin. */
static double closest_on_segment(v3 a, v3 b) {
    v3 ab = v3_sub(b, a);
    double length2 = v3_norm2(ab), t = length2 > 0 ? -v3_dot(a, ab) / length2 : 0;
    return t < 0 ? 0 : t > 1 ? 1 : t;
}

static v3 mix_corners(v3 a, v3 b, v3 c, double u, double v) {
    return v3_add(v3_scale(a, 1 - u - v), v3_add(v3_scale(b, u), v3_scale(c, v)));
}

/* The point on the three sides that is nearest to the origin. */
static v3 closest_on_sides(v3 a, v3 b, v3 c, double *u, double *v) {
    double ab = closest_on_segment(a, b), bc = closest_on_segment(b, c), ac = closest_on_segment(a, c);
    double us[3] = {ab, 1 - bc, 0}, vs[3] = {0, bc, ac};
    v3 best = mix_corners(a, b, c, us[0], vs[0]);
    double best2 = v3_norm2(best);
    *u = us[0], *v = vs[0];
    for (int i = 1; i < 3; ++i) {
        v3 point = mix_corners(a, b, c, us[i], vs[i]);
        double point2 = v3_norm2(point);
        if (!(point2 < best2)) continue;
        best = point, best2 = point2;
        *u = us[i], *v = vs[i];
    }
    return best;
}

v3 fct_triangle_closest(v3 p, v3 a, v3 b, v3 c, double *u, double *v) {
    v3 pa = v3_sub(a, p), pb = v3_sub(b, p), pc = v3_sub(c, p);
    v3 n = v3_cross(v3_sub(b, a), v3_sub(c, a));
    double area2 = v3_norm2(n);
    /* Barycentric weights of the foot of the perpendicular, times area2. It is inside if none is negative. */
    double wb = v3_dot(n, v3_cross(pc, pa)), wc = v3_dot(n, v3_cross(pa, pb)),
           wa = v3_dot(n, v3_cross(pb, pc));
    if (area2 > 0 && wa >= 0 && wb >= 0 && wc >= 0) {
        double sum = wa + wb + wc;
        if (sum > 0) {
            *u = wb / sum, *v = wc / sum;
            return v3_add(p, mix_corners(pa, pb, pc, *u, *v));
        }
    }
    return v3_add(p, closest_on_sides(pa, pb, pc, u, v));
}
