/* Closed forms: shapes that reduce to their fewest triangles without error, and the error of a sphere. */
#include "shapes.h"

static fct_env env;

static void a_cube_goes_back_to_twelve_triangles(void **state) {
    (void)state;
    fct_mesh cube = make_cube(&env, 12);
    assert_float_equal(mesh_volume(&cube), 1, 1e-6);
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 12;
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &cube, &def, &stats);
    assert_int_equal(out.face_count, 12);
    assert_int_equal(out.vertex_count, 8);
    assert_int_equal(stats.stopped_because, FCT_STOP_FACES);
    assert_true(stats.max_cost < 1e-5);
    assert_float_equal(mesh_volume(&out), 1, 1e-5);
    assert_float_equal(mesh_area(&out), 6, 1e-4);
    assert_int_equal(open_sides(&out, NULL), 0);
    for (uint32_t i = 0; i < 24; ++i) assert_float_equal(fabs(out.positions[i] - .5), .5, 1e-5);
    fct_mesh_release(&env, &out);

    /* An error bound finds the same mesh without a face count. */
    def.target_faces = 0;
    def.max_error = 1e-4;
    out = simplified(&env, &cube, &def, &stats);
    assert_int_equal(out.face_count, 12);
    assert_int_equal(stats.stopped_because, FCT_STOP_ERROR);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &cube);
}

static void a_flat_grid_goes_back_to_two_triangles(void **state) {
    (void)state;
    fct_mesh grid = make_grid(&env, 30);
    fct_simplify_def def = fct_simplify_def_default();
    def.max_error = 1e-4;
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &grid, &def, &stats);
    assert_int_equal(out.face_count, 2);
    assert_int_equal(stats.stopped_because, FCT_STOP_ERROR);
    assert_float_equal(mesh_area(&out), 1, 1e-5);
    for (uint32_t v = 0; v < out.vertex_count; ++v) {
        assert_float_equal(out.positions[3 * v + 2], 0, 1e-7);
        assert_float_equal(fabs(out.positions[3 * v] - .5), .5, 1e-5);
        assert_float_equal(fabs(out.positions[3 * v + 1] - .5), .5, 1e-5);
    }
    fct_mesh_release(&env, &out);

    /* Without boundary planes the sheet may shrink within the error bound. */
    def.boundary_weight = 0;
    def.max_error = .05;
    out = simplified(&env, &grid, &def, &stats);
    assert_true(mesh_area(&out) < .99);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &grid);
}

/* Three flat pages of 6 x 6 quads on one spine, whose edges have three faces. */
static void pages_go_back_to_two_triangles_each(void **state) {
    (void)state;
    enum { PAGES = 3, N = 6, PER_PAGE = N * (N + 1) };
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, N + 1 + PAGES * PER_PAGE, PAGES * 2 * N * N, 0, &mesh), FCT_OK);
    uint32_t *t = mesh.triangles;
    for (uint32_t p = 0; p < PAGES; ++p) {
        double angle = 2 * 3.14159265358979 * p / PAGES;
        for (uint32_t j = 0; j <= N; ++j) /* row 0 is the spine */
            for (uint32_t i = 0; i <= N; ++i) {
                float *at =
                    mesh.positions + 3 * (size_t)(j ? N + 1 + p * PER_PAGE + (j - 1) * (N + 1) + i : i);
                at[0] = (float)(j * cos(angle) / N), at[1] = (float)(j * sin(angle) / N),
                at[2] = (float)i / N;
            }
        for (uint32_t j = 0; j < N; ++j)
            for (uint32_t i = 0; i < N; ++i, t += 6) {
                uint32_t up = N + 1 + p * PER_PAGE + j * (N + 1) + i, low = j ? up - N - 1 : i;
                const uint32_t two[6] = {low, up, up + 1, low, up + 1, low + 1};
                memcpy(t, two, sizeof two);
            }
    }
    fct_simplify_def def = fct_simplify_def_default();
    def.max_error = 1e-4;
    fct_mesh out = simplified(&env, &mesh, &def, NULL);
    assert_int_equal(out.face_count, 2 * PAGES);
    assert_int_equal(out.vertex_count, 2 + 2 * PAGES);
    assert_float_equal(mesh_area(&out), PAGES, 1e-4);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

