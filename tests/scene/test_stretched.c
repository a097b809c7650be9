/* Closest points of instances that are sheared and scaled unequally, against every triangle in the world. */
#include "support.h"

#include "base/math/vec.h"
#include "bvh/near/mapped.h"
#include "facetree/scene.h"
#include "scene/transform.h"

static double between(uint64_t *state, double a, double b) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return a + (b - a) * (double)(*state >> 11) * 0x1p-53;
}

/* Scales of 10^-p to 10^p, before and after a rotation, and shears for odd numbers. */
static void make_transform(uint64_t *state, int number, double power, float out[12]) {
    double q[4], length = 0, scale[3], none[3] = {0, 0, 0}, one[3] = {1, 1, 1}, a[12], b[12];
    for (int k = 0; k < 4; ++k) q[k] = between(state, -1, 1), length += q[k] * q[k];
    for (int k = 0; k < 4; ++k) q[k] /= sqrt(length);
    for (int k = 0; k < 3; ++k) scale[k] = pow(10, between(state, -power, power));
    if (number % 4 == 2) scale[0] = -scale[0];
    double unturned[4] = {0, 0, 0, 1};
    fct_transform_compose(none, number % 2 ? unturned : q, scale, a);
    fct_transform_compose(none, number % 2 ? q : unturned, one, b);
    if (number % 2) a[1] += between(state, -1, 1) * fabs(scale[0]), a[6] += between(state, -1, 1) * scale[1];
    fct_transform_multiply(a, b, a);
    for (int k = 0; k < 12; ++k) out[k] = (float)a[k];
    for (int r = 0; r < 3; ++r) out[4 * r + 3] = (float)between(state, -1, 1);
}

/* World positions from rows R|t, written out. */
static v3 place(const float *m, const float *p) {
    double out[3];
    for (int r = 0; r < 3; ++r)
        out[r] = (double)m[4 * r] * (double)p[0] + (double)m[4 * r + 1] * (double)p[1] +
                 (double)m[4 * r + 2] * (double)p[2] + (double)m[4 * r + 3];
    return v3_make(out[0], out[1], out[2]);
}

static double measure_segment(v3 p, v3 a, v3 b) {
    v3 side = v3_sub(b, a);
    double length2 = v3_norm2(side), s = length2 > 0 ? v3_dot(v3_sub(p, a), side) / length2 : 0;
    return v3_norm(v3_sub(v3_mad(a, fmin(fmax(s, 0), 1), side), p));
}

/* The distance to the plane if the foot of the perpendicular is inside of the three sides, else the least
 * distance to a side. */
static double measure_triangle(v3 p, const v3 t[3]) {
    v3 n = v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0]));
    double best = INFINITY;
    bool inside = v3_norm2(n) > 0;
    for (int i = 0; i < 3; ++i) {
        v3 a = t[i], b = t[(i + 1) % 3];
        inside = inside && v3_dot(v3_cross(v3_sub(b, a), v3_sub(p, a)), n) >= 0;
        best = fmin(best, measure_segment(p, a, b));
    }
    return inside ? fmin(best, fabs(v3_dot(v3_sub(p, t[0]), v3_unit(n)))) : best;
}

static double measure_face(const fct_scene_view *view, uint32_t instance, uint32_t at, v3 p) {
    const fct_instance *placed = view->instances + instance;
    fct_tree_view tree = fct_tree_get(view->models[placed->model].tree);
    v3 corner[3];
    for (size_t c = 0; c < 3; ++c)
        corner[c] = place(placed->to_world, tree.positions + 3 * (size_t)tree.triangles[3 * (size_t)at + c]);
    return measure_triangle(p, corner);
}

static double measure_scene(const fct_scene_view *view, v3 p) {
    double best = INFINITY;
    for (uint32_t i = 0; i < view->instance_count; ++i)
        for (uint32_t f = 0; f < fct_tree_get(view->models[view->instances[i].model].tree).face_count; ++f)
            best = fmin(best, measure_face(view, i, f, p));
    return best;
}

