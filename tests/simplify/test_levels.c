/* Levels of progressive meshes: their faces are those of simplifications, and they are the same after every
 * way that leads to them. */
#include "levels.h"

static fct_env env;

/* Each level has the faces of a simplification with the same target, and the finest those of the input. */
static void check_levels(const fct_mesh *mesh, fct_simplify_def def) {
    fct_progressive *progressive = progressive_of(&env, mesh, def, 0);
    fct_progressive_info info;
    fct_progressive_inspect(progressive, &info);
    def.refit_passes = 0;
    for (uint32_t i = 0; i <= 12; ++i) {
        def.target_faces = (uint32_t)(pow(i / 12., 2) * mesh->face_count);
        fct_simplify_stats stats;
        fct_mesh expected = simplified(&env, mesh, &def, &stats), level = level_mesh(progressive, def.target_faces);
        assert_int_equal(fct_mesh_validate(&env, &level), FCT_OK);
        if (expected.face_count >= info.least_faces) assert_true(same_faces(&level, &expected));
        fct_progressive_inspect(progressive, &info);
        assert_int_equal(info.faces, level.face_count);
        assert_float_equal(info.error, stats.max_cost, 1e-6 * stats.max_cost);
        assert_memory_equal(level.origin, mesh->origin, sizeof level.origin);
        fct_mesh_release(&env, &expected);
        fct_mesh_release(&env, &level);
    }
    fct_progressive_destroy(progressive);
}

static void levels_are_simplifications(void **state) {
    (void)state;
    fct_mesh meshes[] = {make_sphere(&env, 14), make_grid(&env, 14), make_cube(&env, 6)};
    for (size_t i = 0; i < FCT_LENGTH(meshes); ++i) {
        check_levels(&meshes[i], fct_simplify_def_default());
        fct_mesh_release(&env, &meshes[i]);
    }
}

static void attributes_follow(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; ++kind) {
        fct_mesh torus = make_torus(&env, 10, kind & 1, kind & 2);
        for (int placement = 0; placement < 4; ++placement) {
            fct_simplify_def def = fct_simplify_def_default();
            def.placement = (fct_placement)placement;
            check_levels(&torus, def);
        }
        fct_mesh_release(&env, &torus);
    }
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {cmocka_unit_test(levels_are_simplifications),
                                       cmocka_unit_test(attributes_follow)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
