/* Vectors and symmetric matrices against sums over components, which the test writes with loops. */
#include "support.h"

#include "base/math/vec.h"

static double next(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0 * 2 - 1;
}

static void near(double value, double expected) {
    assert_true(fabs(value - expected) <= 1e-14 * (1 + fabs(expected)));
}

static void near_vector(v3 value, const double expected[3]) {
    near(value.x, expected[0]), near(value.y, expected[1]), near(value.z, expected[2]);
}

/* e_ijk: 1 for even permutations of 0 1 2, -1 for odd ones. */
static int sign_of(int i, int j, int k) {
    return (j - i) * (k - j) * (k - i) / 2;
}

static void vectors_are_sums_over_components(void **state) {
    (void)state;
    uint64_t seed = 11;
    for (int trial = 0; trial < 1000; ++trial) {
        double a[3], b[3], s = next(&seed), sum[3], difference[3], scaled[3], moved[3], cross[3] = {0},
                           dot = 0;
        for (int i = 0; i < 3; ++i) a[i] = next(&seed), b[i] = next(&seed);
        for (int i = 0; i < 3; ++i) {
            sum[i] = a[i] + b[i], difference[i] = a[i] - b[i], scaled[i] = a[i] * s,
            moved[i] = a[i] + s * b[i];
            dot += a[i] * b[i];
            for (int j = 0; j < 3; ++j)
                for (int k = 0; k < 3; ++k) cross[i] += sign_of(i, j, k) * a[j] * b[k];
        }
        v3 x = v3_make(a[0], a[1], a[2]), y = v3_make(b[0], b[1], b[2]);
        near_vector(v3_add(x, y), sum);
        near_vector(v3_sub(x, y), difference);
        near_vector(v3_scale(x, s), scaled);
        near_vector(v3_mad(x, s, y), moved);
        near_vector(v3_cross(x, y), cross);
        near(v3_dot(x, y), dot);
        near(v3_norm2(x), a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
        near(v3_norm(x), sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]));
        near(v3_norm(v3_unit(x)), 1);
        near(v3_dot(v3_unit(x), x), v3_norm(x));
        float stored[3];
        v3_store(stored, x);
        for (int i = 0; i < 3; ++i) assert_true(stored[i] == (float)a[i]);
        near_vector(v3_load(stored), (const double[3]){stored[0], stored[1], stored[2]});
    }
    v3 zero = v3_unit(v3_make(0, 0, 0));
    assert_true(zero.x == 0 && zero.y == 0 && zero.z == 0);
}

static void frames_are_right_handed(void **state) {
    (void)state;
    uint64_t seed = 5;
    for (int trial = 0; trial < 1000; ++trial) {
        v3 n = v3_unit(v3_make(next(&seed), next(&seed), next(&seed))), t, b;
        if (trial < 2) n = v3_make(0, 0, trial ? 1 : -1);
        v3_frame(n, &t, &b);
        near(v3_norm(t), 1), near(v3_norm(b), 1);
        near(v3_dot(t, b), 0), near(v3_dot(t, n), 0), near(v3_dot(b, n), 0);
        near_vector(v3_cross(t, b), (const double[3]){n.x, n.y, n.z});
    }
}

static void symmetric_matrices_are_full_ones(void **state) {
    (void)state;
    uint64_t seed = 7;
    static const int place[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    for (int trial = 0; trial < 1000; ++trial) {
        double m[6], a[3], b[3], s = next(&seed), form = 0, image[3] = {0}, full[3][3];
        for (int i = 0; i < 6; ++i) m[i] = next(&seed);
        for (int i = 0; i < 3; ++i) a[i] = next(&seed), b[i] = next(&seed);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                form += a[i] * m[place[i][j]] * b[j];
                image[i] += m[place[i][j]] * a[j];
                full[i][j] = m[place[i][j]] + s * a[i] * a[j];
            }
        v3 x = v3_make(a[0], a[1], a[2]), y = v3_make(b[0], b[1], b[2]);
        near(sym3_form(m, x, y), form);
        near_vector(sym3_apply(m, x), image);
        sym3_add_outer(m, s, x);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) near(m[place[i][j]], full[i][j]);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(vectors_are_sums_over_components),
                                       cmocka_unit_test(frames_are_right_handed),
                                       cmocka_unit_test(symmetric_matrices_are_full_ones)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
