/* Records of unions and costs of merges against their formulas in double, for random records instead of those
 * of a mesh: parts that are closed, without area, or share more border than they have.
 */
#include "oracle.h"

#include "cluster/merge/mean.h"

enum { CASES = 4000 };

static double random_in(uint32_t *seed, double low, double high) {
    *seed = *seed * 1664525u + 1013904223u;
    return low + (high - low) * ((*seed >> 8) / 16777216.0);
}

/* A covariance of three random points about their mean, and what else a record holds. One in eight has no
 * area, one in eight no perimeter. */
static fct_record make_record(uint32_t *seed) {
    fct_record r = {.count = 1 + (uint32_t)random_in(seed, 0, 40)};
    double size = random_in(seed, 0.01, 0.3), points[3][3];
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) points[i][k] = random_in(seed, -size, size) * (k == 2 ? 0.1 : 1);
    for (int k = 0, at = 0; k < 3; ++k)
        for (int l = k; l < 3; ++l, ++at)
            for (int i = 0; i < 3; ++i) r.covariance[at] += (float)(points[i][k] * points[i][l]);
    r.area = random_in(seed, 0, 8) < 1 ? 0 : (float)(size * size * random_in(seed, 0.5, 2));
    r.perimeter = random_in(seed, 0, 8) < 1 ? 0 : (float)(size * random_in(seed, 2, 9));
    for (int k = 0; k < 3; ++k) {
        r.centroid[k] = (float)random_in(seed, -0.3, 0.3);
        r.vector[k] = r.area * (float)random_in(seed, k == 2 ? 0.2 : -0.4, 0.55);
    }
    return r;
}

static double weight_of(fct_fit_measure measure, const fct_record *r) {
    return measure == FCT_FIT_AREA ? (double)r->area : 3.0 * r->count;
}

/* What the union of two records holds. spread: the least eigenvalue of its covariance. */
typedef struct sums {
    double covariance[6], centroid[3], vector[3], area, perimeter, weight, spread, trace;
} sums;

static sums unite(fct_fit_measure measure, const fct_record *a, const fct_record *b, double shared) {
    static const int rows[6] = {0, 0, 0, 1, 1, 2}, columns[6] = {0, 1, 2, 1, 2, 2};
    double wa = weight_of(measure, a), wb = weight_of(measure, b);
    sums u = {.area = (double)a->area + (double)b->area, .weight = wa + wb};
    double z[3][3], values[3], axes[3][3];
    for (int k = 0; k < 3; ++k) {
        double p = (double)a->centroid[k], q = (double)b->centroid[k];
        u.centroid[k] = u.weight > 0 ? (wa * p + wb * q) / u.weight : (p + q) / 2;
        u.vector[k] = (double)a->vector[k] + (double)b->vector[k];
    }
    for (int i = 0; i < 6; ++i) { /* both parts about the common centroid */
        int k = rows[i], l = columns[i];
        u.covariance[i] =
            (double)a->covariance[i] + (double)b->covariance[i] +
            wa * ((double)a->centroid[k] - u.centroid[k]) * ((double)a->centroid[l] - u.centroid[l]) +
            wb * ((double)b->centroid[k] - u.centroid[k]) * ((double)b->centroid[l] - u.centroid[l]);
        z[k][l] = z[l][k] = u.covariance[i];
    }
    u.perimeter = fmax((double)a->perimeter + (double)b->perimeter - 2 * shared, 0);
    oracle_eigen(z, values, axes);
    u.spread = fmax(values[0], 0), u.trace = values[0] + values[1] + values[2];
    return u;
}

/* Area times E_fit. */
static double fit_of(fct_fit_measure measure, const sums *u) {
    return measure == FCT_FIT_AREA ? u->spread : u->weight > 0 ? u->spread * u->area / u->weight : 0;
}

