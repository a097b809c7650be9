/* The radix sort: ascending, stable, the same for every thread count, clean under a failing allocator. */
#include "support.h"

#include "base/key.h"
#include "base/sift.h"
#include "base/sort.h"

static uint64_t hash(uint64_t x) {
    x ^= x >> 31, x *= 0x9E3779B97F4A7C15u, x ^= x >> 29, x *= 0xBF58476D1CE4E5B9u;
    return x ^ x >> 32;
}

static void check_sorted(size_t count, uint64_t mask, uint32_t threads) {
    fct_env env = fct_env_default();
    env.thread_count = threads;
    uint64_t *keys = malloc(count * sizeof *keys + 1);
    uint32_t *values = malloc(count * sizeof *values + 1);
    for (size_t i = 0; i < count; ++i) keys[i] = hash(i + 1) & mask, values[i] = (uint32_t)i;
    assert_int_equal(fct_sort_pairs(&env, keys, values, count), FCT_OK);
    uint64_t seen = 0, expected = 0;
    for (size_t i = 0; i < count; ++i) {
        assert_true(keys[i] == (hash((uint64_t)values[i] + 1) & mask));
        if (i) assert_true(keys[i - 1] < keys[i] || (keys[i - 1] == keys[i] && values[i - 1] < values[i]));
        seen += values[i], expected += i;
    }
    assert_true(seen == expected);
    free(keys);
    free(values);
}

static void sorts_and_is_stable(void **state) {
    (void)state;
    const size_t counts[] = {0, 1, 2, 47, 48, 49, 1000, 65536, 65537, 300000};
    const uint64_t masks[] = {UINT64_MAX, 0, 7, 0xFF00, 0xFF000000000000FF, 0xFFFFFFFF};
    for (size_t c = 0; c < sizeof counts / sizeof *counts; ++c)
        for (size_t m = 0; m < sizeof masks / sizeof *masks; ++m)
            for (uint32_t threads = 1; threads <= 3; ++threads) check_sorted(counts[c], masks[m], threads);
}

/* By the upper half alone: the lower halves of equal keys stay in order. */
static void items_go_by_their_upper_half(void **state) {
    (void)state;
    const size_t counts[] = {0, 1, 40, 1000, 200000};
    for (size_t c = 0; c < sizeof counts / sizeof *counts; ++c) {
        fct_env env = fct_env_default();
        uint64_t *items = malloc(counts[c] * sizeof *items + 1);
        for (size_t i = 0; i < counts[c]; ++i) items[i] = (hash(i) & 0x3FF) << 40 | (~i & 0xFFFFFFFF);
        assert_int_equal(fct_sort_items(&env, items, counts[c]), FCT_OK);
        for (size_t i = 0; i < counts[c]; ++i) {
            assert_int_equal(items[i] >> 40, hash(~items[i] & 0xFFFFFFFF) & 0x3FF);
            if (i == 0) continue;
            uint64_t before = items[i - 1], now = items[i];
            assert_true(before >> 32 < now >> 32 || (before >> 32 == now >> 32 && before > now));
        }
        free(items);
    }
}

static void sorts_in_place_by_key_and_value(void **state) {
    (void)state;
    for (size_t count = 0; count < 400; count += 1 + count / 8) {
        uint64_t keys[400];
        uint32_t values[400];
        for (size_t i = 0; i < count; ++i)
            keys[i] = hash(i) % 20 << 40, values[i] = (uint32_t)(hash(i) >> 9) % 50;
        uint64_t sum = 0, expected = 0;
        for (size_t i = 0; i < count; ++i) expected += hash(keys[i] + values[i]);
        fct_sort_in_place(keys, values, count);
        for (size_t i = 0; i < count; ++i) {
            sum += hash(keys[i] + values[i]);
            if (i)
                assert_true(keys[i - 1] < keys[i] || (keys[i - 1] == keys[i] && values[i - 1] <= values[i]));
        }
        assert_true(sum == expected);
    }
}

static bool less_floats(const void *items, size_t i, size_t j) {
    return ((const float *)items)[i] < ((const float *)items)[j];
}

static void swap_floats(void *items, size_t i, size_t j) {
    float *x = items, moving = x[i];
    x[i] = x[j], x[j] = moving;
}

static void greatest_item_is_on_top(void **state) {
    (void)state;
    float heap[200];
    size_t count = 100;
    for (size_t i = 0; i < count; ++i) heap[i] = (float)(hash(i) % 1000);
    fct_sift_all(heap, count, less_floats, swap_floats);
    for (size_t step = 0; step < 1000; ++step) {
        for (size_t i = 1; i < count; ++i) assert_true(heap[i] <= heap[0]);
        if (step % 3 && count < 200) {
            heap[count] = (float)(hash(step + 5000) % 1000);
            fct_sift_up(heap, count++, less_floats, swap_floats);
        } else {
            heap[0] = (float)(hash(step + 9000) % 1000);
            fct_sift_down(heap, 0, count, less_floats, swap_floats);
        }
    }
    fct_sift_sort(heap, count, less_floats, swap_floats);
    for (size_t i = 1; i < count; ++i) assert_true(heap[i - 1] <= heap[i]);
}

static void float_keys_keep_the_order(void **state) {
    (void)state;
    const float values[] = {-INFINITY, -1e30f, -1, -1e-30f, -0.0f, 0.0f, 1e-40f, 1, 2, 1e30f, INFINITY};
    for (size_t i = 1; i < sizeof values / sizeof *values; ++i)
        assert_true(fct_float_key(values[i - 1]) < fct_float_key(values[i]));
    for (size_t i = 0; i < sizeof values / sizeof *values; ++i) {
        float back = fct_float_of_key(fct_float_key(values[i])),
              same = fct_float_of_bits(fct_float_bits(values[i]));
        assert_memory_equal(&back, values + i, sizeof back);
        assert_memory_equal(&same, values + i, sizeof same);
    }
    assert_true(fct_float_bits(1) == 0x3F800000u && fct_double_bits(1) == 0x3FF0000000000000u);
    assert_true(fct_double_bits(1.5) < fct_double_bits(1.75) && fct_double_bits(0) < fct_double_bits(1e-300));
    assert_true(fct_pair_key(7, 3) == 0x300000007u && fct_pair_key(3, 7) == 0x300000007u);
}

static void survives_no_memory(void **state) {
    (void)state;
    for (long fail_at = 1; fail_at <= 4; ++fail_at) {
        recorder r = {.fail_at = fail_at};
        fct_env env = recorder_env(&r);
        uint64_t keys[100];
        uint32_t values[100];
        for (uint32_t i = 0; i < 100; ++i) keys[i] = 99 - i, values[i] = i;
        assert_int_equal(fct_sort_pairs(&env, keys, values, 100), FCT_ERROR_MEMORY);
        assert_int_equal(r.alive, 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(sorts_and_is_stable),
                                       cmocka_unit_test(items_go_by_their_upper_half),
                                       cmocka_unit_test(sorts_in_place_by_key_and_value),
                                       cmocka_unit_test(greatest_item_is_on_top),
                                       cmocka_unit_test(float_keys_keep_the_order),
                                       cmocka_unit_test(survives_no_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
