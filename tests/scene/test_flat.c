/* Queries on a scene against the same queries on all its triangles, taken to the world in double. */
#include "support.h"

#include <time.h>

#include "base/math/origin.h"
#include "facetree/scene.h"
#include "scene/transform.h"

enum { OBJECTS = 14 };

static uint64_t state = 1;
static double between(double a, double b) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return a + (b - a) * (double)(state >> 11) * 0x1p-53;
}

typedef struct triangle {
    v3 p[3];
    uint32_t instance, face;
} triangle;

typedef struct flat {
    fct_scene *scene;
    triangle *list;
    uint32_t count;
} flat;

/* World positions from rows R|t, written out. */
static v3 place(const float *m, const float *p) {
    double out[3];
    for (int r = 0; r < 3; ++r)
        out[r] = (double)m[4 * r] * (double)p[0] + (double)m[4 * r + 1] * (double)p[1] +
                 (double)m[4 * r + 2] * (double)p[2] + (double)m[4 * r + 3];
    return v3_make(out[0], out[1], out[2]);
}

static flat flatten(fct_scene *scene) {
    flat f = {.scene = scene};
    fct_scene_view view = fct_scene_get(scene);
    f.list = malloc((size_t)view.face_count * sizeof *f.list);
    for (uint32_t i = 0; i < view.instance_count; ++i) {
        fct_tree_view tree = fct_tree_get(view.models[view.instances[i].model].tree);
        for (uint32_t k = 0; k < tree.face_count; ++k) {
            triangle *t = f.list + f.count++;
            t->instance = i, t->face = tree.face_ids[k];
            for (uint32_t c = 0; c < 3; ++c)
                t->p[c] = place(view.instances[i].to_world,
                                tree.positions + 3 * (size_t)tree.triangles[3 * (size_t)k + c]);
        }
    }
    assert_int_equal(f.count, view.face_count);
    return f;
}

/* Rotated, scaled evenly or not, mirrored, sheared: by the number of the object. */
static void random_transform(int kind, float out[12]) {
    double q[4], length = 0, t[3], s[3], m[12];
    for (int k = 0; k < 4; ++k) q[k] = between(-1, 1), length += q[k] * q[k];
    for (int k = 0; k < 4; ++k) q[k] /= sqrt(length);
    for (int k = 0; k < 3; ++k) t[k] = between(-3, 3), s[k] = between(.3, 1.4);
    if (kind % 4 == 1) s[1] = s[2] = s[0];
    if (kind % 4 == 2) s[0] = -s[0], s[1] = s[2] = -s[0];
    if (kind % 4 == 3) s[1] = -s[1];
    fct_transform_compose(t, q, s, m);
    for (int k = 0; k < 12; ++k) out[k] = (float)m[k];
    if (kind == 4) out[1] += .4f, out[6] -= .3f;
}

