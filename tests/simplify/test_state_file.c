/* State files: damage is found, a failed write leaves the old file, sizes follow the current mesh. */
#include "handle.h"
#include "mend_state.h"

static fct_env env;
static recorder heard;

static void write_bytes(const char *path, const unsigned char *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

/* Loads the bytes, which are damaged, and expects the message. */
static void check_refused(const unsigned char *bytes, size_t size, const char *message) {
    fct_simplifier *s;
    write_bytes("bad.fst", bytes, size);
    heard = (recorder){0};
    assert_int_equal(fct_simplifier_load(&env, "bad.fst", &s), FCT_ERROR_DATA);
    assert_null(s);
    assert_non_null(strstr(heard.text, "bad.fst: "));
    if (!strstr(heard.text, message)) fail_msg("%s, expected %s", heard.text, message);
}

static fct_simplifier *run_torus(uint32_t n, bool hard, bool seams, uint32_t faces) {
    fct_mesh torus = make_torus(&env, n, hard, seams);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = made(&env, &torus, &def);
    run_to(s, faces);
    fct_mesh_release(&env, &torus);
    return s;
}

static void truncated_and_damaged_files_are_refused(void **state) {
    (void)state;
    fct_simplifier *s = run_torus(6, true, true, 80), *read;
    state_bytes whole = state_of(s);
    for (size_t size = 0; size < whole.size; size += size < 200 ? 1 : 997)
        check_refused(whole.data, size,
                      size < 8     ? "does not begin with its mark"
                      : size < 152 ? "truncated in the head"
                                   : "damaged");
    check_refused(whole.data, whole.size - 1, "truncated or damaged");
    for (size_t at = 0; at < whole.size; at += at < 150 ? 1 : 1009) {
        whole.data[at] ^= 4;
        check_refused(whole.data, whole.size,
                      at < 8    ? "does not begin with its mark"
                      : at < 12 ? "another version"
                      : at < 16 ? "another byte order"
                                : "wrong checksum");
        whole.data[at] ^= 4;
    }
    whole.data = realloc(whole.data, whole.size + 8);
    mend_state(whole.data, whole.size + 8);
    check_refused(whole.data, whole.size + 8, "something is appended");
    assert_int_equal(fct_simplifier_load(&env, "absent.fst", &read), FCT_ERROR_INPUT);
    assert_null(read);
    free(whole.data);
    fct_simplifier_destroy(s);
}

/* Each number of a small state becomes a very large one, with a right checksum: an error or a state that goes
 * on. Numbers of the head and of the live state that nothing checks would lead outside of the arrays. */
static void require(bool condition, const char *what) {
    if (!condition) fail_msg("%s", what);
}

static void malformed_states_are_harmless(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; ++kind) {
        fct_simplifier *s = run_torus(3, kind & 1, kind & 2, 20);
        state_bytes whole = state_of(s), copy = {malloc(whole.size), whole.size};
        uint32_t read = 0, tried = 0, seed = 7;
        for (size_t at = 16; at + 12 <= whole.size; at += SANITIZED ? 28 : 4, ++tried) {
            uint32_t values[] = {FCT_NONE, 0x7ff80000u, 5, seed = seed * 1664525u + 1013904223u};
            memcpy(copy.data, whole.data, whole.size);
            memcpy(copy.data + at, &values[tried % 4], 4);
            mend_state(copy.data, copy.size);
            heard = (recorder){0};
            if (mend_try_state(&env, copy.data, copy.size, require))
                ++read;
            else
                assert_true(heard.messages > 0);
        }
        assert_true(read > 0 && read < .9 * tried);
        free(whole.data), free(copy.data);
        fct_simplifier_destroy(s);
    }
}

/* A ring that has one corner twice would never end. */
static void corners_occur_once(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 6);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = made(&env, &sphere, &def);
    state_bytes whole = state_of(s);
    /* The head, the input, the live head and the roots; then the record of the first root, and its ring. */
    size_t ring = 144 + 16 * (size_t)sphere.face_count + 16 * (size_t)sphere.vertex_count + 56 +
                  4 * (size_t)sphere.vertex_count + 128;
    memcpy(whole.data + ring + 4, whole.data + ring, 4);
    mend_state(whole.data, whole.size);
    check_refused(whole.data, whole.size, "a corner occurs twice");
    free(whole.data);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &sphere);
}

/* Counts that the file has no room for are refused before anything is allocated for them. */
static void large_counts_need_large_files(void **state) {
    (void)state;
    fct_simplifier *s = run_torus(3, false, false, 20);
    state_bytes whole = state_of(s);
    for (size_t at = 16; at < 24; at += 4) {
        uint32_t count = 2000000000, before;
        memcpy(&before, whole.data + at, 4);
        memcpy(whole.data + at, &count, 4);
        mend_state(whole.data, whole.size);
        check_refused(whole.data, whole.size, "truncated in the input");
        memcpy(whole.data + at, &before, 4);
    }
    free(whole.data);
    fct_simplifier_destroy(s);
}

static void failed_writes_change_no_file(void **state) {
    (void)state;
    fct_simplifier *s = run_torus(6, false, false, 80);
    assert_int_equal(fct_simplifier_save(s, "absent/x.fst"), FCT_ERROR_OUTPUT);
    state_bytes before = state_of(s);
    run_to(s, 40);
    assert_int_equal(fct_simplifier_save(s, "."), FCT_ERROR_OUTPUT);
    state_bytes still = read_whole("state.fst");
    assert_true(same_bytes(before, still));
    assert_int_equal(fct_simplifier_save(s, "state.fst"), FCT_OK);
    free(still.data);
    still = read_whole("state.fst");
    assert_true(!same_bytes(before, still) && still.size < before.size);
    free(before.data), free(still.data);
    fct_simplifier_destroy(s);
}

/* The head, 24 bytes per face and vertex of the input without attributes, 4 per point, and about 140 bytes
 * per face that is left (docs/state-file.md). */
static void sizes_follow_the_current_mesh(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 40);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = made(&env, &sphere, &def);
    size_t input = 144 + 16 * (size_t)sphere.face_count + 20 * (size_t)sphere.vertex_count;
    for (uint32_t faces = sphere.face_count; faces > 50; faces /= 2) {
        run_to(s, faces);
        state_bytes b = state_of(s);
        double each = ((double)b.size - (double)input) / fct_simplifier_faces(s);
        if (each < 100 || each > 130) fail_msg("%u faces: %g bytes per face", faces, each);
        free(b.data);
    }
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &sphere);
}

int main(void) {
    env = fct_env_default();
    env.message = recorder_message;
    env.message_user = &heard;
    const struct CMUnitTest tests[] = {cmocka_unit_test(truncated_and_damaged_files_are_refused),
                                       cmocka_unit_test(malformed_states_are_harmless),
                                       cmocka_unit_test(corners_occur_once),
                                       cmocka_unit_test(large_counts_need_large_files),
                                       cmocka_unit_test(failed_writes_change_no_file),
                                       cmocka_unit_test(sizes_follow_the_current_mesh)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
