/* tests/memory/test_memory.c: each public function that can fail runs with a failing nth allocation, for n =
 * 1, 2, 3, ... until no allocation fails: once alone, and once with all later ones. A failure returns MEMORY
 * with a message, leaves no object, no file and no allocation. `--list` prints the functions of the tables;
 * check-table.sh compares them with the headers. An argument is the name of the only function to run. */
#define _GNU_SOURCE
#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/memory/calls.h"

static const memory_call *const tables[] = {mesh_calls, tree_calls, partition_calls, scene_calls};
static long messages, faults;
static char last_message[256];
static const char *only;

static void hear(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity != FCT_MESSAGE_ERROR) return;
    ++messages;
    snprintf(last_message, sizeof last_message, "%s", text);
}

/* Prints a fault and goes on, so that one run shows all of them. */
static void report_fault(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    putchar('\n');
    ++faults;
}

/* A hash of the bytes of a file (FNV-1a). */
static uint64_t hash_file(const char *name) {
    char path[512];
    snprintf(path, sizeof path, OUT "%s", name);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    uint64_t hash = 0xcbf29ce484222325u;
    for (int c; (c = getc(file)) != EOF;) hash = (hash ^ (uint64_t)c) * 0x100000001b3u;
    fclose(file);
    return hash;
}

/* Removes the files of OUT. Returns their number, and the sum of their hashes. */
static int empty_folder(uint64_t *hash) {
    DIR *entries = opendir(OUT);
    assert_non_null(entries);
    int count = 0;
    *hash = 0;
    for (struct dirent *e; (e = readdir(entries));) {
        if (!strcmp(e->d_name, ".") || !strcmp(e->d_name, "..")) continue;
        *hash += hash_file(e->d_name);
        assert_int_equal(unlinkat(dirfd(entries), e->d_name, 0), 0);
        ++count;
    }
    closedir(entries);
    return count;
}

/* Returns the number of failed runs. */
static long starve_call(const memory_call *call, starve_kind kind, bool lasting) {
    fct_env env = starve_env();
    env.thread_count = 2;
    env.message = hear;
    starve_set(kind, 0, false);
    assert_int_equal(call->run(&env), FCT_OK); /* other libraries keep what they make in their first call */
    uint64_t whole, written;
    int outputs = empty_folder(&whole);
    long failures = 0;
    for (long n = 1;; ++n) {
        starve_set(kind, n, lasting);
        messages = 0, last_message[0] = 0;
        long before = starve_alive();
        fct_result result = call->run(&env);
        long kept = starve_alive() - before;
        int files = empty_folder(&written);
        if (!starve_failed()) {
            if (result != FCT_OK)
                fail_msg("%s %s: result %d without a failure", call->function, call->variant, result);
            return failures;
        }
        ++failures;
        /* Stdio does without a buffer, so a failure of the system may remain without effect. */
        bool unaffected = result == FCT_OK && kind == STARVE_SYSTEM && files == outputs && written == whole;
        bool clean = result == FCT_ERROR_MEMORY && messages > 0 && files == 0;
        if ((!unaffected && !clean) || kept)
            report_fault(
                "%s %s, allocation %ld of %s: result %d, %ld messages (%s), %ld blocks and %d files left",
                call->function, call->variant, n, kind == STARVE_HOOK ? "the hook" : "the system",
                (int)result, messages, last_message, kept, files);
    }
}

static void run_tables(starve_kind kind) {
    make_inputs();
    long failures = 0;
    for (size_t i = 0; i < FCT_LENGTH(tables); ++i)
        for (const memory_call *call = tables[i]; call->function; ++call) {
            if (only && strcmp(only, call->function) != 0) continue;
            if (kind == STARVE_SYSTEM && call->hook_only) continue;
            long count = starve_call(call, kind, false);
            failures += count;
            if (!SANITIZED) failures += starve_call(call, kind, true);
            printf("%4ld %s %s\n", count, call->function, call->variant);
        }
    assert_true(failures > 0);
    assert_int_equal(faults, 0);
    starve_set(kind, 0, false);
    release_inputs();
    starve_set(STARVE_HOOK, 0, false);
    assert_int_equal(starve_alive(), 0);
}

static void allocations_of_the_hook(void **state) {
    (void)state;
    run_tables(STARVE_HOOK);
}

static void allocations_of_the_system(void **state) {
    (void)state;
    run_tables(STARVE_SYSTEM);
}

int main(int count, char **arguments) {
    only = count > 1 ? arguments[1] : NULL;
    if (only && strcmp(only, "--list") == 0) {
        for (size_t i = 0; i < FCT_LENGTH(tables); ++i)
            for (const memory_call *call = tables[i]; call->function; ++call) puts(call->function);
        return 0;
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    mkdir(IN, 0777), mkdir(OUT, 0777);
    uint64_t hash;
    empty_folder(&hash);
    const struct CMUnitTest tests[] = {cmocka_unit_test(allocations_of_the_hook),
                                       cmocka_unit_test(allocations_of_the_system)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
