/* Which of several surfaces answers, where they are equally near: faces of one instance around a vertex, and
 * lamps in the plane of a wall, at any place and distance. */
#include "support.h"

#include "facetree/scene.h"
#include "scene/rays.h"
#include "scene/transform.h"

static uint64_t state = 1;
static double between(double a, double b) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return a + (b - a) * (double)(state >> 11) * 0x1p-53;
}

/* m[12] = rotation about a random axis times scales, and a translation up to `far`. */
static void random_transform(const double s[3], double far, double m[12]) {
    double q[4], t[3], length = 0;
    for (int k = 0; k < 4; ++k) q[k] = between(-1, 1), length += q[k] * q[k];
    for (int k = 0; k < 4; ++k) q[k] /= sqrt(length);
    for (int k = 0; k < 3; ++k) t[k] = between(-far, far);
    fct_transform_compose(t, q, s, m);
}

static void to_floats(const double m[12], float out[12]) {
    for (int k = 0; k < 12; ++k) out[k] = (float)m[k];
}

static v3 corner_of(const fct_mesh *mesh, const float m[12], uint32_t face, uint32_t k) {
    return fct_transform_point(m,
                               v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)face + k]));
}

/* Above a vertex of a convex body, all its faces are equally near. */
static void the_lowest_face_around_a_vertex(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 6);
    for (int run = 0; run < 12; ++run) {
        fct_scene *scene;
        fct_material material = {.name = "m"};
        double s[3] = {between(.5, 2), between(.5, 2), between(.5, 2)}, rows[12];
        float m[12];
        uint32_t id, instance;
        if (run % 3 == 0) s[1] = s[2] = s[0];
        if (run % 2) s[0] = -s[0];
        random_transform(s, 3, rows);
        to_floats(rows, m);
        assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
        assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
        assert_int_equal(fct_scene_add_object(scene, "body", &mesh, NULL, m, id, NULL), FCT_OK);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
            uint32_t lowest = FCT_NONE;
            v3 normal = {0, 0, 0}, at = fct_transform_point(m, v3_load(mesh.positions + 3 * (size_t)v));
            for (uint32_t f = 0; f < mesh.face_count; ++f)
                for (uint32_t k = 0; k < 3; ++k) {
                    if (mesh.triangles[3 * (size_t)f + k] != v) continue;
                    v3 a = corner_of(&mesh, m, f, 0), b = corner_of(&mesh, m, f, 1),
                       c = corner_of(&mesh, m, f, 2);
                    lowest = f < lowest ? f : lowest;
                    normal = v3_add(normal, v3_unit(v3_cross(v3_sub(b, a), v3_sub(c, a))));
                }
            float p[3];
            v3_store(p, v3_mad(at, run % 2 ? -1 : 1, v3_scale(v3_unit(normal), between(.1, 2))));
            fct_closest found;
            assert_true(fct_scene_closest_point(scene, p, INFINITY, &instance, &found));
            assert_true(v3_norm(v3_sub(v3_load(found.point), at)) < 1e-5);
            assert_int_equal(found.face, lowest);
        }
        fct_scene_destroy(scene);
    }
    fct_mesh_release(&env, &mesh);
}

/* A wall and a lamp in its plane, turned and scaled in the plane. In front of the lamp, the lamp is met, even
 * where rounding puts it behind the wall; but not if it is behind. */
static void lamps_cover_walls_that_coincide(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_mesh wall = make_grid(&env, 2), panel = make_grid(&env, 3);
    int lamps = 0, walls = 0, backs = 0;
    for (int run = 0; run < 120; ++run) {
        const double far = pow(10, run % 5), ones[3] = {1, 1, 1}, turn = between(0, 3);
        double rows[12], size = between(.1, .3), cosine = size * cos(turn), sine = size * sin(turn);
        double gap = run % 4 == 3 ? -3e-5 * (1 + far) : 0;
        float m[12], n[12];
        fct_scene *scene;
        fct_material paint = {.name = "paint", .reflectance = {.5f, .5f, .5f}},
                     light = {.name = "light", .emission = {1, 2, 3}};
        uint32_t of_wall, of_lamp;
        random_transform(ones, far, rows);
        to_floats(rows, m);
        double inner[12]; /* rows times the turn of the plane, about its middle */
        for (int r = 0; r < 3; ++r) {
            double x = rows[4 * r], y = rows[4 * r + 1], z = rows[4 * r + 2];
            inner[4 * r] = x * cosine + y * sine, inner[4 * r + 1] = y * cosine - x * sine;
            inner[4 * r + 2] = z * size;
            inner[4 * r + 3] = rows[4 * r + 3] + .5 * x + .5 * y + gap * z;
        }
        to_floats(inner, n);
        assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
        assert_int_equal(fct_scene_add_material(scene, &paint, &of_wall), FCT_OK);
        assert_int_equal(fct_scene_add_material(scene, &light, &of_lamp), FCT_OK);
        uint32_t lamp = run % 2 ? 0 : 1;
        for (uint32_t i = 0; i < 2; ++i)
            assert_int_equal(fct_scene_add_object(scene, i == lamp ? "lamp" : "wall",
                                                  i == lamp ? &panel : &wall, NULL, i == lamp ? n : m,
                                                  i == lamp ? of_lamp : of_wall, NULL),
                             FCT_OK);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        v3 z = {rows[2], rows[6], rows[10]};
        for (int k = 0; k < 50; ++k) {
            double a = between(.1, .9), b = between(.1, .9), height = pow(10, between(-3, 0));
            bool back = k % 5 == 4;
            v3 on = {inner[3] + a * inner[0] + b * inner[1], inner[7] + a * inner[4] + b * inner[5],
                     inner[11] + a * inner[8] + b * inner[9]};
            v3 from = v3_mad(on, back ? -height - far * 1e-3 : height + far * 1e-3, z);
            if (k % 7 == 6 && far < 2000 && v3_dot(z, on) < -.5 * v3_norm(on))
                from = v3_make(0, 0, 0), back = false;
            fct_ray ray = {.t_min = 0, .t_max = INFINITY};
            fct_scene_hit hit;
            v3_store(ray.origin, from);
            from = v3_load(ray.origin);
            v3 tilt = {between(-.3, .3), between(-.3, .3), between(-.3, .3)};
            v3 direction = v3_add(v3_sub(on, from), v3_scale(tilt, height * .01));
            v3_store(ray.direction, v3_scale(direction, pow(10, between(-2, 2))));
            if (!fct_scene_light_hit(scene, &ray, &hit, NULL)) continue;
            if (back) {
                ++backs;
                continue;
            }
            if (hit.instance != (gap < 0 ? !lamp : lamp))
                fail_msg("run %d: far %g, height %g, gap %g", run, far, height, gap);
            ++*(gap < 0 ? &walls : &lamps);
        }
        fct_scene_destroy(scene);
    }
    assert_true(lamps > 1000 && walls > 300 && backs > 300);
    fct_mesh_release(&env, &wall);
    fct_mesh_release(&env, &panel);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_lowest_face_around_a_vertex),
                                       cmocka_unit_test(lamps_cover_walls_that_coincide)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