/* A bumpy sphere, a grid or a flat grid far from its origin, of a size. */
static fct_mesh make_model(const fct_env *env, uint64_t *state, int number, float size) {
    fct_mesh mesh = number % 3 ? make_grid(env, 12) : make_sphere(env, 8);
    for (size_t k = 0; k < 3 * (size_t)mesh.vertex_count; ++k) {
        double bump = between(state, .9, 1.1);
        mesh.positions[k] *= (float)bump;
        if (number % 3 == 2) mesh.positions[k] += 20;
        mesh.positions[k] *= size;
    }
    return mesh;
}

/* `count` instances under transforms of scales up to 10^power, asked at points near their surfaces and
 * around. */
static void points_are_nearest(fct_backend backend, int count, double power, float size, uint64_t seed) {
    fct_env env = fct_env_default();
    fct_material material = {.name = "m"};
    fct_scene *scene;
    uint32_t id;
    assert_int_equal(fct_scene_create(&env, backend, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    for (int k = 0; k < count; ++k) {
        float transform[12];
        fct_instance unused;
        double inverse[12];
        do make_transform(&seed, k + (int)(seed % 4), power, transform);
        while (fct_transform_set(transform, &unused, inverse) != FCT_TRANSFORM_GOOD);
        for (int r = 0; r < 3; ++r) transform[4 * r + 3] *= size;
        fct_mesh mesh = make_model(&env, &seed, k, size);
        assert_int_equal(fct_scene_add_object(scene, "object", &mesh, NULL, transform, id, NULL), FCT_OK);
        fct_mesh_release(&env, &mesh);
    }
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_scene_view view = fct_scene_get(scene);
    v3 low = v3_load(view.bounds.lower), extent = v3_sub(v3_load(view.bounds.upper), low);
    int points = SANITIZED ? 20 : 120;
    for (int k = 0; k < points; ++k) {
        double reach = k % 3 == 2 ? 30 : 1, x = between(&seed, -reach, 1 + reach) - .5,
               y = between(&seed, -reach, 1 + reach) - .5, z = between(&seed, -reach, 1 + reach) - .5;
        float p[3];
        v3_store(p, v3_make(low.x + (x + .5) * extent.x, low.y + (y + .5) * extent.y,
                            low.z + (z + .5) * extent.z));
        if (k % 3 == 0) { /* near a face */
            uint32_t i = (uint32_t)between(&seed, 0, view.instance_count);
            fct_tree_view tree = fct_tree_get(view.models[view.instances[i].model].tree);
            size_t v = (size_t)between(&seed, 0, tree.vertex_count);
            double away = pow(10, between(&seed, -6, 0)) * v3_norm(extent);
            v3 at = place(view.instances[i].to_world, tree.positions + 3 * v);
            v3_store(p, v3_mad(at, away, v3_unit(v3_make(x, y, z))));
        }
        uint32_t instance;
        fct_closest closest;
        double expected = measure_scene(&view, v3_load(p));
        double tolerance = 2e-7 * expected + 1e-12 * v3_norm(extent);
        assert_true(fct_scene_closest_point(scene, p, INFINITY, &instance, &closest));
        assert_true(view.instances[instance].uniform_scale == 0);
        assert_true(fabs((double)closest.distance - expected) <= tolerance);
        assert_true(measure_face(&view, instance, closest.place, v3_load(p)) <= expected + tolerance);
        float beyond = (float)(expected + 2 * tolerance), before = (float)(expected - 2 * tolerance);
        assert_true(fct_scene_closest_point(scene, p, beyond, &instance, &closest));
        if (before > 0) assert_false(fct_scene_closest_point(scene, p, before, &instance, &closest));
    }
    fct_scene_destroy(scene);
}

static void points_of_sheared_instances_are_nearest(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 12; ++seed) {
        points_are_nearest(FCT_BACKEND_OBB, 3, .3, 1, seed);
        points_are_nearest(FCT_BACKEND_OBB, 1, 2, 1, seed + 100);
        points_are_nearest(FCT_BACKEND_OBB, 1, 3, 1, seed + 200);
    }
    points_are_nearest(FCT_BACKEND_EMBREE, 2, 1, 1, 5);
}

static void size_does_not_matter(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 3; ++seed) {
        points_are_nearest(FCT_BACKEND_OBB, 2, 1, 1e-12f, seed);
        points_are_nearest(FCT_BACKEND_OBB, 2, 1, 1e12f, seed);
    }
}

