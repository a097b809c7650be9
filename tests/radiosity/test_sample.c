/* Sample points: moments of the distributions, stratification, and Lambert's formula against integration. */
#include "place.h"
#include "radiosity/light/polygon.h"

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

/* For a density cos / pi about n: E[cos] = 2/3, E[cos^2] = 1/2, E[x^2] = 1/4 across, E[x] = 0. */
static void directions_follow_the_cosine(void **state) {
    (void)state;
    const v3 normals[4] = {{0, 0, 1}, {0, 0, -1}, {.6, -.8, 0}, {1 / 3., 2 / 3., -2 / 3.}};
    for (int k = 0; k < 4; ++k) {
        v3 n = normals[k], s, t;
        v3_frame(n, &s, &t);
        double c1 = 0, c2 = 0, x1 = 0, y1 = 0, x2 = 0, y2 = 0, xy = 0;
        enum { N = 1 << 14 };
        for (uint32_t i = 0; i < N; ++i) {
            double u[2];
            fct_plane_point(i, 17, u);
            v3 d = fct_cosine_direction(n, u[0], u[1]);
            assert_near(v3_norm(d), 1, 1e-12);
            double c = v3_dot(d, n), x = v3_dot(d, s), y = v3_dot(d, t);
            assert_true(c >= -1e-9);
            c1 += c / N, c2 += c * c / N, x1 += x / N, y1 += y / N;
            x2 += x * x / N, y2 += y * y / N, xy += x * y / N;
        }
        assert_near(c1, 2 / 3., 1e-3), assert_near(c2, .5, 1e-3);
        assert_near(x1, 0, 1e-3), assert_near(y1, 0, 1e-3);
        assert_near(x2, .25, 1e-3), assert_near(y2, .25, 1e-3), assert_near(xy, 0, 1e-3);
    }
}

/* Uniform barycentrics: each weight has mean 1/3, mean square 1/6, and the mean product of two is 1/12. */
static void points_are_uniform_in_a_triangle(void **state) {
    (void)state;
    double m[3] = {0}, m2[3] = {0}, product = 0;
    enum { N = 1 << 14 };
    for (uint32_t i = 0; i < N; ++i) {
        double u[2], b[2];
        fct_plane_point(i, 3, u);
        fct_triangle_point(u[0], u[1], b);
        double w[3] = {1 - b[0] - b[1], b[0], b[1]};
        for (int k = 0; k < 3; ++k) {
            assert_true(w[k] >= -1e-12);
            m[k] += w[k] / N, m2[k] += w[k] * w[k] / N;
        }
        product += w[1] * w[2] / N;
    }
    for (int k = 0; k < 3; ++k) assert_near(m[k], 1 / 3., 1e-3), assert_near(m2[k], 1 / 6., 1e-3);
    assert_near(product, 1 / 12., 1e-3);
}

/* Every aligned block of 2^k points has one point in each of the 2^k boxes of any shape 2^-i x 2^-(k-i). */
static void blocks_are_stratified(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed < 4; ++seed)
        for (int k = 1; k <= 6; ++k)
            for (uint32_t block = 0; block < 3; ++block)
                for (int i = 0; i <= k; ++i) {
                    uint64_t taken = 0;
                    for (uint32_t p = 0; p < 1u << k; ++p) {
                        double u[2];
                        fct_plane_point((block << k) + p, fct_hash(seed), u);
                        assert_true(u[0] >= 0 && u[0] < 1 && u[1] >= 0 && u[1] < 1);
                        uint64_t box =
                            (uint64_t)(u[0] * (1 << i)) << (k - i) | (uint64_t)(u[1] * (1 << (k - i)));
                        assert_false(taken >> box & 1);
                        taken |= (uint64_t)1 << box;
                    }
                }
}

/* Permutes every aligned block, and differs between seeds. */
static void shuffles_keep_blocks(void **state) {
    (void)state;
    uint32_t different = 0;
    for (uint32_t block = 0; block < 4; ++block) {
        uint64_t taken = 0;
        uint32_t first = fct_shuffle_index(64 * block, 99) / 64;
        for (uint32_t i = 0; i < 64; ++i) {
            uint32_t j = fct_shuffle_index(64 * block + i, 99);
            assert_int_equal(j / 64, first);
            assert_false(taken >> (j % 64) & 1);
            taken |= (uint64_t)1 << (j % 64);
            different += j != fct_shuffle_index(64 * block + i, 100);
        }
    }
    assert_true(different > 200);
}

static void hashes_are_uniform(void **state) {
    (void)state;
    double mean = 0, square = 0, lag = 0, last = .5;
    fct_random r = {42};
    enum { N = 1 << 16 };
    for (int i = 0; i < N; ++i) {
        double x = fct_random_next(&r);
        assert_true(x >= 0 && x < 1);
        mean += x / N, square += x * x / N, lag += (x - .5) * (last - .5) / N;
        last = x;
    }
    assert_near(mean, .5, 4e-3), assert_near(square, 1 / 3., 4e-3), assert_near(lag, 0, 2e-3);
    assert_true(fct_hash2(1, 2) != fct_hash2(2, 1) && fct_hash3(1, 2, 3) != fct_hash3(1, 3, 2));
}

