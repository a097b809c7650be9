/* base/math/vec.h: vectors of three doubles (v3), and symmetric 3x3 matrices stored as xx xy xz yy yz zz. */
#ifndef FCT_BASE_VEC_H
#define FCT_BASE_VEC_H

#include <math.h>
#include <stdbool.h>

/* The lesser and the greater number; b if either is NaN. Unlike fmin and fmax, each is one instruction. */
static inline double fct_min(double a, double b) {
    return a < b ? a : b;
}
static inline double fct_max(double a, double b) {
    return a > b ? a : b;
}

typedef struct v3 {
    double x, y, z;
} v3;

static inline v3 v3_make(double x, double y, double z) {
    return (v3){x, y, z};
}
static inline v3 v3_load(const float *p) {
    return (v3){p[0], p[1], p[2]};
}
static inline void v3_store(float *p, v3 a) {
    p[0] = (float)a.x, p[1] = (float)a.y, p[2] = (float)a.z;
}
static inline v3 v3_add(v3 a, v3 b) {
    return (v3){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline v3 v3_sub(v3 a, v3 b) {
    return (v3){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline v3 v3_scale(v3 a, double s) {
    return (v3){a.x * s, a.y * s, a.z * s};
}
/* a + s b */
static inline v3 v3_mad(v3 a, double s, v3 b) {
    return (v3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline double v3_dot(v3 a, v3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline v3 v3_cross(v3 a, v3 b) {
    return (v3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline double v3_norm2(v3 a) {
    return v3_dot(a, a);
}
static inline double v3_norm(v3 a) {
    return sqrt(v3_dot(a, a));
}
/* Unit vector along a; the zero vector for zero. */
static inline v3 v3_unit(v3 a) {
    double length = v3_norm(a);
    return length > 0 ? v3_scale(a, 1 / length) : (v3){0, 0, 0};
}
/* Two unit vectors that complete the unit vector n to a right-handed frame (t, b, n) (Duff et al. 2017). */
static inline void v3_frame(v3 n, v3 *t, v3 *b) {
    double sign = n.z < 0 ? -1 : 1, a = -1 / (sign + n.z), c = n.x * n.y * a;
    *t = (v3){1 + sign * n.x * n.x * a, sign * c, -sign * n.x};
    *b = (v3){c, sign + n.y * n.y * a, -n.y};
}

/* x^T M y for M = xx xy xz yy yz zz */
static inline double sym3_form(const double m[6], v3 x, v3 y) {
    return x.x * (m[0] * y.x + m[1] * y.y + m[2] * y.z) + x.y * (m[1] * y.x + m[3] * y.y + m[4] * y.z) +
           x.z * (m[2] * y.x + m[4] * y.y + m[5] * y.z);
}
static inline v3 sym3_apply(const double m[6], v3 x) {
    return (v3){m[0] * x.x + m[1] * x.y + m[2] * x.z, m[1] * x.x + m[3] * x.y + m[4] * x.z,
                m[2] * x.x + m[4] * x.y + m[5] * x.z};
}
/* x with (M + ridge I) x = v, by Cramer's rule; false unless the determinant is above 0. */
static inline bool sym3_solve(const double m[6], double ridge, v3 v, v3 *x) {
    double xx = m[0] + ridge, yy = m[3] + ridge, zz = m[5] + ridge, xy = m[1], xz = m[2], yz = m[4];
    double a = yy * zz - yz * yz, b = xz * yz - xy * zz, c = xy * yz - xz * yy;
    double d = xx * zz - xz * xz, e = xy * xz - xx * yz, f = xx * yy - xy * xy;
    double determinant = xx * a + xy * b + xz * c;
    if (!(determinant > 0)) return false;
    *x = (v3){(a * v.x + b * v.y + c * v.z) / determinant, (b * v.x + d * v.y + e * v.z) / determinant,
              (c * v.x + e * v.y + f * v.z) / determinant};
    return true;
}
/* m += s x x^T */
static inline void sym3_add_outer(double m[6], double s, v3 x) {
    m[0] += s * x.x * x.x, m[1] += s * x.x * x.y, m[2] += s * x.x * x.z;
    m[3] += s * x.y * x.y, m[4] += s * x.y * x.z, m[5] += s * x.z * x.z;
}

#endif
