/* base/math/eigen.c: symmetric 3x3 eigenproblem, eight at a time.
 *
 *   1. Scale the matrix to entries of at most 1 and subtract a third of its trace.
 *   2. Find the eigenvalue farthest from the other two, the largest root of a cubic, with two Newton steps.
 *   3. Take its vector from the two most independent rows.
 *   4. Solve the 2x2 problem in the plane across that vector. This is exact for equal eigenvalues too.
 * Diagonal matrices take another path. The only library function is the square root, so every machine gives
 * the same bits. The cubic: Smith, "Eigenvalues of a symmetric 3x3 matrix", CACM 4(4), 1961.
 */
#include "base/math/eigen.h"

#include "base/math/simd_d8.h"

#define W3_LANES d8
#include "base/math/w3.h"

/* s a + t b */
static inline w3 w3_mix(w3 a, d8 s, w3 b, d8 t) {
    return (w3){d8_mad(d8_mul(a.x, s), b.x, t), d8_mad(d8_mul(a.y, s), b.y, t),
                d8_mad(d8_mul(a.z, s), b.z, t)};
}
static inline w3 w3_if_lt(d8 p, d8 q, w3 a, w3 b) {
    return (w3){d8_if_lt(p, q, a.x, b.x), d8_if_lt(p, q, a.y, b.y), d8_if_lt(p, q, a.z, b.z)};
}
/* a^T M b */
static inline d8 d8_form(const d8 m[6], w3 a, w3 b) {
    return w3_dot(a, w3_apply(m, b));
}

static inline d8 largest_entry(const d8 m[6]) {
    d8 most = d8_abs(m[0]);
    for (int i = 1; i < 6; ++i) most = d8_max(most, d8_abs(m[i]));
    return most;
}

/* The unit eigenvector of the simple eigenvalue `value`: it is perpendicular to the two most independent rows
 * of b - value I. */
static inline w3 null_vector(const d8 b[6], d8 value) {
    w3 r0 = {d8_sub(b[0], value), b[1], b[2]}, r1 = {b[1], d8_sub(b[3], value), b[4]};
    w3 r2 = {b[2], b[4], d8_sub(b[5], value)};
    w3 c01 = w3_cross(r0, r1), c02 = w3_cross(r0, r2), c12 = w3_cross(r1, r2), best = c01;
    d8 most = w3_dot(c01, c01), d02 = w3_dot(c02, c02), d12 = w3_dot(c12, c12);
    best = w3_if_lt(most, d02, c02, best);
    most = d8_max(most, d02);
    best = w3_if_lt(most, d12, c12, best);
    most = d8_max(most, d12);
    return w3_scale(best, d8_div(d8_set(1), d8_sqrt(most)));
}

/* cos(acos(r) / 3) for r in [0, 1]: the root of 4 c^3 - 3 c = r in [cos(pi / 6), 1]. */
static inline d8 largest_root(d8 r) {
    d8 c = d8_mad(d8_set(-0.0408812), d8_set(0.00944362), r);
    c = d8_mad(d8_set(0.866062), r, d8_mad(d8_set(0.165404), c, r)); /* within .00004 */
    for (int i = 0; i < 2; ++i) {
        d8 cc4 = d8_mul(d8_set(4), d8_mul(c, c)), three = d8_set(3);
        d8 excess = d8_sub(d8_mul(d8_sub(cc4, three), c), r);
        c = d8_sub(c, d8_div(excess, d8_sub(d8_mul(three, cc4), three)));
    }
    return c;
}

/* Cosine and sine of half the angle of (x, y), which lies in (-pi, pi]. If x and y are below 2^-1000, the
 * angle is 0. */
