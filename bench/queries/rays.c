/* bench/queries/rays.c: rays through our structure and through Embree, in one process over the same mesh.
 *
 * usage: rays [-n RAYS] [-r ROUNDS] [-o FILE.csv] MESH...
 * Three structures take turns: ours, Embree at its default, and Embree in robust mode, which is as watertight
 * as ours. Each round times all three, and the table shows medians over the rounds. A ratio is the rate of
 * ours over Embree's single rays in the same round. Times are processor times of one thread; only builds on
 * two threads are wall time. Embree runs with denormals flushed, as its manual requires, and ours without.
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
#include "facetree/bvh.h"

enum { MOST_ROUNDS = 99 };

typedef struct options {
    size_t rays;
    uint32_t rounds;
    FILE *csv;
} options;

/* --- Rays --- */

/* A square image of the whole mesh, seen from above one corner of its bounds, row by row. */
static void make_primary(const fct_bounds *b, size_t count, fct_ray *rays) {
    double center[3], half2 = 0, forward[3] = {-.62, -.48, -.62}, right[3], up[3];
    for (int k = 0; k < 3; ++k) {
        double half = ((double)b->upper[k] - (double)b->lower[k]) / 2;
        center[k] = (double)b->lower[k] + half, half2 += half * half;
    }
    double flat = hypot(forward[0], forward[2]), radius = sqrt(half2), distance = 2.5 * radius;
    right[0] = -forward[2] / flat, right[1] = 0, right[2] = forward[0] / flat;
    up[0] = right[1] * forward[2] - right[2] * forward[1];
    up[1] = right[2] * forward[0] - right[0] * forward[2];
    up[2] = right[0] * forward[1] - right[1] * forward[0];
    size_t width = (size_t)sqrt((double)count);
    for (size_t i = 0; i < count; ++i) {
        double x = .35 * (2 * ((double)(i % width) + .5) / (double)width - 1);
        double y = .35 * (2 * ((double)(i / width) + .5) / (double)width - 1);
        rays[i] = (fct_ray){.t_min = 0, .t_max = INFINITY};
        for (int k = 0; k < 3; ++k) {
            rays[i].origin[k] = (float)(center[k] - distance * forward[k]);
            rays[i].direction[k] = (float)(forward[k] + x * right[k] + y * up[k]);
        }
    }
}

/* From one random point of the bounds towards another. */
static void make_incoherent(const fct_bounds *b, size_t count, fct_ray *rays) {
    bench_dice dice = {5};
    for (size_t i = 0; i < count; ++i) {
        rays[i] = (fct_ray){.t_min = 0, .t_max = INFINITY};
        for (int k = 0; k < 3; ++k) {
            double low = (double)b->lower[k], size = (double)b->upper[k] - low;
            double from = low + size * bench_unit(&dice), to = low + size * bench_unit(&dice);
            rays[i].origin[k] = (float)from, rays[i].direction[k] = (float)(to - from);
        }
    }
}

/* --- Embree --- */

typedef struct peer {
    RTCDevice device;
    RTCScene scene;
} peer;

static void flush_denormals(bool on) {
#if defined(__SSE__)
    _mm_setcsr(on ? _mm_getcsr() | 0x8040u : _mm_getcsr() & ~0x8040u);
#else
    (void)on;
#endif
}

static peer build_peer(const fct_mesh *mesh, bool robust, uint32_t threads) {
    char config[64];
    snprintf(config, sizeof config, "threads=%u,frequency_level=simd512", threads);
    peer p = {.device = rtcNewDevice(config)};
    p.scene = rtcNewScene(p.device);
    rtcSetSceneFlags(p.scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    RTCGeometry g = rtcNewGeometry(p.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *positions =
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh->vertex_count);
    uint32_t *triangles =
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh->face_count);
    if (!positions || !triangles) bench_fail("Embree has no memory");
    memcpy(positions, mesh->positions, 12 * (size_t)mesh->vertex_count);
    memcpy(triangles, mesh->triangles, 12 * (size_t)mesh->face_count);
    rtcCommitGeometry(g);
    rtcAttachGeometry(p.scene, g);
    rtcReleaseGeometry(g);
    flush_denormals(true);
    rtcCommitScene(p.scene);
    flush_denormals(false);
    if (rtcGetDeviceError(p.device) != RTC_ERROR_NONE) bench_fail("Embree cannot build its structure");
    return p;
}

static void destroy_peer(peer *p) {
    rtcReleaseScene(p->scene);
    rtcReleaseDevice(p->device);
}

