/* cluster/merge/metric.c: fit, direction and shape error of a union, from the records of its parts, eight
 * unions at a time.
 *
 * INCREMENT, C = a1 D(w E_fit) + a2 2 (|Sa| + |Sb| - |Sa + Sb|) + a3 (w E_shape + 5e9 wa wb w |xb - xa|^2 (1
 * - |S| / w)): the growth of the total error. MEAN, E = a1 E_fit + a2 E_dir + a3 E_shape (8.18). E_shape is
 * (8.17), with its factor 2.
 *
 * Degenerate answers. No area: direction and shape errors weigh nothing in INCREMENT; E_dir is 0 and
 * E_shape 1/2 in MEAN. Points on a line: fit 0. A mean normal that cancels: the plane across the direction in
 * which the points spread least, by the adjugate's largest column. A border that closes earns
 * a bonus of at most 1000.
 */
#include "cluster/merge/metric.h"

#include <string.h>

#include "base/math/simd.h"

#define TINY 1e-30f

fct_metric fct_metric_make(const fct_tree_def *def, const fct_bounds *bounds) {
    bool mean = def->cost == FCT_COST_MEAN;
    v3 lower = v3_load(bounds->lower), upper = v3_load(bounds->upper);
    double diagonal = v3_norm(v3_sub(upper, lower));
    fct_metric metric = {.cost = def->cost, .measure = def->fit_measure};
    metric.fit_weight = def->fit_weight >= 0 ? def->fit_weight : mean ? 1e6 : 1e4;
    metric.direction_weight = def->direction_weight >= 0 ? def->direction_weight : 1;
    metric.shape_weight = def->shape_weight >= 0 ? def->shape_weight : mean ? 1 : 0.002;
    metric.origin = v3_scale(v3_add(lower, upper), 0.5);
    metric.scale = diagonal > 0 ? 1 / diagonal : 1;
    return metric;
}

/* Records turned on their side: one field of eight clusters in each vector. */
typedef union lanes {
    struct {
        f8 covariance[6], centroid[3];
        i8 count;
        f8 vector[3], area, perimeter, fit;
    };
    f8 rows[16];
} lanes;

_Static_assert(sizeof(fct_record) == 16 * sizeof(float) && sizeof(lanes) == 16 * sizeof(f8),
               "field for field");

/* A record is half in one row, half in another, before the rows are turned. */
static inline void load_record(const fct_record *record, uint32_t row, lanes *to) {
    memcpy(&to->rows[row], record, sizeof *to->rows);
    memcpy(&to->rows[row + 8], (const char *)record + sizeof *to->rows, sizeof *to->rows);
}
static inline void store_record(const lanes *from, uint32_t row, fct_record *record) {
    memcpy(record, &from->rows[row], sizeof *from->rows);
    memcpy((char *)record + sizeof *from->rows, &from->rows[row + 8], sizeof *from->rows);
}

static inline f8 f8_mad(f8 a, f8 b, f8 c) {
    return f8_add(a, f8_mul(b, c));
}
static inline f8 f8_twice(f8 a) {
    return f8_add(a, a);
}
static inline f8 at_least(f8 a, float least) {
    return f8_max(a, f8_set(least));
}
static inline f8 dot3(const f8 a[3], const f8 b[3]) {
    return f8_mad(f8_mad(f8_mul(a[0], b[0]), a[1], b[1]), a[2], b[2]);
}

/* The sums of a triangle, as doubles. */
typedef struct face_sums {
    d4 covariance[6], centroid[3], vector[3], area;
} face_sums;

