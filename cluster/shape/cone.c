/* cluster/shape/cone.c: angles of cones of normals, from the chord between unit vectors: the cosine of a
 * small angle has no digits left. */
#include "cluster/shape/cone.h"

#include "base/math/simd_d8.h"

void fct_unit_normal(const float *positions, const uint32_t triangle[3], float normal[3]) {
    v3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = v3_load(positions + 3 * (size_t)triangle[k]);
    v3 n = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    double length = v3_norm(n);
    v3_store(normal, length > 0 ? v3_scale(n, 1 / length) : (v3){NAN, NAN, NAN});
}

/* asin(x) for x in [0, 1], within 4e-10: the Taylor series up to 1/2, pi / 2 - 2 asin(sqrt((1 - x) / 2))
 * above.
 */
static inline d8 arc_sine(d8 x) {
    static const double series[] = {
        2027025.0 / 175472640, 135135.0 / 9676800, 10395.0 / 599040, 945.0 / 42240,
        105.0 / 3456,          15.0 / 336,         3.0 / 40,         1.0 / 6};
    const d8 half = d8_set(0.5), one = d8_set(1);
    d8 z = d8_if_lt(half, x, d8_mul(half, d8_sub(one, x)), d8_mul(x, x));
    d8 r = d8_if_lt(half, x, d8_sqrt(z), x);
    d8 p = d8_add(d8_set(34459425.0 / 3530096640), d8_mul(z, d8_set(0.0111)));
    for (int i = 0; i < 8; ++i) p = d8_add(d8_set(series[i]), d8_mul(z, p));
    d8 small = d8_add(r, d8_mul(d8_mul(r, z), p));
    return d8_if_lt(half, x, d8_sub(d8_set(1.5707963267948966), d8_add(small, small)), small);
}

void fct_cone_angles(const float widest[8], float angles[8]) {
    d8 chord = d8_add(d8_sqrt(d8_load_floats(widest)), d8_set(5e-7));
    d8 angle = arc_sine(d8_min(d8_mul(chord, d8_set(0.5)), d8_set(1)));
    d8_store_floats(angles, d8_mul(angle, d8_set(2 * (1 + 2e-7))));
    f8_store(angles, f8_min(f8_load(angles), f8_set(3.14159274f)));
}

float fct_cone_angle(float widest) {
    float all[8], angles[8];
    for (int i = 0; i < 8; ++i) all[i] = widest;
    fct_cone_angles(all, angles);
    return angles[0];
}
