/* The largest distance of one surface from another, against closed forms and dense samples. */
#include "models.h"

static void set_vertex(fct_mesh *mesh, uint32_t v, double x, double y, double z) {
    v3_store(mesh->positions + 3 * (size_t)v, v3_make(x, y, z));
}

/* A roof over a floor: the ridge is 1 above, but its ends and middle are vertices of neither surface's
 * nearest face. */
static void closed_forms(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    /* A triangle over two pieces of floor with a gap of 2 between x = -1 and x = 1: the farthest point is
     * over the middle of the gap, inside of the triangle, at sqrt(1 + 1). */
    fct_mesh top, floor;
    assert_int_equal(fct_mesh_create(&env, 3, 1, 0, &top), FCT_OK);
    assert_int_equal(fct_mesh_create(&env, 8, 4, 0, &floor), FCT_OK);
    set_vertex(&top, 0, -3, -4, 1), set_vertex(&top, 1, 3, -4, 1), set_vertex(&top, 2, 0, 5, 1);
    for (uint32_t i = 0; i < 3; ++i) top.triangles[i] = i;
    for (uint32_t side = 0; side < 2; ++side) {
        double sign = side ? 1 : -1;
        set_vertex(&floor, 4 * side, sign, -9, 0), set_vertex(&floor, 4 * side + 1, sign * 9, -9, 0);
        set_vertex(&floor, 4 * side + 2, sign * 9, 9, 0), set_vertex(&floor, 4 * side + 3, sign, 9, 0);
        uint32_t two[6] = {4 * side, 4 * side + 1, 4 * side + 2, 4 * side, 4 * side + 2, 4 * side + 3};
        memcpy(floor.triangles + 6 * side, two, sizeof two);
    }
    /* The apex lies over the gap too: move it away, so that no vertex has the distance. */
    set_vertex(&top, 2, 3, 5, 1);
    model a = model_make(&env, top, FCT_BACKEND_OBB), b = model_make(&env, floor, FCT_BACKEND_OBB);
    fct_hausdorff h;
    assert_int_equal(fct_mesh_hausdorff(&env, a.bvh, b.bvh, 0, 1e-4, &h), FCT_OK);
    assert_true(h.distance_ab <= sqrt(2) + 1e-12 && h.distance_ab >= sqrt(2) - 1e-4);
    assert_true(fabs(h.point_a[0]) < 1e-3 && fabs(h.point_a[2] - 1) < 1e-12);
    assert_int_equal(h.face_a, 0);
    /* The corner (-9, 9, 0) is farthest from the triangle. */
    v3 corners[3], far = {-9, 9, 0};
    face_corners(&top, 0, corners);
    assert_true(fabs(h.distance_ba - v3_norm(v3_sub(plain_closest(far, corners), far))) < 1e-6);
    assert_true(h.point_b[0] == -9 && h.point_b[1] == 9 && h.distance == h.distance_ba);
    model_release(&env, &a);
    model_release(&env, &b);
}

static void concentric_spheres(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh large = make_sphere(&env, 20);
    for (uint32_t i = 0; i < 3 * large.vertex_count; ++i) large.positions[i] *= 2;
    model a = model_make(&env, make_sphere(&env, 31), FCT_BACKEND_OBB),
          b = model_make(&env, large, FCT_BACKEND_OBB);
    fct_hausdorff h, same;
    assert_int_equal(fct_mesh_hausdorff(&env, a.bvh, b.bvh, 1e-3, 0, &h), FCT_OK);
    assert_true(h.distance > 1 && h.distance < 1.02);
    assert_int_equal(fct_mesh_hausdorff(&env, a.bvh, a.bvh, .01, 1e-3, &same), FCT_OK);
    assert_true(same.distance < 1e-7);
    /* The same bits for every number of threads. */
    fct_hausdorff again;
    env.thread_count = 5;
    assert_int_equal(fct_mesh_hausdorff(&env, a.bvh, b.bvh, 1e-3, 0, &again), FCT_OK);
    assert_memory_equal(&h, &again, sizeof h);
    env.thread_count = 0;
    model_release(&env, &a);
    model_release(&env, &b);
}

