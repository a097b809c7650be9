/* The k nearest faces against brute force. */
#include "packed.h"

#include "base/math/round.h"
#include "bvh/near/triangle.h"

typedef struct ranked {
    double d2;
    uint32_t face;
} ranked;

static int compare_ranked(const void *a, const void *b) {
    const ranked *x = a, *y = b;
    if (x->d2 != y->d2) return x->d2 < y->d2 ? -1 : 1;
    return (x->face > y->face) - (x->face < y->face);
}

/* All faces by distance and id. A power of two scales distances without rounding, so even ties agree. */
static void rank_faces(const model *m, const float point[3], ranked *out) {
    v3 p = fct_bvh_to_scaled(m->bvh, v3_load(point));
    for (uint32_t f = 0; f < m->mesh.face_count; ++f) {
        v3 t[3];
        double u, v;
        face_corners(&m->mesh, f, t);
        for (int c = 0; c < 3; ++c) t[c] = fct_bvh_to_scaled(m->bvh, t[c]);
        out[f] = (ranked){v3_norm2(v3_sub(fct_triangle_closest(p, t[0], t[1], t[2], &u, &v), p)), f};
    }
    qsort(out, m->mesh.face_count, sizeof *out, compare_ranked);
}

static void agrees_with_ranks(const fct_env *env, fct_mesh mesh, double spread) {
    model m = model_make(env, mesh, FCT_BACKEND_OBB);
    uint32_t faces = mesh.face_count, ks[5] = {1, 2, 7, 40, faces + 5};
    ranked *ranks = malloc(faces * sizeof *ranks);
    fct_closest *out = malloc((faces + 5) * sizeof *out);
    uint64_t seed = 17;
    fct_visits visits = {0};
    for (uint32_t i = 0; i < 150; ++i) {
        float point[3];
        v3_store(point, v3_scale(random_direction(&seed), spread * random_unit(&seed)));
        FCT_KEEP_STORED(point);
        rank_faces(&m, point, ranks);
        uint32_t k = ks[i % 5], expected = k < faces ? k : faces;
        float reach = INFINITY;
        if (i % 3 == 0) {
            reach = (float)(spread * random_unit(&seed));
            double reach2 = pow((double)reach * m.bvh->scale, 2);
            while (expected && ranks[expected - 1].d2 > reach2) --expected;
        }
        memset(out, 0x55, (faces + 5) * sizeof *out);
        assert_int_equal(fct_bvh_nearest(m.bvh, point, k, reach, out, k == 7 ? &visits : NULL), expected);
        for (uint32_t j = 0; j < expected; ++j) {
            assert_int_equal(out[j].face, ranks[j].face);
            assert_int_equal(m.bvh->view.face_ids[out[j].place], out[j].face);
            double distance = sqrt(ranks[j].d2) / m.bvh->scale;
            assert_true(fabs((double)out[j].distance - distance) <= 1e-7 * distance);
            fct_hit named = {.face = out[j].face, .u = out[j].u, .v = out[j].v};
            assert_true(v3_norm(v3_sub(hit_point(&mesh, &named), v3_load(out[j].point))) < 1e-6);
            double away = v3_norm(v3_sub(v3_load(out[j].point), v3_load(point)));
            assert_true(fabs(away - distance) < 1e-6);
        }
        for (const char *c = (char *)(out + k); c < (char *)(out + faces + 5) && k < faces; ++c)
            assert_int_equal(*c, 0x55);
        fct_closest first;
        if (fct_bvh_closest_point(m.bvh, point, reach, &first, NULL))
            assert_memory_equal(&first, out, sizeof first);
        else
            assert_int_equal(expected, 0);
    }
    assert_true(visits.nodes > 30 && visits.triangles < 30 * faces / 5);
    free(ranks), free(out);
    model_release(env, &m);
}

static void nearest_faces_agree_with_brute_force(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    agrees_with_ranks(&env, make_pebble(&env, 16, 3), 1.5);
    agrees_with_ranks(&env, make_bars(&env, 6, 3), 1.5);
    agrees_with_ranks(&env, make_soup(&env, 900, 3), 1);
    agrees_with_ranks(&env, make_grid(&env, 16), 1); /* many ties */
}

static void bad_questions_find_nothing(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 8, 3), FCT_BACKEND_OBB);
    model embree = model_make(&env, make_pebble(&env, 8, 3), FCT_BACKEND_EMBREE);
    float good[3] = {1, 2, 3}, bad[3] = {1, NAN, 3}, endless[3] = {INFINITY, 0, 0};
    fct_closest out[2];
    assert_int_equal(fct_bvh_nearest(m.bvh, good, 2, INFINITY, out, NULL), 2);
    assert_int_equal(fct_bvh_nearest(m.bvh, good, 0, INFINITY, out, NULL), 0);
    assert_int_equal(fct_bvh_nearest(m.bvh, bad, 2, INFINITY, out, NULL), 0);
    assert_int_equal(fct_bvh_nearest(m.bvh, endless, 2, INFINITY, out, NULL), 0);
    assert_int_equal(fct_bvh_nearest(m.bvh, good, 2, -1, out, NULL), 0);
    assert_int_equal(fct_bvh_nearest(m.bvh, good, 2, NAN, out, NULL), 0);
    assert_int_equal(fct_bvh_nearest(embree.bvh, good, 2, INFINITY, out, NULL), 0);
    model_release(&env, &m);
    model_release(&env, &embree);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nearest_faces_agree_with_brute_force),
        cmocka_unit_test(bad_questions_find_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
