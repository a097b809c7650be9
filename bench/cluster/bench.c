/* bench/cluster/bench.c: meshes, clocks, memory and seeded numbers for the measuring programs. */
#define _GNU_SOURCE
#include "bench/cluster/bench.h"

#include <errno.h>
#include <malloc.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

void bench_fail(const char *format, ...) {
    va_list list;
    va_start(list, format);
    fputs("bench: ", stderr);
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
    va_end(list);
    exit(1);
}

void bench_check(fct_result result, const char *what) {
    if (result != FCT_OK) bench_fail("%s: %s", what, fct_result_text(result));
}

void *bench_allocate(size_t count, size_t size) {
    void *memory = calloc(count ? count : 1, size);
    if (!memory) bench_fail("out of memory for %zu x %zu bytes", count, size);
    return memory;
}

uint32_t bench_count(const char *text, const char *what) {
    char *end;
    errno = 0;
    unsigned long long value = strtoull(text, &end, 10);
    if (errno || end == text || *end || value > 400000000)
        bench_fail("%s: expected a count, found '%s'", what, text);
    return (uint32_t)value;
}

static void tell(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR) fprintf(stderr, "bench: %s\n", text);
}

fct_env bench_env(uint32_t threads) {
    fct_env env = fct_env_default();
    env.thread_count = threads;
    env.message = tell;
    return env;
}

void bench_load(const fct_env *env, const char *path, fct_mesh *mesh) {
    bench_check(fct_mesh_load(env, path, mesh), path);
    if (mesh->face_count == 0) bench_fail("%s: a mesh without faces", path);
}

void bench_save(const fct_env *env, const char *path, const fct_mesh *mesh) {
    bench_check(fct_mesh_save(env, path, mesh, NULL), path);
}

double bench_diagonal(const fct_mesh *mesh) {
    double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY}, sum = 0;
    for (size_t i = 0; i < 3 * (size_t)mesh->face_count; ++i)
        for (size_t k = 0; k < 3; ++k) {
            double x = (double)mesh->positions[3 * (size_t)mesh->triangles[i] + k];
            lower[k] = fmin(lower[k], x), upper[k] = fmax(upper[k], x);
        }
    for (int k = 0; k < 3; ++k) sum += (upper[k] - lower[k]) * (upper[k] - lower[k]);
    return sum > 0 ? sqrt(sum) : 1;
}

static double clock_of(clockid_t id) {
    struct timespec t;
    clock_gettime(id, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double bench_seconds(void) {
    return clock_of(CLOCK_MONOTONIC);
}

double bench_cpu_seconds(void) {
    return clock_of(CLOCK_PROCESS_CPUTIME_ID);
}

static size_t status_bytes(const char *key) {
    FILE *file = fopen("/proc/self/status", "r");
    char line[256];
    size_t bytes = 0, length = strlen(key);
    while (file && fgets(line, sizeof line, file))
        if (strncmp(line, key, length) == 0) bytes = 1024 * strtoull(line + length, NULL, 10);
    if (file) fclose(file);
    return bytes;
}

bench_memory bench_memory_start(void) {
    malloc_trim(0);
    /* writing 5 resets the peak to the resident memory; if that is forbidden, the peak includes the loading
     */
    FILE *file = fopen("/proc/self/clear_refs", "w");
    if (file) {
        fputs("5", file);
        fclose(file);
    }
    return (bench_memory){status_bytes("VmRSS:")};
}

size_t bench_memory_peak(void) {
    return status_bytes("VmHWM:");
}

size_t bench_memory_grown(bench_memory start) {
    size_t peak = bench_memory_peak();
    return peak > start.resident ? peak - start.resident : 0;
}

uint64_t bench_roll(bench_dice *dice) {
    uint64_t x = dice->state += 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

double bench_unit(bench_dice *dice) {
    return (double)(bench_roll(dice) >> 11) * 0x1p-53;
}

static void rotate(double a[3][3], double v[3][3], int p, int q) {
    if (a[p][q] == 0) return;
    double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
    double t = (theta < 0 ? -1 : 1) / (fabs(theta) + hypot(theta, 1)), c = 1 / hypot(t, 1), s = t * c;
    for (int k = 0; k < 3; ++k) {
        double x = a[k][p], y = a[k][q];
        a[k][p] = c * x - s * y, a[k][q] = s * x + c * y;
    }
    for (int k = 0; k < 3; ++k) {
        double x = a[p][k], y = a[q][k];
        a[p][k] = c * x - s * y, a[q][k] = s * x + c * y;
        x = v[p][k], y = v[q][k];
        v[p][k] = c * x - s * y, v[q][k] = s * x + c * y;
    }
    a[p][q] = a[q][p] = 0;
}

void bench_eigen(const double m[6], double values[3], double vectors[3][3]) {
    double a[3][3] = {{m[0], m[1], m[2]}, {m[1], m[3], m[4]}, {m[2], m[4], m[5]}};
    double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int sweep = 0; sweep < 12; ++sweep) {
        double rest = fabs(a[0][1]) + fabs(a[0][2]) + fabs(a[1][2]);
        if (!(rest > 1e-17 * (fabs(a[0][0]) + fabs(a[1][1]) + fabs(a[2][2])))) break;
        rotate(a, v, 0, 1), rotate(a, v, 0, 2), rotate(a, v, 1, 2);
    }
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 2; ++i)
        for (int j = 2; j > i; --j)
            if (a[order[j]][order[j]] < a[order[j - 1]][order[j - 1]]) {
                int swap = order[j];
                order[j] = order[j - 1], order[j - 1] = swap;
            }
    for (int i = 0; i < 3; ++i) {
        values[i] = a[order[i]][order[i]];
        memcpy(vectors[i], v[order[i]], sizeof v[0]);
    }
}
