/* base/eigen.c: symmetric 3x3 eigenproblem without iteration.
 *
 * The matrix is scaled to entries of at most 1 and its trace removed, so that near multiples of the identity
 * keep their digits. The eigenvalue that stands apart from the other two is the cubic's largest root, which
 * Newton's method finds in three steps, and its vector comes from the two most independent rows; the other
 * two are the exact answer of the 2x2 problem in the plane across that vector, which is sound for equal
 * values as well. Smith, "Eigenvalues of a symmetric 3x3 matrix", CACM 4(4), 1961, for the cubic. No function
 * of the C library but the square root, so that the result is the same everywhere.
 */
#include "base/eigen.h"

static void swap_pair(double values[3], v3 vectors[3], int i, int j) {
    double value = values[i];
    values[i] = values[j], values[j] = value;
    v3 vector = vectors[i];
    vectors[i] = vectors[j], vectors[j] = vector;
}

static void sort_ascending(double values[3], v3 vectors[3]) {
    if (values[1] < values[0]) swap_pair(values, vectors, 0, 1);
    if (values[2] < values[1]) swap_pair(values, vectors, 1, 2);
    if (values[1] < values[0]) swap_pair(values, vectors, 0, 1);
    if (v3_dot(v3_cross(vectors[0], vectors[1]), vectors[2]) < 0) vectors[2] = v3_scale(vectors[2], -1);
}

/* The unit vector that b - value I sends closest to zero, where value is a simple eigenvalue. */
static v3 null_vector(const double b[6], double value) {
    v3 r0 = {b[0] - value, b[1], b[2]}, r1 = {b[1], b[3] - value, b[4]}, r2 = {b[2], b[4], b[5] - value};
    v3 c01 = v3_cross(r0, r1), c02 = v3_cross(r0, r2), c12 = v3_cross(r1, r2);
    double d01 = v3_norm2(c01), d02 = v3_norm2(c02), d12 = v3_norm2(c12);
    v3 best = c01;
    double most = d01;
    if (d02 > most) best = c02, most = d02;
    if (d12 > most) best = c12, most = d12;
    return v3_scale(best, 1 / sqrt(most));
}

/* cos(acos(r) / 3) for r in [0, 1]: the root of 4 c^3 - 3 c = r in [cos(pi / 6), 1]. */
static double largest_root(double r) {
    double c = 0.8660254037844386 + r * (0.1705 - 0.0365254037844386 * r); /* within .003 */
    for (int i = 0; i < 3; ++i) c -= ((4 * c * c - 3) * c - r) / (12 * c * c - 3);
    return c;
}

/* Cosine and sine of half the angle of (x, y), which lies in (-pi, pi]. */
static void half_angle(double x, double y, double *c, double *s) {
    double h = sqrt(x * x + y * y);
    if (!(h > 0)) {
        *c = 1, *s = 0;
    } else if (x >= 0) {
        *c = sqrt(0.5 + 0.5 * (x / h));
        *s = 0.5 * (y / h) / *c;
    } else {
        double sine = sqrt(0.5 - 0.5 * (x / h));
        *s = y < 0 ? -sine : sine;
        *c = 0.5 * (fabs(y) / h) / sine;
    }
}

void fct_eigen3(const double m[6], double values[3], v3 vectors[3]) {
    double scale = 0;
    for (int i = 0; i < 6; ++i) scale = fmax(scale, fabs(m[i]));
    if (m[1] == 0 && m[2] == 0 && m[4] == 0) {
        values[0] = m[0], values[1] = m[3], values[2] = m[5];
        vectors[0] = (v3){1, 0, 0}, vectors[1] = (v3){0, 1, 0}, vectors[2] = (v3){0, 0, 1};
        sort_ascending(values, vectors);
        return;
    }
    double a[6], b[6];
    for (int i = 0; i < 6; ++i) a[i] = b[i] = m[i] / scale;
    double third = (a[0] + a[3] + a[5]) / 3;
    b[0] -= third, b[3] -= third, b[5] -= third;
    double spread = 0; /* of the traceless part, which may be far below 1 */
    for (int i = 0; i < 6; ++i) spread = fmax(spread, fabs(b[i]));
    for (int i = 0; i < 6; ++i) b[i] /= spread;
    double p =
        sqrt((b[0] * b[0] + b[3] * b[3] + b[5] * b[5]) / 6 + (b[1] * b[1] + b[2] * b[2] + b[4] * b[4]) / 3);
    for (int i = 0; i < 6; ++i) b[i] /= p;
    double r = 0.5 * (b[0] * (b[3] * b[5] - b[4] * b[4]) - b[1] * (b[1] * b[5] - b[4] * b[2]) +
                      b[2] * (b[1] * b[4] - b[3] * b[2]));
    double apart = 2 * largest_root(fmin(fabs(r), 1));
    v3 w = null_vector(b, r < 0 ? -apart : apart), u, v;
    v3_frame(w, &u, &v);

    double uu = sym3_form(a, u, u), uv = sym3_form(a, u, v), vv = sym3_form(a, v, v);
    double c, s;
    half_angle(uu - vv, 2 * uv, &c, &s);
    vectors[0] = w, vectors[1] = v3_mad(v3_scale(u, c), s, v), vectors[2] = v3_mad(v3_scale(v, c), -s, u);
    for (int i = 0; i < 3; ++i) values[i] = scale * sym3_form(a, vectors[i], vectors[i]);
    sort_ascending(values, vectors);
}
