/* Nearest points against brute force, closed forms and Embree's point query; errors between surfaces. */
#include "models.h"

#include "bvh/near/triangle.h"

#include <embree3/rtcore.h>

/* The nearest point of a triangle by refining a grid of barycentrics: slow and of another kind. */
static double distance_by_refining(v3 p, v3 a, v3 b, v3 c) {
    double cu = 1 / 3.0, cv = 1 / 3.0, step = .5, best = INFINITY;
    for (int round = 0; round < 60; ++round, step *= .6) {
        double bu = cu, bv = cv;
        for (int i = -4; i <= 4; ++i)
            for (int j = -4; j <= 4; ++j) {
                double u = fmin(fmax(cu + step * i / 4, 0), 1), v = fmin(fmax(cv + step * j / 4, 0), 1);
                if (u + v > 1) {
                    double sum = u + v;
                    u /= sum, v /= sum;
                }
                v3 q = v3_add(v3_scale(a, 1 - u - v), v3_add(v3_scale(b, u), v3_scale(c, v)));
                double d = v3_norm(v3_sub(q, p));
                if (d < best) best = d, bu = u, bv = v;
            }
        cu = bu, cv = bv;
    }
    return best;
}

static void triangle_distance_agrees_with_a_search(void **state) {
    (void)state;
    uint64_t seed = 4;
    for (int i = 0; i < 300; ++i) {
        v3 p[4];
        for (int k = 0; k < 4; ++k)
            p[k] = v3_scale(random_direction(&seed), k ? 1 : .2 + 2 * random_unit(&seed));
        if (i % 10 == 0) p[3] = p[2];
        if (i % 10 == 1) p[3] = v3_mad(p[1], .3, v3_sub(p[2], p[1]));
        if (i % 10 == 2) p[2] = p[3] = p[1];
        double u, v;
        v3 q = fct_triangle_closest(p[0], p[1], p[2], p[3], &u, &v);
        v3 same = v3_add(v3_scale(p[1], 1 - u - v), v3_add(v3_scale(p[2], u), v3_scale(p[3], v)));
        assert_true(v3_norm(v3_sub(q, same)) < 1e-12);
        assert_true(u >= 0 && v >= 0 && u + v <= 1 + 1e-12);
        double expected = distance_by_refining(p[0], p[1], p[2], p[3]), got = v3_norm(v3_sub(q, p[0]));
        assert_true(got <= expected + 1e-9 && got > expected - 1e-4);
    }
}

static double brute_distance(const fct_mesh *mesh, v3 point) {
    double best = INFINITY;
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        v3 p[3];
        double u, v;
        face_corners(mesh, f, p);
        best = fmin(best, v3_norm(v3_sub(fct_triangle_closest(point, p[0], p[1], p[2], &u, &v), point)));
    }
    return best;
}

static void agrees_with_brute_force(const fct_env *env, fct_mesh mesh, float scale, v3 offset, size_t count) {
    for (size_t i = 0; i < mesh.vertex_count; ++i)
        v3_store(mesh.positions + 3 * i,
                 v3_scale(v3_add(offset, v3_load(mesh.positions + 3 * i)), (double)scale));
    model m = model_make(env, mesh, FCT_BACKEND_OBB);
    uint64_t seed = 9;
    fct_visits visits = {0};
    for (size_t i = 0; i < count; ++i) {
        double reach = i % 10 == 0 ? 1e6 : i % 3 ? 1.5 : .9;
        v3 at = v3_add(offset, v3_scale(random_direction(&seed), reach * random_unit(&seed)));
        float point[3];
        v3_store(point, v3_scale(at, (double)scale));
        fct_closest near;
        assert_true(fct_bvh_closest_point(m.bvh, point, INFINITY, &near, &visits));
        double expected = brute_distance(&mesh, v3_load(point));
        assert_true(fabs((double)near.distance - expected) <= 1e-6 * expected + 1e-30 * (double)scale);
        fct_hit named = {.face = near.face, .u = near.u, .v = near.v};
        v3 on_face = hit_point(&mesh, &named);
        double unit = (double)scale * (1 + v3_norm(offset));
        assert_true(v3_norm(v3_sub(on_face, v3_load(near.point))) < 1e-6 * unit);
        /* The maximum distance includes its bound and nothing beyond. */
        assert_true(fct_bvh_closest_point(m.bvh, point, near.distance * 1.00001f, &near, NULL));
        assert_false(fct_bvh_closest_point(m.bvh, point, near.distance * .99999f, &near, NULL));
        assert_int_equal(near.face, FCT_NONE);
    }
    /* The tenth that ask from afar look at everything. */
    assert_true(visits.triangles < count * mesh.face_count / 5);
    model_release(env, &m);
}

