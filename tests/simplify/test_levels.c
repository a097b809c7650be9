/* Levels of progressive meshes: their faces are those of simplifications, and they are the same after every
 * way that leads to them. */
#include "levels.h"

static fct_env env;

/* Each level has the faces of a simplification with the same target, and the finest those of the input. */
static void check_levels(const fct_mesh *mesh, fct_simplify_def def) {
    fct_progressive *progressive = progressive_of(&env, mesh, def, 0);
    fct_progressive_info info;
    fct_progressive_inspect(progressive, &info);
    def.refit_passes = 0;
    for (uint32_t i = 0; i <= 12; ++i) {
        def.target_faces = (uint32_t)(pow(i / 12., 2) * mesh->face_count);
        fct_simplify_stats stats;
        fct_mesh expected = simplified(&env, mesh, &def, &stats),
                 level = level_mesh(progressive, def.target_faces);
        assert_int_equal(fct_mesh_validate(&env, &level), FCT_OK);
        if (expected.face_count >= info.least_faces) assert_true(same_faces(&level, &expected));
        fct_progressive_inspect(progressive, &info);
        assert_int_equal(info.faces, level.face_count);
        assert_float_equal(info.error, stats.max_cost, 1e-6 * stats.max_cost);
        assert_memory_equal(level.origin, mesh->origin, sizeof level.origin);
        fct_mesh_release(&env, &expected);
        fct_mesh_release(&env, &level);
    }
    fct_progressive_destroy(progressive);
}

static void levels_are_simplifications(void **state) {
    (void)state;
    fct_mesh meshes[] = {make_sphere(&env, 14), make_grid(&env, 14), make_cube(&env, 6)};
    for (size_t i = 0; i < FCT_LENGTH(meshes); ++i) {
        check_levels(&meshes[i], fct_simplify_def_default());
        fct_mesh_release(&env, &meshes[i]);
    }
}

static void attributes_follow(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; ++kind) {
        fct_mesh torus = make_torus(&env, 10, kind & 1, kind & 2);
        for (int placement = 0; placement < 4; ++placement) {
            fct_simplify_def def = fct_simplify_def_default();
            def.placement = (fct_placement)placement;
            check_levels(&torus, def);
        }
        fct_mesh_release(&env, &torus);
    }
}

/* Locked vertices are in each level, with the bits of the input. */
static void locks_hold_in_levels(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; ++kind) {
        fct_mesh torus = make_torus(&env, 10, kind & 1, kind & 2);
        uint8_t *locks = calloc(torus.vertex_count, 1);
        for (uint32_t v = 0; v < torus.vertex_count; ++v) locks[v] = v % 23 == 0;
        for (uint32_t i = 0; i < 3 * torus.vertex_count; ++i) torus.normals[i] *= .5f; /* no unit length */
        fct_simplify_def def = fct_simplify_def_default();
        def.locks = locks;
        check_levels(&torus, def);
        fct_progressive *progressive = progressive_of(&env, &torus, def, 0);
        for (uint32_t faces = 0; faces <= torus.face_count; faces += torus.face_count / 4) {
            fct_mesh level = level_mesh(progressive, faces);
            for (uint32_t c = 0; c < 3 * torus.face_count; ++c) {
                size_t v = torus.triangles[c];
                bool found = !locks[v];
                for (uint32_t k = 0; k < 3 * level.face_count && !found; ++k) {
                    size_t w = level.triangles[k];
                    found =
                        !memcmp(level.positions + 3 * w, torus.positions + 3 * v, 12) &&
                        !memcmp(level.colors + 3 * w, torus.colors + 3 * v, 12) &&
                        !memcmp(level.normals + 3 * w, torus.normals + 3 * v, 12) &&
                        (!level.texcoords || !memcmp(level.texcoords + 2 * k, torus.texcoords + 2 * c, 8));
                }
                assert_true(found);
            }
            fct_mesh_release(&env, &level);
        }
        fct_progressive_destroy(progressive);
        free(locks);
        fct_mesh_release(&env, &torus);
    }
}

