/* Real meshes and two generated ones: check_tree.h, connected partitions of manifold meshes, and upper bounds
 * on the quality figures. Absent real meshes are skipped. */
#include "check_tree.h"
#include "oracle/meshes.h"

typedef struct figures {
    const char *name;
    bool connected;                            /* the mesh is one manifold part */
    double deviation, irregularity, box_areas; /* at 1000 clusters: upper bounds; boxes of the whole tree */
} figures;

static double box_areas(const fct_tree *tree) {
    const fct_tree_view *view = &tree->view;
    double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY}, sum = 0;
    for (size_t i = 0; i < 3 * (size_t)view->vertex_count; ++i) {
        lower[i % 3] = fmin(lower[i % 3], (double)view->positions[i]);
        upper[i % 3] = fmax(upper[i % 3], (double)view->positions[i]);
    }
    for (uint32_t i = 0; i < view->node_count; ++i) {
        const float *h = tree->nodes[i].box_half;
        sum += 8 * (double)(h[0] * h[1] + h[1] * h[2] + h[2] * h[0]);
    }
    v3 d = {upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]};
    return sum / v3_norm2(d);
}

static void check_mesh_figures(const fct_mesh *mesh, const figures *expected) {
    fct_env env = fct_env_default();
    for (int method = 0; method < 2; ++method) {
        fct_tree_def def = fct_tree_def_default();
        def.method = (fct_cluster_method)method;
        fct_tree *tree;
        assert_int_equal(fct_tree_build(&env, mesh, &def, NULL, &tree), FCT_OK);
        check_tree(tree, mesh);
        fct_tree_view view = fct_tree_get(tree);
        assert_int_equal(view.root_count, 1);
        assert_true(box_areas(tree) <= expected->box_areas);
        uint32_t *nodes = malloc(4 * (size_t)view.face_count);
        const uint32_t counts[] = {1, 2, 3, 10, 100, 1000, view.face_count / 2};
        for (size_t i = 0; i < sizeof counts / sizeof *counts; ++i) {
            fct_partition_quality quality;
            assert_int_equal(cut_tree(tree, counts[i], nodes), counts[i]);
            assert_int_equal(fct_tree_quality(&env, tree, nodes, counts[i], &quality), FCT_OK);
            if (expected->connected) assert_true(quality.connected);
            if (counts[i] != 1000) continue;
            assert_true(quality.mean_normal_deviation <= expected->deviation);
            assert_true(quality.mean_irregularity <= expected->irregularity);
        }
        free(nodes);
        fct_tree_destroy(tree);
    }
}

static void real_meshes(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    const figures models[] = {{"stanford-bunny", true, 0.0202, 3.6, 71},
                              {"cow", true, 0.0102, 2.4, 41},
                              {"fandisk", true, 0.00002, 2.0, 47}};
    size_t found = 0;
    for (size_t i = 0; i < sizeof models / sizeof *models; ++i) {
        char path[512];
        fct_mesh mesh;
        snprintf(path, sizeof path, "%s/%s.obj", FACETREE_DATA, models[i].name);
        if (!file_exists(path)) continue;
        assert_int_equal(fct_mesh_load(&env, path, &mesh), FCT_OK);
        check_mesh_figures(&mesh, &models[i]);
        fct_mesh_release(&env, &mesh);
        ++found;
    }
    if (!found) skip();
}

static void generated_meshes(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    const figures rough = {"rough sphere", true, 0.0089, 4, 84}, terrain = {"terrain", true, 0.257, 5.4, 42};
    fct_mesh mesh = make_sphere(&env, 90);
    roughen(&mesh, 0.004);
    check_mesh_figures(&mesh, &rough);
    fct_mesh_release(&env, &mesh);
    mesh = make_terrain(&env, 120, 0.03, 1);
    check_mesh_figures(&mesh, &terrain);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(generated_meshes), cmocka_unit_test(real_meshes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
