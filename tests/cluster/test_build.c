/* Trees of generated meshes: check_tree.h, partitions, roots, costs, materials, equal bits for every thread
 * count, and a failure of each allocation. */
#include "check_tree.h"

#include "cluster/merge/work.h"

static fct_tree *build(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def) {
    fct_tree *tree = NULL;
    assert_int_equal(fct_tree_build(env, mesh, def, NULL, &tree), FCT_OK);
    assert_non_null(tree);
    check_tree(tree, mesh);
    return tree;
}

static fct_tree_def def_of(fct_cluster_method method) {
    fct_tree_def def = fct_tree_def_default();
    def.method = method;
    return def;
}

static void all_options(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int option = 0; option < 16; ++option) {
        fct_tree_def def = def_of(option & 8 ? FCT_CLUSTER_GREEDY : FCT_CLUSTER_ROUNDS);
        def.cost = option & 1 ? FCT_COST_MEAN : FCT_COST_INCREMENT;
        def.fit_measure = option & 2 ? FCT_FIT_POINTS : FCT_FIT_AREA;
        fct_mesh mesh = option & 4 ? make_sphere(&env, 40) : make_grid(&env, 50);
        fct_tree *tree = build(&env, &mesh, &def);
        fct_tree_view view = fct_tree_get(tree);
        assert_int_equal(view.root_count, 1);
        assert_true(view.def.fit_weight >= 0 && view.def.method == def.method && !view.def.source);
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
}

static void partitions_are_exact_and_connected(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int method = 0; method < 2; ++method)
        for (int shape = 0; shape < 2; ++shape) {
            fct_tree_def def = def_of((fct_cluster_method)method);
            fct_mesh mesh = shape ? make_sphere(&env, 12) : make_grid(&env, 14);
            fct_tree *tree = build(&env, &mesh, &def);
            fct_tree_view view = fct_tree_get(tree);
            uint32_t *nodes = malloc(4 * (size_t)view.face_count),
                     *labels = malloc(4 * (size_t)view.face_count);
            double deviation = INFINITY;
            for (uint32_t k = 1; k <= view.face_count; k += 1 + k / 8) {
                assert_int_equal(cut_tree(tree, k, nodes), k);
                fct_partition_quality quality;
                assert_int_equal(fct_tree_quality(&env, tree, nodes, k, &quality), FCT_OK);
                assert_true(quality.connected);
                assert_true(quality.mean_normal_deviation <= deviation + 1e-12);
                deviation = quality.mean_normal_deviation;
                memset(labels, 0xFF, 4 * (size_t)view.face_count);
                assert_int_equal(fct_tree_labels(&env, tree, nodes, k, labels), FCT_OK);
                for (uint32_t f = 0; f < view.face_count; ++f) assert_true(labels[f] < k);
            }
            assert_int_equal(cut_tree(tree, 0, nodes), 1);
            assert_int_equal(cut_tree(tree, UINT32_MAX, nodes), view.face_count);
            free(nodes);
            free(labels);
            fct_tree_destroy(tree);
            fct_mesh_release(&env, &mesh);
        }
}

/* A flat grid with one fold. At two clusters, each side of the fold is one, and every figure has a closed
 * form. */
static void quality_of_a_folded_sheet(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 16);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * v;
        if (p[0] > 0.5f) p[2] = p[0] - 0.5f, p[0] = 0.5f;
    }
    fct_tree_def def = fct_tree_def_default();
    fct_tree *tree = build(&env, &mesh, &def);
    uint32_t nodes[2];
    assert_int_equal(cut_tree(tree, 2, nodes), 2);
    fct_partition_quality q;
    assert_int_equal(fct_tree_quality(&env, tree, nodes, 2, &q), FCT_OK);
    assert_true(q.connected && q.mean_fit < 1e-12 && q.mean_direction < 1e-12 &&
                q.mean_normal_deviation < 1e-12);
    assert_true(fabs(q.mean_irregularity - 9 / (4 * 3.14159265358979 * 0.5)) < 1e-5);
    assert_true(fabs(q.box_area - 2 * 2 * 0.5 / 1.5) < 1e-5);
    assert_int_equal(cut_tree(tree, 1, nodes), 1);
    assert_int_equal(fct_tree_quality(&env, tree, nodes, 1, &q), FCT_OK);
    /* both halves at 45 degrees to the mean normal: |n_i - n|^2 = 2 - sqrt 2 */
    assert_true(fabs(q.mean_normal_deviation - (2 - sqrt(2))) < 1e-6);
    assert_true(fabs(q.mean_direction - pow(1 - sqrt(0.5), 2)) < 1e-6);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

static void roots_and_costs(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 12);
    fct_tree_def def = fct_tree_def_default();
    fct_tree *whole = build(&env, &mesh, &def);
    fct_tree_view all = fct_tree_get(whole);
    uint32_t *nodes = malloc(4 * (size_t)all.face_count);
    for (uint32_t roots = 1; roots <= all.face_count; roots = roots * 3 + 1) {
        def.root_count = roots;
        fct_tree *tree = build(&env, &mesh, &def);
        assert_int_equal(fct_tree_get(tree).root_count, roots);
        assert_int_equal(cut_tree(tree, 1, nodes), roots);
        for (uint32_t i = 0; i < roots; ++i) {
            fct_cluster root;
            fct_tree_cluster(tree, nodes[i], &root);
            if (roots > 1)
                assert_true(nodes[i] >= fct_tree_get(tree).node_count || root.cost <= whole->nodes[0].cost);
        }
        fct_tree_destroy(tree);
    }
    def.root_count = 1;
    def.max_cost = (double)whole->nodes[20].cost;
    fct_tree *cut = build(&env, &mesh, &def);
    uint32_t expected = fct_tree_count_at_cost(whole, def.max_cost);
    assert_in_range(expected, 2, 21);
    assert_int_equal(fct_tree_get(cut).root_count, expected);
    assert_int_equal(fct_tree_count_at_cost(whole, -1e30), all.face_count);
    assert_int_equal(fct_tree_count_at_cost(whole, INFINITY), 1);
    fct_tree_destroy(cut);
    def.max_cost = -1e30;
    cut = build(&env, &mesh, &def);
    assert_int_equal(fct_tree_get(cut).node_count, 0);
    fct_tree_destroy(cut);
    fct_tree_destroy(whole);
    fct_mesh_release(&env, &mesh);
    free(nodes);
}

