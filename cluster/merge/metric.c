/* cluster/merge/metric.c: the cost INCREMENT of a merge, the growth of the total error, in floats.
 *
 * C = a1 D(w E_fit) + a2 2 (|Sa| + |Sb| - |S|) + a3 w E_shape f
 * D(x) is x of the union less x of both parts; S = Sa + Sb and w are its area vector and area. The direction
 * term is the growth of the area-weighted squared deviation of unit normals from the mean normal (L2,1).
 * E_shape is (8.17). f grows from .05 on flat ground to 1 where 1 - |S| / w, half the mean squared deviation
 * of the union, reaches .001.
 *
 * Degenerate clusters: without area all terms are 0. Collinear points: the fit is 0. E_shape is 1/2 where
 * both perimeters are 0, and at least -1000, which a union without perimeter gets.
 */
#include "cluster/merge/metric.h"

#include <string.h>

#include "base/math/simd.h"

#define W3_LANES f8
#include "base/math/w3.h"

/* The least divisor. */
#define TINY 1e-30f

/* The part of the shape weight that flat ground gets, and 1 - |S| / w from which on a union gets all of it.
 * Flat ground needs shape only to break ties, and a full weight there takes clusters from bent ground: L2,1
 * of fandisk at 1000 clusters is 1.1e-4 with the full weight everywhere and 1.7e-5 so. */
#define FLAT_SHARE 0.05f
#define FULL_BEND  0.001f

/* Eight records: each vector holds one field of all of them. */
typedef union lanes {
    struct {
        f8 covariance[6], centroid[3];
        i8 count;
        f8 vector[3], area, perimeter, fit;
    };
    f8 rows[16];
} lanes;

_Static_assert(sizeof(fct_record) == 16 * sizeof(float) && sizeof(lanes) == 16 * sizeof(f8),
               "lanes has the fields of fct_record");

/* Before its transposition rows[0..7] hold the first halves of eight records, rows[8..15] the second. */
static inline void load_record(const fct_record *record, uint32_t row, lanes *to) {
    memcpy(&to->rows[row], record, sizeof *to->rows);
    memcpy(&to->rows[row + 8], (const char *)record + sizeof *to->rows, sizeof *to->rows);
}
static inline void store_record(const lanes *from, uint32_t row, fct_record *record) {
    memcpy(record, &from->rows[row], sizeof *from->rows);
    memcpy((char *)record + sizeof *from->rows, &from->rows[row + 8], sizeof *from->rows);
}

static inline f8 f8_twice(f8 a) {
    return f8_add(a, a);
}
static inline f8 at_least(f8 a, float least) {
    return f8_max(a, f8_set(least));
}
/* The sums of four triangles. */
typedef struct face_sums {
    d4 covariance[6], centroid[3], vector[3], area;
} face_sums;

/* From corners[corner][coordinate], in the mesh's coordinates. */
static inline void sum_faces(const fct_metric *metric, const d4 corners[3][3], face_sums *out) {
    const double origin[3] = {metric->origin.x, metric->origin.y, metric->origin.z};
    d4 third = d4_set(1.0 / 3), scale = d4_set(metric->scale), spokes[3][3], *s = out->vector;
    for (int k = 0; k < 3; ++k) { /* spokes: from the centroid to the corners */
        d4 p = d4_mul(d4_sub(corners[1][k], corners[0][k]), scale);
        d4 q = d4_mul(d4_sub(corners[2][k], corners[0][k]), scale), center = d4_mul(d4_add(p, q), third);
        spokes[0][k] = d4_sub(d4_set(0), center);
        spokes[1][k] = d4_sub(p, center), spokes[2][k] = d4_sub(q, center);
        out->centroid[k] = d4_add(d4_mul(d4_sub(corners[0][k], d4_set(origin[k])), scale), center);
    }
    /* the cross product of two spokes is a third of that of two sides */
    for (int k = 0; k < 3; ++k) {
        int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
        s[k] = d4_mul(d4_set(1.5),
                      d4_sub(d4_mul(spokes[1][i], spokes[2][j]), d4_mul(spokes[1][j], spokes[2][i])));
    }
    out->area = d4_sqrt(d4_add(d4_add(d4_mul(s[0], s[0]), d4_mul(s[1], s[1])), d4_mul(s[2], s[2])));
    /* (8.6) over the corners; over the surface, the integral is area / 12 times the sum over the corners */
    d4 weight = metric->measure == FCT_FIT_POINTS ? d4_set(1) : d4_mul(out->area, d4_set(1.0 / 12));
    static const int rows[6] = {0, 0, 0, 1, 1, 2}, columns[6] = {0, 1, 2, 1, 2, 2};
    for (int i = 0; i < 6; ++i) {
        d4 sum = d4_mul(spokes[0][rows[i]], spokes[0][columns[i]]);
        for (int c = 1; c < 3; ++c) sum = d4_add(sum, d4_mul(spokes[c][rows[i]], spokes[c][columns[i]]));
        out->covariance[i] = d4_mul(sum, weight);
    }
}

