/* The way back of the handle: the state of each earlier run and of each face count is restored bit by bit. */
#include "handle.h"

static fct_env env;

enum { RUNS = 6 };

/* Runs through descending targets, and back to each state between them; then the same runs again. */
static void check_way_back(const fct_mesh *mesh, fct_simplify_def def) {
    fct_simplifier *s = made(&env, mesh, &def);
    state_bytes states[RUNS + 1] = {state_of(s)};
    uint32_t faces[RUNS + 1] = {fct_simplifier_faces(s)};
    for (uint32_t i = 0; i < RUNS; ++i) {
        run_to(s, faces[i] * 2 / 3);
        faces[i + 1] = fct_simplifier_faces(s);
        states[i + 1] = state_of(s);
    }
    static const uint32_t ways[] = {RUNS, 5, 3, 4, 0, 2, 1, RUNS, 0};
    uint32_t at = RUNS;
    for (size_t i = 0; i < FCT_LENGTH(ways); ++i) {
        if (ways[i] < at) assert_int_equal(fct_simplifier_undo(s, faces[ways[i]]), FCT_OK);
        for (; at < ways[i]; ++at) run_to(s, faces[at] * 2 / 3);
        at = ways[i];
        state_bytes found = state_of(s);
        assert_true(same_bytes(found, states[at]));
        free(found.data);
        fct_mesh mesh_now = mesh_of(s, true); /* a mesh in between changes nothing */
        fct_mesh_release(&env, &mesh_now);
    }
    for (uint32_t i = 0; i <= RUNS; ++i) free(states[i].data);
    fct_simplifier_destroy(s);
}

static void states_come_back(void **state) {
    (void)state;
    fct_mesh meshes[] = {make_sphere(&env, 14), make_grid(&env, 14), make_torus(&env, 10, false, false),
                         make_torus(&env, 10, true, true)};
    for (size_t i = 0; i < FCT_LENGTH(meshes); ++i) {
        fct_simplify_def def = fct_simplify_def_default();
        check_way_back(&meshes[i], def);
        def.keep_topology = true;
        check_way_back(&meshes[i], def);
        fct_mesh_release(&env, &meshes[i]);
    }
}

/* Any count inside of a run: as if the run had stopped there. */
static void counts_inside_of_a_run_are_its_shorter_runs(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, SANITIZED ? 70 : 90, false, true);
    fct_simplify_def def = fct_simplify_def_default();
    uint32_t f = torus.face_count;
    const uint32_t counts[] = {f / 20 + 1, f / 7, f / 3, f / 2 + 1, f - 10};
    for (size_t i = 0; i < FCT_LENGTH(counts); ++i) {
        fct_simplifier *s = made(&env, &torus, &def), *other = made(&env, &torus, &def);
        env.thread_count = 1 + (uint32_t)i % 4;
        run_to(s, f / 2);
        run_to(s, f / 20);
        if (counts[i] <= f / 2) run_to(other, f / 2);
        run_to(other, counts[i]);
        assert_int_equal(fct_simplifier_undo(s, counts[i]), FCT_OK);
        assert_in_range(fct_simplifier_faces(s), counts[i] - 1, counts[i]);
        assert_true(has_state(s, state_of(other)));
        /* Further back from there, and forwards by another way. */
        assert_int_equal(fct_simplifier_undo(s, f), FCT_OK);
        assert_int_equal(fct_simplifier_faces(s), f);
        run_to(s, counts[i]);
        fct_simplifier_destroy(other);
        other = made(&env, &torus, &def);
        run_to(other, counts[i]);
        assert_true(has_state(s, state_of(other)));
        fct_simplifier_destroy(s);
        fct_simplifier_destroy(other);
    }
    env.thread_count = 0;
    fct_mesh_release(&env, &torus);
}

/* The error bound of the run holds on the way back, too. */
static void bounds_of_errors_are_repeated(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 16);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = made(&env, &sphere, &def), *other = made(&env, &sphere, &def);
    assert_int_equal(fct_simplifier_run(s, 0, .01, NULL), FCT_OK);
    uint32_t half = sphere.face_count / 2;
    assert_true(fct_simplifier_faces(s) < half);
    run_to(s, 20);
    assert_int_equal(fct_simplifier_undo(s, half), FCT_OK);
    assert_int_equal(fct_simplifier_run(other, half, .01, NULL), FCT_OK);
    assert_true(has_state(s, state_of(other)));
    fct_simplifier_destroy(s);
    fct_simplifier_destroy(other);
    fct_mesh_release(&env, &sphere);
}

static bool cancel_at(void *user, const char *phase, double done) {
    int *calls = user;
    (void)phase, (void)done;
    return --*calls != 0;
}

/* A run or a way back that is cancelled changes nothing. */
static void cancelled_calls_change_nothing(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, 60, false, false);
    fct_simplify_def def = fct_simplify_def_default();
    int calls = 0, cancelled = 0;
    fct_env own = env;
    own.progress = cancel_at, own.progress_user = &calls;
    fct_simplifier *s = made(&own, &torus, &def);
    run_to(s, torus.face_count - 100);
    run_to(s, torus.face_count / 3);
    state_bytes before = state_of(s);
    for (int at = 1; at < 8; ++at) {
        calls = at;
        bool back = at % 2;
        fct_result result =
            back ? fct_simplifier_undo(s, torus.face_count / 2) : fct_simplifier_run(s, 200, INFINITY, NULL);
        calls = 0;
        if (result == FCT_OK) break;
        assert_int_equal(result, FCT_ERROR_CANCELLED);
        ++cancelled;
        state_bytes now = state_of(s);
        assert_true(same_bytes(now, before));
        free(now.data);
    }
    assert_true(cancelled > 0);
    free(before.data);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &torus);
}

/* Beyond the beginning, before any run, and after fct_simplifier_forget. */
static void the_way_back_ends(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 12);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = made(&env, &sphere, &def);
    state_bytes start = state_of(s);
    assert_int_equal(fct_simplifier_undo(s, 1000000), FCT_OK);
    run_to(s, 100);
    assert_int_equal(fct_simplifier_undo(s, 50), FCT_OK);
    assert_int_equal(fct_simplifier_faces(s), 100);
    assert_int_equal(fct_simplifier_undo(s, 1000000), FCT_OK);
    assert_true(has_state(s, start));
    run_to(s, 100);
    s = stopped(&env, s); /* a loaded state has no runs yet */
    assert_int_equal(fct_simplifier_undo(s, 1000000), FCT_OK);
    assert_int_equal(fct_simplifier_faces(s), 100);
    fct_simplifier_forget(s);
    run_to(s, 50);
    assert_int_equal(fct_simplifier_undo(s, 100), FCT_ERROR_DATA);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &sphere);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(states_come_back), cmocka_unit_test(counts_inside_of_a_run_are_its_shorter_runs),
        cmocka_unit_test(bounds_of_errors_are_repeated), cmocka_unit_test(cancelled_calls_change_nothing),
        cmocka_unit_test(the_way_back_ends)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
