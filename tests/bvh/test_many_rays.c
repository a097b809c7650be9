/* Many rays: none is answered wrongly beside Embree, and none leaves a closed model. Run as
 *     test_bvh_many_rays check N [SEED]        test_bvh_many_rays inside N [SEED]
 * it shoots N rays in one thread and prints the counts after each round over the models. */
#include "models.h"

#include <pthread.h>
#include <stdatomic.h>

enum { BATCH = 1 << 16, MODELS = 16, THREADS = 2, PLACES = 512, DEFAULT_COUNT = 10000000 };

/* A square of n x n cells whose heights differ by 1e-3 of the width, cut into needles along x. */
static fct_mesh make_needles(const fct_env *env, uint32_t n) {
    fct_mesh mesh = make_grid(env, n);
    uint64_t seed = 21;
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        mesh.positions[3 * v] *= 1000;
        mesh.positions[3 * v + 2] += (float)(1e-3 * random_unit(&seed));
    }
    return mesh;
}

static fct_mesh moved(fct_mesh mesh, float scale, float x, float y, float z) {
    const float offset[3] = {x, y, z};
    for (size_t k = 0; k < 3 * (size_t)mesh.vertex_count; ++k)
        mesh.positions[k] = scale * mesh.positions[k] + offset[k % 3];
    return mesh;
}

static bool load_real(const fct_env *env, const char *name, fct_mesh *mesh) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s.obj", FACETREE_DATA, name);
    return file_exists(path) && fct_mesh_load(env, path, mesh) == FCT_OK;
}

static size_t make_models(const fct_env *env, bool closed, fct_mesh out[MODELS]) {
    static const char *const real[] = {"cow",     "fandisk",   "rocker-arm",    "spot",
                                       "suzanne", "nefertiti", "stanford-bunny"};
    size_t count = 0;
    out[count++] = make_sphere(env, 32);
    out[count++] = make_pebble(env, 64, 2);
    out[count++] = moved(make_pebble(env, 24, 8), 1, 300, -700, 110);
    out[count++] = moved(make_pebble(env, 24, 5), 1e-30f, 0, 0, 0);
    out[count++] = moved(make_pebble(env, 24, 5), 1e30f, 0, 0, 0);
    if (!closed) {
        out[count++] = make_soup(env, 20000, 9);
        out[count++] = make_needles(env, 60);
        out[count++] = make_grid(env, 100);
    }
    for (size_t i = 0; i < sizeof real / sizeof *real; ++i) {
        fct_mesh_report report;
        if (!load_real(env, real[i], &out[count])) continue;
        assert_int_equal(fct_mesh_inspect(env, &out[count], &report), FCT_OK);
        bool open = report.boundary_edges || report.nonmanifold_edges || report.misoriented_edges;
        if (closed && open)
            fct_mesh_release(env, &out[count]);
        else
            ++count;
    }
    return count;
}

/* --- One model --- */

typedef struct subject {
    fct_mesh mesh;
    fct_tree *tree;
    fct_bvh *obb, *embree;
    v3 places[PLACES]; /* inside, at least 1e-3 of the diagonal from the surface */
} subject;

/* Points of a closed model that are well inside. */
static void find_places(subject *s) {
    fct_bounds b = fct_bvh_bounds(s->obb);
    uint64_t seed = 3;
    v3 low = v3_load(b.lower), size = v3_sub(v3_load(b.upper), low);
    for (int i = 0; i < PLACES;) {
        float point[3];
        double x = random_unit(&seed), y = random_unit(&seed), z = random_unit(&seed);
        v3_store(point, v3_make(low.x + x * size.x, low.y + y * size.y, low.z + z * size.z));
        fct_closest nearest;
        if (!fct_bvh_signed_distance(s->obb, point, INFINITY, &nearest, NULL)) continue;
        if ((double)nearest.distance < -1e-3 * v3_norm(size)) s->places[i++] = v3_load(point);
    }
}

