/* Quadrics against squared distances, and the elimination of attributes against dense solves. */
#include "../oracle.h"

enum { MAX = 3 + QUADRIC_MAX_ATTRIBUTES };

static void a_plane_measures_the_squared_distance(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int round = 0; round < 50; ++round) {
        double q[POSITION_QUADRIC] = {0}, want[POSITION_QUADRIC] = {0};
        v3 n[3], p[3], v = random_vector(&seed);
        double weights[3], value = 0, trace = 0;
        v3 slope = {0, 0, 0};
        for (int k = 0; k < 3; ++k) {
            n[k] = v3_unit(random_vector(&seed)), p[k] = random_vector(&seed),
            weights[k] = between(&seed, .1, 9);
            quadric_add_plane(q, n[k], p[k], weights[k]);
            double distance = v3_dot(n[k], v3_sub(v, p[k]));
            value += weights[k] * distance * distance, trace += weights[k];
            slope = v3_mad(slope, weights[k] * distance, n[k]);
        }
        assert_close(quadric_at(q, v), value, 1e-12);
        assert_close(quadric_trace(q), trace, 1e-12);
        v3 g = quadric_gradient(q, v);
        assert_close(g.x, slope.x, 1e-12);
        assert_close(g.y, slope.y, 1e-12);
        assert_close(g.z, slope.z, 1e-12);
        assert_true(q[10] == want[10]); /* a constraint plane has no area */
    }
}

/* `planes` random 2-planes, with weights, summed by the library and remembered for the oracle. */
typedef struct sum {
    uint32_t m, planes;
    double x[6][3][MAX], weights[6], q[MAX_QUADRIC];
} sum;

static sum make_sum(uint32_t m, uint32_t planes, uint64_t *seed) {
    sum s = {.m = m, .planes = planes};
    for (uint32_t k = 0; k < planes; ++k) {
        double q[MAX_QUADRIC] = {0};
        s.weights[k] = between(seed, .2, 3);
        for (int i = 0; i < 3; ++i)
            for (uint32_t j = 0; j < 3 + m; ++j) s.x[k][i][j] = between(seed, -1, 1);
        fct_quadric_of_plane(q, m, s.x[k]);
        assert_close(q[10], 1, 0);
        for (uint32_t i = 0; i < quadric_size(m); ++i) s.q[i] += s.weights[k] * q[i];
    }
    return s;
}

static double sum_distances(const sum *s, const double *v) {
    double value = 0;
    for (uint32_t k = 0; k < s->planes; ++k)
        value += s->weights[k] * squared_distance((int)(3 + s->m), s->x[k][0], s->x[k][1], s->x[k][2], v);
    return value;
}

static void a_face_with_attributes_measures_the_squared_distance(void **state) {
    (void)state;
    uint64_t seed = 2;
    for (uint32_t m = 0; m <= QUADRIC_MAX_ATTRIBUTES; ++m)
        for (int round = 0; round < 20; ++round) {
            sum s = make_sum(m, 4, &seed);
            double v[MAX], none[MAX] = {0};
            for (uint32_t i = 0; i < 3 + m; ++i) v[i] = between(&seed, -2, 2);
            v3 p = {v[0], v[1], v[2]};
            assert_close(fct_quadric_value(s.q, m, p, v + 3), sum_distances(&s, v), 1e-10);
            memcpy(none, v, 3 * sizeof *v);
            assert_close(quadric_at(s.q, p), sum_distances(&s, none), 1e-10);
        }
}

static void a_face_whose_corners_are_in_line_measures_the_line(void **state) {
    (void)state;
    double x[3][MAX] = {{1, 2, 0}, {2, 2, 0}, {4, 2, 0}}, q[MAX_QUADRIC];
    fct_quadric_of_plane(q, 0, x);
    assert_close(quadric_at(q, (v3){9, 5, 4}), 9 + 16, 1e-12);
}

