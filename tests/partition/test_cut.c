/* The cut by distance against a search that measures every vertex of every node, on shapes of every kind. */
#include "cluster/shapes.h"

#include "base/math/vec.h"
#include "facetree/partition.h"

static double distance_of(const fct_tree *tree, uint32_t node) {
    fct_tree_view view = fct_tree_get(tree);
    fct_cluster c;
    fct_tree_cluster(tree, node, &c);
    double largest = 0;
    for (size_t i = 3 * (size_t)c.first; i < 3 * ((size_t)c.first + c.count); ++i) {
        v3 p = v3_load(view.positions + 3 * (size_t)view.triangles[i]);
        largest = fmax(largest, fabs(v3_dot(v3_load(c.plane), p) + (double)c.plane[3]));
    }
    return largest;
}

/* Depth first with no bound; nodes in order of places. */
static uint32_t search(const fct_tree *tree, double limit, uint32_t *nodes, double *largest) {
    fct_tree_view view = fct_tree_get(tree);
    uint32_t *stack = malloc(4 * (2 * (size_t)view.face_count)), top = 0, count = 0;
    *largest = 0;
    for (uint32_t r = view.root_count; r-- > 0;) stack[top++] = view.roots[r];
    while (top > 0) {
        uint32_t node = stack[--top];
        double distance = distance_of(tree, node);
        if (node >= view.node_count || distance <= limit) {
            nodes[count++] = node;
            *largest = fmax(*largest, distance);
        } else {
            fct_cluster own;
            fct_tree_cluster(tree, node, &own);
            stack[top++] = own.child[1];
            stack[top++] = own.child[0];
        }
    }
    free(stack);
    return count;
}

static void the_coarsest_cut_within_a_distance(void **state) {
    (void)state;
    static const double limits[] = {0, 1e-7, 1e-3, 0.01, 0.05, 0.3, 1, 10, INFINITY};
    fct_env env = fct_env_default();
    for (int shape = 0; shape < SHAPES; ++shape)
        for (uint32_t roots = 1; roots < 100; roots += 60) {
            fct_mesh mesh = make_shape(&env, shape);
            fct_tree *tree = tree_of(&env, &mesh, roots < mesh.face_count ? roots : 1);
            uint32_t *nodes = malloc(4 * (size_t)mesh.face_count),
                     *wanted = malloc(4 * (size_t)mesh.face_count);
            uint32_t last = FCT_NONE;
            for (size_t i = 0; i < sizeof limits / sizeof *limits; i += SANITIZED ? 2 : 1) {
                double largest, expected;
                uint32_t count, number = search(tree, limits[i], wanted, &expected);
                assert_int_equal(fct_tree_cut_at_distance(&env, tree, limits[i], nodes, &count, &largest),
                                 FCT_OK);
                assert_int_equal(count, number);
                assert_memory_equal(nodes, wanted, 4 * (size_t)count);
                assert_true(largest == expected);
                assert_true(count <= last);
                last = count;
            }
            assert_int_equal(last, fct_tree_get(tree).root_count);
            free(nodes), free(wanted);
            fct_tree_destroy(tree);
            fct_mesh_release(&env, &mesh);
        }
}

/* The limit is sharp: just below the distance of the root, the root is opened. */
static void the_limit_itself_is_within(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 20);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    uint32_t *nodes = malloc(4 * (size_t)mesh.face_count), count;
    double limit = distance_of(tree, 0), largest;
    assert_int_equal(fct_tree_cut_at_distance(&env, tree, limit, nodes, &count, &largest), FCT_OK);
    assert_true(count == 1 && largest == limit);
    assert_int_equal(fct_tree_cut_at_distance(&env, tree, nextafter(limit, 0), nodes, &count, NULL), FCT_OK);
    assert_true(count > 1);
    free(nodes);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

static void what_is_no_distance_is_refused(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_grid(&env, 2);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    uint32_t nodes[8], count;
    assert_int_equal(fct_tree_cut_at_distance(&env, tree, -1, nodes, &count, NULL), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "distance"));
    assert_int_equal(fct_tree_cut_at_distance(&env, tree, NAN, nodes, &count, NULL), FCT_ERROR_DATA);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

static void a_wide_cut_is_the_same_for_every_thread_count(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, SANITIZED ? 50 : 120);
    roughen(&mesh, 0.01);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    uint32_t *nodes[3], counts[3];
    for (uint32_t t = 0; t < 3; ++t) {
        fct_env some = env;
        some.thread_count = t + 1;
        nodes[t] = malloc(4 * (size_t)mesh.face_count);
        assert_int_equal(fct_tree_cut_at_distance(&some, tree, 0.004, nodes[t], &counts[t], NULL), FCT_OK);
        assert_int_equal(counts[t], counts[0]);
        assert_memory_equal(nodes[t], nodes[0], 4 * (size_t)counts[0]);
    }
    assert_in_range(counts[0], 2000, mesh.face_count - 1); /* wide enough for the parallel cut of subtrees */
    for (int t = 0; t < 3; ++t) free(nodes[t]);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

static void survives_no_memory(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_sphere(&env, 10);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    uint32_t *nodes = malloc(4 * (size_t)mesh.face_count), count;
    double largest;
    long before = r.alive;
    fct_result result = FCT_ERROR_MEMORY;
    for (r.fail_at = 1; result != FCT_OK; ++r.fail_at) {
        r.allocations = 0;
        result = fct_tree_cut_at_distance(&env, tree, 0.1, nodes, &count, &largest);
        assert_int_equal(r.alive, before);
        if (result != FCT_OK) assert_int_equal(result, FCT_ERROR_MEMORY);
    }
    assert_true(r.fail_at > 3);
    free(nodes);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_coarsest_cut_within_a_distance),
                                       cmocka_unit_test(the_limit_itself_is_within),
                                       cmocka_unit_test(what_is_no_distance_is_refused),
                                       cmocka_unit_test(a_wide_cut_is_the_same_for_every_thread_count),
                                       cmocka_unit_test(survives_no_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
