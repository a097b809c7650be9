/* tests/base/test_origin.c: which coordinates get a local origin. */
#include "base/math/origin.h"

#include "support.h"

static bool choose(const double (*points)[3], int count, double origin[3]) {
    fct_extent e = {0};
    for (int i = 0; i < count; ++i) fct_extent_add(&e, points[i]);
    return fct_extent_origin(&e, origin);
}

/* A square of the given side at (x, 2 x, 0). */
static bool choose_square(double x, double side, double origin[3]) {
    const double points[][3] = {{x, 2 * x, 0}, {x + side, 2 * x, 0}, {x + side, 2 * x + side, 0}};
    return choose(points, 3, origin);
}

static void far_and_fine_coordinates_get_an_origin(void **state) {
    (void)state;
    double o[3];
    assert_true(choose_square(500000.003, .01, o));
    /* The power of two that is at least .01 is 1/64. */
    for (int k = 0; k < 3; ++k) assert_true(floor(64 * o[k]) == 64 * o[k]);
    assert_true(fabs(o[0] - 500000.008) <= 1. / 128 && fabs(o[1] - 1000000.011) <= 1. / 128 && o[2] == 0);
    assert_true(choose_square(-500000.003, .01, o));
    assert_true(fabs(o[0] + 499999.998) <= 1. / 128);
    /* Millimetres: 500000.001 has as many digits as a printed float, but is none. */
    assert_true(choose_square(500000, .001, o));
    /* The largest coordinate is 2 x + side: the limit is 2 x = 63 side. */
    assert_true(choose_square(3.151, .1, o));
    assert_false(choose_square(3.149, .1, o));
    assert_true(o[0] == 0 && o[1] == 0 && o[2] == 0);
}

/* A multiple of the least power of two that is at least the side, nearest to the centre; for sides that are
 * powers of two, and others. */
static void the_origin_is_a_multiple_of_the_step(void **state) {
    (void)state;
    uint64_t seed = 3;
    for (int i = 0; i < 2000; ++i) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        double side = ldexp(i % 2 ? 1 : 1 + (double)(seed >> 40) * 0x1p-24, (int)(seed % 41) - 20), step = 1,
               o[3];
        fct_extent e = {.any = true, .fine = true};
        for (int k = 0; k < 3; ++k) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            e.lower[k] = ((double)(seed >> 33) - 0x1p30) * side / 3,
            e.upper[k] = e.lower[k] + (k == i % 3 ? side : side / 4);
        }
        double longest =
            fmax(e.upper[0] - e.lower[0], fmax(e.upper[1] - e.lower[1], e.upper[2] - e.lower[2]));
        if (i % 2)
            e.lower[i % 3] = side * floor(e.lower[i % 3] / side), e.upper[i % 3] = e.lower[i % 3] + side,
                        longest = side;
        while (step < longest) step *= 2;
        while (step / 2 >= longest) step /= 2;
        assert_true(fct_extent_origin(&e, o));
        for (int k = 0; k < 3; ++k) {
            double centre = .5 * e.lower[k] + .5 * e.upper[k];
            assert_true(o[k] / step == floor(o[k] / step) && fabs(o[k] - centre) <= .5 * step);
        }
    }
}

static void floats_get_none(void **state) {
    (void)state;
    double o[3];
    assert_false(choose_square(500000.0625, .0625, o));
    fct_extent none = {0};
    assert_false(fct_extent_origin(&none, o));
}

/* Many floats of all sizes, printed with 9 digits, have no more digits than floats. */
static void printed_floats_are_not_fine(void **state) {
    (void)state;
    uint64_t seed = 7;
    for (int i = 0; i < 20000; ++i) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        float f = ldexpf(1 + (float)(seed >> 41) / 8388608, (int)(seed % 70) - 30);
        char text[32];
        snprintf(text, sizeof text, "%.9g", (double)f);
        const double point[3] = {atof(text), 0, 0};
        fct_extent e = {0};
        fct_extent_add(&e, point);
        assert_false(e.fine);
    }
}

/* The answer does not depend on the order, nor on points that are not finite. */
static void order_does_not_matter(void **state) {
    (void)state;
    double points[6][3], o[3], p[3];
    for (int i = 0; i < 6; ++i)
        for (int k = 0; k < 3; ++k) points[i][k] = 1e6 * (k + 1) + .013 * (i * (k + 2) % 7);
    assert_true(choose(points, 6, o));
    for (int turn = 1; turn < 6; ++turn) {
        double turned[8][3] = {{NAN, 0, 0}, {0, 1e300, 0}};
        for (int i = 0; i < 6; ++i) memcpy(turned[i + 2], points[(i * 5 + turn) % 6], sizeof *turned);
        assert_true(choose(turned, 8, p));
        assert_memory_equal(o, p, sizeof o);
    }
    /* A point at zero ends it, wherever it comes. */
    for (int place = 0; place < 6; ++place) {
        double with[6][3];
        memcpy(with, points, sizeof with);
        memset(with[place], 0, sizeof with[place]);
        assert_false(choose(with, 6, p));
    }
}

static void one_point_has_none(void **state) {
    (void)state;
    double o[3];
    const double points[][3] = {{4123456.789, .1, -3}, {4123456.789, .1, -3}};
    assert_false(choose(points, 2, o));
    assert_true(o[0] == 0 && o[1] == 0 && o[2] == 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(far_and_fine_coordinates_get_an_origin),
        cmocka_unit_test(the_origin_is_a_multiple_of_the_step),
        cmocka_unit_test(floats_get_none),
        cmocka_unit_test(printed_floats_are_not_fine),
        cmocka_unit_test(order_does_not_matter),
        cmocka_unit_test(one_point_has_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
