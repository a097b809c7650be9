/* tests/fuzz/fuzz.h: the environment of fuzzers: one thread, silent, and no request for memory that is out of
 * proportion to the input: a false count must be found before anything is allocated for it.
 *
 * Memory comes from an arena that starts again with each run, because ASan's allocator takes longer than to
 * cluster a small mesh. Gaps between blocks and released blocks are poisoned, and no block is used twice in a
 * run, so ASan still finds each access outside of a live block.
 */
#ifndef FCT_TESTS_FUZZ_H
#define FCT_TESTS_FUZZ_H

#include <sanitizer/asan_interface.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/env.h"

typedef struct fuzz_limit {
    size_t largest; /* bytes one request may ask for */
} fuzz_limit;

/* What an image may ask for beside that: blank images compress well. */
enum { FUZZ_IMAGE = 64 << 20 };

/* Each block follows its size in a gap of FUZZ_GAP bytes. */
enum { FUZZ_ARENA = 64 << 20, FUZZ_GAP = 64, FUZZ_FILL = 4096 };
static _Alignas(FUZZ_GAP) uint8_t fuzz_arena[FUZZ_ARENA];
static size_t fuzz_used, fuzz_alive;
static bool fuzz_full; /* a request of this run has failed, because the arena was full */

static inline void fuzz_require(bool condition, const char *what) {
    if (condition) return;
    fprintf(stderr, "broken promise: %s\n", what);
    abort();
}

static inline void *fuzz_allocate(void *user, size_t size) {
    const fuzz_limit *limit = user;
    if (size > limit->largest) {
        fprintf(stderr, "a request for %zu bytes, at most %zu are in proportion\n", size, limit->largest);
        abort();
    }
    size_t block = fuzz_used + FUZZ_GAP, end = (block + size + FUZZ_GAP - 1) / FUZZ_GAP * FUZZ_GAP;
    if (end > FUZZ_ARENA - FUZZ_GAP) {
        fuzz_full = true;
        return NULL;
    }
    uint8_t *memory = fuzz_arena + block;
    ASAN_UNPOISON_MEMORY_REGION(memory - FUZZ_GAP, sizeof size);
    memcpy(memory - FUZZ_GAP, &size, sizeof size);
    ASAN_POISON_MEMORY_REGION(memory - FUZZ_GAP, sizeof size);
    ASAN_UNPOISON_MEMORY_REGION(memory, size);
    memset(memory, 0xBE, size < FUZZ_FILL ? size : FUZZ_FILL);
    fuzz_used = end, ++fuzz_alive;
    return memory;
}

static inline void fuzz_release(void *user, void *memory) {
    size_t size;
    (void)user;
    uint8_t *header = (uint8_t *)memory - FUZZ_GAP;
    ASAN_UNPOISON_MEMORY_REGION(header, sizeof size);
    memcpy(&size, header, sizeof size);
    ASAN_POISON_MEMORY_REGION(header, FUZZ_GAP + size);
    --fuzz_alive;
}

/* Every error carries a line of text. */
static inline void fuzz_message(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR && !*text) abort();
}

static inline fct_env fuzz_env(fuzz_limit *limit, size_t size) {
    static bool poisoned;
    if (!poisoned) ASAN_POISON_MEMORY_REGION(fuzz_arena, FUZZ_ARENA);
    poisoned = true;
    fuzz_full = false;
    *limit = (fuzz_limit){(1 << 20) + 2000 * size};
    fct_env env = fct_env_default();
    env.thread_count = 1;
    env.allocate = fuzz_allocate;
    env.release = fuzz_release;
    env.message = fuzz_message;
    env.memory_user = limit;
    return env;
}

/* Ends a run: everything is released. */
static inline void fuzz_end(void) {
    fuzz_require(fuzz_alive == 0, "all memory is released");
    fuzz_used = 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