/* Any way to a level gives the same bytes, also from a file of the same progressive mesh. */
static void levels_do_not_depend_on_the_way(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, 12, true, true);
    fct_progressive *a = progressive_of(&env, &torus, fct_simplify_def_default(), 0),
                    *b = progressive_of(&env, &torus, fct_simplify_def_default(), 0);
    for (uint32_t i = 0; i < 40; ++i) {
        fct_progressive_go(a, torus.face_count * (i * 17 % 40) / 39);
        uint32_t target = torus.face_count * (i * 11 % 40) / 39;
        fct_progressive_go(b, 0);
        fct_mesh x = level_mesh(a, target), y = level_mesh(b, target);
        assert_true(same_mesh(&x, &y));
        fct_mesh_release(&env, &x);
        fct_mesh_release(&env, &y);
    }
    fct_progressive_destroy(a);
    fct_progressive_destroy(b);
    fct_mesh_release(&env, &torus);
}

/* The level for an error: the coarsest one whose error is not larger, beside a search of all levels. */
static void levels_are_found_by_their_error(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 14);
    fct_progressive *progressive = progressive_of(&env, &sphere, fct_simplify_def_default(), 10);
    fct_progressive_info info;
    for (double error = .5; error > 1e-5; error /= 1.7) {
        uint32_t coarsest = 0;
        for (uint32_t faces = sphere.face_count; faces >= 10; --faces) {
            fct_progressive_go(progressive, faces);
            fct_progressive_inspect(progressive, &info);
            if (info.error <= error) coarsest = info.faces;
        }
        assert_int_equal(fct_progressive_go_error(progressive, error), coarsest);
    }
    assert_int_equal(fct_progressive_go_error(progressive, INFINITY), 10);
    assert_int_equal(fct_progressive_go_error(progressive, 0), sphere.face_count);
    fct_progressive_destroy(progressive);
    fct_mesh_release(&env, &sphere);
}

/* A mesh so large that it is contracted in blocks: the same levels for every number of threads, and as close
 * to the input as those of a simplification. */
static void blocks_are_joined_in_order(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, SANITIZED ? 70 : 110, false, false), levels[2];
    fct_env one = env;
    one.thread_count = 1;
    env.thread_count = 4;
    fct_progressive *made[2] = {progressive_of(&one, &torus, fct_simplify_def_default(), 500),
                                progressive_of(&env, &torus, fct_simplify_def_default(), 500)};
    double before = INFINITY;
    for (uint32_t target = 600; target < torus.face_count; target = 5 * target / 3) {
        for (int i = 0; i < 2; ++i) levels[i] = level_mesh(made[i], target);
        assert_true(same_mesh(&levels[0], &levels[1]));
        assert_int_equal(fct_mesh_validate(&env, &levels[0]), FCT_OK);
        fct_progressive_info info;
        fct_progressive_inspect(made[0], &info);
        assert_in_range(info.faces, target - 1, target);
        assert_true(info.error <= before);
        before = info.error;
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = target, def.refit_passes = 0;
        fct_mesh_report report;
        assert_int_equal(fct_mesh_inspect(&env, &levels[0], &report), FCT_OK);
        assert_int_equal(report.boundary_edges + report.nonmanifold_edges + report.duplicate_faces, 0);
        fct_simplify_stats stats;
        fct_mesh direct = simplified(&env, &torus, &def, &stats);
        /* Blocks have the same order of costs: at most 34 % more error here, and 220 % without the keys. */
        assert_true(info.error < 1.5 * stats.max_cost);
        fct_mesh_release(&env, &direct);
        for (int i = 0; i < 2; ++i) fct_mesh_release(&env, &levels[i]);
    }
    fct_mesh finest = level_mesh(made[0], FCT_NONE);
    assert_int_equal(finest.face_count, torus.face_count);
    fct_mesh_release(&env, &finest);
    for (int i = 0; i < 2; ++i) fct_progressive_destroy(made[i]);
    fct_mesh_release(&env, &torus);
    env.thread_count = 0;
}

