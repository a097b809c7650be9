/* facetree/base.h: what every part of the library shares: results, the environment a call runs in, the absent
 * id.
 *
 * Every function that can fail returns an fct_result, leaves *out NULL (or untouched where it is a value) on
 * failure and hands one line of text to the environment's message hook. The library never prints, exits or
 * aborts.
 */
#ifndef FACETREE_BASE_H
#define FACETREE_BASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define FCT_API __attribute__((visibility("default")))
#else
#define FCT_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The one absent id: no face, no node, no vertex. */
#define FCT_NONE UINT32_MAX

typedef enum fct_result {
    FCT_OK = 0,
    FCT_ERROR_DATA,      /* the input's content is wrong: malformed, out of range, not finite */
    FCT_ERROR_INPUT,     /* a file is missing or cannot be read */
    FCT_ERROR_OUTPUT,    /* a file cannot be written; an older one is left as it was */
    FCT_ERROR_MEMORY,    /* the environment's allocator returned NULL, or a size does not fit */
    FCT_ERROR_CANCELLED, /* the progress hook returned false */
    FCT_ERROR_INTERNAL   /* a wrapped library failed in a way that should not happen */
} fct_result;

/* A constant English phrase, never NULL. */
FCT_API const char *fct_result_text(fct_result result);

typedef enum fct_severity { FCT_MESSAGE_ERROR, FCT_MESSAGE_WARNING, FCT_MESSAGE_NOTE } fct_severity;

/* Where a call runs. Fill it with fct_env_default and change what you need; it must outlive every object made
 * with it, for objects keep a pointer to it. All hooks may be NULL, which means the default. */
typedef struct fct_env {
    uint32_t size;         /* sizeof(fct_env), set by fct_env_default */
    uint32_t thread_count; /* 0: one per processor */

    /* Returns at least `size` bytes aligned to 64, or NULL. Called from one thread at a time for each object
     * being built, but possibly from several user threads at once. Default: aligned_alloc and free. */
    void *(*allocate)(void *user, size_t size);
    void (*release)(void *user, void *memory);
    void *memory_user;

    /* `done` is in [0, 1] for the named phase; false cancels. Called from the calling thread only. */
    bool (*progress)(void *user, const char *phase, double done);
    void *progress_user;

    /* One line without a line end. Called from the calling thread only. */
    void (*message)(void *user, fct_severity severity, const char *text);
    void *message_user;
} fct_env;

FCT_API fct_env fct_env_default(void);

/* "major.minor.patch" of the library that is linked. */
FCT_API const char *fct_version(void);

/* The SIMD variant in use: "baseline" or "avx2". The library chooses it when it is loaded: AVX2 if the
 * processor supports it. The environment variable FACETREE_SIMD forces one of the two. Results do not depend
 * on it. */
FCT_API const char *fct_simd_variant(void);
/* Checks FACETREE_SIMD. Errors: DATA for an unknown value or for a variant that the processor does not
 * support; the library then uses the best variant that the processor supports. */
FCT_API fct_result fct_simd_check(const fct_env *env);

/* An axis-aligned box; empty when lower > upper in any coordinate. */
typedef struct fct_bounds {
    float lower[3], upper[3];
} fct_bounds;

/* An oriented box: the points center + sum_i s_i half[i] axes[i], |s_i| <= 1. Axes are orthonormal to float
 * rounding. */
typedef struct fct_box {
    float center[3];
    float axes[3][3];
    float half[3];
} fct_box;

#ifdef __cplusplus
}
#endif
#endif
