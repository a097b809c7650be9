/* Temporary files without names, and blocks of files in memory. */
#define _GNU_SOURCE
#include "support.h"

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/io/spool.h"

static char folder[] = "/tmp/facetree-spool-XXXXXX";

static int count_entries(void) {
    DIR *entries = opendir(folder);
    int count = 0;
    assert_non_null(entries);
    while (readdir(entries)) ++count;
    closedir(entries);
    return count - 2;
}

static void bytes_come_back(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_spool spool;
    unsigned char data[10000], back[10000];
    for (size_t i = 0; i < sizeof data; ++i) data[i] = (unsigned char)(i * 7 + i / 256);
    assert_int_equal(fct_spool_open(&env, folder, NULL, &spool), FCT_OK);
    assert_int_equal(count_entries(), 0);
    assert_int_equal(fct_spool_append(&spool, data, 4000), FCT_OK);
    assert_int_equal(fct_spool_append(&spool, data, 0), FCT_OK);
    assert_int_equal(fct_spool_append(&spool, data + 4000, 6000), FCT_OK);
    assert_int_equal(spool.size, 10000);
    assert_int_equal(fct_spool_read(&spool, 0, back, sizeof back), FCT_OK);
    assert_memory_equal(data, back, sizeof data);
    assert_int_equal(fct_spool_read(&spool, 3990, back, 20), FCT_OK);
    assert_memory_equal(data + 3990, back, 20);
    fct_spool_discard(&spool, 0, 4096);
    assert_int_equal(fct_spool_read(&spool, 4096, back, 100), FCT_OK);
    assert_memory_equal(data + 4096, back, 100);
    assert_int_equal(fct_spool_read(&spool, 9990, back, 20), FCT_ERROR_OUTPUT);
    fct_spool_close(&spool);
    fct_spool_close(&spool);
    assert_int_equal(count_entries(), 0);
}

static void a_file_beside_and_a_folder_that_is_not_there(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_spool spool;
    char path[256];
    snprintf(path, sizeof path, "%s/tree.fct", folder);
    assert_int_equal(fct_spool_open(&env, NULL, path, &spool), FCT_OK);
    assert_string_equal(spool.folder, folder);
    fct_spool_close(&spool);
    assert_int_equal(fct_spool_open(&env, NULL, "tree.fct", &spool), FCT_OK);
    assert_string_equal(spool.folder, ".");
    fct_spool_close(&spool);
    assert_int_equal(fct_spool_open(&env, NULL, "/tree.fct", &spool) == FCT_OK, access("/", W_OK) == 0);
    fct_spool_close(&spool);
    snprintf(path, sizeof path, "%s/none", folder);
    assert_int_equal(fct_spool_open(&env, path, NULL, &spool), FCT_ERROR_OUTPUT);
    assert_non_null(strstr(r.text, path));
    assert_int_equal(fct_spool_open(&env, path, NULL, &spool), FCT_ERROR_OUTPUT);
}

static void files_of_killed_processes_are_removed(void **state) {
    (void)state;
    char path[512];
    fct_env env = fct_env_default();
    fct_spool spool;
    snprintf(path, sizeof path, "%s/.facetree-1-0.tmp", folder);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fclose(file);
    assert_int_equal(fct_spool_open(&env, folder, NULL, &spool), FCT_OK);
    assert_false(file_exists(path));
    fct_spool_close(&spool);
}

typedef struct numbers {
    uint64_t fail_at;
    int fills;
} numbers;

static fct_result fill(void *user, uint64_t block, void *data) {
    numbers *n = user;
    ++n->fills;
    if (block == n->fail_at) return FCT_ERROR_INPUT;
    for (uint32_t i = 0; i < 16; ++i) ((uint32_t *)data)[i] = (uint32_t)block * 16 + i;
    return FCT_OK;
}

static uint32_t number_at(fct_cache *cache, uint32_t i) {
    const uint32_t *block = fct_cache_get(cache, i / 16);
    assert_non_null(block);
    return block[i % 16];
}

static void blocks_are_kept_and_replaced(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    numbers n = {.fail_at = UINT64_MAX};
    fct_cache cache;
    assert_int_equal(fct_cache_create(&env, 64, 100, 8, fill, &n, &cache), FCT_OK);
    for (uint32_t i = 0; i < 128; ++i) assert_int_equal(number_at(&cache, i), i);
    assert_int_equal(n.fills, 8);
    for (uint32_t i = 0; i < 1600; i += 37) assert_int_equal(number_at(&cache, i), i);
    assert_int_equal(number_at(&cache, 5), 5);
    n.fail_at = 50;
    assert_null(fct_cache_get(&cache, 50));
    assert_int_equal(cache.result, FCT_ERROR_INPUT);
    n.fail_at = UINT64_MAX; /* the cache does not keep a block that failed to load */
    assert_int_equal(number_at(&cache, 801), 801);
    fct_cache_release(&cache);
    assert_int_equal(r.alive, 0);
    for (r.fail_at = 1; r.fail_at <= 2; ++r.fail_at) {
        r.allocations = 0;
        assert_int_equal(fct_cache_create(&env, 64, 100, 8, fill, &n, &cache), FCT_ERROR_MEMORY);
        assert_int_equal(r.alive, 0);
    }
}

static int make_folder(void **state) {
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state) {
    (void)state;
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(bytes_come_back),
                                       cmocka_unit_test(a_file_beside_and_a_folder_that_is_not_there),
                                       cmocka_unit_test(files_of_killed_processes_are_removed),
                                       cmocka_unit_test(blocks_are_kept_and_replaced)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
