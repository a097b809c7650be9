/* A pool hands out aligned parts of its block that do not overlap, takes them back whole, and turns to the
 * environment beneath when the block is full. */
#include "support.h"

#include "base/pool.h"

enum { BLOCK = 1 << 14 };

static void parts_do_not_overlap(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    unsigned char *block = fct_allocate(&env, BLOCK, 1);
    fct_pool pool;
    fct_pool_create(&env, block, BLOCK, &pool);
    unsigned char *parts[200] = {0};
    size_t sizes[200] = {0};
    uint32_t seed = 1, inside = 0;
    for (int step = 0; step < 20000; ++step) {
        seed = seed * 1664525u + 1013904223u;
        uint32_t i = (seed >> 8) % 200;
        if (parts[i]) {
            for (size_t k = 0; k < sizes[i]; ++k) assert_int_equal(parts[i][k], i);
            fct_release(&pool.env, parts[i]);
            parts[i] = NULL;
            continue;
        }
        sizes[i] = (seed >> 20) % 400;
        parts[i] = fct_allocate(&pool.env, sizes[i], 1);
        assert_non_null(parts[i]);
        assert_int_equal((uintptr_t)parts[i] % 64, 0);
        memset(parts[i], (int)i, sizes[i]);
        inside += parts[i] >= block && parts[i] < block + BLOCK;
    }
    assert_true(inside > 100 && r.alive > 1); /* both were used */
    for (uint32_t i = 0; i < 200; ++i) fct_release(&pool.env, parts[i]);
    assert_int_equal(r.alive, 1);
    fct_release(&env, block);
}

static void what_is_given_back_is_one_again(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    unsigned char *block = fct_allocate(&env, BLOCK, 1);
    fct_pool pool;
    fct_pool_create(&env, block, BLOCK, &pool);
    void *parts[40];
    const int order[4] = {2, 0, 3, 1};
    for (int i = 0; i < 40; ++i) parts[i] = fct_allocate(&pool.env, 200, 1);
    for (int first = 0; first < 4; ++first)
        for (int i = order[first]; i < 40; i += 4) fct_release(&pool.env, parts[i]);
    assert_int_equal(pool.gap_count, 1);
    void *whole = fct_allocate(&pool.env, BLOCK - 192, 1);
    assert_true((unsigned char *)whole == block + 64);
    fct_release(&pool.env, whole);
    fct_release(&env, block);
}

static void an_empty_block_is_no_harm(void **state) {
    (void)state;
    recorder r = {.fail_at = 2};
    fct_env env = recorder_env(&r);
    fct_pool pool;
    fct_pool_create(&env, NULL, 0, &pool);
    void *memory = fct_allocate(&pool.env, 10, 10);
    assert_non_null(memory);
    assert_null(fct_allocate(&pool.env, 10, 10));
    fct_release(&pool.env, memory);
    assert_int_equal(r.alive, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(parts_do_not_overlap),
                                       cmocka_unit_test(what_is_given_back_is_one_again),
                                       cmocka_unit_test(an_empty_block_is_no_harm)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