static void open_subject(const fct_env *env, bool closed, subject *s) {
    fct_tree_def tree_def = fct_tree_def_default();
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = closed ? FCT_BVH_SIGN : 0;
    assert_int_equal(fct_tree_build(env, &s->mesh, &tree_def, NULL, &s->tree), FCT_OK);
    assert_int_equal(fct_bvh_build(env, s->tree, &def, &s->obb), FCT_OK);
    s->embree = NULL;
    if (closed)
        find_places(s);
    else
        assert_int_equal(fct_bvh_create(env, s->tree, FCT_BACKEND_EMBREE, &s->embree), FCT_OK);
}

static void close_subject(const fct_env *env, subject *s) {
    fct_bvh_destroy(s->embree);
    fct_bvh_destroy(s->obb);
    fct_tree_destroy(s->tree);
    fct_mesh_release(env, &s->mesh);
}

typedef struct tally {
    size_t rays, hits, differences, wrong; /* wrong: unexplained, other occlusion, or a ray that leaves */
} tally;

static void check_batch(const fct_env *env, const subject *s, uint64_t seed, fct_ray *rays, tally *sum) {
    fct_ray_check check;
    fct_ray_mix(s->obb, seed, BATCH, rays);
    if (fct_bvh_check(env, s->obb, s->embree, BATCH, rays, &check) != FCT_OK) check.unexplained = BATCH;
    sum->rays += BATCH, sum->hits += check.hits, sum->differences += check.differences;
    sum->wrong += check.unexplained + check.occlusion_differences;
}

/* Aims at vertices, along edges as exactly as floats allow, at the insides of faces, and anywhere; some rays
 * lie in planes of coordinates. */
static fct_ray aim_from_inside(const subject *s, uint64_t *seed) {
    v3 p[3], from = s->places[random_next(seed) % PLACES];
    face_corners(&s->mesh, (uint32_t)(random_next(seed) % s->mesh.face_count), p);
    double u = random_unit(seed), v = random_unit(seed);
    v3 target = p[0];
    switch (random_next(seed) % 5) {
    case 0:
        break;
    case 1:
        target = v3_mad(p[0], u, v3_sub(p[1], p[0]));
        break;
    case 2:
        target = v3_scale(v3_add(p[0], p[1]), .5);
        break;
    case 3:
        target = v3_mad(v3_mad(p[0], u, v3_sub(p[1], p[0])), v * (1 - u), v3_sub(p[2], p[0]));
        break;
    default:
        target = v3_mad(from, v3_norm(v3_sub(p[0], from)), random_direction(seed));
        break;
    }
    v3 d = v3_sub(target, from);
    switch (random_next(seed) % 8) {
    case 0:
        d.x = 0;
        break;
    case 1:
        d.y = d.z = 0;
        break;
    default:
        break;
    }
    if (v3_norm2(d) == 0) d.z = v3_norm(v3_sub(p[1], p[0]));
    return make_ray(from, v3_scale(d, 1 / fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z)))), 0, INFINITY);
}

static void shoot_batch_from_inside(const subject *s, uint64_t seed, tally *sum) {
    size_t hits = 0;
    for (int i = 0; i < BATCH; ++i) {
        fct_ray ray = aim_from_inside(s, &seed);
        hits += fct_bvh_any_hit(s->obb, &ray, NULL);
    }
    sum->rays += BATCH, sum->hits += hits, sum->wrong += BATCH - hits;
}

/* --- All models --- */

typedef struct series {
    fct_env env;
    subject subjects[MODELS];
    size_t subject_count, batch_count;
    bool closed;
    uint64_t seed;
    atomic_size_t next;
} series;

static void open_series(series *s, bool closed, size_t count, uint64_t seed) {
    fct_mesh meshes[MODELS];
    *s = (series){.env = fct_env_default(), .closed = closed, .seed = seed};
    s->subject_count = make_models(&s->env, closed, meshes);
    s->batch_count = (count + BATCH - 1) / BATCH;
    for (size_t i = 0; i < s->subject_count; ++i) {
        s->subjects[i].mesh = meshes[i];
        open_subject(&s->env, closed, &s->subjects[i]);
    }
}

