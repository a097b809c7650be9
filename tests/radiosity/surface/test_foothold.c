/* Footholds of single vertices: normals, sample points and offsets against closed forms. */
#include "../place.h"
#include "radiosity/surface/foothold.h"

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

static void assert_same(v3 a, v3 b, double tolerance) {
    if (!(v3_norm(v3_sub(a, b)) <= tolerance))
        fail_msg("(%g %g %g), expected (%g %g %g)", a.x, a.y, a.z, b.x, b.y, b.z);
}

/* The corner of a cube: one face of two triangles (45 degrees each), two of one. Weights by angle make the
 * diagonal of the cube; equal weights per triangle would not. */
static void normals_are_weighted_by_angle(void **state) {
    (void)state;
    static const float p[15] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1};
    /* z = 0 in two triangles, y = 0 and x = 0 in one, all facing the outside of the octant */
    static const uint32_t t[12] = {0, 2, 1, 0, 3, 2, 0, 1, 4, 0, 4, 3};
    const fct_corners mesh = {5, 4, p, t};
    const uint32_t corners[4] = {0, 3, 6, 9};
    v3 n;
    assert_true(fct_corner_normal(&mesh, corners, 4, &n));
    assert_same(n, v3_scale(v3_make(-1, -1, -1), 1 / sqrt(3)), 1e-6);
    assert_true(fct_corner_front(&mesh, corners, 4, n));
    assert_false(fct_corner_front(&mesh, corners, 4, v3_make(-1, 0, 0)));
    assert_false(fct_corner_front(&mesh, corners, 4, v3_make(0, 0, 0)));
    fct_foothold at = fct_corner_foothold(&mesh, corners, 4, n, false);
    assert_same(at.sample, v3_make(0, 0, 0), 1e-12);
    assert_false(at.flat);
    /* mean of the sides at the corner: two of length 1 per face, one of sqrt 2 in two faces; cosine 1 / sqrt
     * 3 */
    double edge = (2 * .5 * (1 + sqrt(2)) + 2 * 1) / 4;
    assert_near(at.offset, 2e-4 * edge * sqrt(3), 1e-8);
    /* Turns until it is in front of every face, by at least .02. */
    const v3 grazing = v3_unit(v3_make(-1, -1, .03));
    assert_false(fct_corner_front(&mesh, corners, 4, grazing));
    assert_true(fct_corner_front(&mesh, corners, 4, v3_unit(v3_make(-1, -1, -.03))));
    assert_false(fct_corner_front(&mesh, corners, 4, v3_unit(v3_make(-1, -1, -.025))));
}

/* A vertex on a rim moves .15 of the way to the centroid of the face that lies most inwards. */
static void rims_are_pulled_inwards(void **state) {
    (void)state;
    static const float p[15] = {100, 0, 0, 101, 0, 0, 101, 1, 0, 99, 1, 0, 99, 0, 0};
    static const uint32_t t[9] = {0, 1, 2, 0, 2, 3, 0, 3, 4};
    const fct_corners mesh = {5, 3, p, t};
    const uint32_t corners[3] = {0, 3, 6};
    v3 n;
    assert_true(fct_corner_normal(&mesh, corners, 3, &n));
    assert_same(n, v3_make(0, 0, 1), 1e-9);
    fct_foothold at = fct_corner_foothold(&mesh, corners, 3, n, true);
    assert_int_equal(at.face, 1);
    assert_same(at.sample, v3_make(100, .15 * 2 / 3., 0), 1e-6);
    assert_true(at.flat);
    /* mean edge (1 + sqrt 2) / 2 in the outer faces, sqrt 2 in the middle; 8 units of 2^-23 of the coordinate
     */
    double edge = ((1 + sqrt(2)) + sqrt(2)) / 3;
    assert_near(at.offset, 2e-4 * edge + 8 * 0x1p-23 * 100, 1e-8);
    at = fct_corner_foothold(&mesh, corners, 1, n, false);
    assert_near(at.offset, 2e-4 * .5 * (1 + sqrt(2)) + 8 * 0x1p-23 * 100, 1e-8);
    at = fct_corner_foothold(&mesh, corners, 3, n, false);
    assert_same(at.sample, v3_make(100, 0, 0), 1e-9);
    assert_int_equal(at.face, 1); /* the widest angle */
}

/* Degenerate faces do not count; a vertex of degenerate faces only has no normal. */
static void degenerate_faces_have_no_say(void **state) {
    (void)state;
    static const float p[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0};
    static const uint32_t t[6] = {0, 1, 2, 0, 1, 3};
    const fct_corners mesh = {4, 2, p, t};
    const uint32_t corners[2] = {0, 3};
    v3 n;
    assert_true(fct_corner_normal(&mesh, corners, 2, &n));
    assert_same(n, v3_make(0, 0, 1), 1e-9);
    fct_foothold at = fct_corner_foothold(&mesh, corners, 2, n, false);
    assert_true(at.flat && at.face == 0);
    fct_corner_normal(&mesh, corners + 1, 1, &n);
    assert_same(n, v3_make(0, 0, 0), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(normals_are_weighted_by_angle),
        cmocka_unit_test(rims_are_pulled_inwards),
        cmocka_unit_test(degenerate_faces_have_no_say),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