static inline void half_angle(d8 x, d8 y, d8 *c, d8 *s) {
    d8 none = d8_set(0), one = d8_set(1), half = d8_set(0.5), largest = d8_max(d8_abs(x), d8_abs(y));
    d8 least = d8_set(0x1p-1000), known = d8_if_lt(least, largest, one, none);
    d8 invert = d8_div(one, d8_max(largest, least)); /* because squares of tiny numbers lose their digits */
    x = d8_mul(x, invert), y = d8_mul(y, invert);
    d8 h = d8_div(one, d8_sqrt(d8_mad(d8_mul(x, x), y, y)));
    d8 cosine = d8_mul(x, h), sine = d8_mul(y, h);
    d8 large = d8_sqrt(d8_mad(half, half, d8_abs(cosine))); /* the larger of the two, at least sqrt(1/2) */
    d8 small = d8_div(d8_mul(half, d8_abs(sine)), large);
    d8 sign = d8_if_lt(y, none, d8_set(-1), one);
    *c = d8_if_lt(none, known, d8_if_lt(x, none, small, large), one);
    *s = d8_if_lt(none, known, d8_mul(sign, d8_if_lt(x, none, large, small)), none);
}

/* Two unit vectors that complete w to a right-handed frame (u, v, w) (Duff et al. 2017). */
static inline void build_frame(w3 w, w3 *u, w3 *v) {
    d8 one = d8_set(1), sign = d8_if_lt(w.z, d8_set(0), d8_set(-1), one), minus = d8_set(-1);
    d8 a = d8_div(minus, d8_add(sign, w.z)), c = d8_mul(d8_mul(w.x, w.y), a);
    *u = (w3){d8_mad(one, sign, d8_mul(d8_mul(w.x, w.x), a)), d8_mul(sign, c),
              d8_mul(minus, d8_mul(sign, w.x))};
    *v = (w3){c, d8_mad(sign, d8_mul(w.y, w.y), a), d8_mul(minus, w.y)};
}

/* Divides m by its largest entry and returns that entry. */
static inline d8 scale_to_unit(d8 m[6]) {
    d8 largest = largest_entry(m), tiny = d8_set(0x1p-1000), one = d8_set(1);
    d8 boost = d8_if_lt(largest, tiny, d8_set(0x1p500), one); /* because 1 / tiny overflows */
    d8 invert = d8_div(one, d8_mul(largest, boost));
    for (int i = 0; i < 6; ++i) m[i] = d8_mul(d8_mul(m[i], boost), invert);
    return largest;
}

/* Unit eigenvectors by ascending eigenvalue. No lane of a is diagonal, and its entries are at most 1. */
static inline void find_vectors(const d8 a[6], w3 vectors[3]) {
    d8 one = d8_set(1), b[6], third = d8_mul(d8_add(d8_add(a[0], a[3]), a[5]), d8_set(1.0 / 3));
    for (int i = 0; i < 6; ++i) b[i] = i == 0 || i == 3 || i == 5 ? d8_sub(a[i], third) : a[i];
    scale_to_unit(b); /* because the entries of b may be far below 1 */
    d8 diagonal = d8_mad(d8_mad(d8_mul(b[0], b[0]), b[3], b[3]), b[5], b[5]);
    d8 others = d8_mad(d8_mad(d8_mul(b[1], b[1]), b[2], b[2]), b[4], b[4]);
    d8 p = d8_sqrt(d8_mul(d8_mad(diagonal, d8_set(2), others), d8_set(1.0 / 6))), reciprocal = d8_div(one, p);
    for (int i = 0; i < 6; ++i) b[i] = d8_mul(b[i], reciprocal);
    d8 r = d8_mul(b[0], d8_sub(d8_mul(b[3], b[5]), d8_mul(b[4], b[4])));
    r = d8_sub(r, d8_mul(b[1], d8_sub(d8_mul(b[1], b[5]), d8_mul(b[4], b[2]))));
    r = d8_mul(d8_set(0.5), d8_mad(r, b[2], d8_sub(d8_mul(b[1], b[4]), d8_mul(b[3], b[2]))));
    d8 none = d8_set(0), apart = d8_mul(d8_set(2), largest_root(d8_min(d8_abs(r), one)));
    w3 w = null_vector(b, d8_if_lt(r, none, d8_mul(apart, d8_set(-1)), apart)), u, v;
    build_frame(w, &u, &v);
    d8 uu = d8_form(a, u, u), uv = d8_form(a, u, v), vv = d8_form(a, v, v), c, s;
    half_angle(d8_sub(uu, vv), d8_add(uv, uv), &c, &s);
    /* the vector of the greater eigenvalue of the plane; its sign makes both frames right-handed */
    w3 greater = w3_scale(w3_mix(u, c, v, s), d8_set(-1)), lesser = w3_mix(v, c, u, d8_mul(s, d8_set(-1)));
    vectors[0] = w3_if_lt(r, none, w, lesser);
    vectors[1] = w3_if_lt(r, none, lesser, greater);
    vectors[2] = w3_if_lt(r, none, greater, w);
}