static flat make_flat_scene(const fct_env *env) {
    fct_scene *scene;
    fct_material material = {.name = "m"};
    uint32_t id;
    state = 11;
    assert_int_equal(fct_scene_create(env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    for (int k = 0; k < OBJECTS; ++k) {
        float transform[12];
        random_transform(k, transform);
        if (k >= OBJECTS / 2) {
            assert_int_equal(
                fct_scene_add_instance(scene, "again", (uint32_t)(k - OBJECTS / 2), transform, FCT_NONE),
                FCT_OK);
            continue;
        }
        fct_mesh mesh = k % 3 == 2 ? make_grid(env, 5) : make_sphere(env, 6);
        assert_int_equal(fct_scene_add_object(scene, "object", &mesh, NULL, k ? transform : NULL, id, NULL),
                         FCT_OK);
        fct_mesh_release(env, &mesh);
    }
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return flatten(scene);
}

static v3 nearest_of(const triangle *t, v3 p) {
    v3 e = v3_sub(t->p[1], t->p[0]), f = v3_sub(t->p[2], t->p[0]), r = v3_sub(p, t->p[0]), best = t->p[0];
    double ee = v3_dot(e, e), ef = v3_dot(e, f), ff = v3_dot(f, f), det = ee * ff - ef * ef;
    double u = (ff * v3_dot(e, r) - ef * v3_dot(f, r)) / det,
           v = (ee * v3_dot(f, r) - ef * v3_dot(e, r)) / det;
    if (u > 0 && v > 0 && u + v < 1) return v3_mad(v3_mad(t->p[0], u, e), v, f);
    for (int i = 0; i < 3; ++i) {
        v3 a = t->p[i], side = v3_sub(t->p[(i + 1) % 3], a);
        double s = fmin(fmax(v3_dot(v3_sub(p, a), side) / v3_dot(side, side), 0), 1);
        v3 q = v3_mad(a, s, side);
        if (v3_norm(v3_sub(q, p)) < v3_norm(v3_sub(best, p))) best = q;
    }
    return best;
}

static void closest_points_are_those_of_the_flat_mesh(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    flat f = make_flat_scene(&env);
    fct_scene_view view = fct_scene_get(f.scene);
    int uneven = 0, mirrored = 0;
    for (int k = 0; k < 800; ++k) {
        double spread = k % 4 ? 4 : 30;
        v3 p = {between(-spread, spread), between(-spread, spread), between(-spread, spread)};
        float at[3];
        v3_store(at, p);
        p = v3_load(at);
        double distance = INFINITY;
        for (uint32_t i = 0; i < f.count; ++i)
            distance = fmin(distance, v3_norm(v3_sub(nearest_of(f.list + i, p), p)));
        uint32_t instance;
        fct_closest closest;
        assert_true(fct_scene_closest_point(f.scene, at, INFINITY, &instance, &closest));
        double near = 3e-6 * (1 + distance);
        assert_true(fabs((double)closest.distance - distance) < near);
        /* Where two faces are nearly as near, the point may be on either, but it is on the face it names. */
        uint32_t i = 0;
        while (f.list[i].instance != instance || f.list[i].face != closest.face) ++i;
        assert_true(fabs(v3_norm(v3_sub(nearest_of(f.list + i, p), p)) - distance) < near);
        assert_true(v3_norm(v3_sub(nearest_of(f.list + i, p), v3_load(closest.point))) < 1e-4);
        uneven += view.instances[instance].uniform_scale == 0, mirrored += view.instances[instance].mirrored;
        assert_true(fct_scene_closest_point(f.scene, at, (float)(distance + near), &instance, &closest));
        assert_false(fct_scene_closest_point(f.scene, at, (float)(distance - near), &instance, &closest));
        assert_int_equal(instance, FCT_NONE);
    }
    assert_true(uneven > 100 && mirrored > 100);
    free(f.list);
    fct_scene_destroy(f.scene);
}

static bool meet(const triangle *t, v3 o, v3 d, double *at, double *rim) {
    v3 e = v3_sub(t->p[1], t->p[0]), g = v3_sub(t->p[2], t->p[0]), h = v3_cross(d, g), s = v3_sub(o, t->p[0]);
    double det = v3_dot(e, h);
    if (fabs(det) < 1e-12) return false;
    double u = v3_dot(s, h) / det, v = v3_dot(d, v3_cross(s, e)) / det;
    *at = v3_dot(g, v3_cross(s, e)) / det;
    *rim = fmin(u, fmin(v, 1 - u - v));
    return *rim > -1e-5;
}

static void rays_are_those_of_the_flat_mesh(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    flat f = make_flat_scene(&env);
    int hits = 0, misses = 0;
    for (int k = 0; k < 3000; ++k) {
        fct_ray ray = {.t_min = k % 5 ? 0 : .3f, .t_max = k % 7 ? INFINITY : .6f};
        for (int c = 0; c < 3; ++c) {
            ray.origin[c] = (float)between(-5, 5);
            ray.direction[c] = (float)(between(-3, 3) - (double)ray.origin[c]);
        }
        if (k % 11 == 0) ray.direction[k % 3] = 0;
        v3 o = v3_load(ray.origin), d = v3_load(ray.direction);
        double best = INFINITY;
        bool doubtful = false;
        const triangle *of = NULL;
        for (uint32_t i = 0; i < f.count; ++i) {
            double at, rim;
            if (!meet(f.list + i, o, d, &at, &rim)) continue;
            double limit = fmin(fabs(at - (double)ray.t_min), fabs(at - (double)ray.t_max));
            doubtful = doubtful || ((rim < 1e-5 || limit < 1e-5) && at < best + 1e-5);
            if (at >= (double)ray.t_min && at <= (double)ray.t_max && at < best) best = at, of = f.list + i;
        }
        fct_scene_hit hit;
        fct_visits visits = {0};
        bool found = fct_scene_closest_hit(f.scene, &ray, &hit, &visits);
        assert_int_equal(fct_scene_any_hit(f.scene, &ray, NULL), found);
        assert_true(visits.nodes > 0 && visits.boxes >= 8);
        if (doubtful) continue;
        assert_int_equal(found, of != NULL);
        ++*(found ? &hits : &misses);
        if (!found) continue;
        assert_true(fabs((double)hit.t - best) < 3e-6 * (1 + best));
        assert_true(hit.instance == of->instance && hit.face == of->face);
        v3 n = v3_unit(v3_cross(v3_sub(of->p[1], of->p[0]), v3_sub(of->p[2], of->p[0])));
        if (fct_scene_get(f.scene).instances[hit.instance].mirrored) n = v3_scale(n, -1);
        assert_true(v3_norm(v3_sub(n, v3_load(hit.normal))) < 1e-5);
        v3 at = v3_add(v3_scale(of->p[0], 1 - (double)hit.u - (double)hit.v),
                       v3_add(v3_scale(of->p[1], (double)hit.u), v3_scale(of->p[2], (double)hit.v)));
        assert_true(v3_norm(v3_sub(at, v3_mad(o, best, d))) < 2e-5);
    }
    assert_true(hits > 600 && misses > 300);
    free(f.list);
    fct_scene_destroy(f.scene);
}

/* A row of spheres along x, each of them twice at the same place. */
static void equal_instances_and_order_in_a_row(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_scene *scene;
    fct_material material = {.name = "m"};
    fct_mesh mesh = make_sphere(&env, 12);
    uint32_t id;
    enum { ROW = 40 };
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "first", &mesh, NULL, NULL, id, NULL), FCT_OK);
    for (int k = 1; k < 2 * ROW; ++k) {
        float m[12] = {1, 0, 0, 3.0f * (float)(k / 2), 0, 1, 0, 0, 0, 0, 1, 0};
        if (k / 2 % 2) m[5] = 1.5f; /* stretched: another search for the closest point */
        assert_int_equal(fct_scene_add_instance(scene, "next", 0, m, FCT_NONE), FCT_OK);
    }
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    uint64_t triangles = 0, nodes = 0, any = 0;
    for (int k = 0; k < 2 * ROW - 2; ++k) {
        int from = k / 2, back = k % 2; /* from between sphere `from` and the next, to either side */
        fct_ray ray = {{3.0f * (float)from + 1.5f, .1f, .05f}, 0, {back ? -1 : 1, .01f, .02f}, INFINITY};
        fct_scene_hit hit;
        fct_visits visits = {0}, occluded = {0};
        assert_true(fct_scene_closest_hit(scene, &ray, &hit, &visits));
        assert_int_equal(hit.instance, 2 * (from + !back));
        assert_true(fct_scene_any_hit(scene, &ray, &occluded));
        triangles += visits.triangles, nodes += visits.nodes, any += occluded.triangles;
        uint32_t instance;
        fct_closest closest;
        float p[3] = {3.0f * (float)from + (back ? 1.4f : 1.6f), .1f, .1f};
        assert_true(fct_scene_closest_point(scene, p, INFINITY, &instance, &closest));
        assert_int_equal(instance, 2 * (from + !back));
    }
    /* Measured: 32 triangles, those of two leaves, and 8.4 nodes per ray; 20 triangles per occlusion test. */
    assert_true(triangles < 40 * (2 * ROW - 2) && nodes < 9 * (2 * ROW - 2) && any < 22 * (2 * ROW - 2));
    fct_mesh_release(&env, &mesh);
    fct_scene_destroy(scene);
}

