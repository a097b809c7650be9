/* base/eigen.c: symmetric 3x3 eigenproblem, four at a time.
 *
 * The matrix is scaled to entries of at most 1 and its trace removed, so that near multiples of the identity
 * keep their digits. The eigenvalue that stands apart from the other two is the cubic's largest root, which
 * Newton's method finds in three steps, and its vector comes from the two most independent rows; the other
 * two are the exact answer of the 2x2 problem in the plane across that vector, which is sound for equal
 * values as well. Smith, "Eigenvalues of a symmetric 3x3 matrix", CACM 4(4), 1961, for the cubic. No function
 * of the C library but the square root, so that the result is the same everywhere. Diagonal matrices go their
 * own way.
 */
#include "base/eigen.h"

#include <stdbool.h>

#include "base/simd.h"

/* Four vectors. */
typedef struct w3 {
    d4 x, y, z;
} w3;

static inline d4 mad(d4 a, d4 b, d4 c) {
    return d4_add(a, d4_mul(b, c));
}
static inline d4 w3_dot(w3 a, w3 b) {
    return mad(mad(d4_mul(a.x, b.x), a.y, b.y), a.z, b.z);
}
static inline w3 w3_cross(w3 a, w3 b) {
    return (w3){d4_sub(d4_mul(a.y, b.z), d4_mul(a.z, b.y)), d4_sub(d4_mul(a.z, b.x), d4_mul(a.x, b.z)),
                d4_sub(d4_mul(a.x, b.y), d4_mul(a.y, b.x))};
}
static inline w3 w3_scale(w3 a, d4 s) {
    return (w3){d4_mul(a.x, s), d4_mul(a.y, s), d4_mul(a.z, s)};
}
/* s a + t b */
static inline w3 w3_mix(w3 a, d4 s, w3 b, d4 t) {
    return (w3){mad(d4_mul(a.x, s), b.x, t), mad(d4_mul(a.y, s), b.y, t), mad(d4_mul(a.z, s), b.z, t)};
}
static inline w3 w3_if_lt(d4 p, d4 q, w3 a, w3 b) {
    return (w3){d4_if_lt(p, q, a.x, b.x), d4_if_lt(p, q, a.y, b.y), d4_if_lt(p, q, a.z, b.z)};
}
static inline d4 form(const d4 m[6], w3 a, w3 b) {
    w3 mb = {mad(mad(d4_mul(m[0], b.x), m[1], b.y), m[2], b.z),
             mad(mad(d4_mul(m[1], b.x), m[3], b.y), m[4], b.z),
             mad(mad(d4_mul(m[2], b.x), m[4], b.y), m[5], b.z)};
    return w3_dot(a, mb);
}

static inline d4 largest_entry(const d4 m[6]) {
    d4 most = d4_abs(m[0]);
    for (int i = 1; i < 6; ++i) most = d4_max(most, d4_abs(m[i]));
    return most;
}

/* The unit vector that b - value I sends closest to zero, where value is a simple eigenvalue. */
static inline w3 null_vector(const d4 b[6], d4 value) {
    w3 r0 = {d4_sub(b[0], value), b[1], b[2]}, r1 = {b[1], d4_sub(b[3], value), b[4]};
    w3 r2 = {b[2], b[4], d4_sub(b[5], value)};
    w3 c01 = w3_cross(r0, r1), c02 = w3_cross(r0, r2), c12 = w3_cross(r1, r2), best = c01;
    d4 most = w3_dot(c01, c01), d02 = w3_dot(c02, c02), d12 = w3_dot(c12, c12);
    best = w3_if_lt(most, d02, c02, best);
    most = d4_max(most, d02);
    best = w3_if_lt(most, d12, c12, best);
    most = d4_max(most, d12);
    return w3_scale(best, d4_div(d4_set(1), d4_sqrt(most)));
}

/* cos(acos(r) / 3) for r in [0, 1]: the root of 4 c^3 - 3 c = r in [cos(pi / 6), 1]. */
static inline d4 largest_root(d4 r) {
    d4 slope = d4_sub(d4_set(0.1705), d4_mul(d4_set(0.0365254037844386), r));
    d4 c = mad(d4_set(0.8660254037844386), r, slope); /* within .003 */
    for (int i = 0; i < 3; ++i) {
        d4 cc4 = d4_mul(d4_set(4), d4_mul(c, c)), three = d4_set(3);
        d4 excess = d4_sub(d4_mul(d4_sub(cc4, three), c), r);
        c = d4_sub(c, d4_div(excess, d4_sub(d4_mul(three, cc4), three)));
    }
    return c;
}