static void closest_point_agrees_with_brute_force(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    v3 zero = {0, 0, 0}, far = {1000, -500, 200};
    agrees_with_brute_force(&env, make_pebble(&env, 14, 3), 1, zero, 400);
    agrees_with_brute_force(&env, make_pebble(&env, 14, 3), 1e-30f, zero, 200);
    agrees_with_brute_force(&env, make_pebble(&env, 14, 3), 1e30f, zero, 200);
    agrees_with_brute_force(&env, make_pebble(&env, 14, 3), 1, far, 200);
    agrees_with_brute_force(&env, make_soup(&env, 1500, 3), 1, zero, 400);
    agrees_with_brute_force(&env, make_grid(&env, 20), 1, zero, 400);
}

static void bad_points_have_no_answer(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_sphere(&env, 8), FCT_BACKEND_OBB);
    fct_closest near;
    float bad[3][3] = {{NAN, 0, 0}, {0, INFINITY, 0}, {0, 0, -INFINITY}};
    for (int i = 0; i < 3; ++i) {
        assert_false(fct_bvh_closest_point(m.bvh, bad[i], INFINITY, &near, NULL));
        assert_int_equal(near.face, FCT_NONE);
    }
    float good[3] = {3, 0, 0};
    assert_false(fct_bvh_closest_point(m.bvh, good, -1, &near, NULL));
    assert_false(fct_bvh_closest_point(m.bvh, good, NAN, &near, NULL));
    assert_true(fct_bvh_closest_point(m.bvh, good, 2.5f, &near, NULL));
    model_release(&env, &m);
}

typedef struct embree_search {
    const fct_mesh *mesh;
    v3 point;
    double best;
} embree_search;

static bool embree_visit(struct RTCPointQueryFunctionArguments *arguments) {
    embree_search *s = arguments->userPtr;
    v3 p[3];
    double u, v;
    face_corners(s->mesh, arguments->primID, p);
    double d = v3_norm(v3_sub(fct_triangle_closest(s->point, p[0], p[1], p[2], &u, &v), s->point));
    if (d >= s->best) return false;
    s->best = d;
    arguments->query->radius = nextafterf((float)d, INFINITY);
    return true;
}

static void closest_point_agrees_with_embree(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 60, 3), FCT_BACKEND_OBB);
    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12,
                                              m.mesh.vertex_count);
    uint32_t *faces =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, m.mesh.face_count);
    memcpy(vertices, m.mesh.positions, 12 * (size_t)m.mesh.vertex_count);
    memcpy(faces, m.mesh.triangles, 12 * (size_t)m.mesh.face_count);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    size_t count = 3000;
    float *points = malloc(count * 3 * sizeof *points);
    fct_closest *near = malloc(count * sizeof *near);
    uint64_t seed = 2;
    for (size_t i = 0; i < count; ++i)
        v3_store(points + 3 * i, v3_scale(random_direction(&seed), 2 * random_unit(&seed)));
    for (env.thread_count = 1; env.thread_count < 4; ++env.thread_count) {
        fct_bvh_closest_points(m.bvh, count, points, INFINITY, near);
        for (size_t i = 0; i < count; ++i) {
            const float *p = points + 3 * i;
            embree_search search = {&m.mesh, v3_load(p), INFINITY};
            struct RTCPointQuery query = {.x = p[0], .y = p[1], .z = p[2], .radius = INFINITY};
            struct RTCPointQueryContext context;
            rtcInitPointQueryContext(&context);
            rtcPointQuery(scene, &query, &context, embree_visit, &search);
            assert_float_equal((double)near[i].distance, search.best, 1e-6);
        }
    }
    free(points), free(near);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
    model_release(&env, &m);
}

static void a_surface_has_no_distance_from_itself(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 20, 3), FCT_BACKEND_OBB);
    fct_mesh_error error;
    assert_int_equal(fct_mesh_compare(&env, m.bvh, m.bvh, 7, 1, &error), FCT_OK);
    assert_true(error.e_max < 1e-14 && error.e_avg < 1e-28);
    assert_int_equal(error.samples, 2 * (m.mesh.vertex_count + 7 * m.mesh.face_count));
    assert_true(error.color_rms == 0 && error.color_max == 0);
    model_release(&env, &m);
}

/* Two parallel grids .25 apart; and one beside the other, where the distance is to the nearest edge. */
static void parallel_planes_have_their_distance(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh lower = make_grid(&env, 6), upper = make_grid(&env, 9);
    for (uint32_t v = 0; v < upper.vertex_count; ++v) upper.positions[3 * v + 2] = .25f;
    model a = model_make(&env, lower, FCT_BACKEND_OBB), b = model_make(&env, upper, FCT_BACKEND_OBB);
    fct_mesh_error error;
    assert_int_equal(fct_mesh_compare(&env, a.bvh, b.bvh, 10, 1, &error), FCT_OK);
    assert_float_equal(error.e_avg, .0625, 1e-12);
    assert_float_equal(error.e_avg_ab, .0625, 1e-12);
    assert_float_equal(error.e_max_ba, .25, 1e-12);
    assert_float_equal(error.diameter, sqrt(2), 1e-12);
    assert_int_equal(error.samples, 49 + 100 + 10 * (72 + 162));
    model_release(&env, &b);

    upper = make_grid(&env, 40);
    for (uint32_t v = 0; v < upper.vertex_count; ++v) upper.positions[3 * v] += 1;
    b = model_make(&env, upper, FCT_BACKEND_OBB);
    assert_int_equal(fct_mesh_compare(&env, a.bvh, b.bvh, 50, 1, &error), FCT_OK);
    /* E over x uniform in [0, 1] of x^2 */
    assert_float_equal(error.e_avg_ba, 1 / 3.0, .01);
    assert_float_equal(error.e_max, 1, 1e-6);
    model_release(&env, &a);
    model_release(&env, &b);
}