/* (8.17), with the areas multiplied out, so that a part without area counts. */
static double shape_of(const fct_record *a, const fct_record *b, const sums *u) {
    double pa = (double)a->perimeter, pb = (double)b->perimeter, aa = (double)a->area, ab = (double)b->area;
    double worst = fmax(pa * pa * ab, pb * pb * aa) * u->area, joined = u->perimeter * u->perimeter * aa * ab;
    if (!(worst > 0)) return 0.5;
    return joined > 0 ? fmax(1 - worst / (2 * joined), -1000) : -1000;
}

static void check_close(const char *what, int number, double found, double expected, double slack) {
    if (!(fabs(found - expected) <= slack))
        fail_msg("case %d: %s is %.9g, should be %.9g", number, what, found, expected);
}

static void check_record(int number, fct_fit_measure measure, const fct_record *r, const sums *u) {
    for (int i = 0; i < 6; ++i)
        check_close("covariance", number, (double)r->covariance[i], u->covariance[i], 1e-6 * u->trace);
    for (int k = 0; k < 3; ++k) {
        check_close("centroid", number, (double)r->centroid[k], u->centroid[k], 1e-6);
        check_close("vector", number, (double)r->vector[k], u->vector[k], 1e-6 * u->area);
    }
    check_close("area", number, (double)r->area, u->area, 1e-6 * u->area);
    check_close("perimeter", number, (double)r->perimeter, u->perimeter, 1e-6);
    double factor = u->spread > 0 ? fit_of(measure, u) / u->spread : 0;
    check_close("fit", number, (double)r->fit, fit_of(measure, u),
                factor * (1e-4 * u->spread + 5e-7 * u->trace));
}

static void unions_hold_the_sums_of_their_parts(void **state) {
    (void)state;
    uint32_t seed = 1;
    for (int number = 0; number < CASES; number += FCT_LANES) {
        fct_metric metric = {.measure = number % 16 ? FCT_FIT_AREA : FCT_FIT_POINTS};
        fct_record records[2 * FCT_LANES], before[2 * FCT_LANES];
        fct_pair pairs[FCT_LANES];
        uint32_t count = 1 + (uint32_t)random_in(&seed, 0, FCT_LANES);
        for (uint32_t i = 0; i < 2 * FCT_LANES; ++i) before[i] = records[i] = make_record(&seed);
        for (uint32_t i = 0; i < FCT_LANES; ++i) {
            const fct_record *a = &records[2 * i], *b = &records[2 * i + 1];
            double most = fmin((double)a->perimeter, (double)b->perimeter);
            pairs[i] = (fct_pair){2 * i + i % 2, 2 * i + 1 - i % 2, (float)random_in(&seed, 0, 1.3 * most)};
        }
        fct_metric_merges(&metric, records, pairs, count);
        for (uint32_t i = 0; i < FCT_LANES; ++i) {
            const fct_record *a = &before[pairs[i].a], *b = &before[pairs[i].b];
            sums u = unite(metric.measure, a, b, (double)pairs[i].shared);
            assert_memory_equal(&records[pairs[i].b], b, sizeof *b);
            if (i >= count) {
                assert_memory_equal(&records[pairs[i].a], a, sizeof *a);
                continue;
            }
            assert_int_equal(records[pairs[i].a].count, a->count + b->count);
            check_record(number + (int)i, metric.measure, &records[pairs[i].a], &u);
        }
    }
}

