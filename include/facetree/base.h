/* facetree/base.h: results, the environment of a call, and the absent id.
 *
 * A function that can fail returns an fct_result. On failure it sets *out to NULL (or leaves it unchanged if
 * it is a value) and passes one line of text to the message hook. The library never prints, exits or aborts.
 */
#ifndef FACETREE_BASE_H
#define FACETREE_BASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#if defined(__GNUC__)
#define FCT_API __attribute__((visibility("default")))
#else
#define FCT_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The absent id of a face, node or vertex. */
#define FCT_NONE UINT32_MAX

typedef enum fct_result {
    FCT_OK = 0,
    FCT_ERROR_DATA,      /* the input is malformed, out of range, or not finite */
    FCT_ERROR_INPUT,     /* a file is missing or cannot be read */
    FCT_ERROR_OUTPUT,    /* a file cannot be written; an older file stays unchanged */
    FCT_ERROR_MEMORY,    /* the allocator returned NULL, or a size overflows */
    FCT_ERROR_CANCELLED, /* the progress hook returned false */
    FCT_ERROR_INTERNAL   /* another library failed unexpectedly */
} fct_result;

/* A constant English phrase, never NULL. */
FCT_API const char *fct_result_text(fct_result result);

typedef enum fct_severity { FCT_MESSAGE_ERROR, FCT_MESSAGE_WARNING, FCT_MESSAGE_NOTE } fct_severity;

/* The environment of calls. Get it from fct_env_default and change what you need. It must outlive every
 * object created with it, because objects keep a pointer to it. A hook that is NULL means the default. */
typedef struct fct_env {
    uint32_t size;         /* sizeof(fct_env), set by fct_env_default */
    uint32_t thread_count; /* 0: one per processor */

    /* Returns at least `size` bytes aligned to 64, or NULL. Each call of the library uses the hook in the
     * calling thread only, but your threads may call the library at the same time. Default: aligned_alloc and
     * free. */
    void *(*allocate)(void *user, size_t size);
    void (*release)(void *user, void *memory);
    void *memory_user;

    /* done in [0, 1] is the progress of the phase. Return false to cancel. Runs in the calling thread only.
     */
    bool (*progress)(void *user, const char *phase, double done);
    void *progress_user;

    /* text is one line without a line end. Runs in the calling thread only. */
    void (*message)(void *user, fct_severity severity, const char *text);
    void *message_user;

    /* Receives the path of each file that the library opens for reading, also of files that other files name.
     * size: its bytes, 0 for a pipe or a device. Runs in the calling thread only. */
    void (*opened)(void *user, const char *path, uint64_t size);
    void *opened_user;

    /* The format of inputs whose name has no ending, such as "-" and /dev/fd/3: "obj", "json" and so on.
     * NULL:
     * "-" is a PLY, and other such names are errors. */
    const char *input_format;

    /* Whether a scene file may name buffers outside of its folder. Default: false. */
    bool allow_outside;

    /* Whether scenes turn the closed bodies of their models that are wound inwards (fct_inward_flip of
     * dual.h). Default: false. */
    bool flip_inward;

    /* Whether scenes cluster their models with fct_tree_def.weld false, so that vertices of equal position
     * stay apart. Hierarchy files keep the choice of their build. Default: false. */
    bool no_weld;

    /* Whether scene files are read without their textures and vertex colours: only the factors of materials
     * count. Default: false. */
    bool no_textures;
} fct_env;

FCT_API fct_env fct_env_default(void);

/* "major.minor.patch" of the linked library. */
FCT_API const char *fct_version(void);

/* The SIMD variant in use: "baseline" or "avx2". The library chooses it when it is loaded: AVX2 if the
 * processor supports it. The environment variable FACETREE_SIMD forces one of the two. Results do not depend
 * on it. */
FCT_API const char *fct_simd_variant(void);
/* Checks FACETREE_SIMD. Errors: DATA for an unknown value or for a variant that the processor does not
 * support; the library then uses the best variant that the processor supports. */
FCT_API fct_result fct_simd_check(const fct_env *env);

/* A file that appears at its path when it is complete and on the disk. Until then an older file stays. "-" is
 * standard output. A device or a pipe is written directly. Symbolic links are followed. */
typedef struct fct_writer fct_writer;
/* Errors: OUTPUT, MEMORY. */
FCT_API fct_result fct_writer_open(const fct_env *env, const char *path, fct_writer **out);
/* The stream to write to; the caller may ignore the results of fwrite and fprintf. */
FCT_API FILE *fct_writer_stream(fct_writer *writer);
/* Closes the file. If `keep`, it takes its name, else it vanishes. NULL is allowed. Errors: OUTPUT,
 * MEMORY. */
FCT_API fct_result fct_writer_close(fct_writer *writer, bool keep);
/* Whether a file can be written to `path`. Also removes from its folder the temporary files of programs that
 * were killed. Errors: OUTPUT, MEMORY. */
FCT_API fct_result fct_output_check(const fct_env *env, const char *path);
/* Removes the temporary files of this process from a folder. Call it before the process ends by a signal; it
 * may be called in a signal handler. */
FCT_API void fct_temporary_remove(const char *folder);

/* An axis-aligned box. It is empty if lower > upper in any coordinate. */
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
