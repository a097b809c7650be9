/* Neighbours of labels against a count over all pairs of sides, and against the dual graph. */
#include "cluster/shapes.h"

#include "base/math/vec.h"
#include "facetree/dual.h"
#include "facetree/partition.h"

static void *copy_of_numbers(uint32_t count, uint32_t step) {
    uint32_t *labels = malloc(4 * (size_t)count);
    for (uint32_t i = 0; i < count; ++i) labels[i] = i / step;
    return labels;
}

/* With one label per face, pairs and lengths are those of the dual graph, up to float rounding. */
static void faces_as_labels_are_the_dual_graph(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int shape = 0; shape < SHAPES; ++shape) {
        fct_mesh mesh = make_shape(&env, shape);
        uint32_t *labels = copy_of_numbers(mesh.face_count, 1);
        fct_dual dual;
        fct_adjacency found;
        assert_int_equal(fct_dual_build(&env, &mesh, &dual), FCT_OK);
        assert_int_equal(fct_labels_adjacency(&env, &mesh, labels, mesh.face_count, &found), FCT_OK);
        assert_int_equal(found.pair_count, dual.edge_count);
        assert_memory_equal(found.pairs, dual.edges, 8 * (size_t)dual.edge_count);
        for (uint32_t i = 0; i < dual.edge_count; ++i)
            assert_true(fabs(found.lengths[i] - (double)dual.lengths[i]) <= 1e-6 * found.lengths[i]);
        fct_adjacency_release(&env, &found);
        fct_dual_release(&env, &dual);
        fct_mesh_release(&env, &mesh);
        free(labels);
    }
}

static bool has_side(const uint32_t *t, uint32_t a, uint32_t b) {
    for (int k = 0; k < 3; ++k)
        if ((t[k] == a && t[(k + 1) % 3] == b) || (t[k] == b && t[(k + 1) % 3] == a)) return true;
    return false;
}

/* Shared edges of two labels from all pairs of faces. Needs at most two faces per edge. */
static uint32_t count_shared(const fct_mesh *mesh, const uint32_t *labels, uint32_t a, uint32_t b,
                             double *length) {
    uint32_t count = 0;
    *length = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f)
        for (uint32_t g = 0; g < mesh->face_count; ++g) {
            if (labels[f] != a || labels[g] != b) continue;
            const uint32_t *t = mesh->triangles + 3 * (size_t)f;
            for (int k = 0; k < 3; ++k) {
                if (!has_side(mesh->triangles + 3 * (size_t)g, t[k], t[(k + 1) % 3])) continue;
                ++count;
                *length += v3_norm(v3_sub(v3_load(mesh->positions + 3 * (size_t)t[k]),
                                          v3_load(mesh->positions + 3 * (size_t)t[(k + 1) % 3])));
            }
        }
    return count;
}

static void shared_edges_and_lengths(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int shape = 1; shape < 5; ++shape) {
        fct_mesh mesh = make_shape(&env, shape);
        enum { STEP = 60 };
        uint32_t *labels = copy_of_numbers(mesh.face_count, STEP);
        uint32_t count = (mesh.face_count + STEP - 1) / STEP, pair = 0;
        fct_adjacency found;
        assert_int_equal(fct_labels_adjacency(&env, &mesh, labels, count, &found), FCT_OK);
        for (uint32_t a = 0; a < count; ++a)
            for (uint32_t b = a + 1; b < count; ++b) {
                double length;
                uint32_t edges = count_shared(&mesh, labels, a, b, &length);
                if (edges == 0) continue;
                assert_true(pair < found.pair_count);
                assert_int_equal(found.pairs[2 * pair], a);
                assert_int_equal(found.pairs[2 * pair + 1], b);
                assert_int_equal(found.edges[pair], edges);
                assert_true(fabs(found.lengths[pair] - length) <= 1e-12 * length);
                ++pair;
            }
        assert_int_equal(pair, found.pair_count);
        fct_adjacency_release(&env, &found);
        fct_mesh_release(&env, &mesh);
        free(labels);
    }
}