/* The frame keeps lengths, and a map along the axes has one number per row. */
static void frames_measure_lengths(void **state) {
    (void)state;
    uint64_t seed = 9;
    for (int k = 0; k < 200; ++k) {
        float m[12];
        fct_mapped_frame frame;
        make_transform(&seed, k, 3, m);
        fct_mapped_frame_make(m, &frame);
        for (int i = 0; i < 20; ++i) {
            double x = between(&seed, -1, 1), y = between(&seed, -1, 1), z = between(&seed, -1, 1);
            v3 v = v3_make(x, y, z), there = fct_transform_vector(m, v);
            v3 here = v3_make(v3_dot(v3_load(frame.rows), v), v3_dot(v3_load(frame.rows + 3), v),
                              v3_dot(v3_load(frame.rows + 6), v));
            assert_true(fabs(v3_norm(here) / frame.unit - v3_norm(there)) <= 4e-7 / frame.unit);
        }
        double largest = v3_norm(v3_load(frame.rows + 6));
        assert_true(largest > .9 && largest < 2.1);
        for (int i = 0; i < 3; ++i) {
            v3 a = v3_load(frame.rows + 3 * i), b = v3_load(frame.rows + 3 * ((i + 1) % 3));
            assert_true(fabs(v3_dot(a, b)) <= 1e-6);
        }
    }
    const float along[12] = {0, 3, 0, 0, -2, 0, 0, 0, 0, 0, 5, 0};
    fct_mapped_frame frame;
    fct_mapped_frame_make(along, &frame);
    for (int i = 0; i < 3; ++i) {
        int others = 0;
        for (int k = 0; k < 3; ++k) others += frame.rows[3 * i + k] != 0;
        assert_int_equal(others, 1);
    }
}

/* A search opens few boxes and faces, also where the scales differ by a factor of 10^4. */
static void few_faces_are_measured(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 60);
    fct_tree *tree;
    fct_bvh *bvh;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    assert_int_equal(fct_bvh_create(&env, tree, FCT_BACKEND_OBB, &bvh), FCT_OK);
    for (int kind = 0; kind < 3; ++kind) {
        float m[12] = {100, 0, 0, 0, 0, 1, 0, 0, 0, 0, .01f, 0};
        fct_instance instance;
        double inverse[12];
        if (kind == 1) m[1] = 80, m[2] = -70;
        if (kind == 2) m[0] = 1, m[1] = .3f, m[6] = .5f, m[10] = 1;
        assert_int_equal(fct_transform_set(m, &instance, inverse), FCT_TRANSFORM_GOOD);
        fct_mapped_frame frame;
        fct_mapped_frame_make(m, &frame);
        fct_map map = {m, inverse, &frame};
        fct_visits visits = {0};
        uint64_t seed = 2;
        enum { COUNT = 500 };
        for (int k = 0; k < COUNT; ++k) {
            double x = between(&seed, -1.2, 1.2), y = between(&seed, -1.2, 1.2),
                   z = between(&seed, -1.2, 1.2);
            fct_mapped_near near;
            v3 p = fct_transform_point(m, v3_make(x, y, z));
            assert_true(fct_mapped_search(bvh, &map, p, INFINITY, &near, &visits));
        }
        assert_true(visits.nodes < 40 * COUNT && visits.triangles < 40 * COUNT);
    }
    fct_bvh_destroy(bvh);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_of_sheared_instances_are_nearest),
        cmocka_unit_test(size_does_not_matter),
        cmocka_unit_test(frames_measure_lengths),
        cmocka_unit_test(few_faces_are_measured),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
