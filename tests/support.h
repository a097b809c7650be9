/* tests/support.h: common code of the tests: environments that record messages or fail the nth allocation,
 * and small meshes. */
#ifndef FCT_TESTS_SUPPORT_H
#define FCT_TESTS_SUPPORT_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/env.h"
#include "base/variant.h"
#include "facetree/mesh.h"

/* Exit code of a test that cannot run here: CTest shows it as skipped. */
enum { SKIPPED = 77 };

/* A test that includes base/math/simd.h is built once per variant. Its main calls this first. */
static inline void skip_unless_variant_runs(void) {
#ifdef FCT_VARIANT_AVX2
    if (fct_use_avx2) return;
    puts("skipped: avx2 is not in use");
    exit(SKIPPED);
#endif
}

/* Tests of figures skip their large cases with sanitizers, because these make the code ten times slower. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#else
#define SANITIZED 0
#endif

/* Records the last message. Its allocator fails when `allocations` reaches fail_at (0: never) and counts live
 * allocations. */
typedef struct recorder {
    char text[1024];
    long messages, allocations, fail_at, alive;
} recorder;

static inline void recorder_message(void *user, fct_severity severity, const char *text) {
    recorder *r = user;
    if (severity == FCT_MESSAGE_ERROR || r->text[0] == 0) snprintf(r->text, sizeof r->text, "%s", text);
    ++r->messages;
}

static inline void *recorder_allocate(void *user, size_t size) {
    recorder *r = user;
    if (++r->allocations == r->fail_at) return NULL;
    void *memory = aligned_alloc(64, size);
    r->alive += memory != NULL;
    return memory;
}

static inline void recorder_release(void *user, void *memory) {
    --((recorder *)user)->alive;
    free(memory);
}

static inline fct_env recorder_env(recorder *r) {
    fct_env env = fct_env_default();
    env.message = recorder_message;
    env.allocate = recorder_allocate;
    env.release = recorder_release;
    env.message_user = env.memory_user = r;
    return env;
}

/* n x n squares, two triangles each, over [0,1]^2 in the plane z = 0. */
static inline fct_mesh make_grid(const fct_env *env, uint32_t n) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, (n + 1) * (n + 1), 2 * n * n, 0, &mesh), FCT_OK);
    for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i) {
            float *p = mesh.positions + 3 * (j * (n + 1) + i);
            p[0] = (float)i / (float)n, p[1] = (float)j / (float)n, p[2] = 0;
        }
    uint32_t *t = mesh.triangles;
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i, t += 6) {
            uint32_t a = j * (n + 1) + i, b = a + 1, c = b + n + 1, d = c - 1;
            uint32_t two[6] = {a, b, c, a, c, d};
            memcpy(t, two, sizeof two);
        }
    return mesh;
}

/* The unit sphere by latitude and longitude: n rings of 2n quads, triangles at the poles; outward winding. */
static inline fct_mesh make_sphere(const fct_env *env, uint32_t n) {
    uint32_t m = 2 * n, rings = n - 1;
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, rings * m + 2, 2 * m * rings, 0, &mesh), FCT_OK);
    for (uint32_t j = 0; j < rings; ++j)
        for (uint32_t i = 0; i < m; ++i) {
            double theta = 3.14159265358979323846 * (j + 1) / n, phi = 2 * 3.14159265358979323846 * i / m;
            float *p = mesh.positions + 3 * (j * m + i);
            p[0] = (float)(sin(theta) * cos(phi)), p[1] = (float)(sin(theta) * sin(phi)),
            p[2] = (float)cos(theta);
        }
    uint32_t north = rings * m, south = north + 1;
    float poles[6] = {0, 0, 1, 0, 0, -1};
    memcpy(mesh.positions + 3 * (size_t)north, poles, sizeof poles);
    uint32_t *t = mesh.triangles;
    for (uint32_t i = 0; i < m; ++i) {
        uint32_t k = (i + 1) % m;
        uint32_t caps[6] = {north, i, k, south, (rings - 1) * m + k, (rings - 1) * m + i};
        memcpy(t, caps, sizeof caps);
        t += 6;
        for (uint32_t j = 0; j + 1 < rings; ++j, t += 6) {
            uint32_t a = j * m + i, b = (j + 1) * m + i, c = (j + 1) * m + k, d = j * m + k;
            uint32_t two[6] = {a, b, c, a, c, d};
            memcpy(t, two, sizeof two);
        }
    }
    return mesh;
}

static inline bool file_exists(const char *path) {
    FILE *file = fopen(path, "rb");
    if (file) fclose(file);
    return file != NULL;
}

#endif