void fct_metric_faces(const fct_metric *metric, const float *positions, const uint32_t *triangles,
                      const float *perimeters, uint32_t count, fct_record *records) {
    face_sums sums[2];
    lanes out;
    float borders[FCT_LANES];
    for (int half = 0; half < 2; ++half) {
        d4 corners[3][3];
        for (uint32_t c = 0; c < 3; ++c) {
            const float *p[4];
            for (uint32_t i = 0; i < 4; ++i) {
                uint32_t face = 4 * (uint32_t)half + i;
                p[i] = positions + 3 * (size_t)triangles[3 * (face < count ? face : 0) + c];
            }
            d4_load_points(p, corners[c]);
        }
        sum_faces(metric, corners, &sums[half]);
    }
    for (uint32_t i = 0; i < FCT_LANES; ++i) borders[i] = perimeters[i < count ? i : 0];
    for (int i = 0; i < 6; ++i) out.covariance[i] = f8_narrow(sums[0].covariance[i], sums[1].covariance[i]);
    for (int k = 0; k < 3; ++k) {
        out.centroid[k] = f8_narrow(sums[0].centroid[k], sums[1].centroid[k]);
        out.vector[k] = f8_narrow(sums[0].vector[k], sums[1].vector[k]);
    }
    out.area = f8_narrow(sums[0].area, sums[1].area);
    out.count = i8_set(1);
    out.perimeter = f8_load(borders);
    out.fit = f8_set(0);
    f8_transpose(out.rows);
    f8_transpose(out.rows + 8);
    for (uint32_t i = 0; i < count; ++i) {
        store_record(&out, i, &records[i]);
    }
}

/* FCT_LANES pairs. */
typedef struct pair_lanes {
    fct_pair pairs[FCT_LANES];
} pair_lanes;

/* Repeats the first pair where there are fewer than FCT_LANES. */
static inline const fct_pair *fill_up(const fct_pair *pairs, uint32_t count, pair_lanes *filled) {
    if (count == FCT_LANES) return pairs;
    for (uint32_t i = 0; i < FCT_LANES; ++i) filled->pairs[i] = pairs[i < count ? i : 0];
    return filled->pairs;
}

static inline void load_lanes(const fct_record *records, const fct_pair *pairs, bool second, lanes *out) {
    for (uint32_t i = 0; i < FCT_LANES; ++i) {
        load_record(&records[second ? pairs[i].b : pairs[i].a], i, out);
    }
    f8_transpose(out->rows);
    f8_transpose(out->rows + 8);
}

static inline f8 load_shared(const fct_pair *pairs) {
    float shared[FCT_LANES];
    for (uint32_t i = 0; i < FCT_LANES; ++i) shared[i] = pairs[i].shared;
    return f8_load(shared);
}

/* c of (8.3): the number of corners, or the area. */
static inline f8 weight_of(const fct_metric *metric, const lanes *l) {
    return metric->measure == FCT_FIT_AREA ? l->area : f8_mul(f8_set(3), f8_from(l->count));
}

/* 1 / area and 1 / weight of the union. */
static inline void invert(const fct_metric *metric, const lanes *a, const lanes *b, f8 *area, f8 *weight) {
    f8 one = f8_set(1);
    *area = *weight = f8_div(one, at_least(f8_add(a->area, b->area), TINY));
    if (metric->measure == FCT_FIT_POINTS)
        *weight = f8_div(one, f8_add(weight_of(metric, a), weight_of(metric, b)));
}

/* (8.17). Both sides of max(g1, g2) / g (8.16) are multiplied by the areas, so that a part without area
 * counts. */
static inline f8 shape_error(const lanes *a, const lanes *b, const lanes *u, f8 invert_area) {
    f8 one = f8_set(1), none = f8_set(0), share = f8_mul(b->area, invert_area),
       rest = f8_mul(a->area, invert_area);
    f8 worst = f8_max(f8_mul(f8_mul(a->perimeter, a->perimeter), share),
                      f8_mul(f8_mul(b->perimeter, b->perimeter), rest));
    f8 joined = f8_mul(f8_mul(f8_mul(u->perimeter, u->perimeter), share), rest);
    f8 error = f8_sub(one, f8_div(worst, f8_twice(at_least(joined, TINY))));
    return f8_if_lt(none, worst, at_least(error, -1000), f8_set(0.5f));
}

