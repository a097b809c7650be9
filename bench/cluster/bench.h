/* bench/cluster/bench.h: what the measuring programs share: meshes, clocks, memory, seeded numbers, and the
 * judge of a partition, which sees triangles and labels alone and so holds every builder to one measure.
 *
 * Each program measures one thing in a process of its own and prints one JSON object. Errors end the program
 * with one line on stderr and exit code 1.
 */
#ifndef FCT_BENCH_CLUSTER_BENCH_H
#define FCT_BENCH_CLUSTER_BENCH_H

#include "facetree/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

#ifdef __cplusplus
[[noreturn]]
#else
_Noreturn
#endif
void bench_fail(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* Ends the program unless `result` is FCT_OK. */
void bench_check(fct_result result, const char *what);
/* count * size bytes, zeroed; ends the program when there are none. */
void *bench_allocate(size_t count, size_t size);
uint32_t bench_count(const char *text, const char *what);

/* The default environment with its messages on stderr. */
fct_env bench_env(uint32_t threads);
void bench_load(const fct_env *env, const char *path, fct_mesh *mesh);
void bench_save(const fct_env *env, const char *path, const fct_mesh *mesh);
/* Of the bounds of all vertices that a face uses. */
double bench_diagonal(const fct_mesh *mesh);

/* Of a monotonic clock, and of the processor over all threads. */
double bench_seconds(void);
double bench_cpu_seconds(void);

/* Memory from a moment on: what is resident then, and by how much the most ever resident exceeds it later. */
typedef struct bench_memory {
    size_t resident;
} bench_memory;
bench_memory bench_memory_start(void);
size_t bench_memory_grown(bench_memory start);
/* Most that was resident since the start of bench_memory_start, in all. */
size_t bench_memory_peak(void);

/* The same numbers for the same seed everywhere: splitmix64. */
typedef struct bench_dice {
    uint64_t state;
} bench_dice;
uint64_t bench_roll(bench_dice *dice);
/* In [0, 1). */
double bench_unit(bench_dice *dice);

/* Per face, whether it stands for itself: of faces on the same three corners one does if those turned one way
 * outnumber those turned the other, and none if they cancel; faces with a repeated corner never do. What no
 * builder can cluster well and some cannot even take. To be freed. */
bool *bench_single_faces(const fct_mesh *mesh);

/* Area-weighted means over the faces of a partition that stand for themselves. */
typedef struct bench_quality {
    uint32_t clusters;   /* that have such faces */
    double deviation;    /* |n_f - N|^2, N the cluster's mean normal: L2,1 */
    double fit;          /* squared distance to the least-squares plane over the squared diagonal */
    double irregularity; /* perimeter^2 / (4 pi area) */
} bench_quality;
/* Labels below label_count; a face labelled FCT_NONE belongs to no cluster and must not stand for itself. */
bench_quality bench_judge(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                          uint32_t label_count);

/* Eigenvalues, ascending, and unit eigenvectors (rows) of xx xy xz yy yz zz, by Jacobi's rotations. */
void bench_eigen(const double m[6], double values[3], double vectors[3][3]);

#ifdef __cplusplus
}
#endif
#endif
