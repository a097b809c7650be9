/* The handle of the simplifier: a stop changes nothing, and neither does a mesh that is written in between.
 */
#include "handle.h"

static fct_env env;

enum { TARGETS = 4 };

/* Runs through the targets. bits: before which runs the state goes through a file. */
static fct_simplifier *run_chain(const fct_mesh *mesh, const fct_simplify_def *def,
                                 const uint32_t targets[TARGETS], unsigned bits) {
    fct_simplifier *s = made(&env, mesh, def);
    for (uint32_t i = 0; i < TARGETS; ++i) {
        if (bits >> i & 1) s = stopped(&env, s);
        run_to(s, targets[i]);
    }
    return s;
}

static void check_stops(const fct_mesh *mesh, fct_simplify_def def) {
    uint32_t f = mesh->face_count;
    const uint32_t targets[TARGETS] = {f - f / 10, f / 2, f / 5, f / 20};
    def.target_faces = targets[0];
    fct_mesh levels[TARGETS];
    assert_int_equal(fct_simplify_levels(&env, mesh, &def, targets, TARGETS, levels, NULL), FCT_OK);
    fct_simplifier *whole = made(&env, mesh, &def);
    for (uint32_t i = 0; i < TARGETS; ++i) {
        run_to(whole, targets[i]);
        assert_int_equal(fct_simplifier_faces(whole), levels[i].face_count);
        assert_true(has_mesh(&env, whole, levels[i]));
    }
    state_bytes expected = state_of(whole);
    for (unsigned bits = 0; bits < 1 << TARGETS; bits += 3) {
        fct_simplifier *s = run_chain(mesh, &def, targets, bits);
        state_bytes found = state_of(s);
        assert_true(same_bytes(found, expected));
        assert_true(has_mesh(&env, s, mesh_of(whole, true)));
        free(found.data);
        fct_simplifier_destroy(s);
    }
    free(expected.data);
    fct_simplifier_destroy(whole);
}

static void stops_change_nothing(void **state) {
    (void)state;
    fct_mesh meshes[] = {make_sphere(&env, 14),
                         make_grid(&env, 14),
                         make_cube(&env, 6),
                         make_torus(&env, 10, false, false),
                         make_torus(&env, 10, false, true),
                         make_torus(&env, 10, true, true)};
    for (size_t i = 0; i < FCT_LENGTH(meshes); ++i) {
        check_stops(&meshes[i], fct_simplify_def_default());
        fct_mesh_release(&env, &meshes[i]);
    }
}

/* Each option that a state keeps, on a mesh where it matters. */
static void options_are_kept(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, 10, true, true), grid = make_grid(&env, 14);
    uint8_t *locks = calloc(torus.vertex_count + grid.vertex_count, 1);
    for (uint32_t v = 0; v < torus.vertex_count; v += 7) locks[v] = 1;
    for (int option = 0; option < 13; ++option) {
        fct_simplify_def def = fct_simplify_def_default();
        if (option < 3) def.placement = (fct_placement)(1 + option);
        if (option == 3) def.weighting = FCT_WEIGHT_ANGLE;
        if (option == 4) def.weighting = FCT_WEIGHT_UNIFORM;
        if (option == 5) def.color_weight = 0, def.texcoord_weight = .5;
        if (option == 6) def.color_weight = 0, def.texcoord_weight = 0, def.normal_weight = 0;
        if (option == 7) def.boundary_weight = 0, def.feature_threshold = INFINITY;
        if (option == 8) def.locks = locks;
        if (option == 9) def.lock_border = true;
        if (option == 10) def.keep_topology = true, def.refit_passes = 1;
        if (option == 11) def.check_foldover = false, def.regularization = 1e-4;
        if (option == 12) def.primitive = FCT_PRIMITIVE_FACE;
        check_stops(&torus, def);
        check_stops(&grid, def);
    }
    free(locks);
    fct_mesh_release(&env, &torus);
    fct_mesh_release(&env, &grid);
}

/* A mesh so large that runs make sweeps over blocks, for several numbers of threads. */
static void sweeps_and_threads_change_nothing(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, SANITIZED ? 70 : 110, false, true);
    fct_simplify_def def = fct_simplify_def_default();
    uint32_t f = torus.face_count;
    const uint32_t targets[TARGETS] = {f - f / 10, f / 2, f / 5, f / 50};
    state_bytes expected = {0};
    for (uint32_t threads = 1; threads <= 4; ++threads) {
        env.thread_count = threads;
        fct_simplifier *s = run_chain(&torus, &def, targets, threads * 5 % 16);
        state_bytes found = state_of(s);
        if (threads == 1)
            expected = found;
        else {
            assert_true(same_bytes(found, expected));
            free(found.data);
        }
        fct_simplifier_destroy(s);
    }
    env.thread_count = 0;
    free(expected.data);
    fct_mesh_release(&env, &torus);
}