static void close_series(series *s) {
    for (size_t i = 0; i < s->subject_count; ++i) close_subject(&s->env, &s->subjects[i]);
}

/* Shoots batch number `batch`, at one model after the other. */
static void shoot_batch(const series *s, size_t batch, fct_ray *rays, tally *sum) {
    const subject *target = &s->subjects[batch % s->subject_count];
    uint64_t seed = s->seed + batch;
    size_t wrong = sum->wrong;
    if (s->closed)
        shoot_batch_from_inside(target, seed << 32, sum);
    else
        check_batch(&s->env, target, seed, rays, sum);
    if (sum->wrong != wrong)
        fprintf(stderr, "model %zu, seed %llu: %zu wrong\n", batch % s->subject_count,
                (unsigned long long)seed, sum->wrong - wrong);
}

typedef struct worker {
    pthread_t thread;
    series *shared;
    fct_ray *rays; /* BATCH */
    tally sum;
} worker;

static void *shoot_batches(void *user) {
    worker *w = user;
    for (size_t batch; (batch = atomic_fetch_add(&w->shared->next, 1)) < w->shared->batch_count;)
        shoot_batch(w->shared, batch, w->rays, &w->sum);
    return NULL;
}

static tally shoot_series(series *s) {
    worker workers[THREADS] = {0};
    tally sum = {0};
    for (int i = 0; i < THREADS; ++i) {
        workers[i].shared = s;
        workers[i].rays = malloc(BATCH * sizeof(fct_ray));
        assert_non_null(workers[i].rays);
        assert_int_equal(pthread_create(&workers[i].thread, NULL, shoot_batches, &workers[i]), 0);
    }
    for (int i = 0; i < THREADS; ++i) {
        pthread_join(workers[i].thread, NULL);
        free(workers[i].rays);
        sum.rays += workers[i].sum.rays, sum.hits += workers[i].sum.hits;
        sum.differences += workers[i].sum.differences, sum.wrong += workers[i].sum.wrong;
    }
    return sum;
}

static void ten_million_rays_agree_with_embree(void **state) {
    (void)state;
    if (SANITIZED) skip();
    series s;
    open_series(&s, false, DEFAULT_COUNT, 1);
    tally sum = shoot_series(&s);
    close_series(&s);
    assert_true(sum.rays >= DEFAULT_COUNT && sum.hits > sum.rays / 4);
    assert_true(sum.differences < sum.rays / 15);
    assert_int_equal(sum.wrong, 0);
}

static void ten_million_rays_stay_inside(void **state) {
    (void)state;
    if (SANITIZED) skip();
    series s;
    open_series(&s, true, DEFAULT_COUNT, 1);
    tally sum = shoot_series(&s);
    close_series(&s);
    assert_true(sum.rays >= DEFAULT_COUNT);
    assert_int_equal(sum.wrong, 0);
}

static int shoot_and_print(bool closed, size_t count, uint64_t seed) {
    static fct_ray rays[BATCH];
    series s;
    tally sum = {0};
    open_series(&s, closed, count, seed);
    for (size_t batch = 0; batch < s.batch_count; ++batch) {
        shoot_batch(&s, batch, rays, &sum);
        if ((batch + 1) % s.subject_count && batch + 1 < s.batch_count) continue;
        printf("%zu rays, %zu hits, %zu differences, %zu wrong\n", sum.rays, sum.hits, sum.differences,
               sum.wrong);
        fflush(stdout);
    }
    close_series(&s);
    return sum.wrong != 0;
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ten_million_rays_agree_with_embree),
        cmocka_unit_test(ten_million_rays_stay_inside),
    };
    if (argc < 3) return cmocka_run_group_tests(tests, NULL, NULL);
    return shoot_and_print(!strcmp(argv[1], "inside"), strtoull(argv[2], NULL, 10),
                           argc > 3 ? strtoull(argv[3], NULL, 10) : 1);
}