/* Of four triangles, by their corners in the mesh's coordinates. */
static inline void sum_faces(const fct_metric *metric, const d4 corners[3][3], face_sums *out) {
    const double origin[3] = {metric->origin.x, metric->origin.y, metric->origin.z};
    d4 third = d4_set(1.0 / 3), scale = d4_set(metric->scale), spokes[3][3], *s = out->vector;
    for (int k = 0; k < 3; ++k) { /* from the centroid */
        d4 p = d4_mul(d4_sub(corners[1][k], corners[0][k]), scale);
        d4 q = d4_mul(d4_sub(corners[2][k], corners[0][k]), scale), center = d4_mul(d4_add(p, q), third);
        spokes[0][k] = d4_sub(d4_set(0), center);
        spokes[1][k] = d4_sub(p, center), spokes[2][k] = d4_sub(q, center);
        out->centroid[k] = d4_add(d4_mul(d4_sub(corners[0][k], d4_set(origin[k])), scale), center);
    }
    /* half the cross product of two sides is 3/2 times that of two spokes */
    for (int k = 0; k < 3; ++k) {
        int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
        s[k] = d4_mul(d4_set(1.5),
                      d4_sub(d4_mul(spokes[1][i], spokes[2][j]), d4_mul(spokes[1][j], spokes[2][i])));
    }
    out->area = d4_sqrt(d4_add(d4_add(d4_mul(s[0], s[0]), d4_mul(s[1], s[1])), d4_mul(s[2], s[2])));
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

/* A whole FCT_LANES of pairs, the first again where there are fewer. */
typedef struct pair_lanes {
    fct_pair pairs[FCT_LANES];
} pair_lanes;

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

/* The whole measure: the area, or the number of points. */
static inline f8 weight_of(const fct_metric *metric, const lanes *l) {
    return metric->measure == FCT_FIT_AREA ? l->area : f8_mul(f8_set(3), f8_from(l->count));
}

/* 1 over the union's area, and over its weight, which is the same where the measure is the area. */
static inline void invert(const fct_metric *metric, const lanes *a, const lanes *b, f8 *area, f8 *weight) {
    f8 one = f8_set(1);
    *area = *weight = f8_div(one, at_least(f8_add(a->area, b->area), TINY));
    if (metric->measure == FCT_FIT_POINTS)
        *weight = f8_div(one, f8_add(weight_of(metric, a), weight_of(metric, b)));
}

/* (8.17) from perimeters and the shares of the union's area: worst / g = max(pa^2 / a, pb^2 / b) / p^2. */
static inline f8 shape_error(const lanes *a, const lanes *b, const lanes *u, f8 invert_area) {
    f8 one = f8_set(1), none = f8_set(0), share = f8_mul(b->area, invert_area),
       rest = f8_mul(a->area, invert_area);
    f8 worst = f8_max(f8_mul(f8_mul(a->perimeter, a->perimeter), share),
                      f8_mul(f8_mul(b->perimeter, b->perimeter), rest));
    f8 joined = f8_mul(f8_mul(f8_mul(u->perimeter, u->perimeter), share), rest);
    f8 error = f8_sub(one, f8_div(worst, f8_twice(at_least(joined, TINY))));
    return f8_if_lt(none, worst, at_least(error, -1000), f8_set(0.5f));
}

/* Sums of the union about its own centroid; all but its fit. */
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

/* n^T C n */
static inline f8 form(const f8 c[6], const f8 n[3]) {
    f8 x = f8_mad(f8_mul(c[0], n[0]), f8_set(2), f8_mad(f8_mul(c[1], n[1]), c[2], n[2]));
    f8 y = f8_mad(f8_mul(c[3], n[1]), f8_twice(c[4]), n[2]);
    return f8_mad(f8_mad(f8_mul(n[0], x), n[1], y), f8_mul(c[5], n[2]), n[2]);
}

/* Least spread of the covariance, as a total over the measure: one step of inverse iteration from the mean
 * normal, which is as good as an eigen solve here and a tenth of its time. */
static inline f8 least_spread(const lanes *u, f8 invert_area) {
    f8 trace = f8_add(f8_add(u->covariance[0], u->covariance[3]), u->covariance[5]);
    f8 invert = f8_div(f8_set(1), at_least(trace, TINY)), c[6];
    for (int i = 0; i < 6; ++i) c[i] = f8_mul(u->covariance[i], invert);
    f8 adjugate[6] = {
        f8_sub(f8_mul(c[3], c[5]), f8_mul(c[4], c[4])), f8_sub(f8_mul(c[2], c[4]), f8_mul(c[1], c[5])),
        f8_sub(f8_mul(c[1], c[4]), f8_mul(c[2], c[3])), f8_sub(f8_mul(c[0], c[5]), f8_mul(c[2], c[2])),
        f8_sub(f8_mul(c[1], c[2]), f8_mul(c[0], c[4])), f8_sub(f8_mul(c[0], c[3]), f8_mul(c[1], c[1]))};
    f8 one = f8_set(1), none = f8_set(0);
    f8 largest = f8_max(f8_max(f8_abs(u->vector[0]), f8_abs(u->vector[1])), f8_abs(u->vector[2]));
    /* where S cancels: the column of the adjugate with the largest diagonal entry */
    f8 yz = f8_max(adjugate[3], adjugate[5]), x = f8_if_lt(adjugate[0], yz, none, one);
    f8 y = f8_mul(f8_sub(one, x), f8_if_lt(adjugate[3], adjugate[5], none, one));
    f8 start[3] = {x, y, f8_sub(f8_sub(one, x), y)}, s[3], n[3], limit = f8_mul(f8_set(1e-4f), u->area);
    for (int i = 0; i < 3; ++i) s[i] = f8_if_lt(limit, largest, f8_mul(u->vector[i], invert_area), start[i]);
    static const int matrix[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    for (int i = 0; i < 3; ++i)
        n[i] = f8_mad(f8_mad(f8_mul(adjugate[matrix[i][0]], s[0]), adjugate[matrix[i][1]], s[1]),
                      adjugate[matrix[i][2]], s[2]);
    f8 nn = dot3(n, n), ss = dot3(s, s), before = form(c, s), after = form(c, n);
    /* the smaller quotient, after / nn or before / ss */
    f8 cross = f8_if_lt(f8_set(TINY), nn, f8_mul(after, ss), f8_set(INFINITY)), other = f8_mul(before, nn);
    f8 spread = f8_div(f8_if_lt(cross, other, after, before), at_least(f8_if_lt(cross, other, nn, ss), TINY));
    return f8_mul(trace, at_least(spread, 0));
}

static inline f8 total_fit(const fct_metric *metric, const lanes *u, f8 invert_area, f8 invert_weight) {
    f8 spread = least_spread(u, invert_area);
    return metric->measure == FCT_FIT_AREA ? spread : f8_mul(f8_mul(spread, u->area), invert_weight);
}

/* 2 (|a| + |b| - |a + b|). Near-parallel vectors go by their cross product, for the difference has no digits
 * left on fine meshes. */
static inline f8 direction_growth(const lanes *a, const lanes *b, const lanes *u, f8 invert_area) {
    f8 p[3], q[3], s[3];
    for (int i = 0; i < 3; ++i) {
        p[i] = f8_mul(a->vector[i], invert_area), q[i] = f8_mul(b->vector[i], invert_area);
        s[i] = f8_add(p[i], q[i]);
    }
    f8 cross[3] = {f8_sub(f8_mul(p[1], q[2]), f8_mul(p[2], q[1])),
                   f8_sub(f8_mul(p[2], q[0]), f8_mul(p[0], q[2])),
                   f8_sub(f8_mul(p[0], q[1]), f8_mul(p[1], q[0]))};
    f8 lp = f8_sqrt(dot3(p, p)), lq = f8_sqrt(dot3(q, q)), ls = f8_sqrt(dot3(s, s)), dot = dot3(p, q);
    f8 product = f8_mul(lp, lq), sum = f8_add(f8_add(lp, lq), ls), none = f8_set(0);
    f8 over = f8_if_lt(none, dot, dot3(cross, cross), f8_sub(product, dot));
    f8 under = f8_if_lt(none, dot, f8_mul(f8_add(product, dot), sum), sum);
    return f8_mul(f8_mul(u->area, f8_set(4)), f8_div(over, at_least(under, TINY)));
}

void fct_metric_costs(const fct_metric *metric, const fct_record *records, const fct_pair *pairs,
                      uint32_t count, float *costs) {
    lanes a, b, u;
    f8 invert_area, invert_weight;
    pair_lanes filled;
    pairs = fill_up(pairs, count, &filled);
    load_lanes(records, pairs, false, &a);
    load_lanes(records, pairs, true, &b);
    invert(metric, &a, &b, &invert_area, &invert_weight);
    join(metric, &a, &b, load_shared(pairs), invert_weight, &u);
    f8 fit = at_least(f8_sub(f8_sub(total_fit(metric, &u, invert_area, invert_weight), a.fit), b.fit), 0);
    f8 cost = f8_mul(f8_set((float)metric->fit_weight), fit);
    cost = f8_mad(cost, f8_set((float)metric->direction_weight), direction_growth(&a, &b, &u, invert_area));
    f8 shape = f8_mul(u.area, shape_error(&a, &b, &u, invert_area));
    cost = f8_mad(cost, f8_set((float)metric->shape_weight), shape);
    float all[FCT_LANES];
    f8_store(all, cost);
    memcpy(costs, all, count * sizeof *costs);
}

void fct_metric_merges(const fct_metric *metric, fct_record *records, const fct_pair *pairs, uint32_t count) {
    lanes a, b, u;
    f8 invert_area, invert_weight;
    pair_lanes filled;
    pairs = fill_up(pairs, count, &filled);
    load_lanes(records, pairs, false, &a);
    load_lanes(records, pairs, true, &b);
    invert(metric, &a, &b, &invert_area, &invert_weight);
    join(metric, &a, &b, load_shared(pairs), invert_weight, &u);
    u.fit = total_fit(metric, &u, invert_area, invert_weight);
    f8_transpose(u.rows);
    f8_transpose(u.rows + 8);
    for (uint32_t i = 0; i < count; ++i) store_record(&u, i, &records[pairs[i].a]);
}