/* The processor time of 2,000 queries of the nearest point, among spheres on a grid of side^2 places. */
static double time_of_queries(int side) {
    fct_env env = fct_env_default();
    fct_scene *scene;
    fct_material material = {.name = "m"};
    fct_mesh mesh = make_sphere(&env, 4);
    uint32_t id, instance;
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "first", &mesh, NULL, NULL, id, NULL), FCT_OK);
    for (int k = 1; k < side * side; ++k) {
        float m[12] = {1, 0, 0, 3.0f * (float)(k % side), 0, 1, 0, 3.0f * (float)(k / side), 0, 0, 1, 0};
        assert_int_equal(fct_scene_add_instance(scene, "next", 0, m, FCT_NONE), FCT_OK);
    }
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    clock_t start = clock();
    for (int k = 0; k < 2000; ++k) {
        fct_closest closest;
        float p[3] = {(float)between(0, 3 * side), (float)between(0, 3 * side), (float)between(-2, 2)};
        assert_true(fct_scene_closest_point(scene, p, INFINITY, &instance, &closest));
    }
    double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    fct_mesh_release(&env, &mesh);
    fct_scene_destroy(scene);
    return seconds;
}

/* With 400 times as many instances a query takes about 2 times as long, because it skips far boxes. */
static void far_instances_cost_little(void **unused) {
    (void)unused;
    assert_true(time_of_queries(60) < 40 * time_of_queries(3) + 0.01);
}

