/* bench/cluster/bench.h: common code of the measuring programs: meshes, clocks, memory, seeded random
 * numbers, and the judge of partitions, which uses triangles and labels only and so treats all builders
 * alike.
 *
 * Each program measures one thing and prints one JSON object. Errors end the program with one line on stderr
 * and exit code 1.
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
/* Allocates count * size zeroed bytes. Ends the program if memory is exhausted. */
void *bench_allocate(size_t count, size_t size);
uint32_t bench_count(const char *text, const char *what);

/* The default environment, with messages on stderr. */
fct_env bench_env(uint32_t threads);
void bench_load(const fct_env *env, const char *path, fct_mesh *mesh);
void bench_save(const fct_env *env, const char *path, const fct_mesh *mesh);
/* The diagonal of the bounds of all vertices that faces use. */
double bench_diagonal(const fct_mesh *mesh);

/* Seconds of a monotonic clock, and of the processor over all threads. */
double bench_seconds(void);
double bench_cpu_seconds(void);

/* Resident memory at the start, and by how much the later peak exceeds it. */
typedef struct bench_memory {
    size_t resident;
} bench_memory;
bench_memory bench_memory_start(void);
size_t bench_memory_grown(bench_memory start);
/* Peak of the resident memory since bench_memory_start, in total. */
size_t bench_memory_peak(void);

/* splitmix64: the same numbers for the same seed on every machine. */
typedef struct bench_dice {
    uint64_t state;
} bench_dice;
uint64_t bench_roll(bench_dice *dice);
/* In [0, 1). */
double bench_unit(bench_dice *dice);

/* Per face, whether it counts. Faces with a repeated corner do not count. Among faces with the same three
 * corners, one counts if more of them have one orientation than the other, and none if the two are equal.
 * No builder clusters the excluded faces well, and some reject them. The caller frees the array. */
bool *bench_single_faces(const fct_mesh *mesh);

/* Area-weighted means over the faces of a partition that count. */
typedef struct bench_quality {
    uint32_t clusters;   /* clusters with such faces */
    double deviation;    /* |n_f - N|^2, where N is the mean normal of the cluster: L2,1 */
    double fit;          /* squared distance to the least-squares plane over the squared diagonal */
    double irregularity; /* perimeter^2 / (4 pi area) */
} bench_quality;
/* Labels are below label_count. A face with the label FCT_NONE has no cluster and must be one that does not
 * count. */
bench_quality bench_judge(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                          uint32_t label_count);

/* Ascending eigenvalues and unit eigenvectors (rows) of xx xy xz yy yz zz, by Jacobi rotations. */
void bench_eigen(const double m[6], double values[3], double vectors[3][3]);

#ifdef __cplusplus
}
#endif
#endif
