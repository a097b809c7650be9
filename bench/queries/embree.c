/* bench/queries/embree.c: Embree's rays and closest points, by default and in robust mode.
 *
 * Embree runs with denormals flushed, as its manual requires; ours runs without. The callback of the point
 * query measures triangles in float by the cases of Ericson (2005), as in Embree's own tutorial.
 */
#include <embree3/rtcore.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "bench/cluster/bench.h"
#include "bench/queries/sides.h"

typedef struct model {
    const fct_mesh *mesh;
    RTCDevice device;
    RTCScene scene;
    RTCScene filtered; /* with filter functions: made when first asked for */
    ssize_t bytes;
} model;

static void flush_denormals(bool on) {
#if defined(__SSE__)
    _mm_setcsr(on ? _mm_getcsr() | 0x8040u : _mm_getcsr() & ~0x8040u);
#else
    (void)on;
#endif
}

static bool count_memory(void *m, ssize_t bytes, bool post) {
    (void)post;
    __atomic_add_fetch(&((model *)m)->bytes, bytes, __ATOMIC_RELAXED);
    return true;
}

static RTCScene make_scene(RTCDevice device, const fct_mesh *mesh, enum RTCSceneFlags flags) {
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, flags);
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *positions =
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh->vertex_count);
    uint32_t *triangles =
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh->face_count);
    if (!positions || !triangles) bench_fail("Embree has no memory");
    memcpy(positions, mesh->positions, 12 * (size_t)mesh->vertex_count);
    memcpy(triangles, mesh->triangles, 12 * (size_t)mesh->face_count);
    rtcCommitGeometry(g);
    rtcAttachGeometry(scene, g);
    rtcReleaseGeometry(g);
    flush_denormals(true);
    rtcCommitScene(scene);
    flush_denormals(false);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) bench_fail("Embree cannot build its structure");
    return scene;
}

static void *build_model(const fct_mesh *mesh, bool robust, uint32_t threads) {
    model *m = bench_allocate(1, sizeof *m);
    char config[64];
    snprintf(config, sizeof config, "threads=%u,frequency_level=simd512", threads);
    m->mesh = mesh;
    m->filtered = NULL;
    m->device = rtcNewDevice(config);
    rtcSetDeviceMemoryMonitorFunction(m->device, count_memory, m);
    m->scene = make_scene(m->device, mesh, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    return m;
}

static void *build_default(const fct_mesh *mesh, const fct_tree *tree, uint32_t threads) {
    (void)tree;
    return build_model(mesh, false, threads);
}

static void *build_robust(const fct_mesh *mesh, const fct_tree *tree, uint32_t threads) {
    (void)tree;
    return build_model(mesh, true, threads);
}

static void destroy_model(void *model_) {
    model *m = model_;
    rtcReleaseScene(m->scene);
    if (m->filtered) rtcReleaseScene(m->filtered);
    rtcReleaseDevice(m->device);
    free(m);
}

static size_t count_bytes(const void *m) {
    return (size_t)((const model *)m)->bytes;
}

static struct RTCRay make_ray(const fct_ray *r) {
    return (struct RTCRay){.org_x = r->origin[0],
                           .org_y = r->origin[1],
                           .org_z = r->origin[2],
                           .tnear = r->t_min,
                           .dir_x = r->direction[0],
                           .dir_y = r->direction[1],
                           .dir_z = r->direction[2],
                           .tfar = r->t_max,
                           .mask = UINT32_MAX};
}

static void find_closest_hits(void *m, size_t count, const void *rays, double *t) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    flush_denormals(true);
    for (size_t i = 0; i < count; ++i) {
        struct RTCRayHit query = {.ray = make_ray((const fct_ray *)rays + i),
                                  .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
        rtcIntersect1(((model *)m)->scene, &context, &query);
        t[i] = query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? INFINITY : (double)query.ray.tfar;
    }
    flush_denormals(false);
}

static void find_any_hits(void *m, size_t count, const void *rays, double *hit) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    flush_denormals(true);
    for (size_t i = 0; i < count; ++i) {
        struct RTCRay ray = make_ray((const fct_ray *)rays + i);
        rtcOccluded1(((model *)m)->scene, &context, &ray);
        hit[i] = ray.tfar < 0;
    }
    flush_denormals(false);
}

typedef struct filter_context {
    struct RTCIntersectContext context; /* first: Embree passes its address on */
    uint32_t face;
} filter_context;

