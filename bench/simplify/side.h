/* bench/simplify/side.h: one library that simplifies, as a table of functions. Each measuring program links
 * one side; side.c has the main function of all.
 */
#ifndef FCT_BENCH_SIMPLIFY_SIDE_H
#define FCT_BENCH_SIMPLIFY_SIDE_H

#include "bench/cluster/bench.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct bench_side {
    const char *policies; /* the names that `open` accepts; an error message lists them */
    /* The mesh in the form of the library; not timed. The mesh outlives it. NULL: the policy is unknown, or
     * *refused tells why the library cannot hold this mesh. */
    void *(*open)(const fct_mesh *mesh, const char *policy, uint32_t threads, const char **refused);
    /* Simplifies until `faces` or fewer remain, or the library stops earlier; timed. */
    void (*run)(void *model, uint32_t faces);
    /* The triangles that remain, with the vertex colours if the library still has them; not timed. */
    void (*get)(void *model, const fct_env *env, fct_mesh *out);
    void (*close)(void *model);
} bench_side;

/* The side of this program. */
extern const bench_side bench_library;

/* The faces `triangles` (face_count x 3, vertices of `mesh`) with the vertices that they use and their
 * colours. */
void bench_pick_vertices(const fct_env *env, const fct_mesh *mesh, const uint32_t *triangles,
                         uint32_t face_count, fct_mesh *out);

#ifdef __cplusplus
}
#endif
#endif
