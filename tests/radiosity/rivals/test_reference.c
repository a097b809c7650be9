/* The path tracer against closed forms. */
#include "../place.h"
#include "radiosity/rivals/reference.h"

static fct_env plain; /* outlives every scene */

static fct_scene *begin(void) {
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    return scene;
}

static double irradiance(const fct_scene *scene, v3 p, v3 n, uint32_t samples, bool indirect) {
    float point[3], normal[3], e[3];
    v3_store(point, p), v3_store(normal, n);
    assert_int_equal(
        fct_reference_estimate(&plain, scene, 1, point, normal, NULL, samples, 7, indirect, e, NULL, NULL),
        FCT_OK);
    return e[0];
}

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance * fabs(expected)))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

static void turn_inside_out(fct_mesh *mesh) {
    for (size_t t = 0; t < mesh->face_count; ++t) {
        uint32_t *c = mesh->triangles + 3 * t, swap = c[1];
        c[1] = c[2], c[2] = swap;
    }
}

/* The centroid and normal of a face of an inside-out sphere. */
static v3 inner_spot(const fct_mesh *mesh, size_t face, v3 *normal) {
    v3 p[3];
    for (size_t k = 0; k < 3; ++k)
        p[k] = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * face + k]);
    *normal = v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
    return v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1. / 3);
}

/* A closed surface that emits 1 everywhere: E = 1 / (1 - rho), whatever its shape. */
static void furnace(void **state) {
    (void)state;
    for (int lumpy = 0; lumpy < 2; ++lumpy) {
        fct_scene *scene = begin();
        fct_mesh mesh = make_bumpy(&plain, 12, lumpy * .2);
        turn_inside_out(&mesh);
        place_mesh(scene, &mesh, place_material(scene, .8, 1, false), NULL);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        v3 n, p = inner_spot(&mesh, 100, &n);
        assert_near(irradiance(scene, p, n, 8192, false), 5, .02);
        assert_near(irradiance(scene, p, n, 8192, true), 4, .03);
        fct_mesh_release(&plain, &mesh);
        fct_scene_destroy(scene);
    }
}

