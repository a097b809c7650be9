/* bench/queries/points.c: closest points of meshes, beside Embree's point query in the same process.
 *
 *     bench_queries_points MESH...
 *
 * Two sets of points per mesh: "near" within 2 % of the diagonal of the surface, "box" anywhere in the
 * bounds. Both sides answer the same points in turns, one point at a time, on one thread. The table gives the
 * median of the rounds in CPU time. Embree's callback measures triangles in float by the cases of Ericson
 * (2005), as in Embree's own tutorial. The program fails if the distances differ by more than float rounding.
 */
#define _POSIX_C_SOURCE 200809L
#include <embree3/rtcore.h>
#include <facetree/facetree.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { POINTS = 20000, ROUNDS = 7 };

typedef struct subject {
    fct_mesh mesh;
    fct_tree *tree;
    fct_bvh *bvh;
    RTCDevice device;
    RTCScene scene;
    double diagonal;
} subject;

static double cpu_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static uint64_t random_next(uint64_t *state) {
    uint64_t x = *state += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/* In [0, 1). */
static double random_unit(uint64_t *state) {
    return (double)(random_next(state) >> 11) * 0x1p-53;
}

static void print_message(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR) fprintf(stderr, "%s\n", text);
}

/* --- Embree --- */

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

static void commit_embree(subject *s) {
    s->device = rtcNewDevice("threads=1,frequency_level=simd512");
    s->scene = rtcNewScene(s->device);
    RTCGeometry geometry = rtcNewGeometry(s->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12,
                                              s->mesh.vertex_count);
    uint32_t *faces =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, s->mesh.face_count);
    memcpy(vertices, s->mesh.positions, 12 * (size_t)s->mesh.vertex_count);
    memcpy(faces, s->mesh.triangles, 12 * (size_t)s->mesh.face_count);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(s->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(s->scene);
}

static double ask_embree(const subject *s, const float *points, float *distances) {
    double start = cpu_seconds();
    for (size_t i = 0; i < POINTS; ++i) {
        nearest n = {&s->mesh, INFINITY};
        struct RTCPointQuery query = {
            .x = points[3 * i], .y = points[3 * i + 1], .z = points[3 * i + 2], .radius = INFINITY};
        struct RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        rtcPointQuery(s->scene, &query, &context, measure_face, &n);
        distances[i] = sqrtf(n.distance2);
    }
    return cpu_seconds() - start;
}

/* --- Facetree --- */

static double ask_facetree(const subject *s, const float *points, float *distances, fct_visits *visits) {
    double start = cpu_seconds();
    for (size_t i = 0; i < POINTS; ++i) {
        fct_closest closest;
        fct_bvh_closest_point(s->bvh, points + 3 * i, INFINITY, &closest, visits);
        distances[i] = closest.distance;
    }
    return cpu_seconds() - start;
}

/* --- Points and rounds --- */

static void make_near_points(const subject *s, float *points) {
    uint64_t seed = 1;
    for (size_t i = 0; i < POINTS; ++i) {
        const uint32_t *t = s->mesh.triangles + 3 * (size_t)(random_next(&seed) % s->mesh.face_count);
        double u = random_unit(&seed), v = (1 - u) * random_unit(&seed), r = .02 * s->diagonal;
        for (int k = 0; k < 3; ++k) {
            double a = (double)s->mesh.positions[3 * (size_t)t[0] + (size_t)k],
                   b = (double)s->mesh.positions[3 * (size_t)t[1] + (size_t)k],
                   c = (double)s->mesh.positions[3 * (size_t)t[2] + (size_t)k];
            double offset = r * (2 * random_unit(&seed) - 1) / sqrt(3);
            points[3 * i + (size_t)k] = (float)(a + u * (b - a) + v * (c - a) + offset);
        }
    }
}

static void make_box_points(const subject *s, float *points) {
    fct_bounds b = fct_bvh_bounds(s->bvh);
    uint64_t seed = 2;
    for (size_t i = 0; i < 3 * (size_t)POINTS; ++i)
        points[i] = b.lower[i % 3] + (b.upper[i % 3] - b.lower[i % 3]) * (float)random_unit(&seed);
}

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double find_median(double values[ROUNDS]) {
    qsort(values, ROUNDS, sizeof *values, compare_doubles);
    return values[ROUNDS / 2];
}

/* Asks both in turns and prints one row. Returns false if they disagree. */
static bool measure_points(const subject *s, const char *name, const char *kind, const float *points,
                           float *ours, float *theirs) {
    double own[ROUNDS], embree[ROUNDS], ratio[ROUNDS];
    fct_visits visits = {0};
    for (int i = 0; i < ROUNDS; ++i) {
        own[i] = ask_facetree(s, points, ours, i ? NULL : &visits);
        embree[i] = ask_embree(s, points, theirs);
        ratio[i] = embree[i] / own[i];
    }
    size_t different = 0;
    for (size_t i = 0; i < POINTS; ++i)
        different += !(fabs((double)ours[i] - (double)theirs[i]) <= 1e-6 * s->diagonal);
    printf("%-24.24s %9u  %-5s %9.0f %9.0f %7.2f %8.1f %9.1f\n", name, s->mesh.face_count, kind,
           POINTS / find_median(own) / 1e3, POINTS / find_median(embree) / 1e3, find_median(ratio),
           (double)visits.nodes / POINTS, (double)visits.triangles / POINTS);
    fflush(stdout);
    if (different) printf("  %zu of %d distances differ\n", different, POINTS);
    return different == 0;
}

static bool measure_mesh(const fct_env *env, const char *path, float *points, float *ours, float *theirs) {
    subject s = {.diagonal = 0};
    bool good = false;
    fct_tree_def def = fct_tree_def_default();
    if (fct_mesh_load(env, path, &s.mesh) != FCT_OK) return false;
    if (fct_tree_build(env, &s.mesh, &def, NULL, &s.tree) != FCT_OK ||
        fct_bvh_create(env, s.tree, FCT_BACKEND_OBB, &s.bvh) != FCT_OK)
        goto done;
    fct_bounds b = fct_bvh_bounds(s.bvh);
    for (int k = 0; k < 3; ++k) s.diagonal += pow((double)b.upper[k] - (double)b.lower[k], 2);
    s.diagonal = sqrt(s.diagonal);
    commit_embree(&s);
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    make_near_points(&s, points);
    good = measure_points(&s, name, "near", points, ours, theirs);
    make_box_points(&s, points);
    good = measure_points(&s, name, "box", points, ours, theirs) && good;
    rtcReleaseScene(s.scene);
    rtcReleaseDevice(s.device);
done:
    fct_bvh_destroy(s.bvh);
    fct_tree_destroy(s.tree);
    fct_mesh_release(env, &s.mesh);
    return good;
}

int main(int argc, char **argv) {
    fct_env env = fct_env_default();
    env.message = print_message;
    float *points = malloc(3 * sizeof(float) * POINTS), *ours = malloc(sizeof(float) * POINTS),
          *theirs = malloc(sizeof(float) * POINTS);
    bool good = points && ours && theirs && argc > 1;
    if (argc < 2) fprintf(stderr, "usage: bench_queries_points MESH...\n");
    if (good)
        printf("%-24s %9s  %-5s %9s %9s %7s %8s %9s\n", "mesh", "faces", "where", "ours k/s", "embree",
               "ratio", "nodes", "triangles");
    for (int i = 1; good && i < argc; ++i) good = measure_mesh(&env, argv[i], points, ours, theirs);
    free(points), free(ours), free(theirs);
    return !good;
}
