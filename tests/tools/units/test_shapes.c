/* The meshes of `facetree make` against closed forms: areas, volumes, closed surfaces, and the noise behind
 * them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tools/make/parts.h"

static const double pi = 3.14159265358979323846;
static tool test_tool;

static const float *corner(const make_mesh *m, size_t f, int k) {
    return m->positions + 3 * (size_t)m->triangles[3 * f + (size_t)k];
}

static double mesh_area(const make_mesh *m) {
    double area = 0;
    for (size_t f = 0; f < m->face_count; ++f) {
        const float *p = corner(m, f, 0), *q = corner(m, f, 1), *r = corner(m, f, 2);
        double a[3], b[3], n = 0;
        for (int k = 0; k < 3; ++k) a[k] = q[k] - p[k], b[k] = r[k] - p[k];
        for (int k = 0; k < 3; ++k)
            n += pow(a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3], 2);
        area += .5 * sqrt(n);
    }
    return area;
}

/* Positive if the faces of a closed mesh look outwards. */
static double mesh_volume(const make_mesh *m, size_t first, size_t end) {
    double volume = 0;
    for (size_t f = first; f < end; ++f) {
        const float *p = corner(m, f, 0), *q = corner(m, f, 1), *r = corner(m, f, 2);
        for (int k = 0; k < 3; ++k)
            volume += p[k] *
                      ((double)q[(k + 1) % 3] * r[(k + 2) % 3] - (double)q[(k + 2) % 3] * r[(k + 1) % 3]) / 6;
    }
    return volume;
}

static int compare_words(const void *a, const void *b) {
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Each directed side occurs once, and its opposite too: a closed manifold, apart from touching vertices. */
static void assert_closed(const make_mesh *m) {
    size_t count = 3 * m->face_count;
    uint64_t *sides = malloc(count * sizeof *sides);
    for (size_t c = 0; c < count; ++c)
        sides[c] = (uint64_t)m->triangles[c] << 32 | m->triangles[c - c % 3 + (c + 1) % 3];
    qsort(sides, count, sizeof *sides, compare_words);
    for (size_t c = 1; c < count; ++c) assert_true(sides[c] != sides[c - 1]);
    for (size_t c = 0; c < count; ++c) {
        uint64_t back = sides[c] << 32 | sides[c] >> 32;
        assert_non_null(bsearch(&back, sides, count, sizeof *sides, compare_words));
    }
    free(sides);
}

static void assert_ratio(double got, double want, double tolerance) {
    if (fabs(got - want) <= tolerance * fabs(want)) return;
    print_error("got %g, expected %g\n", got, want);
    fail();
}

static void a_sphere_is_round_and_closed(void **state) {
    (void)state;
    for (uint32_t n = 1; n <= 12; n += 11) {
        make_mesh m = {.t = &test_tool};
        make_sphere(&m, make_p(1, 2, 3), 2, n);
        assert_int_equal(m.vertex_count, 10 * n * n + 2);
        assert_int_equal(m.face_count, 20 * n * n);
        assert_closed(&m);
        for (size_t v = 0; v < m.vertex_count; ++v) {
            const float *p = m.positions + 3 * v;
            assert_ratio(sqrt(pow(p[0] - 1, 2) + pow(p[1] - 2, 2) + pow(p[2] - 3, 2)), 2, 1e-6);
        }
        if (n > 1) {
            assert_ratio(mesh_area(&m), 16 * pi, .01);
            assert_ratio(mesh_volume(&m, 0, m.face_count), 32 * pi / 3, .02);
        }
        make_clear(&m);
    }
}

static void boxes_cylinders_and_turned_shapes_have_their_volumes(void **state) {
    (void)state;
    make_mesh m = {.t = &test_tool};
    make_box(&m, make_p(0, 0, 0), make_p(2, 3, 4), true, true);
    assert_closed(&m);
    assert_ratio(mesh_volume(&m, 0, m.face_count), 24, 1e-6);
    make_clear(&m);
    make_box(&m, make_p(0, 0, 0), make_p(2, 3, 4), false, true);
    assert_int_equal(m.face_count, 10);
    assert_ratio(mesh_area(&m), 2 * (2 * 3 + 3 * 4) + 2 * 4, 1e-6);
    make_clear(&m);
    make_cube(&m, 12 * 25);
    assert_int_equal(m.face_count, 12 * 25);
    assert_closed(&m);
    assert_ratio(mesh_volume(&m, 0, m.face_count), 1, 1e-6);
    make_clear(&m);
    make_cylinder(&m, 4000);
    assert_closed(&m);
    assert_ratio(m.face_count, 4000, .1);
    assert_ratio(mesh_volume(&m, 0, m.face_count), pi / 4, .01);
    assert_ratio(mesh_area(&m), pi / 2 + pi, .01);
    make_clear(&m);
    /* A cone of radius 3 and height 2 with its tip up: its base and side. */
    const double profile[3][2] = {{0, 0}, {3, 0}, {0, 2}};
    make_lathe(&m, make_p(5, 1, 0), profile, 3, 90);
    assert_closed(&m);
    assert_ratio(mesh_volume(&m, 0, m.face_count), 6 * pi, .005);
    make_turn(&m);
    assert_ratio(mesh_volume(&m, 0, m.face_count), -6 * pi, .005);
    make_clear(&m);
}

static double half_height(double x, double z, uint64_t seed) {
    return .25 * x + .5 * z + (double)seed;
}

static void a_sheet_follows_its_height(void **state) {
    (void)state;
    make_mesh m = {.t = &test_tool};
    make_sheet(&m, 7, half_height, 2);
    assert_int_equal(m.face_count, 98);
    assert_ratio(mesh_area(&m), sqrt(1 + .0625 + .25), 1e-5);
    for (uint32_t j = 0; j <= 7; ++j)
        for (uint32_t i = 0; i <= 7; ++i) {
            const float *p = m.positions + 3 * (size_t)(8 * j + i);
            assert_float_equal(p[0], i / 7., 1e-6);
            assert_float_equal(p[2], j / 7., 1e-6);
            assert_float_equal(p[1], 2 + .25 * i / 7 + .5 * j / 7, 1e-6);
        }
    const float *a = corner(&m, 0, 0), *b = corner(&m, 0, 1), *c = corner(&m, 0, 2); /* faces look up */
    assert_true((b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2]) > 0);
    make_clear(&m);
}

