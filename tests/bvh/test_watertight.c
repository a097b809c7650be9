/* No ray from inside a closed model leaves it; and all variants of the traversal give the same answers. */
#include "models.h"

#include "bvh/ray/traverse.h"

/* Aims at the inside of faces, exactly along edges as far as floats allow, and at vertices. */
static v3 aim(const fct_mesh *mesh, uint64_t *seed) {
    v3 p[3];
    face_corners(mesh, (uint32_t)(random_next(seed) % mesh->face_count), p);
    double u = random_unit(seed);
    switch (random_next(seed) % 4) {
    case 0:
        return p[0];
    case 1:
        return v3_mad(p[0], u, v3_sub(p[1], p[0]));
    case 2:
        return v3_mad(p[0], .5, v3_sub(p[1], p[0]));
    default:
        return random_direction(seed);
    }
}

static void nothing_leaves(const fct_env *env, fct_mesh mesh, float scale, v3 offset, size_t count) {
    if (SANITIZED) count /= 10;
    for (size_t i = 0; i < mesh.vertex_count; ++i)
        v3_store(mesh.positions + 3 * i, v3_mad(offset, (double)scale, v3_load(mesh.positions + 3 * i)));
    model m = model_make(env, mesh, FCT_BACKEND_OBB);
    uint64_t seed = 17;
    for (size_t i = 0; i < count; ++i) {
        v3 inside = v3_mad(offset, .2 * (double)scale * random_unit(&seed), random_direction(&seed));
        v3 target = aim(&mesh, &seed);
        if (i % 5 == 0) inside = offset;
        if (i % 7 == 0) inside.x = target.x;
        if (i % 7 == 1) inside.y = target.y, inside.z = target.z;
        if (v3_norm(v3_sub(inside, offset)) > .3 * (double)scale) inside = offset;
        v3 d = v3_sub(target, inside);
        fct_ray ray = make_ray(inside, d, 0, INFINITY);
        assert_true(fct_bvh_any_hit(m.bvh, &ray, NULL));
    }
    model_release(env, &m);
}

static void no_ray_leaves_a_closed_model(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    v3 zero = {0, 0, 0}, far = {30, -70, 11};
    nothing_leaves(&env, make_sphere(&env, 32), 1, zero, 500000);
    nothing_leaves(&env, make_pebble(&env, 64, 2), 1, zero, 500000);
    nothing_leaves(&env, make_pebble(&env, 24, 8), 1, far, 200000);
    nothing_leaves(&env, make_pebble(&env, 24, 8), 1e-30f, zero, 100000);
    nothing_leaves(&env, make_pebble(&env, 24, 8), 1e30f, zero, 100000);
}

static void scalar_twin_gives_the_same_hits(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh meshes[3] = {make_pebble(&env, 24, 2), make_soup(&env, 3000, 3), make_grid(&env, 30)};
    for (int k = 0; k < 3; ++k) {
        model m = model_make(&env, meshes[k], FCT_BACKEND_OBB);
        size_t count = SANITIZED ? 6000 : 60000, hits = 0;
        fct_ray *rays = malloc(count * sizeof *rays);
        fct_ray_mix(m.bvh, 8, count, rays);
        for (size_t i = 0; i < count; ++i) {
            fct_prepared_ray ray;
            if (!fct_ray_prepare(m.bvh, &rays[i], &ray)) continue;
            fct_raw_hit a, b;
            fct_visits va = {0}, vb = {0};
            bool found = fct_traverse_closest(m.bvh, &ray, &a, &va);
            assert_int_equal(fct_traverse_closest_baseline(m.bvh, &ray, &b, &vb), found);
            assert_int_equal(fct_traverse_any(m.bvh, &ray, NULL), found);
            assert_int_equal(fct_traverse_any_baseline(m.bvh, &ray, NULL), found);
            assert_memory_equal(&va, &vb, sizeof va);
            assert_memory_equal(&a, &b, sizeof a);
            hits += found;
        }
        assert_true(hits > count / 4);
        free(rays);
        model_release(&env, &m);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_ray_leaves_a_closed_model),
        cmocka_unit_test(scalar_twin_gives_the_same_hits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