/* No dense sample exceeds the result by more than the tolerance, and the result is attained. */
static void samples_are_within(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint64_t seed = 1;
    for (int kind = 0; kind < 4; ++kind) {
        model a = model_make(&env, make_pebble(&env, 7, (uint64_t)kind), FCT_BACKEND_OBB);
        model b =
            model_make(&env, kind == 3 ? make_soup(&env, 60, 9) : make_pebble(&env, 9, 20 + (uint64_t)kind),
                       FCT_BACKEND_OBB);
        double tolerance = kind % 2 ? .05 : .002;
        fct_hausdorff h;
        assert_int_equal(fct_mesh_hausdorff(&env, a.bvh, b.bvh, 0, tolerance, &h), FCT_OK);
        for (int way = 0; way < 2; ++way) {
            const fct_mesh *from = way ? &b.mesh : &a.mesh;
            const fct_bvh *to = way ? a.bvh : b.bvh;
            double result = way ? h.distance_ba : h.distance_ab, most = 0;
            for (uint32_t f = 0; f < from->face_count; ++f)
                for (int i = 0; i < (SANITIZED ? 20 : 200); ++i) {
                    v3 p[3];
                    double u = random_unit(&seed), v = random_unit(&seed);
                    if (u + v > 1) u = 1 - u, v = 1 - v;
                    face_corners(from, f, p);
                    float at[3];
                    fct_closest closest;
                    v3_store(at,
                             v3_add(v3_scale(p[0], 1 - u - v), v3_add(v3_scale(p[1], u), v3_scale(p[2], v))));
                    fct_bvh_closest_point(to, at, INFINITY, &closest, NULL);
                    most = fmax(most, (double)closest.distance);
                }
            assert_true(most <= result + tolerance + 1e-6);
            assert_true(SANITIZED || most >= result - .05);
            const double *point = way ? h.point_b : h.point_a;
            float at[3] = {(float)point[0], (float)point[1], (float)point[2]};
            fct_closest closest;
            fct_bvh_closest_point(to, at, INFINITY, &closest, NULL);
            assert_true(fabs((double)closest.distance - result) < 1e-6);
            v3 p[3], q = {point[0], point[1], point[2]};
            face_corners(from, way ? h.face_b : h.face_a, p);
            assert_true(v3_norm(v3_sub(plain_closest(q, p), q)) < 1e-6);
        }
        model_release(&env, &a);
        model_release(&env, &b);
    }
}

static void bad_calls(void **state) {
    (void)state;
    recorder r = {.text = ""};
    fct_env env = recorder_env(&r);
    model a = model_make(&env, make_sphere(&env, 4), FCT_BACKEND_OBB),
          e = model_make(&env, make_sphere(&env, 4), FCT_BACKEND_EMBREE);
    fct_hausdorff h;
    assert_int_equal(fct_mesh_hausdorff(&env, a.bvh, e.bvh, 0, 0, &h), FCT_ERROR_DATA);
    assert_string_equal(r.text, "expected two structures of the OBB backend");
    assert_int_equal(fct_mesh_hausdorff(&env, a.bvh, a.bvh, NAN, 0, &h), FCT_ERROR_DATA);
    assert_int_equal(fct_mesh_hausdorff(&env, a.bvh, a.bvh, 0, -1, &h), FCT_ERROR_DATA);
    /* Without a tolerance the search ends, too. */
    assert_int_equal(fct_mesh_hausdorff(&env, a.bvh, a.bvh, 0, 0, &h), FCT_OK);
    model_release(&env, &a);
    model_release(&env, &e);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_forms),
        cmocka_unit_test(concentric_spheres),
        cmocka_unit_test(samples_are_within),
        cmocka_unit_test(bad_calls),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