/* The record of the union, except its fit. By (8.7) to (8.10), Z of the union is the sum of both parts' Z and
 * of wa wb / (wa + wb) d d^T, where d goes from one centroid to the other. */
static inline void join(const fct_metric *metric, const lanes *a, const lanes *b, f8 shared, f8 invert_weight,
                        lanes *u) {
    f8 d[3], wa = weight_of(metric, a), wb = weight_of(metric, b), none = f8_set(0);
    f8 share = f8_if_lt(none, f8_add(wa, wb), f8_mul(wb, invert_weight), f8_set(0.5f));
    f8 k = f8_mul(wa, share);
    for (int i = 0; i < 3; ++i) {
        d[i] = f8_sub(b->centroid[i], a->centroid[i]);
        u->centroid[i] = f8_mad(a->centroid[i], share, d[i]);
        u->vector[i] = f8_add(a->vector[i], b->vector[i]);
    }
    static const int rows[6] = {0, 0, 0, 1, 1, 2}, columns[6] = {0, 1, 2, 1, 2, 2};
    for (int i = 0; i < 6; ++i)
        u->covariance[i] =
            f8_mad(f8_add(a->covariance[i], b->covariance[i]), f8_mul(k, d[rows[i]]), d[columns[i]]);
    u->count = i8_add(a->count, b->count);
    u->area = f8_add(a->area, b->area);
    u->perimeter = f8_max(f8_sub(f8_add(a->perimeter, b->perimeter), f8_twice(shared)), none);
}

/* The adjugate of m, in the same order. */
static inline void adjugate(const f8 m[6], f8 out[6]) {
    out[0] = f8_sub(f8_mul(m[3], m[5]), f8_mul(m[4], m[4]));
    out[1] = f8_sub(f8_mul(m[2], m[4]), f8_mul(m[1], m[5]));
    out[2] = f8_sub(f8_mul(m[1], m[4]), f8_mul(m[2], m[3]));
    out[3] = f8_sub(f8_mul(m[0], m[5]), f8_mul(m[2], m[2]));
    out[4] = f8_sub(f8_mul(m[1], m[2]), f8_mul(m[0], m[4]));
    out[5] = f8_sub(f8_mul(m[0], m[3]), f8_mul(m[1], m[1]));
}

/* 1 / sqrt(a). The processor divides and takes the root at the same time. */
static inline f8 invert_root(f8 a) {
    a = at_least(a, TINY);
    return f8_mul(f8_sqrt(a), f8_div(f8_set(1), a));
}

/* The search for the least eigenvalue of Z (8.11), in three steps. It is the sum of squared distances to the
 * best plane, because P (8.4) is n^T Z n at the best d = -n^T b / c. Within 4e-5 of itself and 1.5e-7 of the
 * trace of the eigenvalue in double. Each step waits long for its roots and divisions, so that the processor
 * gains if several searches take a step before any takes the next. */
typedef struct spread_search {
    f8 trace, c[6]; /* c = Z / trace */
    f8 size;        /* p^2 of find_apart */
    f8 apart[3];    /* a multiple of the eigenvector of the eigenvalue that stands apart */
} spread_search;

static inline void start_search(const lanes *l, spread_search *s) {
    f8 third = f8_set(1.0f / 3);
    s->trace = f8_add(f8_add(l->covariance[0], l->covariance[3]), l->covariance[5]);
    f8 invert = f8_div(f8_set(1), at_least(s->trace, TINY)), *c = s->c;
    for (int i = 0; i < 6; ++i) c[i] = f8_mul(l->covariance[i], invert);
    f8 x = f8_sub(c[0], third), y = f8_sub(c[3], third), z = f8_sub(c[5], third);
    f8 diagonal = f8_mad(f8_mad(f8_mul(x, x), y, y), z, z);
    f8 others = f8_mad(f8_mad(f8_mul(c[1], c[1]), c[2], c[2]), c[4], c[4]);
    s->size = f8_mul(f8_add(diagonal, f8_twice(others)), f8_set(1.0f / 6));
}

/* With B = (c - I / 3) / p and tr B^2 = 6, the eigenvalue of B that stands apart from the other two is
 * 2 cos(acos(r) / 3), r = det B / 2, with the sign of r. The polynomial is within 4e-5 of the cosine, and the
 * eigenvector within as much of its own, which changes no Rayleigh quotient by more than 2e-9. Smith,
 * "Eigenvalues of a symmetric 3x3 matrix", CACM 4(4), 1961. */
