/* Bakes without memory, cancelled bakes, extreme scenes, and equal bytes for every number of threads. */
#include "support.h"

#include "facetree/radiosity.h"

static fct_env plain;

/* A lamp over a two-sided floor with a square between them: few elements, but all kinds. */
static fct_scene *small_scene(void) {
    plain = fct_env_default();
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    fct_material white = {.name = "white", .reflectance = {.6F, .5F, .4F}, .two_sided = true};
    fct_material light = {.name = "light", .emission = {3, 2, 1}};
    uint32_t ids[2];
    assert_int_equal(fct_scene_add_material(scene, &white, &ids[0]), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &light, &ids[1]), FCT_OK);
    static const float places[3][12] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                                        {.3F, 0, 0, .3F, 0, .3F, 0, .3F, 0, 0, .3F, .4F},
                                        {.5F, 0, 0, .2F, 0, -.5F, 0, .8F, 0, 0, -.5F, 1}};
    for (int i = 0; i < 3; ++i) {
        fct_mesh square = make_grid(&plain, 1);
        assert_int_equal(fct_scene_add_object(scene, "square", &square, NULL, places[i], ids[i == 2], NULL),
                         FCT_OK);
        fct_mesh_release(&plain, &square);
    }
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static fct_bake_def coarse(void) {
    fct_bake_def def = fct_bake_def_default();
    def.error = 5e-3;
    def.max_edge = .5;
    def.samples = 8;
    return def;
}

/* Bakes, lights all instances and a probe. Returns the first error. */
static fct_result bake_all(const fct_env *env, const fct_scene *scene, const fct_bake_def *def,
                           fct_mesh *mesh) {
    static const float point[3] = {.2F, .2F, 0}, normal[3] = {0, 0, 1};
    fct_bake *bake;
    fct_probe probe;
    *mesh = (fct_mesh){0};
    fct_result result = fct_bake_create(env, scene, def, &bake);
    if (result != FCT_OK) {
        assert_null(bake);
        return result;
    }
    result = fct_bake_mesh(bake, mesh, NULL);
    if (result == FCT_OK) result = fct_bake_probe(bake, 1, point, normal, &probe);
    if (result == FCT_OK) assert_true(probe.irradiance[0] > 0);
    fct_bake_destroy(bake);
    return result;
}

static void every_allocation_may_fail(void **state) {
    (void)state;
    fct_scene *scene = small_scene();
    for (int method = FCT_BAKE_FACE; method <= FCT_BAKE_REFERENCE; ++method) {
        fct_result result = FCT_ERROR_MEMORY;
        long n = 1;
        for (; result != FCT_OK; ++n) {
            recorder r = {.fail_at = n};
            fct_env env = recorder_env(&r);
            fct_bake_def def = coarse();
            def.method = (fct_bake_method)method;
            fct_mesh mesh;
            env.thread_count = 1;
            result = bake_all(&env, scene, &def, &mesh);
            if (result != FCT_OK) assert_int_equal(result, FCT_ERROR_MEMORY);
            if (result != FCT_OK) assert_true(r.messages > 0);
            fct_mesh_release(&env, &mesh);
            assert_int_equal(r.alive, 0);
        }
        assert_true(n > 10);
    }
    fct_scene_destroy(scene);
}

static bool stop_later(void *user, const char *phase, double done) {
    (void)phase;
    assert_true(done >= 0 && done <= 1);
    return --*(long *)user > 0;
}

static void a_cancelled_bake_leaves_nothing(void **state) {
    (void)state;
    fct_scene *scene = small_scene();
    fct_result result = FCT_ERROR_CANCELLED;
    for (long calls = 1; result != FCT_OK; calls += 3) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        long left = calls;
        env.progress = stop_later;
        env.progress_user = &left;
        fct_bake_def def = coarse();
        fct_mesh mesh;
        result = bake_all(&env, scene, &def, &mesh);
        if (result != FCT_OK) assert_int_equal(result, FCT_ERROR_CANCELLED);
        fct_mesh_release(&env, &mesh);
        assert_int_equal(r.alive, 0);
    }
    fct_scene_destroy(scene);
}