static void colours_are_compared_at_the_samples(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh meshes[2];
    for (int i = 0; i < 2; ++i) {
        fct_mesh grid = make_grid(&env, i ? 5 : 4);
        assert_int_equal(
            fct_mesh_create(&env, grid.vertex_count, grid.face_count, FCT_MESH_COLORS, &meshes[i]), FCT_OK);
        memcpy(meshes[i].positions, grid.positions, 12 * (size_t)grid.vertex_count);
        memcpy(meshes[i].triangles, grid.triangles, 12 * (size_t)grid.face_count);
        fct_mesh_release(&env, &grid);
        for (uint32_t v = 0; v < meshes[i].vertex_count; ++v) {
            /* Linear over the plane, so that any triangulation interpolates the same. */
            const float *p = meshes[i].positions + 3 * v;
            float *c = meshes[i].colors + 3 * v;
            c[0] = 1, c[1] = p[0] + .3f * p[1], c[2] = i ? .5f : .2f;
        }
    }
    model a = model_make(&env, meshes[0], FCT_BACKEND_OBB), b = model_make(&env, meshes[1], FCT_BACKEND_OBB);
    fct_mesh_error error;
    assert_int_equal(fct_mesh_compare(&env, a.bvh, b.bvh, 20, 1, &error), FCT_OK);
    assert_float_equal(error.color_max, .3, 1e-6);
    assert_float_equal(error.color_rms, .3 / sqrt(3), 1e-6);
    assert_true(error.color_rms_relative > .15 && error.color_rms_relative < .35);
    model_release(&env, &a);
    model_release(&env, &b);
}

static void comparison_does_not_depend_on_threads(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = model_make(&env, make_pebble(&env, 20, 3), FCT_BACKEND_OBB),
          b = model_make(&env, make_sphere(&env, 16), FCT_BACKEND_OBB);
    fct_mesh_error one, many, other_seed;
    env.thread_count = 1;
    assert_int_equal(fct_mesh_compare(&env, a.bvh, b.bvh, 5, 1, &one), FCT_OK);
    env.thread_count = 4;
    assert_int_equal(fct_mesh_compare(&env, a.bvh, b.bvh, 5, 1, &many), FCT_OK);
    assert_memory_equal(&one, &many, sizeof one);
    assert_int_equal(fct_mesh_compare(&env, a.bvh, b.bvh, 5, 2, &other_seed), FCT_OK);
    assert_true(one.e_avg != other_seed.e_avg && fabs(one.e_avg - other_seed.e_avg) < .05 * one.e_avg);
    model_release(&env, &a);
    model_release(&env, &b);
}

static bool stop(void *user, const char *phase, double done) {
    (void)user, (void)phase;
    return done < .3;
}

static void comparison_reports_memory_and_cancelling(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r), plain = fct_env_default();
    model m = model_make(&plain, make_pebble(&plain, 12, 3), FCT_BACKEND_OBB);
    fct_mesh_error error;
    long n = 0;
    fct_result result;
    do {
        r.allocations = 0, r.fail_at = ++n;
        result = fct_mesh_compare(&env, m.bvh, m.bvh, 1, 1, &error);
        assert_int_equal(r.alive, 0);
        assert_true(result == FCT_OK || result == FCT_ERROR_MEMORY);
    } while (result != FCT_OK);
    assert_int_equal(n, 5);
    r.fail_at = 0;
    env.progress = stop;
    assert_int_equal(fct_mesh_compare(&env, m.bvh, m.bvh, 1, 1, &error), FCT_ERROR_CANCELLED);
    assert_int_equal(r.alive, 0);
    model_release(&plain, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangle_distance_agrees_with_a_search),
        cmocka_unit_test(closest_point_agrees_with_brute_force),
        cmocka_unit_test(bad_points_have_no_answer),
        cmocka_unit_test(closest_point_agrees_with_embree),
        cmocka_unit_test(a_surface_has_no_distance_from_itself),
        cmocka_unit_test(parallel_planes_have_their_distance),
        cmocka_unit_test(colours_are_compared_at_the_samples),
        cmocka_unit_test(comparison_does_not_depend_on_threads),
        cmocka_unit_test(comparison_reports_memory_and_cancelling),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