/* Cosine and sine of half the angle of (x, y), which lies in (-pi, pi]. */
static inline void half_angle(d4 x, d4 y, d4 *c, d4 *s) {
    d4 none = d4_set(0), one = d4_set(1), half = d4_set(0.5), largest = d4_max(d4_abs(x), d4_abs(y));
    d4 scale = d4_if_lt(none, largest, largest, one); /* for squares of tiny numbers have no digits */
    x = d4_div(x, scale), y = d4_div(y, scale);
    d4 h = d4_sqrt(mad(d4_mul(x, x), y, y)), invert = d4_div(one, d4_if_lt(none, h, h, one));
    d4 cosine = d4_mul(x, invert), sine = d4_mul(y, invert);
    d4 large = d4_sqrt(mad(half, half, d4_abs(cosine))); /* the larger of the two, at least sqrt(1/2) */
    d4 small = d4_div(d4_mul(half, d4_abs(sine)), large);
    d4 sign = d4_if_lt(y, none, d4_set(-1), one);
    *c = d4_if_lt(x, none, small, large);
    *s = d4_mul(sign, d4_if_lt(x, none, large, small));
    *c = d4_if_lt(none, h, *c, one), *s = d4_if_lt(none, h, *s, none);
}

/* Two unit vectors that complete w to a right-handed frame (u, v, w) (Duff et al. 2017). */
static inline void frame(w3 w, w3 *u, w3 *v) {
    d4 one = d4_set(1), sign = d4_if_lt(w.z, d4_set(0), d4_set(-1), one), minus = d4_set(-1);
    d4 a = d4_div(minus, d4_add(sign, w.z)), c = d4_mul(d4_mul(w.x, w.y), a);
    *u = (w3){mad(one, sign, d4_mul(d4_mul(w.x, w.x), a)), d4_mul(sign, c), d4_mul(minus, d4_mul(sign, w.x))};
    *v = (w3){c, mad(sign, d4_mul(w.y, w.y), a), d4_mul(minus, w.y)};
}

static inline void order(d4 values[3], w3 vectors[3], int i, int j) {
    d4 a = values[i], b = values[j];
    w3 p = vectors[i], q = vectors[j];
    values[i] = d4_if_lt(b, a, b, a), values[j] = d4_if_lt(b, a, a, b);
    vectors[i] = w3_if_lt(b, a, q, p), vectors[j] = w3_if_lt(b, a, p, q);
}

static void sort_ascending(d4 values[3], w3 vectors[3]) {
    order(values, vectors, 0, 1);
    order(values, vectors, 1, 2);
    order(values, vectors, 0, 1);
    d4 turn = w3_dot(w3_cross(vectors[0], vectors[1]), vectors[2]);
    vectors[2] = w3_scale(vectors[2], d4_if_lt(turn, d4_set(0), d4_set(-1), d4_set(1)));
}