/* A run is fct_simplify, also with a bound of the error. A later, larger bound allows more. */
static void runs_are_simplifications(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 20);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplify_stats stats, expected;
    def.max_error = .003;
    fct_simplifier *s = made(&env, &sphere, &def);
    fct_mesh direct = simplified(&env, &sphere, &def, &expected), mesh;
    assert_int_equal(fct_simplifier_run(s, 0, .003, &stats), FCT_OK);
    assert_int_equal(stats.stopped_because, FCT_STOP_ERROR);
    assert_int_equal(stats.faces_before, sphere.face_count);
    assert_int_equal(stats.faces_after, expected.faces_after);
    assert_true(stats.max_cost == expected.max_cost);
    assert_int_equal(fct_simplifier_mesh(s, true, &mesh, &stats), FCT_OK);
    assert_true(stats.distance_rms == expected.distance_rms && stats.distance_max == expected.distance_max);
    assert_int_equal(stats.stopped_because, FCT_STOP_ERROR);
    assert_true(same_mesh(&mesh, &direct));
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &direct);
    uint32_t before = fct_simplifier_faces(s);
    run_to(s, before);
    assert_int_equal(fct_simplifier_faces(s), before);
    s = stopped(&env, s);
    assert_int_equal(fct_simplifier_run(s, 0, .006, &stats), FCT_OK);
    assert_int_equal(stats.stopped_because, FCT_STOP_ERROR);
    assert_true(stats.faces_after < .8 * before && stats.max_cost > .003 && stats.max_cost <= .006);
    assert_int_equal(fct_simplifier_run(s, 0, NAN, &stats), FCT_ERROR_DATA);
    assert_int_equal(fct_simplifier_run(s, 0, -1, NULL), FCT_ERROR_DATA);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &sphere);
}

/* Without the refit a vertex that no contraction moved has the bits of the input. */
static void the_refit_is_a_choice(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 14);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = made(&env, &sphere, &def);
    run_to(s, sphere.face_count / 3);
    state_bytes before = state_of(s);
    def.refit_passes = 0;
    def.target_faces = sphere.face_count / 3;
    fct_mesh plain = mesh_of(s, false), direct = simplified(&env, &sphere, &def, NULL);
    assert_true(same_mesh(&plain, &direct));
    assert_false(has_mesh(&env, s, plain));
    fct_mesh_release(&env, &direct);
    assert_true(has_state(s, before));
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &sphere);
}

/* The mesh and the options may go away after the creation. */
static void the_input_is_copied(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, 8, true, true), copy;
    char *names[2] = {"stone", "water"};
    torus.material_names = names;
    fct_simplify_def def = fct_simplify_def_default(), gone = def;
    uint8_t *locks = calloc(torus.vertex_count, 1);
    locks[5] = 1;
    gone.locks = def.locks = locks;
    assert_int_equal(fct_mesh_copy(&env, &torus, &copy), FCT_OK);
    fct_simplifier *s = made(&env, &copy, &gone), *other = made(&env, &torus, &def);
    memset(copy.positions, 0xff, 12 * copy.vertex_count);
    fct_mesh_release(&env, &copy);
    memset(&gone, 0xff, sizeof gone);
    memset(locks, 0, torus.vertex_count);
    free(locks);
    run_to(s, 100);
    run_to(other, 100);
    assert_true(has_state(s, state_of(other)));
    s = stopped(&env, s);
    fct_mesh mesh = mesh_of(s, true);
    assert_string_equal(mesh.material_names[1], "water");
    fct_mesh_release(&env, &mesh);
    fct_simplifier_destroy(s);
    fct_simplifier_destroy(other);
    torus.material_names = NULL;
    fct_mesh_release(&env, &torus);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {cmocka_unit_test(stops_change_nothing),
                                       cmocka_unit_test(options_are_kept),
                                       cmocka_unit_test(sweeps_and_threads_change_nothing),
                                       cmocka_unit_test(runs_are_simplifications),
                                       cmocka_unit_test(the_refit_is_a_choice),
                                       cmocka_unit_test(the_input_is_copied)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