/* Octave k has the frequency 2 * 2.03^k and the size .25 * .48^k; from the fourth on the size depends on the
 * height. */
static void terrain_is_a_sum_of_octaves(void **state) {
    (void)state;
    for (int i = 0; i < 200; ++i) {
        double x = .005 * i, z = fmod(.0137 * i, 1), sum = 0;
        for (int k = 0; k < 9; ++k) {
            double f = 2 * pow(2.03, k), n = make_noise(make_p(x * f, 7.3 * k, z * f), 5);
            sum += .25 * pow(.48, k) * n * (k < 3 ? 1 : .3 + 3 * fmax(0, sum));
        }
        assert_float_equal(make_terrain_height(x, z, 5), sum, 1e-9);
    }
}

static void crates_are_slender_boxes_at_random_angles(void **state) {
    (void)state;
    enum { COUNT = 4000 };
    make_mesh m = {.t = &test_tool};
    make_crates(&m, COUNT, 3);
    assert_int_equal(m.face_count, 12 * COUNT);
    double spacing = 1 / cbrt(COUNT), mean[3] = {0}, place[3] = {0}, up = 0;
    for (size_t k = 0; k < COUNT; ++k) {
        const float *p = m.positions + 24 * k;
        double side[3][3], length[3], center[3] = {0};
        for (int a = 0; a < 3; ++a) {
            double square = 0;
            for (int c = 0; c < 3; ++c)
                side[a][c] = (double)p[3 * (1 << a) + c] - p[c], square += pow(side[a][c], 2);
            length[a] = sqrt(square), mean[a] += .5 * length[a] / COUNT;
        }
        for (int a = 0; a < 3; ++a) {
            double cross = 0;
            for (int c = 0; c < 3; ++c) cross += side[a][c] * side[(a + 1) % 3][c];
            assert_true(fabs(cross) < 1e-3 * length[a] * length[(a + 1) % 3]);
        }
        for (int v = 0; v < 8; ++v)
            for (int c = 0; c < 3; ++c) center[c] += p[3 * v + c] / 8;
        for (int c = 0; c < 3; ++c) place[c] += center[c] / COUNT;
        up += pow(side[0][1] / length[0], 2) / COUNT;
        assert_ratio(mesh_volume(&m, 12 * k, 12 * k + 12), length[0] * length[1] * length[2], .01);
    }
    assert_ratio(mean[0], 4 * .13 * spacing, .02);
    assert_ratio(mean[1], .13 * spacing, .02);
    assert_ratio(mean[2], .13 * spacing, .02);
    for (int c = 0; c < 3; ++c) assert_ratio(place[c], .5, .04);
    assert_ratio(up, 1. / 3, .05); /* of uniform directions */
    make_clear(&m);
}

