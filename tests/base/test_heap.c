/* The indexed heap against a plain search for the least (key, id), under random calls. */
#include "support.h"

#include "base/heap.h"

enum { IDS = 200 };

static uint32_t least(const uint64_t *keys, const bool *in) {
    uint32_t best = FCT_NONE;
    for (uint32_t i = 0; i < IDS; ++i)
        if (in[i] && (best == FCT_NONE || keys[i] < keys[best])) best = i;
    return best;
}

static void pops_in_order_of_key_and_id(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_heap heap;
    assert_int_equal(fct_heap_create(&env, IDS, &heap), FCT_OK);
    uint64_t keys[IDS] = {0};
    bool in[IDS] = {0};
    uint32_t seed = 5, held = IDS;
    for (uint32_t i = 0; i < IDS; ++i) {
        keys[i] = (i * 7919u) % 50, in[i] = true;
        fct_heap_append(&heap, i, keys[i]);
    }
    fct_heap_order(&heap);
    for (int step = 0; step < 20000; ++step) {
        seed = seed * 1664525u + 1013904223u;
        uint32_t id = (seed >> 8) % IDS, kind = seed >> 28;
        if (kind < 7) {
            held += !in[id];
            keys[id] = (seed >> 16) % 50, in[id] = true; /* few keys: many ties */
            fct_heap_set(&heap, id, keys[id]);
        } else if (kind < 10) {
            held -= in[id];
            in[id] = false;
            fct_heap_remove(&heap, id);
        } else {
            uint32_t expected = least(keys, in);
            assert_int_equal(fct_heap_pop(&heap), expected);
            if (expected != FCT_NONE) in[expected] = false, --held;
        }
        assert_int_equal(heap.count, held);
    }
    for (uint32_t expected; (expected = least(keys, in)) != FCT_NONE; in[expected] = false)
        assert_int_equal(fct_heap_pop(&heap), expected);
    assert_int_equal(fct_heap_pop(&heap), FCT_NONE);
    fct_heap_release(&env, &heap);
    assert_int_equal(r.alive, 0);
}

static void survives_no_memory(void **state) {
    (void)state;
    for (long fail_at = 1; fail_at <= 2; ++fail_at) {
        recorder r = {.fail_at = fail_at};
        fct_env env = recorder_env(&r);
        fct_heap heap;
        assert_int_equal(fct_heap_create(&env, 10, &heap), FCT_ERROR_MEMORY);
        assert_int_equal(r.alive, 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(pops_in_order_of_key_and_id),
                                       cmocka_unit_test(survives_no_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
