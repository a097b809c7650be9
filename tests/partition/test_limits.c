/* Borders through degenerate faces, and perimeters of merged charts. */
#include "cluster/shapes.h"

#include "base/math/vec.h"
#include "facetree/partition.h"
#include "partition/chart/merge.h"

/* Face 1 lies twice on the edge between faces 0 and 2. */
static void a_degenerate_face_passes_its_border_on(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    float p[15] = {0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 0};
    uint32_t t[9] = {0, 1, 2, 0, 1, 0, 1, 0, 3}, labels[3] = {0, 1, 2};
    fct_mesh mesh = {.vertex_count = 5, .face_count = 3, .positions = p, .triangles = t};
    fct_adjacency found;
    assert_int_equal(fct_labels_adjacency(&env, &mesh, labels, 3, &found), FCT_OK);
    for (uint32_t i = 0; i < found.pair_count; ++i)
        print_message("%u %u %g\n", found.pairs[2 * i], found.pairs[2 * i + 1], found.lengths[i]);
    assert_int_equal(found.pair_count, 2);
    assert_true(fabs(found.lengths[0] - 2) < 1e-9 && fabs(found.lengths[1] - 2) < 1e-9);
    fct_adjacency_release(&env, &found);
}

/* Rows 0 and 1 are charts A and B, 8 x 1 each; C is 3 wide and 12 high on top. The union of A and B has the
 * perimeter 20, of which C shares 3, more than an eighth. */
static void merged_charts_have_their_own_perimeter(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh grid = make_grid(&env, 16), mesh;
    uint32_t list[512], label_of[512], count = 0;
    for (uint32_t f = 0; f < grid.face_count; ++f) {
        uint32_t x = f / 2 % 16, y = f / 32,
                 label = y < 2 && x < 8                        ? y
                         : y >= 2 && y < 14 && x >= 2 && x < 5 ? 2
                                                               : 9;
        if (label == 9) continue;
        label_of[count] = label, list[count++] = f;
    }
    assert_int_equal(fct_mesh_extract(&env, &grid, list, count, &mesh, NULL), FCT_OK);
    fct_tree *tree;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    fct_charter c = {.tree = tree, .view = &tree->view, .def = fct_chart_def_default(), .count = 3};
    c.labels = malloc(4 * (size_t)count);
    for (uint32_t i = 0; i < count; ++i) c.labels[i] = label_of[tree->view.face_ids[i]];
    assert_int_equal(fct_sides_build(&env, tree->view.triangles, count, tree->view.vertex_count, &c.sides),
                     FCT_OK);
    assert_int_equal(fct_charts_merge(&env, &c), FCT_OK);
    assert_int_equal(c.count, 1);
    fct_sides_release(&env, &c.sides);
    free(c.labels);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &grid);
}

/* The lengths of borders need no scale, also where those of the mesh are no floats. */
static void quality_does_not_depend_on_scale(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_partition_quality all[3];
    for (int k = 0; k < 3; ++k) {
        fct_mesh mesh = make_grid(&env, 8);
        uint32_t labels[128];
        for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i)
            mesh.positions[i] = ldexpf(mesh.positions[i], (const int[]){0, 127, -140}[k]);
        for (uint32_t f = 0; f < mesh.face_count; ++f) labels[f] = f / 16 % 3;
        assert_int_equal(fct_labels_quality(&env, &mesh, labels, 3, all + k), FCT_OK);
        fct_mesh_release(&env, &mesh);
        assert_true(fabs(all[k].mean_irregularity - all[0].mean_irregularity) < 1e-9);
        assert_true(fabs(all[k].box_area - all[0].box_area) < 1e-9 && all[k].mean_irregularity > 1);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_degenerate_face_passes_its_border_on),
                                       cmocka_unit_test(merged_charts_have_their_own_perimeter),
                                       cmocka_unit_test(quality_does_not_depend_on_scale)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