/* Five tetrahedra and one triangle, apart from each other: each vanishes as a whole, and comes back. */
static void bodies_vanish_and_come_back(void **state) {
    (void)state;
    enum { BODIES = 5 };
    static const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 4 * BODIES + 3, 4 * BODIES + 1, 0, &mesh), FCT_OK);
    for (uint32_t i = 0; i < BODIES; ++i) {
        float size = 1 + (float)i;
        for (uint32_t v = 0; v < 4; ++v)
            for (uint32_t k = 0; k < 3; ++k) mesh.positions[3 * (4 * i + v) + k] = v == k ? size : 0;
        for (uint32_t v = 0; v < 4; ++v) mesh.positions[3 * (4 * i + v)] += 10 * size;
        for (uint32_t c = 0; c < 12; ++c) mesh.triangles[12 * i + c] = 4 * i + faces[c];
    }
    for (uint32_t k = 0; k < 9; ++k) mesh.positions[12 * BODIES + k] = (float)(k % 4 == 0);
    for (uint32_t k = 0; k < 3; ++k) mesh.triangles[12 * BODIES + k] = 4 * BODIES + k;
    check_levels(&mesh, fct_simplify_def_default());
    fct_progressive *progressive = progressive_of(&env, &mesh, fct_simplify_def_default(), 0);
    fct_progressive_info info;
    fct_progressive_inspect(progressive, &info);
    assert_int_equal(info.least_faces, 0);
    fct_progressive_destroy(progressive);
    fct_mesh_release(&env, &mesh);
}

/* Halfway between two levels, each vertex is in the middle between itself and its ancestor. */
static void check_geomorph(bool hard) {
    fct_mesh torus = make_torus(&env, 12, hard, true), parts[5], coarse, fine;
    fct_progressive *progressive = progressive_of(&env, &torus, fct_simplify_def_default(), 60);
    coarse = level_mesh(progressive, 150);
    fine = level_mesh(progressive, 400);
    for (int i = 0; i < 5; ++i)
        assert_int_equal(fct_progressive_morph(progressive, 150, i / 4., &parts[i]), FCT_OK);
    assert_true(same_mesh(&parts[4], &fine));
    assert_float_equal(mesh_area(&parts[0]), mesh_area(&coarse), 1e-5 * mesh_area(&coarse));
    assert_float_equal(mesh_volume(&parts[0]), mesh_volume(&coarse), 1e-5);
    for (uint32_t v = 0; v < fine.vertex_count; ++v) {
        bool found = false;
        for (uint32_t w = 0; w < coarse.vertex_count; ++w)
            found |= !memcmp(parts[0].positions + 3 * v, coarse.positions + 3 * w, 12);
        assert_true(found);
        for (int i = 1; i < 4; ++i)
            for (uint32_t k = 3 * v; k < 3 * v + 3; ++k) {
                assert_float_equal(
                    parts[i].positions[k],
                    (1 - i / 4.) * (double)parts[0].positions[k] + i / 4. * (double)fine.positions[k], 1e-6);
                assert_float_equal(
                    parts[i].colors[k],
                    (1 - i / 4.) * (double)parts[0].colors[k] + i / 4. * (double)fine.colors[k], 1e-6);
            }
        assert_float_equal(v3_norm(v3_load(parts[2].normals + 3 * v)), 1, 1e-6);
    }
    for (uint32_t c = 0; c < 6 * fine.face_count; ++c)
        assert_float_equal(parts[1].texcoords[c],
                           .75 * (double)parts[0].texcoords[c] + .25 * (double)fine.texcoords[c], 1e-6);
    fct_mesh none;
    recorder heard = {0};
    env.message = recorder_message, env.message_user = &heard;
    assert_int_equal(fct_progressive_morph(progressive, 150, 1.5, &none), FCT_ERROR_DATA);
    assert_int_equal(fct_progressive_morph(progressive, 150, NAN, &none), FCT_ERROR_DATA);
    for (int i = 0; i < 5; ++i) fct_mesh_release(&env, &parts[i]);
    fct_mesh_release(&env, &coarse);
    fct_mesh_release(&env, &fine);
    fct_progressive_destroy(progressive);
    fct_mesh_release(&env, &torus);
}

static void geomorphs_lead_from_level_to_level(void **state) {
    (void)state;
    check_geomorph(false);
    check_geomorph(true);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {cmocka_unit_test(levels_are_simplifications),
                                       cmocka_unit_test(attributes_follow),
                                       cmocka_unit_test(locks_hold_in_levels),
                                       cmocka_unit_test(levels_do_not_depend_on_the_way),
                                       cmocka_unit_test(levels_are_found_by_their_error),
                                       cmocka_unit_test(blocks_are_joined_in_order),
                                       cmocka_unit_test(bodies_vanish_and_come_back),
                                       cmocka_unit_test(geomorphs_lead_from_level_to_level)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
