/* cluster/shape/sums.c: sums over the surface of a cluster, in double: of triangles, four at a time, and of
 * the union of two clusters.
 *
 * The covariance is Z (8.6), integrated over the surface instead of summed over points. That of a triangle is
 * area / 36 times the sum of the outer products of its three sides. That of a union follows from (8.10): both
 * parts move to the common centroid. The moment is D of (8.14), weighted by area, and the vector is -e. A
 * triangle without area weighs 1e-20 of its longest squared side in centroid and covariance, so that clusters
 * of such faces have both.
 */
#include "cluster/shape/sums.h"

#include <assert.h>
#include <stddef.h>

#include "base/math/simd.h"

#define W3_LANES d4
#include "base/math/w3.h"

static inline w3 load_corners(const float *const rows[4]) {
    d4 m[4];
    for (int i = 0; i < 4; ++i) m[i] = d4_load_floats(rows[i]);
    d4_transpose(m);
    return w3_load(m);
}
static inline d4 third_add(d4 a, d4 b, d4 c) {
    return d4_add(a, d4_mul(d4_set(1.0 / 3), d4_add(b, c)));
}
static inline d4 sum3(d4 a, d4 b, d4 c) {
    return d4_add(d4_add(a, b), c);
}

void fct_sums_four(const float *const corners[3][4], fct_sums *out, float (*normals)[4]) {
    static_assert(sizeof(fct_sums) == 20 * sizeof(double), "rows of four");
    const d4 none = d4_set(0);
    w3 p = load_corners(corners[0]), u = w3_sub(load_corners(corners[1]), p),
       v = w3_sub(load_corners(corners[2]), p);
    w3 e = w3_sub(v, u), s = w3_scale(w3_cross(u, v), d4_set(0.5));
    d4 area = d4_sqrt(w3_dot(s, s)), longest = d4_max(w3_dot(u, u), d4_max(w3_dot(v, v), w3_dot(e, e)));
    d4 weight = d4_if_lt(none, area, area, d4_mul(d4_set(1e-20), longest));
    d4 inverse = d4_div(d4_set(1), area), bounded = d4_if_lt(none, area, inverse, none);
    w3 n = w3_scale(s, inverse), m = w3_scale(s, bounded);
    d4 share = d4_mul(weight, d4_set(1.0 / 36)); /* of the outer products of the sides */
    d4 rows[20] = {
        area,
        weight,
        d4_mul(m.x, s.x),
        d4_mul(m.x, s.y),
        d4_mul(m.x, s.z),
        d4_mul(m.y, s.y),
        d4_mul(m.y, s.z),
        d4_mul(m.z, s.z),
        d4_mul(share, sum3(d4_mul(u.x, u.x), d4_mul(v.x, v.x), d4_mul(e.x, e.x))),
        d4_mul(share, sum3(d4_mul(u.x, u.y), d4_mul(v.x, v.y), d4_mul(e.x, e.y))),
        d4_mul(share, sum3(d4_mul(u.x, u.z), d4_mul(v.x, v.z), d4_mul(e.x, e.z))),
        d4_mul(share, sum3(d4_mul(u.y, u.y), d4_mul(v.y, v.y), d4_mul(e.y, e.y))),
        d4_mul(share, sum3(d4_mul(u.y, u.z), d4_mul(v.y, v.z), d4_mul(e.y, e.z))),
        d4_mul(share, sum3(d4_mul(u.z, u.z), d4_mul(v.z, v.z), d4_mul(e.z, e.z))),
        s.x,
        s.y,
        s.z,
        third_add(p.x, u.x, v.x),
        third_add(p.y, u.y, v.y),
        third_add(p.z, u.z, v.z),
    };
    for (int i = 0; i < 20; i += 4) {
        d4_transpose(rows + i);
        for (int k = 0; k < 4; ++k) d4_store((double *)&out[k] + i, rows[i + k]);
    }
    d4 turned[4] = {n.x, n.y, n.z, none};
    d4_transpose(turned);
    for (int k = 0; k < 4; ++k) d4_store_floats(normals[k], turned[k]);
}

void fct_sums_face(const float *positions, const uint32_t triangle[3], fct_sums *out) {
    float rows[3][4] = {{0}}, normals[4][4];
    const float *corners[3][4];
    fct_sums all[4];
    for (int k = 0; k < 3; ++k) {
        for (int j = 0; j < 3; ++j) rows[k][j] = positions[3 * (size_t)triangle[k] + (size_t)j];
        for (int i = 0; i < 4; ++i) corners[k][i] = rows[k];
    }
    fct_sums_four((const float *const(*)[4])corners, all, normals);
    *out = all[0];
}

void fct_sums_join(const fct_sums *a, const fct_sums *b, fct_sums *out) {
    double weight = a->weight + b->weight, share = weight > 0 ? b->weight / weight : 0.5;
    v3 d = v3_sub(b->center, a->center);
    out->area = a->area + b->area;
    out->weight = weight;
    out->vector = v3_add(a->vector, b->vector);
    out->center = v3_mad(a->center, share, d);
    for (int i = 0; i < 6; ++i) {
        out->moment[i] = a->moment[i] + b->moment[i];
        out->covariance[i] = a->covariance[i] + b->covariance[i];
    }
    sym3_add_outer(out->covariance, a->weight * share, d);
}
