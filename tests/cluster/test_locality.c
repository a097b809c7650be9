/* The build sorts a shuffled mesh, but the results have the ids of the mesh. */
#include "check_tree.h"
#include "shapes.h"

#include "cluster/tree/locality.h"

/* A sphere of 36,480 triangles with colours and materials, with faces, vertices or both shuffled. */
static fct_mesh make_shuffled(const fct_env *env, bool faces, bool vertices) {
    fct_mesh sphere = make_sphere(env, 96), mesh;
    uint32_t state = 7, *order = malloc(((size_t)sphere.face_count + sphere.vertex_count) * sizeof *order);
    assert_int_equal(fct_mesh_create(env, sphere.vertex_count + 1, sphere.face_count,
                                     FCT_MESH_COLORS | FCT_MESH_MATERIALS, &mesh),
                     FCT_OK);
    for (uint32_t v = 0; v < sphere.vertex_count; ++v) order[v] = v;
    for (uint32_t v = sphere.vertex_count; vertices && v-- > 1;) {
        uint32_t w = (uint32_t)(shape_random(&state) * v), other = order[w];
        order[w] = order[v], order[v] = other;
    }
    for (uint32_t v = 0; v < sphere.vertex_count; ++v)
        for (size_t k = 0; k < 3; ++k) {
            mesh.positions[3 * (size_t)order[v] + k] = sphere.positions[3 * (size_t)v + k];
            mesh.colors[3 * (size_t)order[v] + k] = (float)order[v] + 0.25f * (float)k;
        }
    for (size_t k = 0; k < 3; ++k) /* a vertex that no face uses */
        mesh.positions[3 * (size_t)sphere.vertex_count + k] =
            mesh.colors[3 * (size_t)sphere.vertex_count + k] = 2;
    for (uint32_t i = 0; i < 3 * sphere.face_count; ++i) mesh.triangles[i] = order[sphere.triangles[i]];
    for (uint32_t f = sphere.face_count; faces && f-- > 1;) {
        uint32_t g = (uint32_t)(shape_random(&state) * f), t[3];
        memcpy(t, mesh.triangles + 3 * (size_t)g, sizeof t);
        memcpy(mesh.triangles + 3 * (size_t)g, mesh.triangles + 3 * (size_t)f, sizeof t);
        memcpy(mesh.triangles + 3 * (size_t)f, t, sizeof t);
    }
    for (uint32_t f = 0; f < mesh.face_count; ++f) mesh.materials[f] = f % 2;
    mesh.material_count = 2;
    fct_mesh_release(env, &sphere);
    free(order);
    return mesh;
}

static void ids_are_those_of_the_mesh(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int which = 1; which < 4; ++which) {
        fct_mesh mesh = make_shuffled(&env, which & 1, which & 2);
        fct_tree *trees[2];
        for (uint32_t i = 0; i < 2; ++i) {
            env.thread_count = i + 1;
            trees[i] = tree_of(&env, &mesh, 1);
            check_tree(trees[i], &mesh);
        }
        fct_tree_view a = fct_tree_get(trees[0]), b = fct_tree_get(trees[1]);
        assert_memory_equal(a.face_ids, b.face_ids, a.face_count * sizeof *a.face_ids);
        assert_memory_equal(trees[0]->nodes, trees[1]->nodes, a.node_count * sizeof(fct_cluster));
        for (size_t p = 0; p < a.face_count; ++p)
            assert_int_equal(a.materials[p], mesh.materials[a.face_ids[p]]);
        for (size_t v = 0; v < a.vertex_count; ++v)
            assert_memory_equal(a.colors + 3 * v, mesh.colors + 3 * (size_t)a.vertex_ids[v], 12);
        for (int i = 0; i < 2; ++i) fct_tree_destroy(trees[i]);
        fct_mesh_release(&env, &mesh);
    }
}

static double mean_gap(const fct_mesh *mesh) {
    double gaps = 0;
    for (size_t i = 0; i + 3 < 3 * (size_t)mesh->face_count; ++i)
        gaps += fabs((double)mesh->triangles[i + 3] - (double)mesh->triangles[i]);
    return gaps / (3.0 * mesh->face_count * mesh->vertex_count);
}

static void only_what_is_scattered_is_sorted(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int which = 0; which < 4; ++which) {
        fct_mesh mesh = make_shuffled(&env, which & 1, which & 2);
        fct_local_mesh local;
        assert_int_equal(fct_local_mesh_create(&env, &mesh, 0, &local), FCT_OK);
        assert_true((local.faces != NULL) == (which > 0) && (local.vertices != NULL) == (which > 0));
        assert_true((local.mesh.triangles == mesh.triangles) == (which == 0));
        assert_true(mean_gap(&local.mesh) < 0.05);
        fct_local_mesh_release(&env, &local);
        fct_mesh_release(&env, &mesh);
    }
}

/* A needle along an axis: the cells are those of a cube around it. */
static void needles_are_sorted_along_their_axis(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (size_t axis = 0; axis < 3; ++axis) {
        fct_mesh mesh = make_shuffled(&env, true, true);
        fct_local_mesh local;
        for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i)
            if (i % 3 != axis) mesh.positions[i] = 0;
        assert_int_equal(fct_local_mesh_create(&env, &mesh, 0, &local), FCT_OK);
        assert_true(mean_gap(&local.mesh) < 0.01);
        fct_local_mesh_release(&env, &local);
        fct_mesh_release(&env, &mesh);
    }
}

static void survives_no_memory(void **state) {
    (void)state;
    fct_env plain = fct_env_default();
    fct_mesh mesh = make_shuffled(&plain, true, true);
    for (long nth = 1;; ++nth) {
        recorder r = {.fail_at = nth};
        fct_env env = recorder_env(&r);
        fct_local_mesh local;
        fct_result result = fct_local_mesh_create(&env, &mesh, 0, &local);
        if (result == FCT_OK) fct_local_mesh_release(&env, &local);
        assert_int_equal(r.alive, 0);
        if (result == FCT_OK) {
            assert_true(nth > 10);
            break;
        }
        assert_int_equal(result, FCT_ERROR_MEMORY);
    }
    fct_mesh_release(&plain, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ids_are_those_of_the_mesh), cmocka_unit_test(only_what_is_scattered_is_sorted),
        cmocka_unit_test(needles_are_sorted_along_their_axis), cmocka_unit_test(survives_no_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
