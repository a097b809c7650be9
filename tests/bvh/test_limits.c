/* Cases at the limits of what the queries promise: tiny models, hits at t_max, bright colours, and points
 * between floats. */
#include "models.h"

#include "bvh/model.h"
#include "bvh/near/nearest.h"

static void normals_of_tiny_models_are_not_zero(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 4);
    for (uint32_t i = 0; i < 3 * mesh.vertex_count; ++i) mesh.positions[i] *= 1e-25f;
    for (int b = 0; b < 2; ++b) {
        model m = model_make(&env, mesh, b ? FCT_BACKEND_EMBREE : FCT_BACKEND_OBB);
        fct_ray ray = make_ray(v3_make(.3e-25, .6e-25, 1e-25), v3_make(0, 0, -1), 0, INFINITY);
        fct_hit hit;
        assert_true(fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL));
        assert_true(hit.normal[0] == 0 && hit.normal[1] == 0 && hit.normal[2] > 0);
        fct_bvh_destroy(m.bvh);
        fct_tree_destroy(m.tree);
    }
    fct_mesh_release(&env, &mesh);
}

/* The boxes miss the faces of a masked leaf; a ray that ends exactly at such a face is explained. */
static void a_hit_at_t_max_explains_a_difference(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 12, 5), FCT_BACKEND_OBB);
    fct_bvh *embree;
    assert_int_equal(fct_bvh_create(&env, m.tree, FCT_BACKEND_EMBREE, &embree), FCT_OK);
    fct_leaf *leaf = (fct_leaf *)(void *)m.bvh->leaves;
    fct_ray rays[16];
    uint32_t n = 0;
    for (uint32_t i = 0; i < leaf->count; ++i) {
        v3 t[3];
        fct_hit hit;
        face_corners(&m.mesh, m.bvh->view.face_ids[leaf->first + i], t);
        v3 aim = v3_scale(v3_add(v3_add(t[0], t[1]), t[2]), 1. / 3);
        rays[n] = make_ray(v3_make(0, 0, 0), aim, 0, INFINITY);
        assert_true(fct_bvh_closest_hit(embree, &rays[n], &hit, NULL));
        rays[n++].t_max = hit.t;
    }
    fct_ray_check check;
    leaf->mask = 0;
    assert_int_equal(fct_bvh_check(&env, m.bvh, embree, n, rays, &check), FCT_OK);
    assert_true(check.differences > 0);
    assert_int_equal(check.unexplained, 0);
    for (uint32_t i = 0; i < n; ++i) rays[i].t_max *= 1.01f;
    assert_int_equal(fct_bvh_check(&env, m.bvh, embree, n, rays, &check), FCT_OK);
    assert_int_equal(check.unexplained, n);
    fct_bvh_destroy(embree);
    model_release(&env, &m);
}

/* A row of 100 squares of the colours i + 1, shifted up by .5 in the second mesh, times 1, 2 and 4 in the
 * three channels; 95 % of the area is darker than 96. */
static fct_mesh make_row(const fct_env *env, uint32_t parts, float add, uint32_t first) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, 400 * parts, 200 * parts, FCT_MESH_COLORS, &mesh), FCT_OK);
    for (uint32_t q = 0; q < 100 * parts; ++q) {
        uint32_t i = q / parts;
        float x0 = (float)q / (float)parts + (float)i * .5f, x1 = x0 + 1 / (float)parts;
        const float p[12] = {x0, 0, 0, x1, 0, 0, x1, 1, 0, x0, 1, 0};
        memcpy(mesh.positions + 12 * q, p, sizeof p);
        for (int k = 0; k < 12; ++k)
            mesh.colors[12 * q + k] = ((float)(i + 1) + add) * (float)(1 << (k + first) % 3);
        const uint32_t t[6] = {4 * q, 4 * q + 1, 4 * q + 2, 4 * q, 4 * q + 2, 4 * q + 3};
        memcpy(mesh.triangles + 6 * q, t, sizeof t);
    }
    return mesh;
}

static void relative_colour_errors_have_their_bound(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (uint32_t i = 0; i < 6; ++i) {
        model a = model_make(&env, make_row(&env, 1, 0, i % 3), FCT_BACKEND_OBB),
              b = model_make(&env, make_row(&env, 1 + i / 3, .5f, i % 3), FCT_BACKEND_OBB);
        fct_mesh_error e;
        assert_int_equal(fct_mesh_compare(&env, a.bvh, b.bvh, 0, 1, &e), FCT_OK);
        double ab = 0;
        for (int k = 1; k <= 100; ++k) ab += fmin(k, 96) * fmin(k, 96);
        double expected = .5 / sqrt(ab / 100);
        assert_true(fabs(e.color_rms_relative - expected) < 1e-6);
        assert_true(fabs((double)e.color_max - 2) < 1e-4 && fabs((double)e.color_rms - .5 * sqrt(7)) < 1e-4);
        model_release(&env, &a);
        model_release(&env, &b);
    }
}

/* 400 triangles of at most 4 units in the last place, in a cube of 64 such units. */
static void points_between_floats_have_their_nearest_face(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh;
    uint64_t seed = 3;
    const double ulp = 0x1p-12;
    assert_int_equal(fct_mesh_create(&env, 1200, 400, 0, &mesh), FCT_OK);
    for (uint32_t f = 0; f < 400; ++f) {
        double c[3];
        for (int k = 0; k < 3; ++k) c[k] = 3000 + floor(60 * random_unit(&seed)) * ulp;
        for (uint32_t v = 0; v < 3; ++v)
            for (int k = 0; k < 3; ++k)
                mesh.positions[9 * f + 3 * v + k] = (float)(c[k] + floor(5 * random_unit(&seed)) * ulp);
        for (uint32_t v = 0; v < 3; ++v) mesh.triangles[3 * f + v] = 3 * f + v;
    }
    model m = model_make(&env, mesh, FCT_BACKEND_OBB);
    uint32_t wrong = 0;
    for (int i = 0; i < 3000; ++i) {
        v3 p = v3_make(3000 + 64 * ulp * random_unit(&seed), 3000 + 64 * ulp * random_unit(&seed),
                       3000 + 64 * ulp * random_unit(&seed));
        double best = INFINITY;
        fct_near near;
        for (uint32_t f = 0; f < 400; ++f) {
            v3 t[3];
            face_corners(&mesh, f, t);
            best = fmin(best, v3_norm(v3_sub(plain_closest(p, t), p)));
        }
        assert_true(fct_nearest_search(m.bvh, p, NULL, INFINITY, &near, NULL));
        double d = sqrt(near.distance2);
        wrong += d > best * (1 + 1e-6);
    }
    assert_int_equal(wrong, 0);
    model_release(&env, &m);
}
int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(normals_of_tiny_models_are_not_zero),
                                       cmocka_unit_test(a_hit_at_t_max_explains_a_difference),
                                       cmocka_unit_test(relative_colour_errors_have_their_bound),
                                       cmocka_unit_test(points_between_floats_have_their_nearest_face)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