static void materials_come_first(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int method = 0; method < 2; ++method) {
        fct_mesh mesh = make_grid(&env, 60);
        mesh.materials = fct_allocate(&env, mesh.face_count, sizeof *mesh.materials);
        mesh.material_count = 3;
        for (uint32_t f = 0; f < mesh.face_count; ++f) mesh.materials[f] = f / 2 % 60 / 20;
        fct_tree_def def = def_of((fct_cluster_method)method);
        fct_tree *tree = build(&env, &mesh, &def);
        fct_tree_view view = fct_tree_get(tree);
        uint32_t nodes[3];
        assert_int_equal(cut_tree(tree, 3, nodes), 3);
        for (int i = 0; i < 3; ++i) {
            const fct_cluster *c = &tree->nodes[nodes[i]];
            for (uint32_t p = c->first; p < c->first + c->count; ++p)
                assert_int_equal(view.materials[p], view.materials[c->first]);
        }
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
}

/* The tallest tree over n faces: 2 log2 n + 8 levels, on small trees 3 log2 n - 1. */
static void heights_are_limited(void **state) {
    (void)state;
    for (uint32_t k = 1; k < 32; ++k) {
        assert_int_equal(fct_height_limit(1u << k, false), 3 * k - 1);
        assert_int_equal(fct_height_limit(1u << k, true), k <= 9 ? 3 * k - 1 : 2 * k + 8);
    }
    assert_int_equal(fct_height_limit(1, false), 0);
    assert_int_equal(fct_height_limit(1, true), 0);
}

static void same_for_every_thread_count(void **state) {
    (void)state;
    for (int method = 0; method < 2; ++method)
        for (int cost = 0; cost < 2; ++cost) {
            fct_tree *trees[3];
            fct_env envs[3];
            for (uint32_t t = 0; t < 3; ++t) {
                envs[t] = fct_env_default();
                envs[t].thread_count = t + 1;
                fct_mesh mesh = make_sphere(&envs[t], 70);
                fct_tree_def def = def_of((fct_cluster_method)method);
                def.cost = (fct_cluster_cost)cost;
                assert_int_equal(fct_tree_build(&envs[t], &mesh, &def, NULL, &trees[t]), FCT_OK);
                fct_mesh_release(&envs[t], &mesh);
            }
            fct_tree_view a = fct_tree_get(trees[0]);
            for (int t = 1; t < 3; ++t) {
                fct_tree_view b = fct_tree_get(trees[t]);
                assert_int_equal(a.node_count, b.node_count);
                assert_memory_equal(trees[0]->nodes, trees[t]->nodes, a.node_count * sizeof(fct_cluster));
                assert_memory_equal(a.face_ids, b.face_ids, 4 * (size_t)a.face_count);
            }
            for (int t = 0; t < 3; ++t) fct_tree_destroy(trees[t]);
        }
}

static void survives_no_memory(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_sphere(&env, 40); /* more faces than the rounds leave to greedy */
    mesh.materials = fct_allocate_zero(&env, mesh.face_count, sizeof *mesh.materials);
    mesh.material_count = 1;
    long before = r.alive;
    for (r.fail_at = 1;; ++r.fail_at) {
        r.allocations = 0;
        fct_tree_def def = fct_tree_def_default();
        def.cost = FCT_COST_MEAN;
        def.source = "memory";
        fct_tree *tree;
        fct_result result = fct_tree_build(&env, &mesh, &def, NULL, &tree);
        if (result == FCT_OK) {
            fct_tree_destroy(tree);
            assert_int_equal(r.alive, before);
            break;
        }
        assert_null(tree);
        assert_int_equal(result, FCT_ERROR_MEMORY);
        assert_int_equal(r.alive, before);
    }
    assert_true(r.fail_at > 20);
    fct_mesh_release(&env, &mesh);
    assert_int_equal(r.alive, 0);
}

static bool stop_at(void *user, const char *phase, double done) {
    (void)phase, (void)done;
    return --*(int *)user != 0;
}

static void can_be_cancelled_anywhere(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_sphere(&env, 40);
    long before = r.alive;
    env.progress = stop_at;
    int left, limit = 1;
    env.progress_user = &left;
    for (;; ++limit) {
        left = limit;
        fct_tree *tree;
        fct_result result = fct_tree_build(&env, &mesh, NULL, NULL, &tree);
        if (result == FCT_OK) {
            fct_tree_destroy(tree);
            break;
        }
        assert_int_equal(result, FCT_ERROR_CANCELLED);
        assert_null(tree);
        assert_int_equal(r.alive, before);
    }
    assert_true(limit > 5);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(all_options),
                                       cmocka_unit_test(partitions_are_exact_and_connected),
                                       cmocka_unit_test(quality_of_a_folded_sheet),
                                       cmocka_unit_test(roots_and_costs),
                                       cmocka_unit_test(materials_come_first),
                                       cmocka_unit_test(heights_are_limited),
                                       cmocka_unit_test(same_for_every_thread_count),
                                       cmocka_unit_test(survives_no_memory),
                                       cmocka_unit_test(can_be_cancelled_anywhere)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