static void threads_do_not_show(void **state) {
    (void)state;
    fct_scene *scene = small_scene();
    fct_mesh meshes[3];
    fct_bake_def def = coarse();
    def.error = 1e-3;
    for (uint32_t i = 0; i < 3; ++i) {
        fct_env env = fct_env_default();
        env.thread_count = i + 1;
        assert_int_equal(bake_all(&env, scene, &def, &meshes[i]), FCT_OK);
        assert_int_equal(meshes[i].vertex_count, meshes[0].vertex_count);
        assert_memory_equal(meshes[i].colors, meshes[0].colors, 12 * (size_t)meshes[0].vertex_count);
        assert_memory_equal(meshes[i].triangles, meshes[0].triangles, 12 * (size_t)meshes[0].face_count);
    }
    for (uint32_t i = 0; i < 3; ++i) fct_mesh_release(&plain, &meshes[i]);
    fct_scene_destroy(scene);
}

/* A scene without emission is valid and dark. */
static void darkness_is_a_result(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    fct_material grey = {.name = "grey", .reflectance = {.5F, .5F, .5F}};
    uint32_t id;
    assert_int_equal(fct_scene_add_material(scene, &grey, &id), FCT_OK);
    fct_mesh grid = make_grid(&plain, 3);
    memcpy(grid.triangles, (uint32_t[]){0, 0, 1}, 12); /* a degenerate face among them */
    assert_int_equal(fct_scene_add_object(scene, "grid", &grid, NULL, NULL, id, NULL), FCT_OK);
    fct_mesh_release(&plain, &grid);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_bake_def def = fct_bake_def_default();
    fct_bake *bake;
    fct_mesh lit;
    assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
    assert_true(fct_bake_get_stats(bake).converged);
    assert_int_equal(fct_bake_mesh(bake, &lit, NULL), FCT_OK);
    for (size_t i = 0; i < 3 * (size_t)lit.vertex_count; ++i) assert_true(lit.colors[i] == 0);
    fct_mesh_release(&plain, &lit);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
}

static void senseless_options_are_refused(void **state) {
    (void)state;
    fct_scene *scene = small_scene();
    recorder r = {0};
    fct_env env = recorder_env(&r);
    static const double errors[] = {0, -1, NAN};
    for (size_t i = 0; i < 3; ++i) {
        fct_bake_def def = fct_bake_def_default();
        def.error = errors[i];
        fct_bake *bake;
        assert_int_equal(fct_bake_create(&env, scene, &def, &bake), FCT_ERROR_DATA);
        assert_null(bake);
    }
    assert_int_equal(r.alive, 0);
    fct_scene_destroy(scene);
}

/* A scene whose areas exceed a float fails with a message; it is not silently dark, and it ends. */
static void sizes_that_floats_cannot_tell_are_refused(void **state) {
    (void)state;
    static const struct {
        float size;
        fct_result result;
    } cases[] = {{1e-30F, FCT_ERROR_DATA}, {1e-17F, FCT_ERROR_DATA}, {1e-12F, FCT_OK},
                 {1e15F, FCT_OK},          {1e20F, FCT_ERROR_DATA},  {1e30F, FCT_ERROR_DATA}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        fct_scene *scene;
        fct_bake *bake;
        fct_material light = {.name = "light", .emission = {1, 1, 1}};
        uint32_t id;
        assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
        assert_int_equal(fct_scene_add_material(scene, &light, &id), FCT_OK);
        fct_mesh square = make_grid(&env, 1);
        for (int i = 0; i < 12; ++i) square.positions[i] *= cases[k].size;
        assert_int_equal(fct_scene_add_object(scene, "square", &square, NULL, NULL, id, NULL), FCT_OK);
        fct_mesh_release(&env, &square);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_bake_def def = coarse();
        def.max_edge = 0;
        assert_int_equal(fct_bake_create(&env, scene, &def, &bake), cases[k].result);
        if (bake) {
            double area = (double)cases[k].size * (double)cases[k].size;
            assert_true(fabs(fct_bake_get_stats(bake).power_emitted - 3 * area) < 1e-3 * area);
        } else {
            assert_non_null(strstr(r.text, "across"));
        }
        fct_bake_destroy(bake);
        fct_scene_destroy(scene);
        assert_int_equal(r.alive, 0);
    }
}

/* Answers true from the n-th question on. */
typedef struct stopper {
    long questions, at;
} stopper;

static bool stop_at(void *user) {
    stopper *s = user;
    return ++s->questions >= s->at;
}

static double sum_colors(const fct_mesh *mesh) {
    double sum = 0;
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; ++i) sum += mesh->colors[i];
    return sum / mesh->vertex_count;
}

