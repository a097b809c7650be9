/* Inputs that break other programs. Each gives a valid tree with both methods, in about the time of a good
 * mesh of the same size. */
#include <float.h>

#include "check_tree.h"

#include "facetree/partition.h"

static fct_mesh make(const fct_env *env, uint32_t vertices, uint32_t faces) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, vertices, faces, 0, &mesh), FCT_OK);
    memset(mesh.positions, 0, 12 * (size_t)vertices);
    memset(mesh.triangles, 0, 12 * (size_t)faces);
    return mesh;
}

static void set_vertex(fct_mesh *mesh, uint32_t v, double x, double y, double z) {
    float *p = mesh->positions + 3 * (size_t)v;
    p[0] = (float)x, p[1] = (float)y, p[2] = (float)z;
}

static void set_face(fct_mesh *mesh, uint32_t f, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *t = mesh->triangles + 3 * (size_t)f;
    t[0] = a, t[1] = b, t[2] = c;
}

/* Whether the clusters of every partition must be connected. */
enum { NEVER, ALWAYS };

/* Builds with both methods and costs, and once with materials, and checks the trees. Releases the mesh. */
static void check(fct_mesh *mesh, int connected) {
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_env plain = fct_env_default();
    for (int option = 0; option < 5; ++option) {
        if (option == 4) {
            mesh->materials = fct_allocate(&plain, mesh->face_count, sizeof *mesh->materials);
            mesh->material_count = 3, connected = NEVER;
            for (uint32_t f = 0; f < mesh->face_count; ++f) mesh->materials[f] = f / 5 % 3;
        }
        fct_tree_def def = fct_tree_def_default();
        def.method = option & 1 ? FCT_CLUSTER_GREEDY : FCT_CLUSTER_ROUNDS;
        def.cost = option & 2 ? FCT_COST_MEAN : FCT_COST_INCREMENT;
        fct_tree *tree = NULL;
        assert_int_equal(fct_tree_build(&env, mesh, &def, NULL, &tree), FCT_OK);
        check_tree(tree, mesh);
        assert_int_equal(fct_tree_verify(&env, tree), FCT_OK);
        uint32_t *nodes = malloc(4 * (size_t)mesh->face_count);
        for (uint32_t k = 1; connected == ALWAYS && k <= mesh->face_count; k *= 3) {
            fct_partition_quality quality;
            assert_int_equal(cut_tree(tree, k, nodes), k);
            assert_int_equal(fct_tree_quality(&env, tree, nodes, k, &quality), FCT_OK);
            assert_true(quality.connected);
        }
        free(nodes);
        fct_tree_destroy(tree);
        assert_int_equal(r.alive, 0);
    }
    fct_mesh_release(&plain, mesh);
}

static void one_and_two_faces(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh one = make(&env, 3, 1);
    set_vertex(&one, 1, 1, 0, 0), set_vertex(&one, 2, 0, 1, 0), set_face(&one, 0, 0, 1, 2);
    check(&one, ALWAYS);
    fct_mesh two = make(&env, 5, 2); /* share only a vertex */
    for (uint32_t v = 0; v < 5; ++v) set_vertex(&two, v, v, v * v, 0);
    set_face(&two, 0, 0, 1, 2), set_face(&two, 1, 2, 3, 4);
    check(&two, NEVER);
}

static void no_faces_is_an_error(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh none = {0};
    fct_tree *tree;
    assert_int_equal(fct_tree_build(&env, &none, NULL, NULL, &tree), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "without faces"));
    fct_mesh mesh = make(&env, 3, 1);
    mesh.positions[4] = NAN;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_ERROR_DATA);
    mesh.positions[4] = 0, mesh.triangles[1] = 3;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_ERROR_DATA);
    assert_null(tree);
    fct_mesh_release(&env, &mesh);
}

static void options_out_of_range(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_grid(&env, 3);
    fct_tree *tree;
    const double bad[3] = {NAN, INFINITY, 2e30};
    for (int k = 0; k < 9; ++k) {
        fct_tree_def def = fct_tree_def_default();
        *(k % 3 == 0 ? &def.fit_weight : k % 3 == 1 ? &def.direction_weight : &def.shape_weight) = bad[k / 3];
        assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_ERROR_DATA);
        assert_null(tree);
        assert_non_null(strstr(r.text, "at most 1e30"));
    }
    fct_tree_def def = fct_tree_def_default();
    def.max_cost = NAN;
    assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_ERROR_DATA);
    def = fct_tree_def_default();
    def.size = 8;
    assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_ERROR_DATA);
    for (int cost = 0; cost < 2; ++cost) { /* the largest allowed weights give finite numbers */
        def = fct_tree_def_default();
        def.cost = cost ? FCT_COST_MEAN : FCT_COST_INCREMENT;
        def.fit_weight = def.direction_weight = def.shape_weight = 1e30;
        assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_OK);
        assert_int_equal(fct_tree_verify(&env, tree), FCT_OK);
        fct_tree_destroy(tree);
    }
    fct_mesh_release(&env, &mesh);
    assert_int_equal(r.alive, 0);
}

