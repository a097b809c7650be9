/* The bound on jansson's memory holds for texts of every shape, a text over the budget is refused before
 * jansson parses it, errors name their place, and tokens of every length survive a malloc that fails. */
#define _GNU_SOURCE
#include "support.h"

#include <errno.h>
#include <jansson.h>
#include <limits.h>
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
    fct_env env = fct_env_default();
    json_set_alloc_funcs(count_malloc, count_free);
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; ++i) {
        size_t size;
        char *text = make_text(shapes[i].before, shapes[i].part, shapes[i].count, shapes[i].after, &size);
        now = peak = 0;
        json_t *root;
        (void)!fct_json_load(&env, "text", text, size, 0, &root); /* the bound holds for invalid texts, too */
        json_decref(root);
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
    fct_env env = fct_env_default();
    json_t *root;
    assert_int_equal(fct_json_load(&env, "text", text, (size_t)(end - text), JSON_REJECT_DUPLICATES, &root),
                     FCT_OK);
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
    json_t *root;
    assert_int_equal(fct_json_load(&env, "text", text, size, 0, &root), FCT_ERROR_MEMORY);
    assert_null(root);
    limit = 6000000;
    assert_int_equal(fct_json_load(&env, "text", text, size, 0, &root), FCT_OK);
    assert_int_equal(json_string_length(json_array_get(root, 0)), 1000000);
    json_decref(root);
    free(text);
}

static void errors_name_the_place(void **state) {
    (void)state;
    static const struct {
        const char *text, *message;
    } cases[] = {{"", "text:1:1: unexpected end of the text"},
                 {"{\"a\": 1", "text:1:8: unexpected end of the text"},
                 {"{\"a\":\n \"b", "text:2:4: unexpected end of the text"},
                 {"\"\\", "text:1:3: unexpected end of the text"},
                 {"[1,\n2 3]", "text:2:3: ']' expected near '3'"},
                 {"{\"a\": tru}", "text:1:9: invalid token near 'tru'"},
                 {"{\"a\": 1, \"a\": 2}", "text:1:12: duplicate object key near '\"a\"'"},
                 {"{}]", "text:1:4: end of file expected near ']'"},
                 {"{}, {}", "text: found 2 JSON values, expected 1"},
                 {"[\"\xff\"]", "text:1:2: unable to decode byte 0xff near '\"'"}};
    for (size_t i = 0; i < FCT_LENGTH(cases); ++i) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        json_t *root;
        assert_int_equal(
            fct_json_load(&env, "text", cases[i].text, strlen(cases[i].text), JSON_REJECT_DUPLICATES, &root),
            FCT_ERROR_DATA);
        assert_null(root);
        assert_string_equal(r.text, cases[i].message);
    }
}

static long asked, refused_from, refused_to; /* these allocations fail */

static void *refuse_some(size_t size) {
    ++asked;
    if (asked < refused_from || asked > refused_to) return malloc(size);
    errno = ENOMEM;
    return NULL;
}

/* Tokens around every size of jansson's buffer: an allocation fails, alone or with all later ones. */
static void tokens_survive_a_failing_malloc(void **state) {
    (void)state;
    static const char *const shapes[][2] = {{"[\"", "\"]"},
                                            {"{\"k\": \"", "\", \"l\": [true]}"},
                                            {"[1", "]"},
                                            {"[1.", "]"},
                                            {"[\"\\u00e9", "\\\"\"]"}};
    fct_env env = fct_env_default();
    json_set_alloc_funcs(refuse_some, free);
    for (size_t shape = 0; shape < FCT_LENGTH(shapes); ++shape)
        for (size_t length = 1; length < 140; ++length) {
            if (shape == 2 && length > 17) break; /* an integer of jansson has 64 bits */
            size_t size;
            char *text = make_text(shapes[shape][0], "1", length, shapes[shape][1], &size);
            for (int lasting = 0; lasting < 2; ++lasting) {
                fct_result result = FCT_ERROR_MEMORY;
                for (refused_from = 1; result != FCT_OK; ++refused_from) {
                    json_t *root;
                    asked = 0, refused_to = lasting ? LONG_MAX : refused_from;
                    result = fct_json_load(&env, "text", text, size, 0, &root);
                    assert_int_equal(result, asked >= refused_from ? FCT_ERROR_MEMORY : FCT_OK);
                    assert_int_equal(root != NULL, result == FCT_OK);
                    json_decref(root);
                }
            }
            free(text);
        }
    json_set_alloc_funcs(malloc, free);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_bound_holds), cmocka_unit_test(the_bound_holds_for_large_objects),
        cmocka_unit_test(a_text_over_the_budget_is_refused), cmocka_unit_test(errors_name_the_place),
        cmocka_unit_test(tokens_survive_a_failing_malloc)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
