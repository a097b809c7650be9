/* Scenes of several resolutions: which models have a coarse form, and that a completed scene answers like any
 * other. */
#include "support.h"

#include "facetree/scene.h"
#include "scene/coarse.h"

static uint32_t add_material(fct_scene *scene, double emission) {
    const fct_material m = {.reflectance = {.5F, .5F, .5F}, .emission = {(float)emission, 0, 0}};
    uint32_t id;
    assert_int_equal(fct_scene_add_material(scene, &m, &id), FCT_OK);
    return id;
}

enum { SMALL_FACES = 4 * 10 * 9, LARGE_FACES = 4 * 40 * 39 };

/* Balls in a row: `small` ones of SMALL_FACES, then one that emits light, one that its colours paint, one
 * that is stretched, and `large` ones, of LARGE_FACES each. */
static fct_scene *make_row(const fct_env *env, fct_backend backend, uint32_t patches, int small, int large) {
    fct_scene *scene;
    assert_int_equal(fct_scene_create(env, backend, &scene), FCT_OK);
    scene->patches = patches;
    const uint32_t grey = add_material(scene, 0), lamp = add_material(scene, 1),
                   painted = add_material(scene, 0);
    fct_paint paint = fct_paint_default();
    paint.vertex_colors = true;
    assert_int_equal(fct_scene_paint_material(scene, painted, &paint), FCT_OK);
    for (int i = 0; i < small + 3 + large; ++i) {
        fct_mesh ball = make_sphere(env, i < small ? 10 : 40);
        const int kind = i - small;
        float to_world[12] = {1, 0, 0, 3.F * (float)i, 0, kind == 2 ? 2.F : 1.F, 0, 0, 0, 0, 1, 0};
        assert_int_equal(fct_scene_add_object(scene, "ball", &ball, NULL, to_world,
                                              kind == 0   ? lamp
                                              : kind == 1 ? painted
                                                          : grey,
                                              NULL),
                         FCT_OK);
        fct_mesh_release(env, &ball);
    }
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static void large_plain_models_become_coarse(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    fct_scene *scene = make_row(&env, FCT_BACKEND_MULTIRES, 2000, 4, 2);
    const fct_scene *coarse = fct_scene_coarse(scene);
    assert_ptr_not_equal(coarse, scene);
    assert_ptr_equal(fct_scene_coarse(coarse), coarse);
    for (uint32_t m = 0; m < 9; ++m) {
        const fct_coarse *c = fct_scene_coarse_model(coarse, m);
        assert_null(fct_scene_coarse_model(scene, m));
        assert_int_equal(c != NULL, m >= 7);
        assert_int_equal(fct_scene_get(scene).models[m].bvh == NULL, m >= 7);
        assert_non_null(fct_scene_get(coarse).models[m].bvh);
        const uint32_t count = fct_tree_get(fct_scene_get(scene).models[m].tree).face_count;
        assert_int_equal(count, m < 4 ? SMALL_FACES : LARGE_FACES);
        if (c) assert_int_equal(c->patch_count, 2000 / 2);
        if (c) assert_ptr_equal(fct_scene_get(coarse).models[m].tree, c->tree);
    }
    fct_scene_destroy(scene);

    /* As many patches as half of the faces are not worth it. */
    scene = make_row(&env, FCT_BACKEND_MULTIRES, LARGE_FACES, 0, 2);
    assert_ptr_equal(fct_scene_coarse(scene), scene);
    fct_scene_destroy(scene);
    scene = make_row(&env, FCT_BACKEND_OBB, 100, 0, 2);
    assert_ptr_equal(fct_scene_coarse(scene), scene);
    assert_int_equal(fct_scene_complete(scene), FCT_OK);
    fct_scene_destroy(scene);
}

/* More models than patches, and trees of several roots: each keeps at least its roots. */
static void many_models_have_enough_patches(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_MULTIRES, &scene), FCT_OK);
    scene->patches = 6;
    const uint32_t grey = add_material(scene, 0);
    fct_tree_def def = fct_tree_def_default();
    for (int i = 0; i < 12; ++i) {
        fct_mesh ball = make_sphere(&env, 6);
        fct_tree *tree;
        def.root_count = 1 + (uint32_t)i;
        assert_int_equal(fct_tree_build(&env, &ball, &def, NULL, &tree), FCT_OK);
        assert_int_equal(fct_scene_add_object(scene, "ball", NULL, tree, NULL, grey, NULL), FCT_OK);
        fct_mesh_release(&env, &ball);
    }
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    for (uint32_t m = 0; m < 12; ++m) {
        const fct_coarse *c = fct_scene_coarse_model(fct_scene_coarse(scene), m);
        assert_non_null(c);
        assert_int_equal(c->patch_count, 1 + m);
    }
    fct_scene_destroy(scene);
}