/* The function that elimination minimises. */
static double regular_value(const sum *s, const double *v, const double *prior, double ridge) {
    double value = sum_distances(s, v);
    for (uint32_t i = 0; i < s->m; ++i) value += ridge * (v[3 + i] - prior[i]) * (v[3 + i] - prior[i]);
    return value;
}

/* The best attributes by a dense solve: the matrix and the right side are differences of the function, which
 * is quadratic. */
static void solve_attributes(const sum *s, const double *prior, double ridge, double *v) {
    double a[MAX * MAX], b[MAX];
    uint32_t m = s->m;
    for (uint32_t i = 0; i < m; ++i) v[3 + i] = 0;
    double zero = regular_value(s, v, prior, ridge);
    for (uint32_t i = 0; i < m; ++i) {
        double up, down;
        v[3 + i] = 1, up = regular_value(s, v, prior, ridge);
        v[3 + i] = -1, down = regular_value(s, v, prior, ridge);
        v[3 + i] = 0;
        b[i] = -.5 * (up - down), a[i * m + i] = up + down - 2 * zero;
        for (uint32_t j = 0; j < i; ++j) {
            double both, first, second;
            v[3 + i] = v[3 + j] = 1, both = regular_value(s, v, prior, ridge);
            v[3 + j] = 0, first = regular_value(s, v, prior, ridge);
            v[3 + i] = 0, v[3 + j] = 1, second = regular_value(s, v, prior, ridge);
            v[3 + j] = 0;
            a[i * m + j] = a[j * m + i] = both - first - second + zero;
        }
    }
    solve_dense((int)m, a, b);
    for (uint32_t i = 0; i < m; ++i) v[3 + i] = b[i];
}

static void elimination_leaves_the_best_attributes(void **state) {
    (void)state;
    uint64_t seed = 3;
    for (uint32_t m = 1; m <= QUADRIC_MAX_ATTRIBUTES; ++m)
        for (int round = 0; round < 10; ++round) {
            sum s = make_sum(m, 6, &seed);
            double prior[QUADRIC_MAX_ATTRIBUTES], got[QUADRIC_MAX_ATTRIBUTES], v[MAX],
                ridge = round % 2 ? .3 : 1e-3;
            for (uint32_t i = 0; i < m; ++i) prior[i] = between(&seed, -1, 1);
            fct_elimination e;
            fct_quadric_eliminate(s.q, m, prior, ridge, &e);
            assert_close(e.position[10], s.q[10], 0);
            for (int k = 0; k < 5; ++k) {
                v3 p = random_vector(&seed);
                v3_to_array(p, v);
                solve_attributes(&s, prior, ridge, v);
                fct_quadric_attributes(&e, m, p, got);
                for (uint32_t i = 0; i < m; ++i) assert_close(got[i], v[3 + i], 1e-7);
                assert_close(quadric_at(e.position, p), regular_value(&s, v, prior, ridge), 1e-8);
            }
        }
}

static void attributes_without_any_weight_become_zero(void **state) {
    (void)state;
    double q[MAX_QUADRIC] = {0}, prior[2] = {3, 4}, got[2];
    fct_elimination e;
    quadric_add_plane(q, (v3){0, 0, 1}, (v3){0, 0, 2}, 5);
    fct_quadric_eliminate(q, 2, prior, 0, &e);
    fct_quadric_attributes(&e, 2, (v3){1, 1, 1}, got);
    assert_true(got[0] == 0 && got[1] == 0);
    assert_close(quadric_at(e.position, (v3){0, 0, 5}), 45, 1e-12);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plane_measures_the_squared_distance),
        cmocka_unit_test(a_face_with_attributes_measures_the_squared_distance),
        cmocka_unit_test(a_face_whose_corners_are_in_line_measures_the_line),
        cmocka_unit_test(elimination_leaves_the_best_attributes),
        cmocka_unit_test(attributes_without_any_weight_become_zero),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
