/* cluster/cone.c: how far normals lie from an axis, by the chord, which keeps small angles that a cosine
 * loses. */
#include "cluster/cone.h"

#include "base/simd.h"

static const float pi = 3.14159274f;

void fct_unit_normal(const float *positions, const uint32_t triangle[3], float normal[3]) {
    v3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = v3_load(positions + 3 * (size_t)triangle[k]);
    v3 n = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    double length = v3_norm(n);
    v3_store(normal, length > 0 ? v3_scale(n, 1 / length) : (v3){NAN, NAN, NAN});
}

static inline f8 chord2(fct_points n, size_t i, const f8 axis[3]) {
    f8 x = f8_sub(f8_load(n.x + i), axis[0]), y = f8_sub(f8_load(n.y + i), axis[1]),
       z = f8_sub(f8_load(n.z + i), axis[2]);
    return f8_add(f8_add(f8_mul(x, x), f8_mul(y, y)), f8_mul(z, z));
}

float fct_cone_widen(float widest, fct_points n, size_t begin, size_t end, const float axis[3]) {
    size_t i = begin;
    if (end - begin >= 8) {
        f8 a[3] = {f8_set(axis[0]), f8_set(axis[1]), f8_set(axis[2])}, most = f8_set(widest);
        for (; i + 8 <= end; i += 8) most = f8_max(chord2(n, i, a), most); /* NaN is passed over */
        if (i < end) most = f8_max(chord2(n, end - 8, a), most);
        float lanes[8];
        f8_store(lanes, most);
        for (int k = 0; k < 8; ++k) widest = lanes[k] > widest ? lanes[k] : widest;
        return widest;
    }
    for (; i < end; ++i) {
        float x = n.x[i] - axis[0], y = n.y[i] - axis[1], z = n.z[i] - axis[2], d = x * x + y * y + z * z;
        widest = d > widest ? d : widest;
    }
    return widest;
}

/* asin(x) for x in [0, 1] within 4e-10, less than a float shows: a polynomial up to 1/2, half the angle
 * beyond. */
static double arc_sine(double x) {
    bool far = x > 0.5;
    double z = far ? 0.5 * (1 - x) : x * x, r = far ? sqrt(z) : x;
    double p =
        1.0 / 6 +
        z * (3.0 / 40 +
             z * (15.0 / 336 +
                  z * (105.0 / 3456 +
                       z * (945.0 / 42240 + z * (10395.0 / 599040 +
                                                 z * (135135.0 / 9676800 +
                                                      z * (2027025.0 / 175472640 +
                                                           z * (34459425.0 / 3530096640 + z * 0.0111))))))));
    double small = r + r * z * p;
    return far ? 1.5707963267948966 - 2 * small : small;
}

float fct_cone_angle(float widest) {
    double chord = sqrt((double)widest) + 5e-7;
    float angle = chord < 2 ? (float)(2 * arc_sine(chord / 2) * (1 + 2e-7)) : pi;
    return angle < pi ? angle : pi;
}
