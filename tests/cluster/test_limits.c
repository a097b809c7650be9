/* Faces without area, and a wrong mean depth. */
#include "check_tree.h"

/* Two collinear faces, both with 4 as the longest squared side. */
static void faces_without_area_weigh_by_their_longest_side(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    float p[18] = {1, 0, 0, 0, 0, 0, 2, 0, 0, 10, 0, 0, 11, 0, 0, 12, 0, 0};
    uint32_t t[6] = {0, 1, 2, 3, 4, 5};
    fct_mesh mesh = {.vertex_count = 6, .face_count = 2, .positions = p, .triangles = t};
    fct_tree *tree;
    fct_cluster c;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    assert_int_equal(fct_tree_cluster(tree, 0, &c), FCT_OK);
    assert_true(fabs((double)c.centroid[0] - 6) < 1e-5);
    fct_tree_destroy(tree);
}

static void a_wrong_mean_depth_is_found(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_sphere(&env, 6);
    fct_tree *tree;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    double right = tree->view.mean_depth;
    for (int i = -1; i <= 1; i += 2) {
        tree->view.mean_depth = right * (1 + .001 * i);
        assert_int_equal(fct_tree_verify(&env, tree), FCT_ERROR_DATA);
    }
    tree->view.mean_depth = right;
    assert_int_equal(fct_tree_verify(&env, tree), FCT_OK);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}
int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(faces_without_area_weigh_by_their_longest_side),
                                       cmocka_unit_test(a_wrong_mean_depth_is_found)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