static double smooth(double t) {
    return t * t * (3 - 2 * t);
}

static void noise_interpolates_hashes(void **state) {
    (void)state;
    double mean = 0, square = 0;
    for (int64_t i = 0; i < 100000; ++i) {
        double h = make_hash(i % 50, i / 50 % 50, i / 2500, 9);
        assert_true(h >= 0 && h < 1);
        mean += h / 1e5, square += h * h / 1e5;
    }
    assert_ratio(mean, .5, .01);
    assert_ratio(square - mean * mean, 1. / 12, .02);
    assert_true(make_hash(1, 2, 3, 4) != make_hash(1, 2, 3, 5) &&
                make_hash(1, 2, 3, 4) != make_hash(2, 1, 3, 4));
    for (int i = 0; i < 300; ++i) {
        double p[3] = {-3 + .031 * i, 2 - .017 * i, .041 * i}, sum = 0;
        for (int k = 0; k < 8; ++k) {
            double weight = 1;
            int64_t at[3];
            for (int c = 0; c < 3; ++c) {
                double u = smooth(p[c] - floor(p[c]));
                weight *= k >> c & 1 ? u : 1 - u;
                at[c] = (int64_t)floor(p[c]) + (k >> c & 1);
            }
            sum += weight * make_hash(at[0], at[1], at[2], 6);
        }
        assert_float_equal(make_noise(make_p(p[0], p[1], p[2]), 6), 2 * sum - 1, 1e-9);
    }
}

static double ball_value(const void *user, make_point p) {
    return sqrt(p.x * p.x + p.y * p.y + p.z * p.z) - *(const double *)user;
}

static void surfaces_lie_on_the_zero_level(void **state) {
    (void)state;
    double radius = .8;
    const make_field ball = {ball_value, &radius, 1, {-.8, -.8, -.8}, {.8, .8, .8}};
    make_mesh m = {.t = &test_tool};
    assert_int_equal(make_surface(&m, &ball, 5000), TOOL_DONE);
    assert_ratio((double)m.face_count, 5000, .05);
    assert_closed(&m);
    assert_ratio(mesh_volume(&m, 0, m.face_count), 4 * pi / 3 * pow(radius, 3), .01);
    for (size_t v = 0; v < m.vertex_count; ++v) {
        const float *p = m.positions + 3 * v;
        assert_ratio(sqrt((double)p[0] * p[0] + (double)p[1] * p[1] + (double)p[2] * p[2]), radius, 1e-3);
    }
    make_clear(&m);
}

static void statues_are_closed_and_stand_on_the_ground(void **state) {
    (void)state;
    /* Recorded from these very meshes: a changed field shows as a changed volume. */
    const double volumes[MAKE_STATUES + 1] = {.0586, .0817, .2126, .1182, .0499, .02945};
    for (int statue = 0; statue <= MAKE_STATUES; ++statue) {
        make_mesh m = {.t = &test_tool};
        if (statue < MAKE_STATUES)
            assert_int_equal(make_statue_mesh(&m, (make_statue)statue, 6000, 1), TOOL_DONE);
        else
            make_vase(&m, 6000);
        assert_ratio((double)m.face_count, 6000, statue < MAKE_STATUES ? .12 : .001);
        assert_closed(&m);
        assert_ratio(mesh_volume(&m, 0, m.face_count), volumes[statue], .02);
        double low = 9, high = -9;
        for (size_t v = 0; v < m.vertex_count; ++v)
            low = fmin(low, m.positions[3 * v + 1]), high = fmax(high, m.positions[3 * v + 1]);
        assert_true(fabs(low) < .02 && high > .8 && high < 1.1);
        make_clear(&m);
    }
}

int main(void) {
    test_tool = (tool){.name = "test", .quiet = true};
    tool_env_open(&test_tool, NULL);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sphere_is_round_and_closed),
        cmocka_unit_test(boxes_cylinders_and_turned_shapes_have_their_volumes),
        cmocka_unit_test(a_sheet_follows_its_height),
        cmocka_unit_test(terrain_is_a_sum_of_octaves),
        cmocka_unit_test(crates_are_slender_boxes_at_random_angles),
        cmocka_unit_test(noise_interpolates_hashes),
        cmocka_unit_test(surfaces_lie_on_the_zero_level),
        cmocka_unit_test(statues_are_closed_and_stand_on_the_ground),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