static void degenerate_faces(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh points = make(&env, 300, 100); /* all vertices in one place */
    for (uint32_t f = 0; f < 100; ++f) set_face(&points, f, 3 * f, 3 * f + 1, 3 * f + 2);
    check(&points, NEVER);
    fct_mesh same = make(&env, 1, 1000); /* three equal corners per face */
    check(&same, NEVER);
    fct_mesh line = make(&env, 1002, 1000);
    for (uint32_t v = 0; v < 1002; ++v) set_vertex(&line, v, v, 2 * v, 3 * v);
    for (uint32_t f = 0; f < 1000; ++f) set_face(&line, f, f, f + 1, f + 2);
    check(&line, ALWAYS);
    fct_mesh doubles = make_grid(&env, 20); /* every face twice: once reversed, or with two equal corners */
    fct_mesh twice = make(&env, doubles.vertex_count, 2 * doubles.face_count);
    memcpy(twice.positions, doubles.positions, 12 * (size_t)doubles.vertex_count);
    for (uint32_t f = 0; f < doubles.face_count; ++f) {
        const uint32_t *t = doubles.triangles + 3 * f;
        set_face(&twice, 2 * f, t[0], t[1], t[2]);
        set_face(&twice, 2 * f + 1, t[0], f % 3 ? t[2] : t[0], t[1]);
    }
    fct_mesh_release(&env, &doubles);
    check(&twice, NEVER);
}

static void extents(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    const double scales[] = {1e-30, 1e-18, 1e18, 1e30};
    for (int i = 0; i < 4; ++i) {
        fct_mesh mesh = make_sphere(&env, 12);
        for (uint32_t k = 0; k < 3 * mesh.vertex_count; ++k)
            mesh.positions[k] = (float)((double)mesh.positions[k] * scales[i]);
        check(&mesh, ALWAYS);
    }
    fct_mesh far = make_sphere(&env, 12);
    for (uint32_t k = 0; k < 3 * far.vertex_count; ++k) far.positions[k] += 4096;
    check(&far, ALWAYS);
    fct_mesh needle = make_sphere(&env, 12);
    for (uint32_t k = 0; k < needle.vertex_count; ++k) needle.positions[3 * k] *= 1e12f;
    check(&needle, ALWAYS);
    fct_mesh whole = make_sphere(&env, 12); /* the largest floats, with most of the extent along a diagonal */
    for (uint32_t v = 0; v < whole.vertex_count; ++v) {
        float *p = whole.positions + 3 * v, along = p[0] < 0 ? -1 : 1;
        for (int k = 0; k < 3; ++k) p[k] = v % 2 ? along * FLT_MAX : p[k] * 1e37f;
    }
    check(&whole, ALWAYS);
}

static void scattered_triangles(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint32_t count = 8000, seed = 1;
    fct_mesh mesh = make(&env, 3 * count, count);
    for (uint32_t v = 0; v < 3 * count; ++v) {
        double p[3];
        for (int k = 0; k < 3; ++k) seed = seed * 1664525u + 1013904223u, p[k] = (seed >> 8) / 16777216.0;
        uint32_t f = v / 3;
        set_vertex(&mesh, v, f % 27 + p[0], f / 27 % 27 + p[1], f / 729 + p[2]);
    }
    for (uint32_t f = 0; f < count; ++f) set_face(&mesh, f, 3 * f, 3 * f + 1, 3 * f + 2);
    check(&mesh, NEVER);
}

/* One part with most of the faces and many single faces: little height is left for the join. */
static void large_and_small_parts(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (uint32_t loose = 1; loose < 3000; loose = loose * 4 + 1) {
        fct_mesh sphere = make_sphere(&env, 10);
        fct_mesh mesh = make(&env, sphere.vertex_count + 3 * loose, sphere.face_count + loose);
        memcpy(mesh.positions, sphere.positions, 12 * (size_t)sphere.vertex_count);
        memcpy(mesh.triangles, sphere.triangles, 12 * (size_t)sphere.face_count);
        for (uint32_t i = 0; i < loose; ++i) {
            uint32_t v = sphere.vertex_count + 3 * i;
            double x = pow(1.01, i % 1000) * 2;
            set_vertex(&mesh, v, x, 0, 0), set_vertex(&mesh, v + 1, x, 1, 0),
                set_vertex(&mesh, v + 2, x, 0, 1);
            set_face(&mesh, sphere.face_count + i, v, v + 1, v + 2);
        }
        fct_mesh_release(&env, &sphere);
        check(&mesh, NEVER);
    }
}