/* One term at a time. */
static void costs_are_the_growth_of_each_term(void **state) {
    (void)state;
    uint32_t seed = 2;
    for (int number = 0; number < CASES; ++number) {
        int term = number % 3;
        fct_metric metric = {.measure = number % 2 ? FCT_FIT_AREA : FCT_FIT_POINTS,
                             .fit_weight = term == 0,
                             .direction_weight = term == 1,
                             .shape_weight = term == 2};
        fct_record r[2] = {make_record(&seed), make_record(&seed)};
        fct_pair pair = {0, 1, 0};
        double most = fmin((double)r[0].perimeter, (double)r[1].perimeter), slack, expected;
        pair.shared = (float)random_in(&seed, 0, 1.1 * most);
        sums u = unite(metric.measure, &r[0], &r[1], (double)pair.shared);
        double factor = u.spread > 0 ? fit_of(metric.measure, &u) / u.spread : 0, vectors[2];
        float cost;
        for (int k = 0; k < 2; ++k) {
            r[k].fit = (float)(fit_of(metric.measure, &u) * random_in(&seed, 0, 0.6));
            const double v[3] = {(double)r[k].vector[0], (double)r[k].vector[1], (double)r[k].vector[2]};
            vectors[k] = oracle_norm(v);
        }
        fct_metric_costs(&metric, r, &pair, 1, &cost);
        double length = oracle_norm(u.vector), shape = shape_of(&r[0], &r[1], &u);
        double share =
            u.area > 0 ? fmin(fmax((1 - length / u.area) / 0.001, 0.05), 1) : 0.05; /* of the shape weight */
        if (term == 0) {
            expected = fmax(fit_of(metric.measure, &u) - (double)r[0].fit - (double)r[1].fit, 0);
            slack = factor * (1e-4 * u.spread + 5e-7 * u.trace);
        } else if (term == 1) {
            expected = 2 * (vectors[0] + vectors[1] - length);
            slack = 1e-5 * expected + 1e-6 * u.area;
        } else {
            expected = u.area * share * shape;
            double rest = fmax(u.perimeter, 1e-9); /* what rounding does to a small perimeter */
            slack = u.area * (1e-5 + fabs(shape) * (1e-4 + 1e-5 * most / rest));
            if (u.perimeter < 1e-4 * most) continue;
        }
        check_close("cost", number, (double)cost, expected, slack);
    }
}

/* The reference in double. The moment counts in the cost alone, so the record keeps the sum. */
static void the_reference_sums_too(void **state) {
    (void)state;
    uint32_t seed = 3;
    for (int number = 0; number < CASES / 4; ++number) {
        fct_record r[2] = {make_record(&seed), make_record(&seed)};
        fct_mean_record m[2];
        double most = fmin((double)r[0].perimeter, (double)r[1].perimeter);
        double shared = random_in(&seed, 0, 1.3 * most), moments[2][6];
        for (int k = 0; k < 2; ++k) {
            m[k] = (fct_mean_record){.centroid = v3_load(r[k].centroid),
                                     .weight = weight_of(FCT_FIT_AREA, &r[k]),
                                     .vector = v3_load(r[k].vector),
                                     .area = (double)r[k].area,
                                     .perimeter = (double)r[k].perimeter};
            for (int i = 0; i < 6; ++i) {
                m[k].covariance[i] = (double)r[k].covariance[i];
                m[k].moment[i] = moments[k][i] = random_in(&seed, -1, 1);
            }
        }
        sums u = unite(FCT_FIT_AREA, &r[0], &r[1], shared);
        fct_mean_merge(&m[0], &m[1], shared);
        const double centroid[3] = {m[0].centroid.x, m[0].centroid.y, m[0].centroid.z};
        const double vector[3] = {m[0].vector.x, m[0].vector.y, m[0].vector.z};
        for (int i = 0; i < 6; ++i) {
            check_close("covariance", number, m[0].covariance[i], u.covariance[i], 1e-13);
            check_close("moment", number, m[0].moment[i], moments[0][i] + moments[1][i], 1e-13);
        }
        for (int k = 0; k < 3; ++k) {
            check_close("centroid", number, centroid[k], u.centroid[k], 1e-13);
            check_close("vector", number, vector[k], u.vector[k], 1e-13);
        }
        check_close("area", number, m[0].area, u.area, 1e-13);
        check_close("weight", number, m[0].weight, u.weight, 1e-13);
        check_close("perimeter", number, m[0].perimeter, u.perimeter, 1e-13);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(unions_hold_the_sums_of_their_parts),
                                       cmocka_unit_test(costs_are_the_growth_of_each_term),
                                       cmocka_unit_test(the_reference_sums_too)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
