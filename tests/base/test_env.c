/* Memory, messages and progress through the caller's environment: sizes that overflow, alignment, growth that
 * keeps the old contents, one line per message, absent hooks. */
#include "support.h"

static void sizes_that_do_not_fit_are_refused(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    const size_t counts[][2] = {{SIZE_MAX, 1},        {SIZE_MAX, 2},  {SIZE_MAX / 2 + 2, 2},
                                {1, SIZE_MAX - 3},    {SIZE_MAX, 64}, {(size_t)1 << 32, (size_t)1 << 32},
                                {SIZE_MAX / 2 + 1, 1}};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; ++i) {
        assert_null(fct_allocate(&env, counts[i][0], counts[i][1]));
        assert_null(fct_allocate_zero(&env, counts[i][0], counts[i][1]));
    }
    assert_int_equal(r.allocations, 0); /* the allocator was not even asked */
}

static void memory_is_aligned_and_wide_enough(void **state) {
    (void)state;
    recorder r = {0};
    fct_env recorded = recorder_env(&r), plain = fct_env_default();
    for (size_t count = 0; count < 200; count += 7)
        for (int i = 0; i < 2; ++i) {
            const fct_env *env = i ? &recorded : &plain;
            unsigned char *memory = fct_allocate(env, count, 3), *zero = fct_allocate_zero(env, count, 3);
            assert_non_null(memory);
            assert_non_null(zero);
            assert_true((uintptr_t)memory % 64 == 0 && (uintptr_t)zero % 64 == 0);
            memset(memory, 0xAB, 3 * count); /* a sanitizer sees when it is short */
            for (size_t k = 0; k < 3 * count; ++k) assert_int_equal(zero[k], 0);
            fct_release(env, memory);
            fct_release(env, zero);
        }
    fct_release(&recorded, NULL);
    assert_int_equal(r.alive, 0);
}

static void growth_keeps_contents(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    uint32_t *array = NULL;
    size_t capacity = 0;
    for (uint32_t i = 0; i < 10000; ++i) {
        assert_int_equal(fct_grow(&env, (void **)&array, &capacity, i + 1, sizeof *array), FCT_OK);
        assert_true(capacity > i);
        array[i] = i * i;
    }
    for (uint32_t i = 0; i < 10000; ++i) assert_int_equal(array[i], i * i);
    assert_true(r.allocations < 20); /* by half at least, not by one */
    assert_int_equal(r.alive, 1);

    uint32_t *before = array;
    size_t capacity_before = capacity;
    r.fail_at = r.allocations + 1;
    assert_int_equal(fct_grow(&env, (void **)&array, &capacity, capacity + 1, sizeof *array),
                     FCT_ERROR_MEMORY);
    assert_int_equal(fct_grow(&env, (void **)&array, &capacity, SIZE_MAX, sizeof *array), FCT_ERROR_MEMORY);
    assert_true(array == before && capacity == capacity_before && array[99] == 99 * 99);
    fct_release(&env, array);
    assert_int_equal(r.alive, 0);
}

static void groups_are_allocated_whole_or_not_at_all(void **state) {
    (void)state;
    for (long fail_at = 0; fail_at <= 3; ++fail_at) {
        recorder r = {.fail_at = fail_at};
        fct_env env = recorder_env(&r);
        double *numbers;
        uint8_t *flags;
        uint32_t(*pairs)[2], *none;
        const fct_array arrays[] = {FCT_ARRAY(numbers, 100), FCT_ARRAY_ZERO(flags, 1000),
                                    FCT_ARRAY_IF(true, pairs, 7), FCT_ARRAY_IF(false, none, 7)};
        assert_int_equal(fct_allocate_all(&env, arrays, FCT_LENGTH(arrays), "a group"),
                         fail_at ? FCT_ERROR_MEMORY : FCT_OK);
        assert_int_equal(r.alive, fail_at ? 0 : 3);
        if (fail_at) {
            assert_true(!numbers && !flags && !pairs && !none);
            assert_string_equal(r.text, "out of memory for a group");
        } else {
            assert_null(none);
            memset(numbers, 0xAB, 100 * sizeof *numbers); /* a sanitizer sees when it is short */
            memset(pairs, 0xAB, 7 * sizeof *pairs);
            for (int i = 0; i < 1000; ++i) assert_int_equal(flags[i], 0);
        }
        fct_release_all(&env, arrays, FCT_LENGTH(arrays));
        assert_true(r.alive == 0 && !numbers && !flags && !pairs);
    }
}