static struct RTCRay make_peer_ray(const fct_ray *r) {
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

/* --- Questions --- */

typedef enum question { CLOSEST, ANY, CLOSEST_BATCH, ANY_BATCH } question;

typedef struct subject {
    const fct_bvh *bvh;
    peer peers[2]; /* default, robust */
    size_t count;
    const fct_ray *rays;
    fct_hit *hits;
    uint64_t *bits;
} subject;

/* Seconds of all rays; *hits receives how many hit. */
static double time_ours(const subject *s, question q, size_t *hits) {
    *hits = 0;
    double start = bench_cpu_seconds();
    switch (q) {
    case CLOSEST:
        for (size_t i = 0; i < s->count; ++i)
            *hits += fct_bvh_closest_hit(s->bvh, s->rays + i, s->hits, NULL);
        break;
    case ANY:
        for (size_t i = 0; i < s->count; ++i) *hits += fct_bvh_any_hit(s->bvh, s->rays + i, NULL);
        break;
    case CLOSEST_BATCH:
        fct_bvh_closest_hits(s->bvh, s->count, s->rays, s->hits);
        break;
    case ANY_BATCH:
        fct_bvh_any_hits(s->bvh, s->count, s->rays, s->bits);
        break;
    }
    double seconds = bench_cpu_seconds() - start;
    for (size_t i = 0; i < s->count && q == CLOSEST_BATCH; ++i) *hits += s->hits[i].face != FCT_NONE;
    for (size_t i = 0; i < s->count && q == ANY_BATCH; ++i) *hits += s->bits[i / 64] >> (i % 64) & 1;
    return seconds;
}

static double time_peer(const subject *s, int which, question q, size_t *hits) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    *hits = 0;
    flush_denormals(true);
    double start = bench_cpu_seconds();
    for (size_t i = 0; i < s->count; ++i) {
        struct RTCRayHit query = {.ray = make_peer_ray(s->rays + i),
                                  .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
        if (q == CLOSEST || q == CLOSEST_BATCH) {
            rtcIntersect1(s->peers[which].scene, &context, &query);
            *hits += query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        } else {
            rtcOccluded1(s->peers[which].scene, &context, &query.ray);
            *hits += query.ray.tfar < 0;
        }
    }
    double seconds = bench_cpu_seconds() - start;
    flush_denormals(false);
    return seconds;
}

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double find_median(double *values, uint32_t count) {
    qsort(values, count, sizeof *values, compare_doubles);
    return values[count / 2];
}

static void print_row(const options *o, const char *mesh, const char *what, double ours, double embree,
                      double robust, double ratio, double ratio_robust) {
    printf("  %-20s %9.3f %9.3f %9.3f %8.2f %8.2f\n", what, ours, embree, robust, ratio, ratio_robust);
    fflush(stdout);
    if (o->csv)
        fprintf(o->csv, "%s,%s,%g,%g,%g,%g,%g\n", mesh, what, ours, embree, robust, ratio, ratio_robust);
}

/* Fails if the hits of ours and of Embree differ by more than rays that pass a rim. */
static void compare_rates(const options *o, const char *mesh, const subject *s, const char *what,
                          question q) {
    double ours[MOST_ROUNDS], peers[2][MOST_ROUNDS], ratios[2][MOST_ROUNDS];
    for (uint32_t i = 0; i < o->rounds; ++i) {
        size_t hits, peer_hits;
        double seconds = time_ours(s, q, &hits);
        ours[i] = (double)s->count / seconds / 1e6;
        for (int which = 0; which < 2; ++which) {
            double peer_seconds = time_peer(s, which, q, &peer_hits);
            peers[which][i] = (double)s->count / peer_seconds / 1e6;
            ratios[which][i] = peer_seconds / seconds;
        }
        if (fabs((double)hits - (double)peer_hits) > 1e-3 * (double)s->count + 8)
            bench_fail("%s, %s: we hit %zu times and Embree %zu times", mesh, what, hits, peer_hits);
    }
    print_row(o, mesh, what, find_median(ours, o->rounds), find_median(peers[0], o->rounds),
              find_median(peers[1], o->rounds), find_median(ratios[0], o->rounds),
              find_median(ratios[1], o->rounds));
}

/* --- Builds --- */

static double time_own_build(const fct_tree *tree, uint32_t threads) {
    fct_env env = bench_env(threads);
    fct_bvh *bvh;
    double start = bench_seconds();
    bench_check(fct_bvh_create(&env, tree, FCT_BACKEND_OBB, &bvh), "a ray structure");
    double seconds = bench_seconds() - start;
    fct_bvh_destroy(bvh);
    return seconds;
}

static double time_peer_build(const fct_mesh *mesh, bool robust, uint32_t threads) {
    double start = bench_seconds();
    peer p = build_peer(mesh, robust, threads);
    double seconds = bench_seconds() - start;
    destroy_peer(&p);
    return seconds;
}

static void compare_builds(const options *o, const char *mesh_name, const fct_mesh *mesh,
                           const fct_tree *tree, uint32_t threads, const char *what) {
    double ours[MOST_ROUNDS], peers[2][MOST_ROUNDS], ratios[2][MOST_ROUNDS];
    for (uint32_t i = 0; i < o->rounds; ++i) {
        ours[i] = time_own_build(tree, threads);
        for (int which = 0; which < 2; ++which) {
            peers[which][i] = time_peer_build(mesh, which == 1, threads);
            ratios[which][i] = peers[which][i] / ours[i];
        }
    }
    print_row(o, mesh_name, what, find_median(ours, o->rounds), find_median(peers[0], o->rounds),
              find_median(peers[1], o->rounds), find_median(ratios[0], o->rounds),
              find_median(ratios[1], o->rounds));
}

/* --- One mesh --- */

static void print_visits(const char *what, const subject *s) {
    fct_visits v = {0, 0, 0};
    for (size_t i = 0; i < s->count; ++i) fct_bvh_closest_hit(s->bvh, s->rays + i, s->hits, &v);
    double n = (double)s->count;
    printf("  %-20s %.2f nodes, %.1f boxes, %.2f triangles per ray\n", what, (double)v.nodes / n,
           (double)v.boxes / n, (double)v.triangles / n);
}

static void measure_mesh(const options *o, const char *path) {
    fct_env env = bench_env(1);
    fct_mesh mesh;
    fct_tree *tree;
    fct_bvh *bvh;
    bench_load(&env, path, &mesh);
    fct_tree_def def = fct_tree_def_default();
    bench_check(fct_tree_build(&env, &mesh, &def, NULL, &tree), "a tree");
    bench_check(fct_bvh_create(&env, tree, FCT_BACKEND_OBB, &bvh), "a ray structure");
    fct_ray *rays = bench_allocate(o->rays, sizeof *rays);
    subject s = {.bvh = bvh,
                 .peers = {build_peer(&mesh, false, 1), build_peer(&mesh, true, 1)},
                 .count = o->rays,
                 .rays = rays,
                 .hits = bench_allocate(o->rays, sizeof *s.hits),
                 .bits = bench_allocate(o->rays / 64 + 1, sizeof *s.bits)};
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    fct_bounds bounds = fct_bvh_bounds(bvh);
    printf("%s: %u triangles, %.1f bytes per triangle\n", name, mesh.face_count,
           (double)fct_bvh_bytes(bvh) / mesh.face_count);
    printf("  %-20s %9s %9s %9s %8s %8s\n", "M rays/s, seconds", "ours", "embree", "robust", "ratio",
           "/robust");
    make_primary(&bounds, o->rays, rays);
    compare_rates(o, name, &s, "primary", CLOSEST);
    compare_rates(o, name, &s, "primary batch", CLOSEST_BATCH);
    print_visits("primary visits", &s);
    make_incoherent(&bounds, o->rays, rays);
    compare_rates(o, name, &s, "incoherent", CLOSEST);
    compare_rates(o, name, &s, "incoherent batch", CLOSEST_BATCH);
    compare_rates(o, name, &s, "incoherent any", ANY);
    compare_rates(o, name, &s, "incoherent any batch", ANY_BATCH);
    print_visits("incoherent visits", &s);
    compare_builds(o, name, &mesh, tree, 1, "build, 1 thread");
    compare_builds(o, name, &mesh, tree, 2, "build, 2 threads");
    free(rays), free(s.hits), free(s.bits);
    destroy_peer(&s.peers[0]), destroy_peer(&s.peers[1]);
    fct_bvh_destroy(bvh);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

int main(int argc, char **argv) {
    options o = {.rays = 1 << 18, .rounds = 5};
    int i = 1;
    for (; i + 1 < argc && argv[i][0] == '-'; i += 2) {
        if (!strcmp(argv[i], "-n"))
            o.rays = bench_count(argv[i + 1], "-n");
        else if (!strcmp(argv[i], "-r"))
            o.rounds = bench_count(argv[i + 1], "-r");
        else if (!strcmp(argv[i], "-o"))
            o.csv = fopen(argv[i + 1], "w");
        else
            break;
    }
    if (i >= argc || argv[i][0] == '-' || o.rays < 1 || o.rounds < 1 || o.rounds > MOST_ROUNDS)
        bench_fail("usage: rays [-n RAYS] [-r ROUNDS] [-o FILE.csv] MESH...");
    if (o.csv) fputs("mesh,measure,ours,embree,robust,ratio,ratio_robust\n", o.csv);
    for (; i < argc; ++i) measure_mesh(&o, argv[i]);
    if (o.csv) fclose(o.csv);
    return 0;
}