/* The mean squared distance from the unit sphere, over 36 points per face. */
static double sphere_error(const fct_mesh *mesh) {
    enum { N = 8 };
    double sum = 0, weight = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * (size_t)f;
        double area = v3_norm(face_cross(mesh, f));
        for (int i = 0; i < N; ++i)
            for (int j = 0; i + j < N; ++j) {
                double u = (i + 1. / 3) / N, v = (j + 1. / 3) / N;
                v3 p = v3_mad(v3_scale(vertex(mesh, t[0]), 1 - u - v), u, vertex(mesh, t[1]));
                sum += area * pow(v3_norm(v3_mad(p, v, vertex(mesh, t[2]))) - 1, 2);
                weight += area;
            }
    }
    return sum / weight;
}

static void error_on_a_sphere_falls_with_the_square_of_the_faces(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 80);
    fct_simplify_def def = fct_simplify_def_default();
    double error[3];
    for (uint32_t i = 0; i < 3; ++i) {
        def.target_faces = 100u << (2 * i);
        fct_mesh out = simplified(&env, &sphere, &def, NULL);
        assert_in_range(out.face_count, def.target_faces - 1, def.target_faces);
        assert_int_equal(open_sides(&out, NULL), 0);
        error[i] = sphere_error(&out);
        fct_mesh_release(&env, &out);
    }
    for (uint32_t i = 0; i < 2; ++i) {
        double power = log(error[i] / error[i + 1]) / log(4);
        assert_true(power > 1.7 && power < 2.3);
    }
    /* Equilateral triangles of area pi / 100, half inside and half outside the sphere, have an error of about
     * 6e-6. */
    assert_true(error[1] < 1.5e-5);
    fct_mesh_release(&env, &sphere);
}

static void refit_lowers_the_error(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 60);
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 200;
    fct_mesh with = simplified(&env, &sphere, &def, NULL);
    def.refit_passes = 0;
    fct_mesh without = simplified(&env, &sphere, &def, NULL);
    assert_true(sphere_error(&with) < .8 * sphere_error(&without));
    fct_mesh_release(&env, &with);
    fct_mesh_release(&env, &without);
    fct_mesh_release(&env, &sphere);
}

static void subset_placement_uses_input_positions(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 20);
    for (size_t i = 0; i < 3 * (size_t)sphere.vertex_count; ++i) sphere.positions[i] += 3;
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 100;
    def.placement = FCT_PLACE_SUBSET;
    fct_mesh out = simplified(&env, &sphere, &def, NULL);
    for (uint32_t v = 0; v < out.vertex_count; ++v) {
        bool found = false;
        for (uint32_t w = 0; w < sphere.vertex_count && !found; ++w)
            found = !memcmp(out.positions + 3 * v, sphere.positions + 3 * w, 3 * sizeof(float));
        assert_true(found);
    }
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &sphere);
}

static void placements_order_by_error(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 40);
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 300;
    def.refit_passes = 0;
    double error[4];
    for (int policy = FCT_PLACE_OPTIMAL; policy <= FCT_PLACE_SUBSET; ++policy) {
        def.placement = policy;
        fct_mesh out = simplified(&env, &sphere, &def, NULL);
        error[policy] = sphere_error(&out);
        fct_mesh_release(&env, &out);
    }
    assert_true(error[FCT_PLACE_OPTIMAL] < error[FCT_PLACE_SEGMENT]);
    assert_true(error[FCT_PLACE_OPTIMAL] < error[FCT_PLACE_SUBSET]);
    fct_mesh_release(&env, &sphere);
}

static void nothing_to_do_leaves_the_mesh(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 10);
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = sphere.face_count;
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &sphere, &def, &stats);
    assert_int_equal(out.face_count, sphere.face_count);
    assert_int_equal(out.vertex_count, sphere.vertex_count);
    assert_int_equal(stats.stopped_because, FCT_STOP_FACES);
    for (uint32_t c = 0; c < 3 * sphere.face_count; ++c)
        assert_memory_equal(out.positions + 3 * out.triangles[c], sphere.positions + 3 * sphere.triangles[c],
                            12);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &sphere);
}

