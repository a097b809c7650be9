/* The errors of a result, and that sweeps over blocks keep it valid, exact in its number of faces, and the
 * same for every number of threads. */
#include "shapes.h"

static fct_env env;

enum { N = 4 };

/* A square of N x N cells, whose middle vertex is raised by `height` and brighter by `light`. */
static fct_mesh make_bump(float height, float light) {
    fct_mesh mesh;
    assert_int_equal(
        fct_mesh_create(&env, (N + 1) * (N + 1), 2 * N * N, FCT_MESH_COLORS | FCT_MESH_TEXCOORDS, &mesh),
        FCT_OK);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        uint32_t x = v % (N + 1), y = v / (N + 1);
        bool middle = x == N / 2 && y == N / 2;
        const float p[3] = {(float)x, (float)y, middle ? height : 0};
        memcpy(mesh.positions + 3 * v, p, sizeof p);
        for (uint32_t k = 0; k < 3; ++k)
            mesh.colors[3 * v + k] = .1f + .05f * (float)x + (middle ? light * (float)(k + 1) : 0);
    }
    uint32_t *t = mesh.triangles;
    for (uint32_t y = 0; y < N; ++y)
        for (uint32_t x = 0; x < N; ++x) {
            uint32_t a = y * (N + 1) + x, b = a + 1, c = a + N + 2, d = a + N + 1;
            const uint32_t two[6] = {a, b, c, a, c, d};
            memcpy(t, two, sizeof two);
            t += 6;
        }
    for (uint32_t c = 0; c < 3 * mesh.face_count; ++c) {
        const float *p = mesh.positions + 3 * mesh.triangles[c];
        mesh.texcoords[2 * c] = p[0] / N, mesh.texcoords[2 * c + 1] = p[1] / N + (p[2] > 0 ? .2f : 0);
    }
    return mesh;
}

/* Two triangles replace the square: every sample is as far from them as it is high. Vertices count with a
 * twelfth of the areas around them, centroids with three quarters. */
static void errors_are_those_of_a_bump(void **state) {
    (void)state;
    const double height = .6, light = .1;
    fct_mesh mesh = make_bump((float)height, (float)light);
    double all = mesh_area(&mesh), middle = 0, faces = 0; /* around the middle vertex; their number */
    for (uint32_t f = 0; f < mesh.face_count; ++f)
        for (uint32_t k = 0; k < 3; ++k)
            if (mesh.triangles[3 * f + k] == N / 2 * (N + 1) + N / 2)
                middle += .5 * v3_norm(face_cross(&mesh, f)), ++faces;
    assert_true(faces == 6);
    /* the share of a square: the vertex itself, and its faces' centroids at a third */
    double share = (middle / 12 + .75 * middle / 9) / all;
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 2;
    def.placement = FCT_PLACE_SUBSET;
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &mesh, &def, &stats);
    assert_int_equal(out.face_count, 2);
    assert_true(fabs(stats.distance_rms - height * sqrt(share)) < 1e-5);
    assert_true(fabs(stats.distance_max - height) < 1e-5);
    /* one component: the mean over light, 2 light and 3 light squared */
    assert_true(fabs(stats.color_rms - light * sqrt(14 / 3. * share)) < 1e-5);
    assert_true(fabs(stats.texcoord_rms - .2 * sqrt(share)) < 1e-5);
    assert_true(stats.normal_rms == 0 && stats.lost_area == 0);
    fct_mesh_release(&env, &out);
    def.target_faces = mesh.face_count; /* nothing to do, no error */
    out = simplified(&env, &mesh, &def, &stats);
    assert_true(stats.distance_rms == 0 && stats.distance_max == 0 && stats.color_rms == 0);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

/* Tetrahedra with legs of 1 to 5: their areas are as the squares of these. The smaller ones vanish first. */
static void the_area_of_vanished_bodies_is_lost(void **state) {
    (void)state;
    enum { BODIES = 5 };
    static const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 4 * BODIES, 4 * BODIES, 0, &mesh), FCT_OK);
    for (uint32_t i = 0; i < BODIES; ++i) {
        float size = 1 + (float)i;
        for (uint32_t v = 0; v < 4; ++v)
            for (uint32_t k = 0; k < 3; ++k)
                mesh.positions[3 * (4 * i + v) + k] = (v == k + 1 ? size : 0) + (k == 0 ? 10 * size : 0);
        for (uint32_t c = 0; c < 12; ++c) mesh.triangles[12 * i + c] = 4 * i + faces[c];
    }
    for (uint32_t left = 0; left <= BODIES; ++left) {
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = 4 * left;
        fct_simplify_stats stats;
        fct_mesh out = simplified(&env, &mesh, &def, &stats);
        assert_int_equal(out.face_count, 4 * left);
        double lost = 0;
        for (uint32_t size = 1; size <= BODIES - left; ++size) lost += size * size / 55.;
        assert_float_equal(stats.lost_area, lost, 1e-6);
        assert_true(stats.distance_max < 1e-6);
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &mesh);
}

/* Two triangles that share a vertex, of the areas 8 and 1/2. The shortest side of the small one goes, and
 * with it two of its corners. */
