/* base/math/nearest8.h: the points of eight triangles that are nearest to the origin, in float. For kernel
 * files.
 */
#ifndef FCT_BASE_NEAREST8_H
#define FCT_BASE_NEAREST8_H

#include "base/math/simd.h"

typedef struct f8x3 {
    f8 x, y, z;
} f8x3;

static inline f8x3 f8x3_sub(f8x3 a, f8x3 b) {
    return (f8x3){f8_sub(a.x, b.x), f8_sub(a.y, b.y), f8_sub(a.z, b.z)};
}
static inline f8 f8x3_dot(f8x3 a, f8x3 b) {
    return f8_add(f8_add(f8_mul(a.x, b.x), f8_mul(a.y, b.y)), f8_mul(a.z, b.z));
}
/* a + v b + w c */
static inline f8x3 f8x3_mix(f8x3 a, f8 v, f8x3 b, f8 w, f8x3 c) {
    return (f8x3){f8_add(a.x, f8_add(f8_mul(v, b.x), f8_mul(w, c.x))),
                  f8_add(a.y, f8_add(f8_mul(v, b.y), f8_mul(w, c.y))),
                  f8_add(a.z, f8_add(f8_mul(v, b.z), f8_mul(w, c.z)))};
}
typedef struct fct_nearest8 {
    f8x3 point;
    f8 v, w; /* its weights of b and c: v, w >= 0, and v + w <= 1 up to 2^-21 */
} fct_nearest8;

/* The nearest point a + v (b - a) + w (c - a) of each triangle, by the cases of Ericson (Real-Time Collision
 * Detection, 2005, section 5.1.5). */
static inline fct_nearest8 fct_nearest8_find(f8x3 a, f8x3 b, f8x3 c) {
    f8x3 ab = f8x3_sub(b, a), ac = f8x3_sub(c, a);
    f8 zero = f8_set(0), one = f8_set(1);
    /* Ericson's d1 to d6 with the opposite sign, because the point is the origin. */
    f8 a1 = f8x3_dot(ab, a), a2 = f8x3_dot(ac, a), b1 = f8x3_dot(ab, b), b2 = f8x3_dot(ac, b),
       c1 = f8x3_dot(ab, c), c2 = f8x3_dot(ac, c);
    f8 weight_a = f8_max(f8_sub(f8_mul(b1, c2), f8_mul(c1, b2)), zero),
       weight_b = f8_max(f8_sub(f8_mul(c1, a2), f8_mul(a1, c2)), zero),
       weight_c = f8_max(f8_sub(f8_mul(a1, b2), f8_mul(b1, a2)), zero);
    /* The weights of b and c are v and w over `all`. First the inside, then each case replaces those before
     * it: sides bc, ac, ab, then corners c, b, a. A case holds where high <= low. */
    f8 v = weight_b, w = weight_c, all = f8_add(f8_add(weight_a, weight_b), weight_c);
    f8 from_b = f8_sub(b1, b2), from_c = f8_sub(c2, c1); /* along bc; both positive between b and c */
    f8 low = f8_min(f8_min(from_b, from_c), zero), high = weight_a;
    v = f8_if_lt(low, high, v, from_c), w = f8_if_lt(low, high, w, from_b);
    all = f8_if_lt(low, high, all, f8_add(from_b, from_c));
    low = f8_min(c2, zero), high = f8_max(weight_b, a2);
    v = f8_if_lt(low, high, v, zero), w = f8_if_lt(low, high, w, f8_sub(zero, a2));
    all = f8_if_lt(low, high, all, f8_sub(c2, a2));
    low = f8_min(b1, zero), high = f8_max(weight_c, a1);
    v = f8_if_lt(low, high, v, f8_sub(zero, a1)), w = f8_if_lt(low, high, w, zero);
    all = f8_if_lt(low, high, all, f8_sub(b1, a1));
    low = zero, high = f8_max(c2, f8_sub(c2, c1));
    v = f8_if_lt(low, high, v, zero), w = f8_if_lt(low, high, w, one);
    all = f8_if_lt(low, high, all, one);
    high = f8_max(b1, f8_sub(b1, b2));
    v = f8_if_lt(low, high, v, one), w = f8_if_lt(low, high, w, zero);
    all = f8_if_lt(low, high, all, one);
    low = f8_min(a1, a2), high = zero;
    v = f8_if_lt(low, high, v, zero), w = f8_if_lt(low, high, w, zero);
    all = f8_if_lt(low, high, all, one);
    f8 scale = f8_div(one, f8_max(all, f8_set(1e-37f)));
    v = f8_mul(v, scale), w = f8_mul(w, scale);
    return (fct_nearest8){f8x3_mix(a, v, ab, w, ac), v, w};
}

#endif
