/* simplify/cost/nearest.h: the point of a triangle nearest to p. A triangle is prepared once for many
 * queries. A triangle without area counts as its three sides.
 */
#ifndef FCT_SIMPLIFY_NEAREST_H
#define FCT_SIMPLIFY_NEAREST_H

#include "base/math/vec.h"

typedef struct triangle {
    v3 a, ab, ac;           /* first corner, sides from it */
    double aa, bb, cc, det; /* ab.ab, ab.ac, ac.ac, aa cc - bb bb */
} triangle;

/* The nearest point a + u ab + v ac, and its squared distance. */
typedef struct foot {
    double u, v, distance2;
} foot;

static inline triangle triangle_make(v3 a, v3 b, v3 c) {
    triangle t = {.a = a, .ab = v3_sub(b, a), .ac = v3_sub(c, a)};
    t.aa = v3_norm2(t.ab), t.bb = v3_dot(t.ab, t.ac), t.cc = v3_norm2(t.ac);
    t.det = t.aa * t.cc - t.bb * t.bb;
    return t;
}

/* The projection if it lies inside, else the nearest point of the nearest side. */
static inline foot triangle_nearest(const triangle *t, v3 p) {
    v3 ap = v3_sub(p, t->a);
    double d1 = v3_dot(t->ab, ap), d2 = v3_dot(t->ac, ap), aa = t->aa, bb = t->bb, cc = t->cc;
    double u = cc * d1 - bb * d2, v = aa * d2 - bb * d1;
    if (t->det > 0 && u >= 0 && v >= 0 && u + v <= t->det)
        u /= t->det, v /= t->det;
    else {
        double on_ab = aa > 0 ? fct_min(fct_max(d1 / aa, 0), 1) : 0;
        double on_ac = cc > 0 ? fct_min(fct_max(d2 / cc, 0), 1) : 0;
        double bc2 = aa + cc - 2 * bb, along = d2 - d1 + aa - bb; /* (p - b).(c - b) */
        double y = bc2 > 0 ? fct_min(fct_max(along / bc2, 0), 1) : 0, x = 1 - y;
        double e_ab = on_ab * (on_ab * aa - 2 * d1), e_ac = on_ac * (on_ac * cc - 2 * d2);
        double e_bc = x * x * aa + y * y * cc + 2 * x * y * bb - 2 * (x * d1 + y * d2);
        u = on_ab, v = 0;
        if (e_ac < e_ab) u = 0, v = on_ac;
        if (e_bc < fct_min(e_ab, e_ac)) u = x, v = y;
    }
    v3 rest = v3_sub(ap, v3_add(v3_scale(t->ab, u), v3_scale(t->ac, v)));
    return (foot){u, v, v3_norm2(rest)};
}

#endif
