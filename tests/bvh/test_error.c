/* E_max and E_avg (Garland 1999, (2.7), (2.8)) against closed forms. Distances are between surfaces whose
 * distance at each sample is known, or whose mean over the surface is an integral. */
#include "models.h"

static fct_mesh_error compare(const fct_env *env, fct_mesh first, fct_mesh second, uint32_t samples) {
    model a = model_make(env, first, FCT_BACKEND_OBB), b = model_make(env, second, FCT_BACKEND_OBB);
    fct_mesh_error error;
    assert_int_equal(fct_mesh_compare(env, a.bvh, b.bvh, samples, 3, &error), FCT_OK);
    assert_int_equal(error.samples, first.vertex_count + second.vertex_count +
                                        (size_t)samples * (first.face_count + second.face_count));
    model_release(env, &a);
    model_release(env, &b);
    return error;
}

/* Squares over [0,1]^2 at heights base[i] + slope[i] x. */
static fct_mesh make_squares(const fct_env *env, uint32_t n, uint32_t count, const double *base,
                             const double *slope) {
    fct_mesh grid = make_grid(env, n), out;
    uint32_t vertices = grid.vertex_count, faces = grid.face_count;
    assert_int_equal(fct_mesh_create(env, count * vertices, count * faces, 0, &out), FCT_OK);
    for (uint32_t i = 0; i < count; ++i) {
        for (uint32_t v = 0; v < vertices; ++v) {
            float *p = out.positions + 3 * (i * vertices + v);
            memcpy(p, grid.positions + 3 * v, 12);
            p[2] = (float)(base[i] + slope[i] * (double)p[0]);
        }
        for (uint32_t k = 0; k < 3 * faces; ++k)
            out.triangles[3 * i * faces + k] = i * vertices + grid.triangles[k];
    }
    fct_mesh_release(env, &grid);
    return out;
}

static void expect(double value, double expected, double relative) {
    assert_true(fabs(value - expected) <= relative * expected);
}

/* One square at height 0, two at .5 and 1. From the one: .5 everywhere. From the two: .5 and 1. */
static void both_directions_count_by_their_samples(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    double zero[1] = {0}, heights[2] = {.5, 1}, flat[2] = {0, 0};
    fct_mesh_error e =
        compare(&env, make_squares(&env, 7, 1, zero, flat), make_squares(&env, 3, 2, heights, flat), 10);
    double k1 = 64 + 98 * 10, k2 = 2 * (16 + 18 * 10);
    expect(e.e_avg_ab, .25, 1e-9);
    expect(e.e_avg_ba, (.25 + 1) / 2, 1e-9);
    expect(e.e_avg, (k1 * .25 + k2 * .625) / (k1 + k2), 1e-9);
    expect(e.e_max_ab, .5, 1e-9);
    expect(e.e_max_ba, 1, 1e-9);
    expect(e.e_max, 1, 1e-9);
    expect(e.diameter, sqrt(2), 1e-9);
    e = compare(&env, make_squares(&env, 3, 2, heights, flat), make_squares(&env, 7, 1, zero, flat), 10);
    expect(e.e_avg_ab, .625, 1e-9);
    expect(e.e_max_ab, 1, 1e-9);
    expect(e.e_max, 1, 1e-9);
    expect(e.diameter, 1.5, 1e-9);
}

/* A plane z = x / 2 over the square. A point of it lies z above the square: mean of squares 1/12, largest
 * 1/2. A point (x, y, 0) of the square is x sin(a) from the plane, tan(a) = 1/2: sin(a)^2 / 3 and sin(a). */
static void samples_of_a_face_are_uniform(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    double zero[1] = {0}, half[1] = {.5};
    double sine2 = .25 / 1.25;
    fct_mesh_error e =
        compare(&env, make_squares(&env, 1, 1, zero, zero), make_squares(&env, 1, 1, zero, half), 20000);
    expect(e.e_avg_ab, sine2 / 3, 2e-3);
    expect(e.e_avg_ba, 1. / 12, 2e-3);
    expect(e.e_avg, (sine2 / 3 + 1. / 12) / 2, 2e-3);
    expect(e.e_max_ab, sqrt(sine2), 1e-6);
    expect(e.e_max_ba, .5, 1e-6);
    /* Few samples on many faces: the shifts by face must be uniform too. */
    e = compare(&env, make_squares(&env, 40, 1, zero, zero), make_squares(&env, 40, 1, zero, half), 1);
    expect(e.e_avg_ab, sine2 / 3, 3e-2);
    expect(e.e_avg_ba, 1. / 12, 3e-2);
}

/* Spheres of radius 1 and 1.5 of 96 rings: facets lie up to 1 - cos(pi / 96) below the sphere. */
static void concentric_spheres_have_their_gap(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh inner = make_sphere(&env, 96), outer = make_sphere(&env, 96);
    for (uint32_t i = 0; i < 3 * outer.vertex_count; ++i) outer.positions[i] *= 1.5f;
    fct_mesh_error e = compare(&env, inner, outer, 2);
    expect(e.e_avg_ab, .25, 5e-3);
    expect(e.e_avg_ba, .25, 5e-3);
    expect(e.e_avg, .25, 5e-3);
    expect(e.e_max, .5, 5e-3);
    expect(e.e_max_ab, .5, 5e-3);
    expect(e.e_max_ba, .5, 5e-3);
    expect(e.diameter, 2 * sqrt(3), 1e-6);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(both_directions_count_by_their_samples),
        cmocka_unit_test(samples_of_a_face_are_uniform),
        cmocka_unit_test(concentric_spheres_have_their_gap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