/* A scene gets an origin if its coordinates exceed 512 times the longest side of its bounds: those of the
 * turned boxes of its instances. */
static void far_scenes_have_the_origin_of_their_bounds(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    int origins = 0, none = 0;
    for (int run = 0; run < 60; ++run) {
        fct_scene *scene;
        fct_material material = {.name = "m"};
        fct_extent extent = {.any = true, .fine = true};
        double at[3], far = pow(10, between(2, 4.5)), largest = 0, side = 0, expected[3] = {0, 0, 0};
        uint32_t id;
        assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
        assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
        for (int c = 0; c < 3; ++c) {
            extent.lower[c] = INFINITY, extent.upper[c] = -INFINITY;
            at[c] = between(-1, 1) * far;
        }
        for (int i = 0; i < 1 + run % 3; ++i) {
            float m[12];
            fct_mesh mesh = make_grid(&env, 3);
            random_transform(run + i, m);
            for (int c = 0; c < 3; ++c) m[4 * c + 3] += (float)at[c];
            assert_int_equal(fct_scene_add_object(scene, "object", &mesh, NULL, m, id, NULL), FCT_OK);
            for (int corner = 0; corner < 4; ++corner) { /* of the unit square */
                float p[3] = {(float)(corner % 2), (float)(corner / 2), 0};
                v3 q = place(m, p);
                const double x[3] = {q.x, q.y, q.z};
                for (int c = 0; c < 3; ++c)
                    extent.lower[c] = fmin(extent.lower[c], x[c]),
                    extent.upper[c] = fmax(extent.upper[c], x[c]);
            }
            fct_mesh_release(&env, &mesh);
        }
        for (int c = 0; c < 3; ++c) {
            largest = fmax(largest, fmax(fabs(extent.lower[c]), fabs(extent.upper[c])));
            side = fmax(side, extent.upper[c] - extent.lower[c]);
        }
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        if (largest > 512 * side) fct_extent_origin(&extent, expected);
        ++*(largest > 512 * side ? &origins : &none);
        fct_scene_view view = fct_scene_get(scene);
        for (int c = 0; c < 3; ++c) assert_true(fabs(view.origin[c] - expected[c]) <= 1e-6 * side);
        fct_scene_destroy(scene);
    }
    assert_true(origins > 15 && none > 15);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closest_points_are_those_of_the_flat_mesh),
        cmocka_unit_test(rays_are_those_of_the_flat_mesh),
        cmocka_unit_test(equal_instances_and_order_in_a_row),
        cmocka_unit_test(far_instances_cost_little),
        cmocka_unit_test(far_scenes_have_the_origin_of_their_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