static void a_lost_corner_counts_a_third(void **state) {
    (void)state;
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 5, 2, 0, &mesh), FCT_OK);
    const float p[15] = {0, 0, 0, 4, 0, 0, 4, 4, 0, 6, 4, 0, 6, 4.5f, 0};
    const uint32_t t[6] = {0, 1, 2, 2, 3, 4};
    memcpy(mesh.positions, p, sizeof p);
    memcpy(mesh.triangles, t, sizeof t);
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 1;
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &mesh, &def, &stats);
    assert_int_equal(out.face_count, 1);
    assert_float_equal(stats.lost_area, 2 / 3. * .5 / 8.5, 1e-12);
    fct_mesh_release(&env, &out);
    def.target_faces = 0;
    out = simplified(&env, &mesh, &def, &stats);
    assert_true(stats.lost_area == 1 && stats.distance_max == 0);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

/* A closed surface of 90,000 faces goes through several sweeps. */
static void blocks_give_the_same_on_all_threads(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 150);
    assert_true(sphere.face_count > 80000);
    const uint32_t targets[] = {40000, 3001, 500};
    for (int i = 0; i < 3; ++i) {
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = targets[i];
        fct_mesh out[2];
        fct_simplify_stats stats[2];
        for (int k = 0; k < 2; ++k) {
            fct_env own = env;
            own.thread_count = k ? 4 : 1;
            out[k] = simplified(&own, &sphere, &def, &stats[k]);
        }
        assert_int_equal(out[0].face_count, out[1].face_count);
        assert_int_equal(out[0].face_count, targets[i] / 2 * 2);
        assert_memory_equal(out[0].positions, out[1].positions, 12 * (size_t)out[0].vertex_count);
        assert_memory_equal(out[0].triangles, out[1].triangles, 12 * (size_t)out[0].face_count);
        assert_true(stats[0].distance_rms == stats[1].distance_rms && stats[0].max_cost == stats[1].max_cost);
        /* Equilateral triangles of n faces that cut a unit sphere best are .26 / n times its area away: the
         * mean square of h^2 (1/6 - r^2) over a triangle, with its plane at the mean height. */
        assert_true(stats[0].distance_rms < 8. / targets[i]);
        fct_mesh_report report;
        assert_int_equal(fct_mesh_inspect(&env, &out[0], &report), FCT_OK);
        assert_int_equal(report.boundary_edges + report.nonmanifold_edges + report.duplicate_faces +
                             report.degenerate_faces,
                         0);
        for (int k = 0; k < 2; ++k) fct_mesh_release(&env, &out[k]);
    }
    fct_mesh_release(&env, &sphere);
}

static void assert_same(const fct_mesh *a, const fct_mesh *b) {
    assert_int_equal(a->vertex_count, b->vertex_count);
    assert_int_equal(a->face_count, b->face_count);
    assert_memory_equal(a->positions, b->positions, 12 * (size_t)a->vertex_count);
    assert_memory_equal(a->triangles, b->triangles, 12 * (size_t)a->face_count);
    if (a->colors) assert_memory_equal(a->colors, b->colors, 12 * (size_t)a->vertex_count);
}

/* The first level is that of a run of its own. The refit of a level leaves no trace in the next one: without
 * refits, and after levels that are fitted, the contractions are the same. */
static void levels_continue_one_run(void **state) {
    (void)state;
    fct_mesh mesh = make_sphere(&env, 60);
    mesh.colors = malloc(12 * (size_t)mesh.vertex_count);
    for (uint32_t i = 0; i < 3 * mesh.vertex_count; ++i) mesh.colors[i] = .5f + .4f * mesh.positions[i];
    const uint32_t targets[3] = {9000, 800, 60};
    fct_simplify_def def = fct_simplify_def_default();
    fct_mesh fitted[3], plain[3];
    fct_simplify_stats stats[3], plain_stats[3];
    assert_int_equal(fct_simplify_levels(&env, &mesh, &def, targets, 3, fitted, stats), FCT_OK);
    fct_simplify_def alone = def;
    alone.target_faces = targets[0];
    fct_mesh first = simplified(&env, &mesh, &alone, NULL);
    assert_same(&fitted[0], &first);
    def.refit_passes = 0;
    assert_int_equal(fct_simplify_levels(&env, &mesh, &def, targets, 3, plain, plain_stats), FCT_OK);
    for (int i = 0; i < 3; ++i) {
        assert_int_equal(fitted[i].face_count, targets[i]);
        assert_int_equal(stats[i].faces_before, mesh.face_count);
        assert_memory_equal(fitted[i].triangles, plain[i].triangles, 12 * (size_t)targets[i]);
        assert_true(stats[i].max_cost == plain_stats[i].max_cost);
        assert_true(stats[i].distance_rms < plain_stats[i].distance_rms);
        assert_true(i == 0 || stats[i].distance_rms > 5 * stats[i - 1].distance_rms);
        fct_mesh_release(&env, &fitted[i]);
        fct_mesh_release(&env, &plain[i]);
    }
    const uint32_t wrong[2] = {800, 800};
    assert_int_equal(fct_simplify_levels(&env, &mesh, &def, wrong, 2, fitted, NULL), FCT_ERROR_DATA);
    assert_null(fitted[0].positions);
    assert_int_equal(fct_simplify_levels(&env, &mesh, &def, wrong, 0, fitted, NULL), FCT_ERROR_DATA);
    fct_mesh_release(&env, &first);
    free(mesh.colors);
    mesh.colors = NULL;
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(errors_are_those_of_a_bump),   cmocka_unit_test(the_area_of_vanished_bodies_is_lost),
        cmocka_unit_test(a_lost_corner_counts_a_third), cmocka_unit_test(blocks_give_the_same_on_all_threads),
        cmocka_unit_test(levels_continue_one_run),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
