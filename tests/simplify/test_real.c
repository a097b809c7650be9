/* Real meshes: table 6.4 of the dissertation, and a scan with open edges. Skipped without the data. */
#include "facetree/bvh.h"
#include "shapes.h"

static fct_env env;

static bool load(const char *name, fct_mesh *mesh) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", FACETREE_DATA, name);
    if (!file_exists(path)) return false;
    assert_int_equal(fct_mesh_load(&env, path, mesh), FCT_OK);
    return true;
}

static fct_mesh_error compare(const fct_mesh *a, const fct_mesh *b, uint32_t samples) {
    fct_tree *trees[2];
    fct_bvh *bvhs[2];
    fct_tree_def def = fct_tree_def_default();
    for (int k = 0; k < 2; ++k) {
        assert_int_equal(fct_tree_build(&env, k ? b : a, &def, NULL, &trees[k]), FCT_OK);
        assert_int_equal(fct_bvh_create(&env, trees[k], FCT_BACKEND_OBB, &bvhs[k]), FCT_OK);
    }
    fct_mesh_error error;
    assert_int_equal(fct_mesh_compare(&env, bvhs[0], bvhs[1], samples, 1, &error), FCT_OK);
    for (int k = 0; k < 2; ++k) {
        fct_bvh_destroy(bvhs[k]);
        fct_tree_destroy(trees[k]);
    }
    return error;
}

static void the_cow_is_at_least_as_close_as_in_table_6_4(void **state) {
    (void)state;
    fct_mesh cow;
    if (!load("cow.obj", &cow)) skip();
    struct {
        uint32_t faces;
        double e_avg;
    } table[] = {{100, 0.000259639}, {500, 1.27412e-05}, {1000, 3.43394e-06}, {3000, 2.57919e-07}};
    fct_simplify_def def = fct_simplify_def_default();
    for (size_t i = 0; i < sizeof table / sizeof *table; ++i) {
        def.target_faces = table[i].faces;
        fct_mesh out = simplified(&env, &cow, &def, NULL);
        fct_mesh_error error = compare(&cow, &out, 100);
        double squared = error.diameter * error.diameter;
        assert_true(error.e_avg / squared <= .6 * table[i].e_avg);
        assert_true(error.e_max / error.diameter < .7 / sqrt(table[i].faces));
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &cow);
}

static void the_bunny_keeps_its_open_edges(void **state) {
    (void)state;
    fct_mesh bunny;
    if (!load("stanford-bunny.obj", &bunny)) skip();
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = bunny.face_count / 10;
    fct_mesh out = simplified(&env, &bunny, &def, NULL);
    fct_mesh_error error = compare(&bunny, &out, 4);
    double squared = error.diameter * error.diameter;
    assert_true(error.e_avg / squared < .85 * 6.4e-8);
    assert_true(error.e_max / error.diameter < .006);
    fct_mesh_report before, after;
    assert_int_equal(fct_mesh_inspect(&env, &bunny, &before), FCT_OK);
    assert_int_equal(fct_mesh_inspect(&env, &out, &after), FCT_OK);
    assert_true(after.boundary_edges > 0 && after.boundary_edges < before.boundary_edges);
    assert_int_equal(after.components, before.components);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &bunny);
}

int main(void) {
    if (!file_exists(FACETREE_DATA "/cow.obj") && !file_exists(FACETREE_DATA "/stanford-bunny.obj"))
        return 77; /* skipped */
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_cow_is_at_least_as_close_as_in_table_6_4),
        cmocka_unit_test(the_bunny_keeps_its_open_edges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
