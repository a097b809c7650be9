/* Elementary functions against the C library in long double, over their ranges. */
#include "support.h"

#include "base/math/elementary.h"

static double next_unit(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

/* The distance in units of the last place of the expected value. */
static double count_ulps(double found, long double expected) {
    double unit = ldexp(1, ilogb((double)expected) - 52);
    return (double)(fabsl((long double)found - expected) / (long double)unit);
}

static void sines_and_cosines(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 100000; ++i) {
        double x = (2 * next_unit(&seed) - 1) * (i % 3 == 0 ? 1e5 : i % 3 == 1 ? 7 : 1e-3);
        assert_true(fabsl((long double)fct_sin(x) - sinl((long double)x)) < 1e-15L);
        assert_true(fabsl((long double)fct_cos(x) - cosl((long double)x)) < 1e-15L);
        double sine, cosine;
        fct_sine_cosine(x, &sine, &cosine);
        assert_true(sine == fct_sin(x) && cosine == fct_cos(x));
        if (fabs(x) < 0.7) assert_true(x == 0 || count_ulps(fct_sin(x), sinl((long double)x)) < 4);
    }
    assert_true(fct_sin(0) == 0 && fct_cos(0) == 1);
}

static void arcs(void **state) {
    (void)state;
    uint64_t seed = 2;
    for (int i = 0; i < 100000; ++i) {
        double x = 2 * next_unit(&seed) - 1, y = (2 * next_unit(&seed) - 1) * ldexp(1, i % 60 - 30);
        assert_true(count_ulps(fct_atan2(y, x), atan2l((long double)y, (long double)x)) < 4);
        assert_true(count_ulps(fct_asin(x), asinl((long double)x)) < 4);
        assert_true(count_ulps(fct_acos(x), acosl((long double)x)) < 4);
    }
    assert_true(fct_atan2(0, 0) == 0 && fct_atan2(0, 1) == 0 && fct_acos(1) == 0 && fct_asin(0) == 0);
    assert_true(fct_atan2(0, -1) == acos(-1) && fct_acos(-1) == acos(-1) && fct_asin(-1) == -fct_asin(1));
}

static void logarithms_and_powers(void **state) {
    (void)state;
    uint64_t seed = 3;
    for (int i = 0; i < 100000; ++i) {
        double x = ldexp(0.5 + next_unit(&seed), i % 200 - 100), e = 100 * (2 * next_unit(&seed) - 1);
        long double logarithm = log2l((long double)x);
        assert_true(fabsl((long double)fct_log2(x) - logarithm) <= 4 * 0x1p-52L * (1 + fabsl(logarithm)));
        assert_true(count_ulps(fct_exp2(e), exp2l((long double)e)) < 4);
        assert_true(count_ulps(fct_root(x, 3), powl((long double)x, 1 / 3.0L)) < 4);
        assert_true(count_ulps(fct_root(x, 5), powl((long double)x, 1 / 5.0L)) < 4);
    }
    for (int k = -60; k <= 60; ++k) {
        assert_true(fct_log2(ldexp(1, k)) == k);
        assert_true(fct_exp2(k) == ldexp(1, k));
    }
    assert_true(fct_root(0, 3) == 0 && fct_root(0, 5) == 0 && fct_root(27, 3) == 3 && fct_root(32, 5) == 2);
}

static void large_angles_are_reduced(void **state) {
    (void)state;
    for (int i = 0; i < 1000; ++i) {
        double x = 1e5 + 997.25 * i;
        assert_true(fabs(fct_sin(x) - sin(x)) < 1e-9 && fabs(fct_cos(-x) - cos(x)) < 1e-9);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(large_angles_are_reduced),
        cmocka_unit_test(sines_and_cosines),
        cmocka_unit_test(arcs),
        cmocka_unit_test(logarithms_and_powers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
