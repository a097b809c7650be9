/* base/env.c: see env.h. The only file that reads a clock or the processor count. */
#define _GNU_SOURCE
#include "base/env.h"

#include <sched.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

enum { PAGE = 1 << 12, LARGE = 1 << 22 }; /* bytes */

static void *default_allocate(void *user, size_t size) {
    (void)user;
    return aligned_alloc(64, size);
}

static void default_release(void *user, void *memory) {
    (void)user;
    free(memory);
}

/* Random access to a large array in small pages costs a walk of the page table per access. A hint: it changes
 * only the speed. */
static void ask_for_huge_pages(void *memory, size_t bytes) {
#ifdef MADV_HUGEPAGE
    uintptr_t begin = ((uintptr_t)memory + PAGE - 1) & ~(uintptr_t)(PAGE - 1);
    uintptr_t end = ((uintptr_t)memory + bytes) & ~(uintptr_t)(PAGE - 1);
    madvise((void *)begin, end - begin, MADV_HUGEPAGE);
#else
    (void)memory, (void)bytes;
#endif
}

void *fct_allocate(const fct_env *env, size_t count, size_t size) {
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes) || bytes > SIZE_MAX / 2) return NULL;
    bytes = (bytes + 64) & ~(size_t)63;
    void *memory = (env->allocate ? env->allocate : default_allocate)(env->memory_user, bytes);
    if (memory && bytes >= LARGE) ask_for_huge_pages(memory, bytes);
    return memory;
}

void *fct_allocate_zero(const fct_env *env, size_t count, size_t size) {
    void *memory = fct_allocate(env, count, size);
    if (memory) memset(memory, 0, count * size);
    return memory;
}

void fct_release(const fct_env *env, void *memory) {
    if (memory) (env->release ? env->release : default_release)(env->memory_user, memory);
}

/* memcpy, because the pointers in the table have the types of their elements. */
static void set_pointer(const fct_array *array, void *memory) {
    memcpy(array->pointer, &memory, sizeof memory);
}

void fct_release_all(const fct_env *env, const fct_array *arrays, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        void *memory;
        memcpy(&memory, arrays[i].pointer, sizeof memory);
        fct_release(env, memory);
        set_pointer(arrays + i, NULL);
    }
}

fct_result fct_allocate_all(const fct_env *env, const fct_array *arrays, size_t count, const char *what) {
    bool complete = true;
    for (size_t i = 0; i < count; ++i) {
        const fct_array *a = arrays + i;
        void *memory = NULL;
        if (complete && !a->absent)
            memory =
                a->zero ? fct_allocate_zero(env, a->count, a->size) : fct_allocate(env, a->count, a->size);
        complete = complete && (memory || a->absent);
        set_pointer(a, memory);
    }
    if (complete) return FCT_OK;
    fct_release_all(env, arrays, count);
    return fct_fail_memory(env, what);
}

fct_result fct_grow(const fct_env *env, void **array, size_t *capacity, size_t needed, size_t size) {
    if (needed <= *capacity) return FCT_OK;
    size_t larger = *capacity + *capacity / 2 + 64;
    if (larger < needed) larger = needed;
    void *memory = fct_allocate(env, larger, size);
    if (!memory) return fct_fail_memory(env, "a growing array");
    if (*array) memcpy(memory, *array, *capacity * size);
    fct_release(env, *array);
    *array = memory;
    *capacity = larger;
    return FCT_OK;
}

static void send(const fct_env *env, fct_severity severity, const char *format, va_list arguments) {
    if (!env->message) return;
    char text[1024];
    vsnprintf(text, sizeof text, format, arguments);
    env->message(env->message_user, severity, text);
}

fct_result fct_fail(const fct_env *env, fct_result result, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    send(env, FCT_MESSAGE_ERROR, format, arguments);
    va_end(arguments);
    return result;
}

fct_result fct_fail_memory(const fct_env *env, const char *what) {
    return fct_fail(env, FCT_ERROR_MEMORY, "out of memory for %s", what);
}

void fct_note(const fct_env *env, fct_severity severity, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    send(env, severity, format, arguments);
    va_end(arguments);
}

fct_result fct_progress(const fct_env *env, const char *phase, double done) {
    if (!env->progress || env->progress(env->progress_user, phase, done)) return FCT_OK;
    return FCT_ERROR_CANCELLED;
}

uint32_t fct_env_threads(const fct_env *env) {
    if (env->thread_count) return env->thread_count < 256 ? env->thread_count : 256;
    cpu_set_t set;
    int count = sched_getaffinity(0, sizeof set, &set) ? 1 : CPU_COUNT(&set);
    return count < 1 ? 1 : (uint32_t)(count < 256 ? count : 256);
}

double fct_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

fct_env fct_env_default(void) {
    return (fct_env){.size = sizeof(fct_env)};
}

const char *fct_version(void) {
    return FACETREE_VERSION;
}

const char *fct_result_text(fct_result result) {
    switch (result) {
    case FCT_OK:
        return "done";
    case FCT_ERROR_DATA:
        return "bad data";
    case FCT_ERROR_INPUT:
        return "input missing or unreadable";
    case FCT_ERROR_OUTPUT:
        return "output cannot be written";
    case FCT_ERROR_MEMORY:
        return "out of memory";
    case FCT_ERROR_CANCELLED:
        return "cancelled";
    case FCT_ERROR_INTERNAL:
        return "internal error";
    }
    return "unknown result";
}