/* Bakes, and stops at the n-th question. Returns false if nothing was complete. */
static bool bake_stopped(const fct_scene *scene, fct_bake_def def, uint32_t threads, long n, fct_mesh *mesh,
                         fct_bake_stats *stats) {
    static const float point[3] = {.2F, .2F, 0}, normal[3] = {0, 0, 1};
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_bake *bake;
    fct_probe probe;
    stopper s = {.at = n};
    env.thread_count = threads;
    def.stop = stop_at, def.stop_user = &s;
    *mesh = (fct_mesh){0};
    const fct_result result = fct_bake_create(&env, scene, &def, &bake);
    if (result == FCT_OK) {
        const bool early = fct_bake_get_stats(bake).interrupted;
        fct_mesh lit;
        assert_int_equal(fct_bake_mesh(bake, &lit, NULL), FCT_OK);
        assert_int_equal(fct_mesh_copy(&plain, &lit, mesh), FCT_OK);
        fct_mesh_release(&env, &lit);
        *stats = fct_bake_get_stats(bake);
        assert_int_equal(stats->interrupted, s.questions >= n);
        assert_int_equal(fct_bake_probe(bake, 1, point, normal, &probe),
                         early ? FCT_ERROR_CANCELLED : FCT_OK);
        if (stats->interrupted) assert_int_equal(s.questions, n); /* it is not asked again */
    } else {
        assert_int_equal(result, FCT_ERROR_CANCELLED);
        assert_null(bake);
    }
    fct_bake_destroy(bake);
    assert_int_equal(r.alive, 0);
    return result == FCT_OK;
}

/* Wherever a bake is stopped, it gives nothing before the first pass, and light that is nearly right later;
 * the number of threads does not matter. */
static void a_stopped_bake_keeps_its_light(void **state) {
    (void)state;
    fct_scene *scene = small_scene();
    fct_bake_stats stats = {.interrupted = true}, other;
    fct_mesh whole, mesh;
    long nothing = 0, early = 0;
    fct_bake_def def = coarse();
    def.error = 1e-4; /* the first pass has 16 times that */
    assert_true(bake_stopped(scene, def, 1, 1000000, &whole, &stats));
    assert_true(!stats.interrupted && stats.error_estimate > 0);
    stats.interrupted = true;
    for (long n = 1; stats.interrupted; n += 1 + n / 16) {
        if (!bake_stopped(scene, def, 1, n, &mesh, &stats)) {
            assert_int_equal(early, 0);
            ++nothing;
            continue;
        }
        early += stats.interrupted;
        const double share = sum_colors(&mesh) / sum_colors(&whole);
        const double most = stats.power_escaped > 0 ? 1.2 : 2; /* the gather was complete, or a pass */
        if (!(share > 1 / most && share < most))
            fail_msg("stopped at question %ld: %g of the light", n, share);
        assert_true(stats.power_emitted > 0 && stats.power_absorbed > 0);
        if (early % 5 == 0) {
            fct_mesh same;
            assert_true(bake_stopped(scene, def, 3, n, &same, &other));
            assert_int_equal(same.vertex_count, mesh.vertex_count);
            assert_memory_equal(same.colors, mesh.colors, 12 * (size_t)mesh.vertex_count);
            fct_mesh_release(&plain, &same);
        }
        fct_mesh_release(&plain, &mesh);
    }
    printf("    nothing %ld times, early light %ld times\n", nothing, early);
    assert_true(nothing >= 2 && early > 20);
    /* The links do not tell direct from indirect light, nor its error: it is not asked. */
    def.outputs = FCT_MESH_DIRECT;
    assert_true(bake_stopped(scene, def, 1, 1, &mesh, &stats) && !stats.interrupted && mesh.direct);
    fct_mesh_release(&plain, &mesh);
    def.outputs = FCT_MESH_ERROR;
    assert_true(bake_stopped(scene, def, 1, 1, &mesh, &stats) && !stats.interrupted && mesh.error);
    fct_mesh_release(&plain, &mesh);
    fct_mesh_release(&plain, &whole);
    fct_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sizes_that_floats_cannot_tell_are_refused),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(a_cancelled_bake_leaves_nothing),
        cmocka_unit_test(a_stopped_bake_keeps_its_light),
        cmocka_unit_test(threads_do_not_show),
        cmocka_unit_test(darkness_is_a_result),
        cmocka_unit_test(senseless_options_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
