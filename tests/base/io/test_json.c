/* The bound on jansson's memory holds for texts of every shape, and a text over the budget is refused before
 * jansson parses it. */
#define _GNU_SOURCE
#include "support.h"

#include <jansson.h>
#include <malloc.h>

#include "base/io/json.h"

static size_t now, peak;

static void *count_malloc(size_t size) {
    void *memory = malloc(size);
    now += malloc_usable_size(memory) + 8;
    peak = now > peak ? now : peak;
    return memory;
}

static void count_free(void *memory) {
    if (memory) now -= malloc_usable_size(memory) + 8;
    free(memory);
}

/* Writes before, then `count` times `part`, then after. The caller frees it. */
static char *make_text(const char *before, const char *part, size_t count, const char *after, size_t *size) {
    size_t length = strlen(part);
    char *text = malloc(strlen(before) + count * length + strlen(after) + 1), *end = stpcpy(text, before);
    for (size_t i = 0; i < count; ++i) end = stpcpy(end, part);
    *size = (size_t)(stpcpy(end, after) - text);
    return text;
}

static void the_bound_holds(void **state) {
    (void)state;
    static const struct {
        const char *before, *part, *after;
        size_t count;
    } shapes[] = {{"[", "0,", "0]", 100000},
                  {"[", "1.5,", "0]", 100000},
                  {"[", "[],", "0]", 50000},
                  {"[", "{},", "0]", 50000},
                  {"[", "\"\",", "0]", 50000},
                  {"[", "{\"a\":{\"b\":[1,2,3]}},", "0]", 20000},
                  {"[", "{\"a\":1,\"b\":2,\"c\":3,\"d\":4,\"e\":5,\"f\":6},", "0]", 20000},
                  {"[\"", "x", "\"]", 3000000},
                  {"[\"", "\\n", "\"]", 1000000},
                  {"[\"", "\\u00e9", "\"]", 300000},
                  {"[", "1", "]", 300},
                  {"", "[", "", 2000},
                  {"[", "[[[1]]],", "0]", 30000},
                  {"[", "true , null\n,", "0]", 30000}};
    json_set_alloc_funcs(count_malloc, count_free);
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; ++i) {
        size_t size;
        char *text = make_text(shapes[i].before, shapes[i].part, shapes[i].count, shapes[i].after, &size);
        now = peak = 0;
        json_decref(json_loadb(text, size, 0, NULL));
        size_t need = fct_json_need(text, size);
        assert_in_range(peak, 1, need);
        assert_true(need < 8 * peak + 100000); /* and is not far from it */
        free(text);
    }
    json_set_alloc_funcs(malloc, free);
}

/* Objects with many different members. */
static void the_bound_holds_for_large_objects(void **state) {
    (void)state;
    json_set_alloc_funcs(count_malloc, count_free);
    char *text = malloc(3000000), *end = stpcpy(text, "{");
    for (int i = 0; i < 100000; ++i) end += sprintf(end, "\"k%d\":%d,", i, i);
    end = stpcpy(end, "\"end\":0}");
    now = peak = 0;
    json_t *root = json_loadb(text, (size_t)(end - text), JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(root);
    json_decref(root);
    assert_in_range(peak, 1, fct_json_need(text, (size_t)(end - text)));
    free(text);
    json_set_alloc_funcs(malloc, free);
}

static void *refuse_large(void *user, size_t size) {
    return size > *(size_t *)user ? NULL : aligned_alloc(64, (size + 63) / 64 * 64);
}

static void release(void *user, void *memory) {
    (void)user;
    free(memory);
}

static void a_text_over_the_budget_is_refused(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    size_t size, limit = 1 << 20;
    env.allocate = refuse_large, env.release = release, env.memory_user = &limit;
    char *text = make_text("[\"", "x", 1000000, "\"]", &size);
    assert_int_equal(fct_json_check_memory(&env, "text", text, size), FCT_ERROR_MEMORY);
    limit = 6000000;
    assert_int_equal(fct_json_check_memory(&env, "text", text, size), FCT_OK);
    assert_int_equal(fct_json_check_memory(&env, "text", "", 0), FCT_OK);
    assert_int_equal(fct_json_check_memory(&env, "text", "\"\\", 2), FCT_OK);
    assert_int_equal(fct_json_check_memory(&env, "text", "\"", 1), FCT_OK);
    free(text);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_bound_holds),
                                       cmocka_unit_test(the_bound_holds_for_large_objects),
                                       cmocka_unit_test(a_text_over_the_budget_is_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