static inline void find_apart(spread_search *s) {
    f8 third = f8_set(1.0f / 3), invert = invert_root(s->size), a[6], *u = s->apart;
    f8 b[6] = {f8_sub(s->c[0], third), s->c[1], s->c[2],
               f8_sub(s->c[3], third), s->c[4], f8_sub(s->c[5], third)};
    for (int i = 0; i < 6; ++i) b[i] = f8_mul(b[i], invert);
    adjugate(b, a);
    f8 r = f8_mul(f8_set(0.5f), f8_mad(f8_mad(f8_mul(b[0], a[0]), b[1], a[1]), b[2], a[2]));
    f8 x = f8_min(f8_abs(r), f8_set(1)), cosine = f8_mad(f8_set(-0.0408812f), f8_set(0.00944362f), x);
    cosine = f8_mad(f8_set(0.866062f), x, f8_mad(f8_set(0.165404f), cosine, x));
    f8 value = f8_copysign(f8_twice(cosine), r);
    b[0] = f8_sub(b[0], value), b[3] = f8_sub(b[3], value), b[5] = f8_sub(b[5], value);
    /* the adjugate of B - value I is a multiple of u u^T: its column with the largest diagonal entry */
    adjugate(b, a);
    f8 xx = f8_abs(a[0]), yy = f8_abs(a[3]), zz = f8_abs(a[5]), most = f8_max(xx, yy);
    u[0] = f8_if_lt(xx, yy, a[1], a[0]), u[1] = f8_if_lt(xx, yy, a[3], a[1]);
    u[2] = f8_if_lt(xx, yy, a[4], a[2]);
    u[0] = f8_if_lt(most, zz, a[2], u[0]), u[1] = f8_if_lt(most, zz, a[4], u[1]);
    u[2] = f8_if_lt(most, zz, a[5], u[2]);
}

/* The least of the Rayleigh quotient of the eigenvector u that stands apart and of the lesser eigenvalue of
 * the 2x2 matrix (ee ef; ef ff) across u. */
static inline f8 finish_search(const spread_search *s) {
    f8 one = f8_set(1), minus = f8_set(-1);
    w3 u = w3_load(s->apart);
    u = w3_scale(u, invert_root(w3_dot(u, u)));
    /* unit vectors e, f across u (Duff et al. 2017) */
    f8 sign = f8_copysign(one, u.z), a = f8_div(minus, f8_add(sign, u.z)), xy = f8_mul(f8_mul(u.x, u.y), a);
    w3 e = {f8_mad(one, f8_mul(sign, f8_mul(u.x, u.x)), a), f8_mul(sign, xy),
            f8_mul(minus, f8_mul(sign, u.x))};
    w3 f = {xy, f8_mad(sign, f8_mul(u.y, u.y), a), f8_mul(minus, u.y)};
    w3 cu = w3_apply(s->c, u), ce = w3_apply(s->c, e), cf = w3_apply(s->c, f);
    f8 ee = w3_dot(e, ce), ef = w3_dot(f, ce), ff = w3_dot(f, cf), squared = f8_mul(ef, ef);
    f8 half = f8_mul(f8_set(0.5f), f8_abs(f8_sub(ee, ff))), root = f8_sqrt(f8_mad(squared, half, half));
    f8 lesser = f8_sub(f8_min(ee, ff), f8_div(squared, at_least(f8_add(half, root), TINY)));
    return f8_mul(s->trace, at_least(f8_min(lesser, w3_dot(u, cu)), 0));
}

/* Times the spread: the fit of the union. */
static inline f8 fit_factor(const fct_metric *metric, const lanes *u, f8 invert_weight) {
    return metric->measure == FCT_FIT_AREA ? f8_set(1) : f8_mul(u->area, invert_weight);
}

/* 2 (|a| + |b| - |a + b|) of area vectors, as 4 |a x b|^2 / ((|a| |b| + a.b) (|a| + |b| + |a + b|)) where
 * a.b > 0, because the plain difference loses its digits on fine meshes. *length: |a + b| / area. */