static void book_of_one_spine(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint32_t count = 6000;
    fct_mesh mesh = make(&env, count + 2, count);
    set_vertex(&mesh, 1, 0, 0, 1);
    for (uint32_t f = 0; f < count; ++f) {
        double angle = 2 * 3.14159265358979 * f / count;
        set_vertex(&mesh, f + 2, cos(angle), sin(angle), 0.5);
        set_face(&mesh, f, 0, 1, f + 2);
    }
    check(&mesh, ALWAYS);
}

static void fan_of_one_vertex(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint32_t count = 6000;
    for (int closed = 0; closed < 2;
         ++closed) { /* a disc; the lid of a cylinder with its wall, whose centre is a hub */
        fct_mesh mesh = make(&env, 2 * count + 1, closed ? 2 * count : count);
        for (uint32_t f = 0; f < count; ++f) {
            double angle = 2 * 3.14159265358979 * f / count;
            set_vertex(&mesh, f + 1, cos(angle), sin(angle), 0);
            set_vertex(&mesh, count + f + 1, 1.001 * cos(angle), 1.001 * sin(angle), -1e-3);
            set_face(&mesh, f, 0, f + 1, (f + 1) % count + 1);
            if (closed) set_face(&mesh, count + f, f + 1, count + f + 1, (f + 1) % count + 1);
        }
        check(&mesh, ALWAYS);
    }
}

static void strips(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint32_t count = 6000;
    for (int kind = 0; kind < 3; ++kind) { /* equal steps; steps that grow by .1 %; a spiral */
        fct_mesh mesh = make(&env, count + 2, count);
        double x = 0, step = 1;
        for (uint32_t v = 0; v < count + 2; ++v) {
            if (kind == 2)
                set_vertex(&mesh, v, (1 + v * 1e-3) * cos(v * 0.01), (1 + v * 1e-3) * sin(v * 0.01),
                           v % 2 * 0.1);
            else
                set_vertex(&mesh, v, x, v % 2 ? step : 0, 0);
            x += step;
            if (kind == 1) step *= 1.001;
        }
        for (uint32_t f = 0; f < count; ++f) set_face(&mesh, f, f, f + 1, f + 2);
        check(&mesh, ALWAYS);
    }
}

static void flat_grid(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 100);
    check(&mesh, ALWAYS);
}

/* Chains of every length: each face shares an edge with the one before. Short chains come closest to the
 * limit of depth. */
static void short_chains(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (uint32_t count = 2; count < 70; ++count) {
        fct_mesh mesh = make(&env, count + 2, count);
        double size = 1;
        for (uint32_t v = 0; v < count + 2; ++v, size *= 1.7) set_vertex(&mesh, v, size, v % 2 ? size : 0, 0);
        for (uint32_t f = 0; f < count; ++f) set_face(&mesh, f, f, f + 1, f + 2);
        check(&mesh, ALWAYS);
    }
}

/* Each allocation fails once while a hub is contracted and a loose face is joined. */
static void no_memory_for_odd_shapes(void **state) {
    (void)state;
    fct_env plain = fct_env_default();
    uint32_t count = 400;
    fct_mesh mesh = make(&plain, 2 * count + 5, 2 * count + 1);
    for (uint32_t f = 0; f < count; ++f) {
        double angle = 2 * 3.14159265358979 * f / count;
        set_vertex(&mesh, f + 1, cos(angle), sin(angle), 0);
        set_vertex(&mesh, count + f + 1, 1.001 * cos(angle), 1.001 * sin(angle), -1e-3);
        set_face(&mesh, f, 0, f + 1, (f + 1) % count + 1);
        set_face(&mesh, count + f, f + 1, count + f + 1, (f + 1) % count + 1);
    }
    set_face(&mesh, 2 * count, 2 * count + 1, 2 * count + 2, 2 * count + 3);
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_tree_def def = fct_tree_def_default();
    def.cost = FCT_COST_MEAN;
    for (r.fail_at = 1;; ++r.fail_at) {
        r.allocations = 0;
        fct_tree *tree;
        fct_result result = fct_tree_build(&env, &mesh, &def, NULL, &tree);
        fct_tree_destroy(tree);
        assert_int_equal(r.alive, 0);
        if (result == FCT_OK) break;
        assert_int_equal(result, FCT_ERROR_MEMORY);
    }
    assert_true(r.fail_at > 20);
    fct_mesh_release(&plain, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(one_and_two_faces),
                                       cmocka_unit_test(no_faces_is_an_error),
                                       cmocka_unit_test(options_out_of_range),
                                       cmocka_unit_test(degenerate_faces),
                                       cmocka_unit_test(extents),
                                       cmocka_unit_test(scattered_triangles),
                                       cmocka_unit_test(large_and_small_parts),
                                       cmocka_unit_test(book_of_one_spine),
                                       cmocka_unit_test(fan_of_one_vertex),
                                       cmocka_unit_test(strips),
                                       cmocka_unit_test(flat_grid),
                                       cmocka_unit_test(short_chains),
                                       cmocka_unit_test(no_memory_for_odd_shapes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