/* Inside a sphere E is the same everywhere: a tenth of the area shines, E = .1 / (1 - .5). */
static void sphere_with_a_bright_part(void **state) {
    (void)state;
    fct_scene *scene = begin();
    fct_mesh mesh = make_sphere(&plain, 40);
    turn_inside_out(&mesh);
    uint32_t ids[2] = {place_material(scene, .5, 0, false), place_material(scene, .5, 1, false)};
    uint32_t *materials = fct_allocate(&plain, mesh.face_count, sizeof *materials);
    double lit = 0, all = 0;
    for (size_t t = 0; t < mesh.face_count; ++t) {
        v3 p[3];
        for (size_t k = 0; k < 3; ++k) p[k] = v3_load(mesh.positions + 3 * (size_t)mesh.triangles[3 * t + k]);
        double area = v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
        materials[t] = ids[p[0].z + p[1].z + p[2].z > 3 * .8];
        all += area, lit += materials[t] == ids[1] ? area : 0;
    }
    assert_int_equal(fct_scene_add_object(scene, "ball", &mesh, NULL, NULL, 0, materials), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    for (size_t face = 300; face < 1500; face += 600) {
        v3 n, p = inner_spot(&mesh, face, &n);
        assert_near(irradiance(scene, p, n, 4096, false), 2 * lit / all, .02);
    }
    fct_memory_release(&plain, materials);
    fct_mesh_release(&plain, &mesh);
    fct_scene_destroy(scene);
}

static fct_scene *disk_and_blocker(double radius, bool two_sided) {
    fct_scene *scene = begin();
    fct_mesh disk = make_disk(&plain, 128, v3_make(0, 0, 2), 1, false);
    place_mesh(scene, &disk, place_material(scene, 0, 1, false), NULL);
    fct_mesh_release(&plain, &disk);
    if (radius > 0) {
        disk = make_disk(&plain, 128, v3_make(0, 0, 1), radius, true);
        place_mesh(scene, &disk, place_material(scene, 0, 0, two_sided), NULL);
        fct_mesh_release(&plain, &disk);
    }
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static void disk_lamp(void **state) {
    (void)state;
    v3 up = {0, 0, 1}, origin = {0, 0, 0};
    fct_scene *scene = disk_and_blocker(0, false);
    assert_near(irradiance(scene, origin, up, 4096, false), .2, .005);
    assert_true(irradiance(scene, origin, up, 64, true) == 0);
    fct_scene_destroy(scene);
    for (int two = 0; two < 2; ++two) {
        scene = disk_and_blocker(.3, two);
        assert_near(irradiance(scene, origin, up, 16384, false), .117431, .01);
        fct_scene_destroy(scene);
    }
}

/* The back of a one-sided lamp is black. */
static void backs_are_black(void **state) {
    (void)state;
    for (int two = 0; two < 2; ++two) {
        fct_scene *scene = begin();
        place_sheet(&plain, scene, place_material(scene, 0, 1, two), 2, v3_make(-.5, -.5, 1),
                    v3_make(1, 0, 0), v3_make(0, 1, 0));
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        double e = irradiance(scene, v3_make(0, 0, 0), v3_make(0, 0, 1), 2048, false);
        if (two)
            assert_near(e, .2394, .01);
        else
            assert_true(e == 0);
        fct_scene_destroy(scene);
    }
}

/* A mirrored, sheared instance of an inside-out ball is still a furnace. */
static void transformed_furnace(void **state) {
    (void)state;
    fct_scene *scene = begin();
    fct_mesh mesh = make_sphere(&plain, 12);
    turn_inside_out(&mesh);
    const float squeezed[12] = {-3, 0, 0, 5, 0, 1, .5F, 0, 0, 0, 2, 1};
    place_mesh(scene, &mesh, place_material(scene, .5, 1, false), squeezed);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    assert_near(irradiance(scene, v3_make(5, 0, 1), v3_make(0, 0, 1), 8192, false), 2, .02);
    fct_mesh_release(&plain, &mesh);
    fct_scene_destroy(scene);
}

typedef struct canceller {
    int left;
} canceller;

static bool cancel(void *user, const char *phase, double done) {
    (void)phase, (void)done;
    return --((canceller *)user)->left > 0;
}

/* The number of threads does not change a bit; another seed changes the noise but not the mean. */
static void threads_and_seeds(void **state) {
    (void)state;
    fct_scene *scene = disk_and_blocker(.3, false);
    enum { COUNT = 300 };
    float points[3 * COUNT], normals[3 * COUNT], a[3 * COUNT], b[3 * COUNT], c[3 * COUNT];
    for (int i = 0; i < COUNT; ++i) {
        float p[6] = {(float)i / COUNT - .5F, .1F, 0, 0, 0, 1};
        memcpy(points + 3 * i, p, 12), memcpy(normals + 3 * i, p + 3, 12);
    }
    uint64_t rays = 0, more = 0;
    for (int samples = 40; samples <= 1200; samples *= 30) {
        fct_env one = plain, three = plain;
        one.thread_count = 1, three.thread_count = 3;
        rays = more = 0;
        assert_int_equal(fct_reference_estimate(&one, scene, COUNT, points, normals, NULL, (uint32_t)samples,
                                                1, false, a, NULL, &rays),
                         FCT_OK);
        assert_int_equal(fct_reference_estimate(&three, scene, COUNT, points, normals, NULL,
                                                (uint32_t)samples, 1, false, b, NULL, &more),
                         FCT_OK);
        assert_memory_equal(a, b, sizeof a);
        assert_true(rays == more && rays >= (uint64_t)samples * COUNT);
    }
    assert_int_equal(
        fct_reference_estimate(&plain, scene, COUNT, points, normals, NULL, 1200, 2, false, c, NULL, NULL),
        FCT_OK);
    double mean[2] = {0, 0};
    for (int i = 0; i < COUNT; ++i) mean[0] += a[3 * i], mean[1] += c[3 * i];
    assert_memory_not_equal(a, c, sizeof a);
    assert_near(mean[0], mean[1], .005);

    canceller stop = {2};
    fct_env env = plain;
    env.progress = cancel, env.progress_user = &stop;
    assert_int_equal(
        fct_reference_estimate(&env, scene, COUNT, points, normals, NULL, 64, 1, false, a, NULL, NULL),
        FCT_ERROR_CANCELLED);
    fct_scene_destroy(scene);
}

static void memory_runs_out(void **state) {
    (void)state;
    fct_scene *scene = disk_and_blocker(.3, false);
    float point[3] = {0, 0, 0}, normal[3] = {0, 0, 1}, e[3];
    fct_result result = FCT_ERROR_MEMORY;
    long n = 1;
    for (; result != FCT_OK; ++n) {
        recorder r = {.fail_at = n};
        fct_env env = recorder_env(&r);
        result = fct_reference_estimate(&env, scene, 1, point, normal, NULL, 1024, 1, false, e, NULL, NULL);
        assert_true(result == FCT_OK || (result == FCT_ERROR_MEMORY && r.messages));
        assert_int_equal(r.alive, 0);
    }
    assert_true(n > 6);
    fct_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(furnace),
        cmocka_unit_test(sphere_with_a_bright_part),
        cmocka_unit_test(disk_lamp),
        cmocka_unit_test(backs_are_black),
        cmocka_unit_test(transformed_furnace),
        cmocka_unit_test(threads_and_seeds),
        cmocka_unit_test(memory_runs_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
