/* tests/fuzz/fuzz.h: the environment fuzzers run in: one thread, silent, and no request for memory that is
 * out of proportion to the input: a count that lies must be found out before anything is allocated for it. */
#ifndef FCT_TESTS_FUZZ_H
#define FCT_TESTS_FUZZ_H

#include <stdio.h>
#include <stdlib.h>

#include "base/env.h"

typedef struct fuzz_limit {
    size_t largest; /* bytes one request may ask for */
} fuzz_limit;

static inline void *fuzz_allocate(void *user, size_t size) {
    const fuzz_limit *limit = user;
    if (size > limit->largest) {
        fprintf(stderr, "a request for %zu bytes, at most %zu are in proportion\n", size, limit->largest);
        abort();
    }
    return aligned_alloc(64, size);
}

static inline void fuzz_release(void *user, void *memory) {
    (void)user;
    free(memory);
}

/* Every error carries a line of text. */
static inline void fuzz_message(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR && !*text) abort();
}

static inline fct_env fuzz_env(fuzz_limit *limit, size_t size) {
    *limit = (fuzz_limit){(1 << 20) + 2000 * size};
    fct_env env = fct_env_default();
    env.thread_count = 1;
    env.allocate = fuzz_allocate;
    env.release = fuzz_release;
    env.message = fuzz_message;
    env.memory_user = limit;
    return env;
}

static inline void fuzz_require(bool condition, const char *what) {
    if (condition) return;
    fprintf(stderr, "broken promise: %s\n", what);
    abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
