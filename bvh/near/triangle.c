/* bvh/near/triangle.c: the point of a triangle nearest to a point, in double (Ericson, "Real-Time Collision
 * Detection", 2005, 5.1.5: by Voronoi regions). A triangle without area is the union of its sides.
 */
#include "bvh/near/triangle.h"

/* Parameter in [0, 1] of the point of the segment a b nearest to the origin. */
static double segment_closest(v3 a, v3 b) {
    v3 ab = v3_sub(b, a);
    double length2 = v3_norm2(ab), t = length2 > 0 ? -v3_dot(a, ab) / length2 : 0;
    return t < 0 ? 0 : t > 1 ? 1 : t;
}

static v3 mix(v3 a, v3 b, v3 c, double u, double v) {
    return v3_add(v3_scale(a, 1 - u - v), v3_add(v3_scale(b, u), v3_scale(c, v)));
}

/* The nearest of the three sides; all corners relative to the point. */
static v3 sides_closest(v3 a, v3 b, v3 c, double *u, double *v) {
    double ab = segment_closest(a, b), bc = segment_closest(b, c), ac = segment_closest(a, c);
    double us[3] = {ab, 1 - bc, 0}, vs[3] = {0, bc, ac};
    int best = 0;
    for (int i = 1; i < 3; ++i)
        if (v3_norm2(mix(a, b, c, us[i], vs[i])) < v3_norm2(mix(a, b, c, us[best], vs[best]))) best = i;
    *u = us[best], *v = vs[best];
    return mix(a, b, c, *u, *v);
}

v3 fct_triangle_closest(v3 p, v3 a, v3 b, v3 c, double *u, double *v) {
    v3 pa = v3_sub(a, p), pb = v3_sub(b, p), pc = v3_sub(c, p);
    v3 n = v3_cross(v3_sub(b, a), v3_sub(c, a));
    double area2 = v3_norm2(n);
    /* Weights of the foot of the perpendicular, times area2; inside where none is negative. */
    double wb = v3_dot(n, v3_cross(pc, pa)), wc = v3_dot(n, v3_cross(pa, pb)),
           wa = v3_dot(n, v3_cross(pb, pc));
    if (area2 > 0 && wa >= 0 && wb >= 0 && wc >= 0) {
        double sum = wa + wb + wc;
        if (sum > 0) {
            *u = wb / sum, *v = wc / sum;
            return v3_add(p, mix(pa, pb, pc, *u, *v));
        }
    }
    return v3_add(p, sides_closest(pa, pb, pc, u, v));
}