static void neighbours_of_each_label_ascend(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 12);
    uint32_t *labels = copy_of_numbers(mesh.face_count, 7), count = (mesh.face_count + 6) / 7 + 2, ends = 0;
    fct_adjacency found;
    assert_int_equal(fct_labels_adjacency(&env, &mesh, labels, count, &found), FCT_OK);
    assert_int_equal(found.label_count, count);
    assert_int_equal(found.first[0], 0);
    assert_int_equal(found.first[count], 2 * found.pair_count);
    for (uint32_t a = 0; a < count; ++a)
        for (uint32_t i = found.first[a]; i < found.first[a + 1]; ++i, ++ends) {
            uint32_t b = found.others[i];
            const uint32_t *pair = found.pairs + 2 * (size_t)found.other_pairs[i];
            assert_true(i == found.first[a] || found.others[i - 1] < b);
            assert_int_equal(pair[0], a < b ? a : b);
            assert_int_equal(pair[1], a < b ? b : a);
        }
    assert_int_equal(ends, 2 * found.pair_count);
    /* a label without faces has no neighbours */
    assert_int_equal(found.first[count - 1], found.first[count]);
    fct_adjacency_release(&env, &found);
    fct_mesh_release(&env, &mesh);
    free(labels);
}

/* Five faces with labels 0 1 0 1 2 around one edge of length 1: four links of length 1/2, three of them 0-1.
 */
static void an_edge_with_many_faces_is_a_chain(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_book(&env, 5);
    static const uint32_t labels[5] = {0, 1, 0, 1, 2};
    fct_adjacency found;
    assert_int_equal(fct_labels_adjacency(&env, &mesh, labels, 3, &found), FCT_OK);
    assert_int_equal(found.pair_count, 2);
    assert_true(found.pairs[0] == 0 && found.pairs[1] == 1 && found.pairs[2] == 1 && found.pairs[3] == 2);
    assert_true(found.edges[0] == 1 && found.edges[1] == 1);
    assert_true(fabs(found.lengths[0] - 1.5) < 1e-12 && fabs(found.lengths[1] - 0.5) < 1e-12);
    fct_adjacency_release(&env, &found);
    fct_mesh_release(&env, &mesh);
}

static void bad_labels_are_refused(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_grid(&env, 2);
    uint32_t labels[8] = {0, 1, 1, 0, 0, 2, 0, 0};
    fct_adjacency found;
    assert_int_equal(fct_labels_adjacency(&env, &mesh, labels, 2, &found), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "face 5: label 2 is out of range"));
    assert_null(found.pairs);
    mesh.triangles[4] = 100;
    assert_int_equal(fct_labels_adjacency(&env, &mesh, labels, 3, &found), FCT_ERROR_DATA);
    fct_mesh_release(&env, &mesh);
}

static void survives_no_memory(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_grid(&env, 6);
    uint32_t *labels = copy_of_numbers(mesh.face_count, 3);
    long before = r.alive;
    fct_result result = FCT_ERROR_MEMORY;
    for (r.fail_at = 1; result != FCT_OK; ++r.fail_at) {
        fct_adjacency found;
        r.allocations = 0;
        result = fct_labels_adjacency(&env, &mesh, labels, mesh.face_count, &found);
        if (result == FCT_OK) {
            fct_adjacency_release(&env, &found);
        } else {
            assert_int_equal(result, FCT_ERROR_MEMORY);
            assert_null(found.pairs);
        }
        assert_int_equal(r.alive, before);
    }
    assert_true(r.fail_at > 12);
    fct_mesh_release(&env, &mesh);
    free(labels);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(faces_as_labels_are_the_dual_graph),
                                       cmocka_unit_test(shared_edges_and_lengths),
                                       cmocka_unit_test(neighbours_of_each_label_ascend),
                                       cmocka_unit_test(an_edge_with_many_faces_is_a_chain),
                                       cmocka_unit_test(bad_labels_are_refused),
                                       cmocka_unit_test(survives_no_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