static inline f8 direction_growth(const lanes *a, const lanes *b, const lanes *u, f8 invert_area,
                                  f8 *length) {
    w3 p = w3_scale(w3_load(a->vector), invert_area), q = w3_scale(w3_load(b->vector), invert_area);
    w3 s = w3_add(p, q), cross = w3_cross(p, q);
    f8 lp = f8_sqrt(w3_dot(p, p)), lq = f8_sqrt(w3_dot(q, q)), ls = f8_sqrt(w3_dot(s, s)), dot = w3_dot(p, q);
    f8 product = f8_mul(lp, lq), sum = f8_add(f8_add(lp, lq), ls), none = f8_set(0);
    f8 over = f8_if_lt(none, dot, w3_dot(cross, cross), f8_sub(product, dot));
    f8 under = f8_if_lt(none, dot, f8_mul(f8_add(product, dot), sum), sum);
    *length = ls;
    return f8_mul(f8_mul(u->area, f8_set(4)), f8_div(over, at_least(under, TINY)));
}

/* f of the file's header, from |S| / w. */
static inline f8 shape_share(f8 length) {
    f8 bend = f8_mul(f8_sub(f8_set(1), length), f8_set(1 / FULL_BEND));
    return f8_min(at_least(bend, FLAT_SHARE), f8_set(1));
}

/* Eight merges whose costs are found step by step. */
typedef struct pricing {
    spread_search spread;
    f8 fit_factor, fit_of_parts, rest; /* rest: the terms of direction and shape */
} pricing;

static inline void start_pricing(const fct_metric *metric, const fct_record *records, const fct_pair *pairs,
                                 pricing *p) {
    lanes a, b, u;
    f8 invert_area, invert_weight, length;
    load_lanes(records, pairs, false, &a);
    load_lanes(records, pairs, true, &b);
    invert(metric, &a, &b, &invert_area, &invert_weight);
    join(metric, &a, &b, load_shared(pairs), invert_weight, &u);
    start_search(&u, &p->spread);
    p->fit_factor = fit_factor(metric, &u, invert_weight);
    p->fit_of_parts = f8_add(a.fit, b.fit);
    f8 direction = direction_growth(&a, &b, &u, invert_area, &length);
    f8 shape = f8_mul(f8_mul(u.area, shape_share(length)), shape_error(&a, &b, &u, invert_area));
    p->rest = f8_mul(f8_set((float)metric->direction_weight), direction);
    p->rest = f8_mad(p->rest, f8_set((float)metric->shape_weight), shape);
}

static inline f8 finish_pricing(const fct_metric *metric, const pricing *p) {
    f8 fit = f8_sub(f8_mul(finish_search(&p->spread), p->fit_factor), p->fit_of_parts);
    return f8_mad(p->rest, f8_set((float)metric->fit_weight), at_least(fit, 0));
}

/* times FCT_LANES merges take each step of the search together; more gain nothing */
enum { BATCH = 4 };

void fct_metric_costs(const fct_metric *metric, const fct_record *records, const fct_pair *pairs,
                      uint32_t count, float *costs) {
    pricing batch[BATCH];
    for (uint32_t done = 0; done < count; done += BATCH * FCT_LANES) {
        const uint32_t left = count - done, size = left < BATCH * FCT_LANES ? left : BATCH * FCT_LANES,
                       octets = (size + FCT_LANES - 1) / FCT_LANES;
        for (uint32_t i = 0; i < octets; ++i) {
            const uint32_t first = done + i * FCT_LANES, rest = count - first;
            pair_lanes filled;
            start_pricing(metric, records,
                          fill_up(pairs + first, rest < FCT_LANES ? rest : FCT_LANES, &filled), &batch[i]);
        }
        for (uint32_t i = 0; i < octets; ++i) find_apart(&batch[i].spread);
        for (uint32_t i = 0; i < octets; ++i) {
            float all[FCT_LANES];
            f8_store(all, finish_pricing(metric, &batch[i]));
            const uint32_t rest = size - i * FCT_LANES;
            memcpy(costs + done + i * FCT_LANES, all, (rest < FCT_LANES ? rest : FCT_LANES) * sizeof *costs);
        }
    }
}

void fct_metric_merges(const fct_metric *metric, fct_record *records, const fct_pair *pairs, uint32_t count) {
    lanes a, b, u;
    f8 invert_area, invert_weight;
    pair_lanes filled;
    spread_search spread;
    pairs = fill_up(pairs, count, &filled);
    load_lanes(records, pairs, false, &a);
    load_lanes(records, pairs, true, &b);
    invert(metric, &a, &b, &invert_area, &invert_weight);
    join(metric, &a, &b, load_shared(pairs), invert_weight, &u);
    start_search(&u, &spread);
    find_apart(&spread);
    u.fit = f8_mul(finish_search(&spread), fit_factor(metric, &u, invert_weight));
    f8_transpose(u.rows);
    f8_transpose(u.rows + 8);
    for (uint32_t i = 0; i < count; ++i) store_record(&u, i, &records[pairs[i].a]);
}
