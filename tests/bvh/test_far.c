/* Models at up to 10^6 times their size from the origin of coordinates: rays and closest points against brute
 * force in double over the same rounded positions. */
#include "models.h"

/* A pebble of radius 50 about (at, at / 2, -at), in floats. */
static fct_mesh make_far_pebble(const fct_env *env, double at) {
    fct_mesh mesh = make_pebble(env, 8, 5);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * (size_t)v;
        v3_store(p, v3_mad(v3_make(at, at / 2, -at), 50, v3_load(p)));
    }
    return mesh;
}

/* The mix, rays from the origin of coordinates, and rays whose limits begin behind their origin. */
static void make_rays(const model *m, double at, size_t count, fct_ray *rays) {
    uint64_t seed = 1;
    fct_ray_mix(m->bvh, 1, count, rays);
    for (size_t i = 0; i < count; i += 3) {
        v3 aim = v3_mad(v3_make(at, at / 2, -at), 60 * random_unit(&seed), random_direction(&seed));
        rays[i] = make_ray(v3_make(0, 0, 0), aim, 0, INFINITY);
        if (i % 2) continue;
        v3 direction = random_direction(&seed);
        rays[i] = make_ray(v3_mad(aim, 1e3, direction), direction, -INFINITY, INFINITY);
    }
}

static const double ratios[] = {0, 1, 30, 1e3, 1e4, 1e5, 1e6};
enum { RATIOS = sizeof ratios / sizeof *ratios };

static void far_rays_hit_what_they_meet(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    size_t count = SANITIZED ? 600 : 6000;
    fct_ray *rays = malloc(count * sizeof *rays);
    for (int r = 0; r < RATIOS; ++r) {
        double at = 50 * ratios[r];
        model m = model_make(&env, make_far_pebble(&env, at), FCT_BACKEND_OBB);
        size_t sure = 0, hits = 0;
        make_rays(&m, at, count, rays);
        for (size_t i = 0; i < count; ++i) {
            fct_hit hit;
            double t;
            bool doubtful, found = fct_bvh_closest_hit(m.bvh, &rays[i], &hit, NULL);
            assert_int_equal(fct_bvh_any_hit(m.bvh, &rays[i], NULL), found);
            uint32_t face = brute_closest(&m.mesh, &rays[i], 1e-4, &t, &doubtful);
            if (doubtful) continue;
            assert_int_equal(found ? hit.face : FCT_NONE, face);
            ++sure, hits += found;
            if (found)
                assert_true(fabs((double)hit.t - t) <=
                            1e-6 * fabs(t) + 1e-3 / v3_norm(v3_load(rays[i].direction)));
        }
        assert_true(sure > count / 3 && hits > count / 5);
        model_release(&env, &m);
    }
    free(rays);
}

static void far_models_pass_the_check(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    size_t count = SANITIZED ? 3000 : 30000;
    fct_ray *rays = malloc(count * sizeof *rays);
    for (int r = 0; r < RATIOS; ++r) {
        double at = 50 * ratios[r];
        model m = model_make(&env, make_far_pebble(&env, at), FCT_BACKEND_OBB);
        fct_bvh *embree;
        fct_ray_check check;
        assert_int_equal(fct_bvh_create(&env, m.tree, FCT_BACKEND_EMBREE, &embree), FCT_OK);
        make_rays(&m, at, count, rays);
        assert_int_equal(fct_bvh_check(&env, m.bvh, embree, count, rays, &check), FCT_OK);
        assert_int_equal(check.unexplained, 0);
        assert_int_equal(check.occlusion_differences, 0);
        assert_true(check.hits > count / 3 && check.differences < count / 15);
        fct_bvh_destroy(embree);
        model_release(&env, &m);
    }
    free(rays);
}

static void far_points_are_measured_exactly(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int r = 0; r < RATIOS; ++r) {
        double at = 50 * ratios[r];
        model m = model_make(&env, make_far_pebble(&env, at), FCT_BACKEND_OBB);
        uint64_t seed = 2;
        for (int i = 0; i < 300; ++i) {
            double far = i % 3 ? 100 : 2 * at + 1;
            v3 where = v3_mad(v3_make(at, at / 2, -at), far * random_unit(&seed), random_direction(&seed));
            float point[3];
            v3_store(point, where);
            where = v3_load(point);
            fct_closest closest;
            assert_true(fct_bvh_closest_point(m.bvh, point, INFINITY, &closest, NULL));
            double least = INFINITY;
            for (uint32_t f = 0; f < m.mesh.face_count; ++f) {
                v3 p[3];
                face_corners(&m.mesh, f, p);
                least = fmin(least, v3_norm(v3_sub(plain_closest(where, p), where)));
            }
            assert_true(fabs((double)closest.distance - least) <= 1e-6 * least + 1e-9 * at);
        }
        model_release(&env, &m);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(far_rays_hit_what_they_meet),
        cmocka_unit_test(far_models_pass_the_check),
        cmocka_unit_test(far_points_are_measured_exactly),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
