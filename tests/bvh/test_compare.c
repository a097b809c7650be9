/* Colour differences between surfaces: the face that gives the colour, and the weight of bright lights. */
#include "models.h"

/* Grids of the unit square, one after the other; each has a height and a grey, odd ones face down. */
static fct_mesh make_sheets(const fct_env *env, uint32_t n, uint32_t count, const float *heights,
                            const float *greys) {
    fct_mesh grid = make_grid(env, n), out;
    uint32_t vertices = grid.vertex_count, faces = grid.face_count;
    assert_int_equal(fct_mesh_create(env, count * vertices, count * faces, FCT_MESH_COLORS, &out), FCT_OK);
    for (uint32_t i = 0; i < count; ++i) {
        for (uint32_t v = 0; v < vertices; ++v) {
            memcpy(out.positions + 3 * (i * vertices + v), grid.positions + 3 * v, 12);
            out.positions[3 * (i * vertices + v) + 2] = heights[i];
            for (int k = 0; k < 3; ++k) out.colors[3 * (i * vertices + v) + k] = greys[i];
        }
        for (uint32_t f = 0; f < faces; ++f)
            for (uint32_t k = 0; k < 3; ++k)
                out.triangles[3 * (i * faces + f) + (i % 2 ? 2 - k : k)] =
                    i * vertices + grid.triangles[3 * f + k];
    }
    fct_mesh_release(env, &grid);
    return out;
}

static fct_mesh_error compare(const fct_env *env, fct_mesh first, fct_mesh second) {
    model a = model_make(env, first, FCT_BACKEND_OBB), b = model_make(env, second, FCT_BACKEND_OBB);
    fct_mesh_error error;
    assert_int_equal(fct_mesh_compare(env, a.bvh, b.bvh, 10, 1, &error), FCT_OK);
    model_release(env, &a);
    model_release(env, &b);
    return error;
}

/*  floor, light, facing up   ----------
 *  underside, dark           ----------   at the same place or 10^-7 diameters from it  */
static void colours_come_from_the_side_that_faces_alike(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    const float greys[2] = {.8f, .05f};
    for (int apart = 0; apart < 2; ++apart) {
        const float heights[2] = {0, apart ? 1e-7f : 0};
        fct_mesh_error error =
            compare(&env, make_sheets(&env, 6, 2, heights, greys), make_sheets(&env, 5, 2, heights, greys));
        assert_true(error.color_max < 1e-6);
        assert_true(error.color_rms < 1e-6);
    }
    /* Farther apart, the nearest counts, whatever it faces. */
    const float heights[2] = {0, .1f}, lower[2] = {.1f, 0};
    fct_mesh_error error =
        compare(&env, make_sheets(&env, 6, 2, heights, greys), make_sheets(&env, 5, 2, lower, greys));
    assert_float_equal(error.color_max, .75, 1e-5);
    assert_float_equal(error.color_rms, .75, 1e-5);
}

/* Twenty-five sheets at grey .4, one of them a lamp of 40. */
static void lamps_do_not_outweigh_the_rest(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    float heights[25], right[25], wrong[25];
    for (int i = 0; i < 25; ++i) heights[i] = (float)i, right[i] = wrong[i] = i ? .4f : 40;
    wrong[0] = 20;
    fct_mesh_error error =
        compare(&env, make_sheets(&env, 3, 25, heights, right), make_sheets(&env, 3, 25, heights, wrong));
    assert_float_equal(error.color_max, 20, 1e-4);
    assert_float_equal(error.color_rms, 20 / 5., 1e-4);
    /* A lamp that is wrong by more than .4 is wrong by .4: one part in 25 of the squares. */
    assert_float_equal(error.color_rms_relative, 1 / 5., 1e-4);
    for (int i = 1; i < 25; ++i) wrong[i] = .3f;
    wrong[0] = 40;
    error = compare(&env, make_sheets(&env, 3, 25, heights, right), make_sheets(&env, 3, 25, heights, wrong));
    assert_float_equal(error.color_rms_relative, sqrt(24 / 25.) / 4, 1e-4);
}

static void memory_may_fail_with_colours(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r), plain = fct_env_default();
    const float heights[2] = {0, 1}, greys[2] = {.5f, 1};
    model m = model_make(&plain, make_sheets(&plain, 4, 2, heights, greys), FCT_BACKEND_OBB);
    fct_mesh_error error;
    fct_result result;
    long n = 0;
    do {
        r.allocations = 0, r.fail_at = ++n;
        result = fct_mesh_compare(&env, m.bvh, m.bvh, 1, 1, &error);
        assert_int_equal(r.alive, 0);
        assert_true(result == FCT_OK || result == FCT_ERROR_MEMORY);
    } while (result != FCT_OK);
    assert_true(n > 6);
    model_release(&plain, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colours_come_from_the_side_that_faces_alike),
        cmocka_unit_test(lamps_do_not_outweigh_the_rest),
        cmocka_unit_test(memory_may_fail_with_colours),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