/* Rounding may swap nearly equal eigenvalues, so the function sorts them. */
static inline void find_values(const d8 a[6], d8 scale, const w3 vectors[3], d8 values[3]) {
    d8 f[3];
    for (int i = 0; i < 3; ++i) f[i] = d8_mul(scale, d8_form(a, vectors[i], vectors[i]));
    d8 low = d8_min(f[0], f[1]), high = d8_max(f[0], f[1]), rest = d8_min(high, f[2]);
    values[0] = d8_min(low, rest), values[1] = d8_max(low, rest), values[2] = d8_max(high, f[2]);
}

/* Coordinate axes, ordered by (entry, axis). */
static void solve_diagonal(const double entries[3], double values[3], v3 vectors[3]) {
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

static inline void set_lane(d8 *a, int lane, double value) {
    double all[8];
    d8_store(all, *a);
    all[lane] = value;
    *a = d8_load(all);
}

static void solve_diagonal_lane(const d8 m[6], int lane, d8 values[3], d8 vectors[3][3]) {
    double entries[3][8], own[3];
    v3 axes[3];
    for (int i = 0; i < 3; ++i) d8_store(entries[i], m[i == 0 ? 0 : i == 1 ? 3 : 5]);
    solve_diagonal((const double[3]){entries[0][lane], entries[1][lane], entries[2][lane]}, own, axes);
    for (int i = 0; i < 3; ++i) {
        if (values) set_lane(&values[i], lane, own[i]);
        set_lane(&vectors[i][0], lane, axes[i].x);
        set_lane(&vectors[i][1], lane, axes[i].y);
        set_lane(&vectors[i][2], lane, axes[i].z);
    }
}

void fct_eigen3_eight(const d8 m[6], d8 values[3], d8 vectors[3][3]) {
    static const double stand_in[6] = {1, 0.5, 0, 2, 0, 3};
    d8 none = d8_set(0), most = d8_max(d8_max(d8_abs(m[1]), d8_abs(m[2])), d8_abs(m[4])), a[6];
    uint32_t diagonal = 255 & ~d8_lt(none, most);
    w3 found[3];
    for (int i = 0; i < 6; ++i) a[i] = d8_if_lt(none, most, m[i], d8_set(stand_in[i]));
    d8 scale = scale_to_unit(a);
    find_vectors(a, found);
    if (values) find_values(a, scale, found, values);
    for (int i = 0; i < 3; ++i)
        vectors[i][0] = found[i].x, vectors[i][1] = found[i].y, vectors[i][2] = found[i].z;
    for (int i = 0; diagonal >> i; ++i)
        if (diagonal >> i & 1) solve_diagonal_lane(m, i, values, vectors);
}

void fct_eigen3(const double m[6], double values[3], v3 vectors[3]) {
    d8 matrix[6], all_values[3], all_vectors[3][3];
    for (int i = 0; i < 6; ++i) matrix[i] = d8_set(m[i]);
    fct_eigen3_eight((const d8 *)matrix, all_values, all_vectors);
    for (int i = 0; i < 3; ++i) {
        double value[8], v[3][8];
        d8_store(value, all_values[i]);
        for (int k = 0; k < 3; ++k) d8_store(v[k], all_vectors[i][k]);
        values[i] = value[0], vectors[i] = (v3){v[0][0], v[1][0], v[2][0]};
    }
}