typedef struct heard {
    int count;
    fct_severity severity;
    char text[2048];
} heard;

static void hear(void *user, fct_severity severity, const char *text) {
    heard *h = user;
    ++h->count;
    h->severity = severity;
    snprintf(h->text, sizeof h->text, "%s", text);
}

static void failures_are_told_once(void **state) {
    (void)state;
    heard h = {0};
    fct_env env = fct_env_default();
    assert_int_equal(fct_fail(&env, FCT_ERROR_DATA, "unheard %d", 1), FCT_ERROR_DATA); /* no hook: no crash */
    env.message = hear;
    env.message_user = &h;
    assert_int_equal(fct_fail(&env, FCT_ERROR_INPUT, "face %d of %s", 7, "bunny"), FCT_ERROR_INPUT);
    assert_true(h.count == 1 && h.severity == FCT_MESSAGE_ERROR);
    assert_string_equal(h.text, "face 7 of bunny");
    assert_int_equal(fct_fail_memory(&env, "a tree"), FCT_ERROR_MEMORY);
    assert_string_equal(h.text, "out of memory for a tree");
    fct_note(&env, FCT_MESSAGE_WARNING, "%s", "odd");
    assert_true(h.count == 3 && h.severity == FCT_MESSAGE_WARNING);
    char wide[4000];
    memset(wide, 'x', sizeof wide - 1);
    wide[sizeof wide - 1] = 0;
    fct_note(&env, FCT_MESSAGE_NOTE, "%s", wide); /* cut, not overrun */
    assert_true(strlen(h.text) > 500 && strlen(h.text) < sizeof wide);
    for (int result = FCT_OK; result <= FCT_ERROR_INTERNAL + 1; ++result)
        for (int other = FCT_OK; other < result; ++other)
            assert_string_not_equal(fct_result_text((fct_result)result), fct_result_text((fct_result)other));
}

static bool watch(void *user, const char *phase, double done) {
    assert_string_equal(phase, "phase");
    *(double *)user = done;
    return done < 0.5;
}

static void progress_may_cancel(void **state) {
    (void)state;
    double seen = -1;
    fct_env env = fct_env_default();
    assert_int_equal(fct_progress(&env, "phase", 1), FCT_OK);
    env.progress = watch;
    env.progress_user = &seen;
    assert_int_equal(fct_progress(&env, "phase", 0.25), FCT_OK);
    assert_true(seen == 0.25);
    assert_int_equal(fct_progress(&env, "phase", 0.75), FCT_ERROR_CANCELLED);
}

static void threads_are_at_least_one(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    assert_int_equal(env.size, sizeof env);
    assert_true(fct_env_threads(&env) >= 1);
    env.thread_count = 3;
    assert_int_equal(fct_env_threads(&env), 3);
    env.thread_count = UINT32_MAX;
    assert_true(fct_env_threads(&env) >= 1 && fct_env_threads(&env) <= 4096);
    double earlier = fct_seconds();
    assert_true(fct_seconds() >= earlier);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(sizes_that_do_not_fit_are_refused),
                                       cmocka_unit_test(memory_is_aligned_and_wide_enough),
                                       cmocka_unit_test(growth_keeps_contents),
                                       cmocka_unit_test(groups_are_allocated_whole_or_not_at_all),
                                       cmocka_unit_test(failures_are_told_once),
                                       cmocka_unit_test(progress_may_cancel),
                                       cmocka_unit_test(threads_are_at_least_one)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