/* No lane diagonal. */
static void solve(const d4 m[6], d4 values[3], w3 vectors[3]) {
    d4 scale = largest_entry(m), one = d4_set(1), a[6], b[6];
    for (int i = 0; i < 6; ++i) a[i] = b[i] = d4_div(m[i], scale);
    d4 third = d4_div(d4_add(d4_add(a[0], a[3]), a[5]), d4_set(3));
    b[0] = d4_sub(b[0], third), b[3] = d4_sub(b[3], third), b[5] = d4_sub(b[5], third);
    d4 spread = largest_entry(b); /* of the traceless part, which may be far below 1 */
    for (int i = 0; i < 6; ++i) b[i] = d4_div(b[i], spread);
    d4 diagonal = mad(mad(d4_mul(b[0], b[0]), b[3], b[3]), b[5], b[5]);
    d4 others = mad(mad(d4_mul(b[1], b[1]), b[2], b[2]), b[4], b[4]);
    d4 p = d4_sqrt(d4_div(mad(diagonal, d4_set(2), others), d4_set(6)));
    d4 reciprocal = d4_div(one, p);
    for (int i = 0; i < 6; ++i) b[i] = d4_mul(b[i], reciprocal);
    d4 r = d4_mul(b[0], d4_sub(d4_mul(b[3], b[5]), d4_mul(b[4], b[4])));
    r = d4_sub(r, d4_mul(b[1], d4_sub(d4_mul(b[1], b[5]), d4_mul(b[4], b[2]))));
    r = d4_mul(d4_set(0.5), mad(r, b[2], d4_sub(d4_mul(b[1], b[4]), d4_mul(b[3], b[2]))));
    d4 apart = d4_mul(d4_set(2), largest_root(d4_min(d4_abs(r), one)));
    apart = d4_if_lt(r, d4_set(0), d4_mul(apart, d4_set(-1)), apart);
    w3 w = null_vector(b, apart), u, v;
    frame(w, &u, &v);
    d4 uu = form(a, u, u), uv = form(a, u, v), vv = form(a, v, v), c, s;
    half_angle(d4_sub(uu, vv), d4_add(uv, uv), &c, &s);
    vectors[0] = w, vectors[1] = w3_mix(u, c, v, s), vectors[2] = w3_mix(v, c, u, d4_mul(s, d4_set(-1)));
    for (int i = 0; i < 3; ++i) values[i] = d4_mul(scale, form(a, vectors[i], vectors[i]));
    sort_ascending(values, vectors);
}

static bool is_diagonal(const double m[6]) {
    return m[1] == 0 && m[2] == 0 && m[4] == 0;
}

/* Coordinate axes, by value and then by number. */
static void solve_diagonal(const double m[6], double values[3], v3 vectors[3]) {
    const double entries[3] = {m[0], m[3], m[5]};
    const v3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    int places[3] = {0, 1, 2};
    for (int pass = 0; pass < 3; ++pass)
        for (int i = pass % 2; i < 2; i += 2)
            if (entries[places[i + 1]] < entries[places[i]]) {
                int place = places[i];
                places[i] = places[i + 1], places[i + 1] = place;
            }
    for (int i = 0; i < 3; ++i) values[i] = entries[places[i]], vectors[i] = axes[places[i]];
    if (v3_dot(v3_cross(vectors[0], vectors[1]), vectors[2]) < 0) vectors[2] = v3_scale(vectors[2], -1);
}

void fct_eigen3_four(const double *const m[4], double values[4][3], v3 vectors[4][3]) {
    static const double stand_in[6] = {1, 0.5, 0, 2, 0, 3};
    double rows[6][4], out_values[3][4], out_vectors[3][3][4];
    d4 matrix[6], lane_values[3];
    w3 lane_vectors[3];
    for (int i = 0; i < 4; ++i) {
        const double *from = is_diagonal(m[i]) ? stand_in : m[i];
        for (int k = 0; k < 6; ++k) rows[k][i] = from[k];
    }
    for (int k = 0; k < 6; ++k) matrix[k] = d4_load(rows[k]);
    solve(matrix, lane_values, lane_vectors);
    for (int k = 0; k < 3; ++k) {
        d4_store(out_values[k], lane_values[k]);
        d4_store(out_vectors[k][0], lane_vectors[k].x);
        d4_store(out_vectors[k][1], lane_vectors[k].y);
        d4_store(out_vectors[k][2], lane_vectors[k].z);
    }
    for (int i = 0; i < 4; ++i) {
        if (is_diagonal(m[i])) {
            solve_diagonal(m[i], values[i], vectors[i]);
            continue;
        }
        for (int k = 0; k < 3; ++k) {
            values[i][k] = out_values[k][i];
            vectors[i][k] = (v3){out_vectors[k][0][i], out_vectors[k][1][i], out_vectors[k][2][i]};
        }
    }
}

void fct_eigen3(const double m[6], double values[3], v3 vectors[3]) {
    double all_values[4][3];
    v3 all_vectors[4][3];
    if (is_diagonal(m)) {
        solve_diagonal(m, values, vectors);
        return;
    }
    fct_eigen3_four((const double *const[4]){m, m, m, m}, all_values, all_vectors);
    for (int k = 0; k < 3; ++k) values[k] = all_values[0][k], vectors[k] = all_vectors[0][k];
}
