/* base/env.h: memory, messages and progress through the caller's fct_env. */
#ifndef FCT_BASE_ENV_H
#define FCT_BASE_ENV_H

#include "facetree/base.h"

/* count * size bytes aligned to 64, or NULL if the product overflows or memory is exhausted. A request of 0
 * bytes returns a valid pointer. */
void *fct_allocate(const fct_env *env, size_t count, size_t size);
void *fct_allocate_zero(const fct_env *env, size_t count, size_t size);
/* NULL is allowed. */
void fct_release(const fct_env *env, void *memory);

/* One array of a group: where its pointer is stored, its length, and the size of an element. An absent array
 * gets the pointer NULL. */
typedef struct fct_array {
    void *pointer; /* address of the pointer */
    size_t count, size;
    bool zero, absent;
} fct_array;
#define FCT_ARRAY(pointer, count)                                                                            \
    { &(pointer), (count), sizeof *(pointer), false, false }
#define FCT_ARRAY_ZERO(pointer, count)                                                                       \
    { &(pointer), (count), sizeof *(pointer), true, false }
#define FCT_ARRAY_IF(wanted, pointer, count)                                                                 \
    { &(pointer), (count), sizeof *(pointer), false, !(wanted) }
#define FCT_LENGTH(array) (sizeof(array) / sizeof *(array))

/* Allocates all arrays of the table. On failure it releases them, sets every pointer to NULL and fails with
 * fct_fail_memory(env, what). */
fct_result fct_allocate_all(const fct_env *env, const fct_array *arrays, size_t count, const char *what);
/* Releases all arrays of the table and sets every pointer to NULL. NULL pointers are allowed. */
void fct_release_all(const fct_env *env, const fct_array *arrays, size_t count);

/* Makes room for `needed` elements in *array, which holds *capacity. The capacity grows by at least half, and
 * the contents stay. On failure nothing changes. Errors: MEMORY. */
fct_result fct_grow(const fct_env *env, void **array, size_t *capacity, size_t needed, size_t size);

/* Sends the message and returns `result`: return fct_fail(env, FCT_ERROR_DATA, ...). */
fct_result fct_fail(const fct_env *env, fct_result result, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
fct_result fct_fail_memory(const fct_env *env, const char *what);
void fct_note(const fct_env *env, fct_severity severity, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Reports progress. Returns FCT_ERROR_CANCELLED if the hook returns false. Call it only in the thread that
 * called the library. */
fct_result fct_progress(const fct_env *env, const char *phase, double done);

/* At least 1. */
uint32_t fct_env_threads(const fct_env *env);

/* Seconds of a monotonic clock, for statistics only. */
double fct_seconds(void);

#endif