static float next_random(uint32_t *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return (float)(*seed >> 8) / 16777216.F;
}

static void completed_scenes_answer_like_others(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    fct_scene *plain = make_row(&env, FCT_BACKEND_OBB, 500, 2, 3);
    fct_scene *scene = make_row(&env, FCT_BACKEND_MULTIRES, 500, 2, 3);
    const fct_scene *coarse = fct_scene_coarse(scene);
    const fct_scene_view a = fct_scene_get(plain), b = fct_scene_get(scene);
    assert_memory_equal(&a.bounds, &b.bounds, sizeof a.bounds);
    assert_int_equal(a.face_count, b.face_count);
    assert_int_equal(fct_scene_complete(scene), FCT_OK);
    assert_int_equal(fct_scene_complete(scene), FCT_OK);
    uint32_t seed = 7;
    int hits = 0, alike = 0, blocked = 0;
    for (int i = 0; i < 20000; ++i) {
        fct_ray ray = {.t_max = INFINITY};
        for (int k = 0; k < 3; ++k) {
            ray.origin[k] = (k == 0 ? 24 : 6) * next_random(&seed) - 3;
            ray.direction[k] = next_random(&seed) - .5F;
        }
        fct_scene_hit p, q, r;
        const bool hit = fct_scene_closest_hit(plain, &ray, &p, NULL);
        assert_int_equal(fct_scene_closest_hit(scene, &ray, &q, NULL), hit);
        assert_int_equal(fct_scene_any_hit(scene, &ray, NULL), hit);
        if (hit) assert_memory_equal(&p, &q, sizeof p);
        const bool near = fct_scene_closest_hit(coarse, &ray, &r, NULL);
        assert_int_equal(fct_scene_any_hit(coarse, &ray, NULL), near);
        hits += hit, blocked += near;
        alike += hit && near && p.instance == r.instance && fabsf(p.t - r.t) < .1F * (1 + p.t);
    }
    assert_true(hits > 1500);
    assert_true(abs(blocked - hits) < hits / 50);
    assert_true(alike > hits - hits / 25);
    fct_scene_destroy(scene);
    fct_scene_destroy(plain);
}

static void each_allocation_may_fail(void **state) {
    (void)state;
    const fct_env plain = fct_env_default();
    fct_mesh ball = make_sphere(&plain, 8);
    recorder r = {0};
    const fct_env env = recorder_env(&r);
    bool failed = true;
    for (long fail = 1; failed; fail += 1 + fail / 20) {
        fct_scene *scene;
        assert_int_equal(fct_scene_create(&env, FCT_BACKEND_MULTIRES, &scene), FCT_OK);
        scene->patches = 100;
        const uint32_t grey = add_material(scene, 0);
        assert_int_equal(fct_scene_add_object(scene, "ball", &ball, NULL, NULL, grey, NULL), FCT_OK);
        r.allocations = 0, r.fail_at = fail;
        const fct_result committed = fct_scene_commit(scene);
        const fct_result result = committed == FCT_OK ? fct_scene_complete(scene) : committed;
        failed = result != FCT_OK;
        r.fail_at = 0;
        if (failed) assert_int_equal(result, FCT_ERROR_MEMORY);
        if (committed == FCT_OK) assert_int_equal(fct_scene_complete(scene), FCT_OK);
        fct_scene_destroy(scene);
        assert_int_equal(r.alive, 0);
    }
    fct_mesh_release(&plain, &ball);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(large_plain_models_become_coarse),
        cmocka_unit_test(many_models_have_enough_patches),
        cmocka_unit_test(completed_scenes_answer_like_others),
        cmocka_unit_test(each_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