static void error_bound_is_in_the_units_of_the_mesh(void **state) {
    (void)state;
    fct_simplify_def def = fct_simplify_def_default();
    uint32_t faces[2];
    for (int i = 0; i < 2; ++i) {
        double scale = i ? 1000 : 1;
        fct_mesh sphere = make_sphere(&env, 40);
        for (size_t k = 0; k < 3 * (size_t)sphere.vertex_count; ++k) sphere.positions[k] *= (float)scale;
        def.max_error = .01 * scale;
        fct_simplify_stats stats;
        fct_mesh out = simplified(&env, &sphere, &def, &stats);
        assert_int_equal(stats.stopped_because, FCT_STOP_ERROR);
        assert_true(stats.max_cost <= def.max_error && stats.max_cost > .5 * def.max_error);
        faces[i] = out.face_count;
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &sphere);
    }
    assert_true(faces[0] > 40 && faces[0] < 1000);
    assert_true(abs((int)faces[0] - (int)faces[1]) < (int)faces[0] / 10);
}

static void topology_is_kept_when_asked(void **state) {
    (void)state;
    /* No torus has fewer than 14 triangles. */
    enum { N = 24, M = 8 };
    fct_mesh torus;
    assert_int_equal(fct_mesh_create(&env, N * M, 2 * N * M, 0, &torus), FCT_OK);
    for (uint32_t i = 0; i < N; ++i)
        for (uint32_t j = 0; j < M; ++j) {
            double u = 6.283185307179586 * i / N, v = 6.283185307179586 * j / M;
            float *p = torus.positions + 3 * (i * M + j);
            p[0] = (float)((1 + .4 * cos(v)) * cos(u)), p[1] = (float)((1 + .4 * cos(v)) * sin(u));
            p[2] = (float)(.4 * sin(v));
            uint32_t a = i * M + j, b = (i + 1) % N * M + j, c = (i + 1) % N * M + (j + 1) % M;
            uint32_t d = i * M + (j + 1) % M, two[6] = {a, b, c, a, c, d};
            memcpy(torus.triangles + 6 * a, two, sizeof two);
        }
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 0;
    def.keep_topology = true;
    def.check_foldover = false;
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &torus, &def, &stats);
    assert_int_equal(stats.stopped_because, FCT_STOP_EXHAUSTED);
    assert_true(out.face_count >= 14 && out.face_count < 60);
    fct_mesh_report report;
    assert_int_equal(fct_mesh_inspect(&env, &out, &report), FCT_OK);
    assert_int_equal(report.nonmanifold_edges + report.boundary_edges + report.nonmanifold_vertices, 0);
    assert_int_equal((int)report.vertices - (int)report.edges + (int)report.faces, 0); /* Euler: genus 1 */
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &torus);
}

static void an_open_sheet_keeps_its_boundary_loop_with_topology(void **state) {
    (void)state;
    fct_mesh grid = make_grid(&env, 8);
    fct_simplify_def def = fct_simplify_def_default();
    def.keep_topology = true;
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &grid, &def, &stats);
    fct_mesh_report report;
    assert_int_equal(fct_mesh_inspect(&env, &out, &report), FCT_OK);
    assert_int_equal(stats.stopped_because, FCT_STOP_EXHAUSTED);
    assert_true(out.face_count >= 1 && out.face_count <= 2);
    assert_int_equal(report.boundary_loops, 1);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &grid);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cube_goes_back_to_twelve_triangles),
        cmocka_unit_test(pages_go_back_to_two_triangles_each),
        cmocka_unit_test(a_flat_grid_goes_back_to_two_triangles),
        cmocka_unit_test(error_on_a_sphere_falls_with_the_square_of_the_faces),
        cmocka_unit_test(refit_lowers_the_error),
        cmocka_unit_test(subset_placement_uses_input_positions),
        cmocka_unit_test(placements_order_by_error),
        cmocka_unit_test(nothing_to_do_leaves_the_mesh),
        cmocka_unit_test(error_bound_is_in_the_units_of_the_mesh),
        cmocka_unit_test(topology_is_kept_when_asked),
        cmocka_unit_test(an_open_sheet_keeps_its_boundary_loop_with_topology),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