/* Integral of cos cos' / (pi r^2) over the triangle above the horizon, on an n x n midpoint grid. */
static double integrate_triangle(const v3 p[3], v3 n, int grid) {
    v3 e1 = v3_sub(p[1], p[0]), e2 = v3_sub(p[2], p[0]), cross = v3_cross(e1, e2);
    double area = .5 * v3_norm(cross), sum = 0;
    v3 face = v3_unit(cross);
    for (int i = 0; i < grid; ++i)
        for (int j = 0; j < grid; ++j) {
            /* Two triangles per grid cell below the diagonal, one on it. */
            for (int upper = 0; upper < 2; ++upper) {
                double a = (i + (upper ? 2 / 3. : 1 / 3.)) / grid, b = (j + (upper ? 2 / 3. : 1 / 3.)) / grid;
                if (i + j + upper >= grid) continue;
                v3 y = v3_mad(v3_mad(p[0], a, e1), b, e2);
                double r2 = v3_norm2(y), height = v3_dot(y, n), toward = fabs(v3_dot(y, face));
                if (height > 0) sum += height * toward / (3.14159265358979 * r2 * r2);
            }
        }
    return sum * area / ((double)grid * grid);
}

static void lambert_equals_integration(void **state) {
    (void)state;
    for (uint64_t i = 0; i < 60; ++i) {
        v3 p[3];
        for (uint64_t k = 0; k < 3; ++k)
            p[k] = v3_make(4 * fct_uniform(fct_hash3(i, k, 0)) - 2, 4 * fct_uniform(fct_hash3(i, k, 1)) - 2,
                           3 * fct_uniform(fct_hash3(i, k, 2)) + (i % 3 ? .7 : -1));
        v3 n = v3_unit(v3_make(.3 * (double)(i % 5) - .6, .2, 1));
        /* The midpoint rule needs the triangle away from the origin. */
        v3 face = v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
        if (fabs(v3_dot(face, p[0])) < .3) continue;
        double expected = integrate_triangle(p, n, 400);
        assert_near(fct_triangle_irradiance(p, n), expected, 2e-3 * expected + 1e-5);
        v3 turned[3] = {p[0], p[2], p[1]};
        assert_near(fct_triangle_irradiance(turned, n), fct_triangle_irradiance(p, n), 1e-9);
    }
    /* The quadrant x, y > 0 of the plane z = 1 fills a quarter of the hemisphere's projection. */
    const v3 quadrant[3] = {{0, 0, 1}, {1e6, 0, 1}, {0, 1e6, 1}};
    assert_near(fct_triangle_irradiance(quadrant, v3_make(0, 0, 1)), .25, 1e-5);
    const v3 holds[3] = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
    assert_near(fct_triangle_irradiance(holds, v3_make(0, 0, 1)), 0, 1e-12);
}

static void angles_equal_atan2(void **state) {
    (void)state;
    for (int i = 0; i <= 1000; ++i) {
        double a = 3.14159265358979323846 * i / 1000;
        assert_near(fct_angle(7 * fabs(sin(a)), 7 * cos(a)), a, 2e-10);
    }
}

static void clips_keep_the_part_above(void **state) {
    (void)state;
    const v3 n = {0, 0, 1};
    v3 out[4];
    const v3 above[3] = {{0, 0, 1}, {1, 0, 1}, {0, 1, 2}}, below[3] = {{0, 0, -1}, {1, 0, -1}, {0, 1, -2}};
    assert_int_equal(fct_triangle_clip(above, n, out), 3);
    assert_int_equal(fct_triangle_clip(below, n, out), 0);
    /* One corner above: the edges cross at a quarter and at half. */
    const v3 one[3] = {{0, 0, 1}, {4, 0, -3}, {0, 2, -1}}, two[3] = {{0, 0, -1}, {4, 0, 3}, {0, 2, 1}};
    assert_int_equal(fct_triangle_clip(one, n, out), 3);
    double sum_x = out[0].x + out[1].x + out[2].x, sum_y = out[0].y + out[1].y + out[2].y;
    assert_near(sum_x, 1, 1e-12), assert_near(sum_y, 1, 1e-12);
    assert_int_equal(fct_triangle_clip(two, n, out), 4);
    for (int i = 0; i < 4; ++i) assert_true(out[i].z >= -1e-12);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directions_follow_the_cosine), cmocka_unit_test(points_are_uniform_in_a_triangle),
        cmocka_unit_test(blocks_are_stratified),        cmocka_unit_test(shuffles_keep_blocks),
        cmocka_unit_test(hashes_are_uniform),           cmocka_unit_test(lambert_equals_integration),
        cmocka_unit_test(angles_equal_atan2),           cmocka_unit_test(clips_keep_the_part_above),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