static void reject_face(const struct RTCFilterFunctionNArguments *arguments) {
    const filter_context *c = (const filter_context *)(const void *)arguments->context;
    const struct RTCHit *hit = (const struct RTCHit *)(const void *)arguments->hit; /* of one ray */
    if (hit->primID == c->face) arguments->valid[0] = 0;
}

static void find_except(void *model_, size_t count, const void *queries, double *t) {
    model *m = model_;
    if (!m->filtered) m->filtered = make_scene(m->device, m->mesh, RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    filter_context c;
    rtcInitIntersectContext(&c.context);
    c.context.filter = reject_face;
    flush_denormals(true);
    for (size_t i = 0; i < count; ++i) {
        const bench_except *e = (const bench_except *)queries + i;
        struct RTCRayHit query = {.ray = make_ray(&e->ray), .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
        c.face = e->face;
        rtcIntersect1(m->filtered, &c.context, &query);
        t[i] = query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? INFINITY : (double)query.ray.tfar;
    }
    flush_denormals(false);
}

/* --- Closest points --- */

static void subtract(const float a[3], const float b[3], float out[3]) {
    for (int k = 0; k < 3; ++k) out[k] = a[k] - b[k];
}

static float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Weights of b and c of the point of the triangle that is nearest to p. */
static void find_weights(const float p[3], const float a[3], const float b[3], const float c[3], float *v,
                         float *w) {
    float ab[3], ac[3], ap[3], bp[3], cp[3];
    subtract(b, a, ab), subtract(c, a, ac), subtract(p, a, ap), subtract(p, b, bp), subtract(p, c, cp);
    float d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
          d6 = dot(ac, cp);
    float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    *v = 0, *w = 0;
    if (d1 <= 0 && d2 <= 0) return;
    if (d3 >= 0 && d4 <= d3) {
        *v = 1;
    } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        *v = d1 / (d1 - d3);
    } else if (d6 >= 0 && d5 <= d6) {
        *w = 1;
    } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        *w = d2 / (d2 - d6);
    } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        *w = (d4 - d3) / ((d4 - d3) + (d5 - d6)), *v = 1 - *w;
    } else {
        float scale = 1 / (va + vb + vc);
        *v = vb * scale, *w = vc * scale;
    }
}

typedef struct nearest {
    const fct_mesh *mesh;
    float distance2;
} nearest;

static bool measure_face(struct RTCPointQueryFunctionArguments *arguments) {
    nearest *n = arguments->userPtr;
    const uint32_t *t = n->mesh->triangles + 3 * (size_t)arguments->primID;
    const float *a = n->mesh->positions + 3 * (size_t)t[0], *b = n->mesh->positions + 3 * (size_t)t[1],
                *c = n->mesh->positions + 3 * (size_t)t[2];
    float p[3] = {arguments->query->x, arguments->query->y, arguments->query->z}, v, w, d[3];
    find_weights(p, a, b, c, &v, &w);
    for (int k = 0; k < 3; ++k) d[k] = a[k] + v * (b[k] - a[k]) + w * (c[k] - a[k]) - p[k];
    float distance2 = dot(d, d);
    if (distance2 >= n->distance2) return false;
    n->distance2 = distance2;
    arguments->query->radius = sqrtf(distance2);
    return true;
}

static void find_closest_points(void *m, size_t count, const void *points, double *distances) {
    for (size_t i = 0; i < count; ++i) {
        const float *p = (const float *)points + 3 * i;
        nearest n = {((model *)m)->mesh, INFINITY};
        struct RTCPointQuery query = {.x = p[0], .y = p[1], .z = p[2], .radius = INFINITY};
        struct RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        rtcPointQuery(((model *)m)->scene, &query, &context, measure_face, &n);
        distances[i] = (double)sqrtf(n.distance2);
    }
}

const bench_side bench_embree = {
    .name = "Embree",
    .most_triangles = UINT32_MAX,
    .build = build_default,
    .destroy = destroy_model,
    .bytes = count_bytes,
    .ask = {[BENCH_CLOSEST_HIT] = find_closest_hits,
            [BENCH_ANY_HIT] = find_any_hits,
            [BENCH_CLOSEST_POINT] = find_closest_points,
            [BENCH_SIGNED_DISTANCE] = find_closest_points,
            [BENCH_EXCEPT] = find_except},
    .no_sign = true,
};

const bench_side bench_robust = {
    .name = "robust",
    .most_triangles = UINT32_MAX,
    .build = build_robust,
    .destroy = destroy_model,
    .bytes = count_bytes,
    .ask = {[BENCH_CLOSEST_HIT] = find_closest_hits, [BENCH_ANY_HIT] = find_any_hits},
};
