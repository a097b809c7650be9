/* tests/scene/test_rays.c: rays, closest points, bounds and volumes of a scene against brute force over every
 * transformed triangle. */
#include "support.h"

#include "facetree/scene.h"
#include "scene/scene.h"
#include "scene/transform.h"

enum { OBJECTS = 24 };

static uint64_t state = 1;
static double uniform(void) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}
static double between(double a, double b) {
    return a + (b - a) * uniform();
}

static void random_transform(int kind, float out[12]) {
    double q[4], t[3], s[3], m[12];
    for (int k = 0; k < 4; ++k) q[k] = between(-1, 1);
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; ++k) q[k] /= length;
    for (int k = 0; k < 3; ++k) t[k] = between(-4, 4), s[k] = between(.3, 1.5);
    if (kind % 4 == 1) s[1] = s[2] = s[0];
    if (kind % 4 == 2) s[0] = -s[0], s[1] = s[2] = -s[0];
    if (kind % 4 == 3) s[1] = -s[1];
    fct_transform_compose(t, q, s, m);
    for (int k = 0; k < 12; ++k) out[k] = (float)m[k];
    if (kind == 0) memcpy(out, fct_transform_identity, 12 * sizeof *out);
    if (kind == 4) out[1] += .4f, out[6] -= .3f; /* sheared */
}

/* Spheres and grids under transforms of every kind; half of them instances of others. */
static fct_scene *make_scene(const fct_env *env, fct_backend backend) {
    fct_scene *scene;
    fct_material material = {.name = "m", .reflectance = {.5f, .5f, .5f}};
    uint32_t id;
    state = 7;
    assert_int_equal(fct_scene_create(env, backend, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    for (int k = 0; k < OBJECTS; ++k) {
        float transform[12];
        char name[16];
        random_transform(k, transform);
        snprintf(name, sizeof name, "object %d", k);
        if (k >= OBJECTS / 2) {
            assert_int_equal(
                fct_scene_add_instance(scene, name, (uint32_t)k - OBJECTS / 2, transform, FCT_NONE), FCT_OK);
            continue;
        }
        fct_mesh mesh = k % 3 == 2 ? make_grid(env, 4) : make_sphere(env, 5);
        assert_int_equal(fct_scene_add_object(scene, name, &mesh, NULL, transform, id, NULL), FCT_OK);
        fct_mesh_release(env, &mesh);
    }
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

/* Corner c of the face at `place`, in the world, from the public view alone. */
static v3 corner(const fct_scene_view *view, uint32_t instance, uint32_t place, int c) {
    const fct_instance *i = view->instances + instance;
    fct_tree_view tree = fct_tree_get(view->models[i->model].tree);
    return fct_transform_point(i->to_world, v3_load(tree.positions + 3 * tree.triangles[3 * place + c]));
}

static uint32_t face_count(const fct_scene_view *view, uint32_t instance) {
    return fct_tree_get(view->models[view->instances[instance].model].tree).face_count;
}

/* Signed volumes; `rim` tells how near the hit is to a side of the triangle, in barycentrics. */
static bool hit_triangle(v3 o, v3 d, v3 a, v3 b, v3 c, double *t, double *rim) {
    v3 e = v3_sub(b, a), f = v3_sub(c, a), p = v3_cross(d, f), s = v3_sub(o, a), q = v3_cross(s, e);
    double det = v3_dot(e, p);
    if (fabs(det) < 1e-14) return false;
    double u = v3_dot(s, p) / det, v = v3_dot(d, q) / det;
    *t = v3_dot(f, q) / det;
    *rim = fmin(u, fmin(v, 1 - u - v));
    return *rim > -1e-4;
}

typedef struct brute {
    double t;
    bool certain; /* no candidate nearer than t lies on a rim */
    uint32_t instance;
    v3 normal;
} brute;

static brute brute_hit(const fct_scene_view *view, const fct_ray *ray) {
    brute best = {INFINITY, true, FCT_NONE, {0, 0, 0}};
    v3 o = v3_load(ray->origin), d = v3_load(ray->direction);
    double doubtful = INFINITY;
    for (uint32_t i = 0; i < view->instance_count; ++i)
        for (uint32_t f = 0; f < face_count(view, i); ++f) {
            v3 a = corner(view, i, f, 0), b = corner(view, i, f, 1), c = corner(view, i, f, 2);
            double t, rim;
            if (!hit_triangle(o, d, a, b, c, &t, &rim) || t < ray->t_min || t > ray->t_max) continue;
            if (rim < 1e-4) {
                doubtful = fmin(doubtful, t);
            } else if (t < best.t) {
                double sign = view->instances[i].mirrored ? -1 : 1;
                best.t = t, best.instance = i;
                best.normal = v3_scale(v3_unit(v3_cross(v3_sub(b, a), v3_sub(c, a))), sign);
            }
        }
    best.certain = doubtful == INFINITY || doubtful > best.t + 1e-4;
    return best;
}

static fct_ray random_ray(int k) {
    fct_ray ray = {.t_min = 0, .t_max = INFINITY};
    for (int c = 0; c < 3; ++c) {
        ray.origin[c] = (float)between(-6, 6);
        ray.direction[c] = (float)(between(-4, 4) - ray.origin[c]);
    }
    if (k % 5 == 1) ray.direction[k / 5 % 3] = 0;
    if (k % 5 == 2) ray.direction[0] = ray.direction[1] = 0;
    if (k % 7 == 3) ray.t_max = .7f;
    if (k % 7 == 4) ray.t_min = .4f;
    return ray;
}

static void rays_agree_with_brute_force(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    for (int backend = 0; backend < 2; ++backend) {
        fct_scene *scene = make_scene(&env, backend ? FCT_BACKEND_EMBREE : FCT_BACKEND_OBB);
        fct_scene_view view = fct_scene_get(scene);
        int hits = 0, checked = 0, mirrored = 0;
        for (int k = 0; k < 1500; ++k) {
            fct_ray ray = random_ray(k);
            brute expected = brute_hit(&view, &ray);
            fct_scene_hit hit;
            bool found = fct_scene_closest_hit(scene, &ray, &hit, NULL);
            assert_int_equal(found, fct_scene_any_hit(scene, &ray, NULL));
            if (!expected.certain) continue;
            ++checked;
            assert_int_equal(found, expected.instance != FCT_NONE);
            if (!found) continue;
            ++hits;
            mirrored += view.instances[hit.instance].mirrored;
            assert_true(fabs(hit.t - expected.t) < 1e-4);
            assert_int_equal(hit.instance, expected.instance);
            assert_true(v3_norm(v3_sub(v3_load(hit.normal), expected.normal)) < 1e-3);
            v3 at = v3_mad(v3_load(ray.origin), hit.t, v3_load(ray.direction)), by_uv = {0, 0, 0};
            double weights[3] = {1 - hit.u - hit.v, hit.u, hit.v};
            for (int c = 0; c < 3; ++c)
                by_uv = v3_mad(by_uv, weights[c], corner(&view, hit.instance, hit.place, c));
            assert_true(v3_norm(v3_sub(at, by_uv)) < 1e-4);
        }
        assert_true(checked > 1400 && hits > 300 && mirrored > 50);
        fct_scene_destroy(scene);
    }
}

/* Along every edge of a cube in the plane of one of its sides: the bounds of the instance are met as surely
 * as the model's own. */
static void rays_in_the_plane_of_a_side_hit(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 8, 12, 0, &mesh), FCT_OK);
    for (int k = 0; k < 24; ++k) mesh.positions[k] = (float)(k / 3 >> k % 3 & 1);
    static const uint32_t sides[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    memcpy(mesh.triangles, sides, sizeof sides);
    fct_material material = {.name = "m"};
    fct_scene *scene;
    uint32_t id;
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    float far_away[12] = {1, 0, 0, 40, 0, 1, 0, 0, 0, 0, 1, 0};
    assert_int_equal(fct_scene_add_object(scene, "cube", &mesh, NULL, NULL, id, NULL), FCT_OK);
    assert_int_equal(fct_scene_add_instance(scene, "other", 0, far_away, FCT_NONE), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    const fct_bvh *model = fct_scene_get(scene).models[0].bvh;
    for (int k = 0; k < 24; ++k) {
        int along = k % 3, side = (along + 1 + k / 3 % 2) % 3;
        fct_ray ray = {{.5f, .5f, .5f}, 1e-3f, {0, 0, 0}, INFINITY};
        ray.origin[along] = -2, ray.direction[along] = 1;
        ray.origin[side] = (float)(k / 6 % 2);
        ray.direction[side] = k < 12 ? 0.0f : -0.0f;
        fct_scene_hit hit;
        fct_hit expected;
        assert_true(fct_bvh_closest_hit(model, &ray, &expected, NULL));
        assert_true(fct_scene_closest_hit(scene, &ray, &hit, NULL));
        assert_true(hit.t == expected.t && hit.instance == 0);
        assert_true(fct_scene_any_hit(scene, &ray, NULL));
    }
    fct_scene_destroy(scene);
    fct_mesh_release(&env, &mesh);
}

/* Where areas cannot be told any more, and where there is nothing to place. */
static void what_has_no_area_is_refused(void **unused) {
    (void)unused;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_material material = {.name = "m"};
    fct_mesh mesh = make_grid(&env, 2), none = {0};
    fct_scene *scene;
    uint32_t id, labels[1] = {0};
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    float small[12] = {1e-25f, 0, 0, 0, 0, 1e-25f, 0, 0, 0, 0, 1e-25f, 0};
    assert_int_equal(fct_scene_add_object(scene, "small", &mesh, NULL, small, id, NULL), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "singular"));
    for (int k = 0; k < 12; ++k) small[k] *= 1e10f;
    assert_int_equal(fct_scene_add_object(scene, "larger", &mesh, NULL, small, id, NULL), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "none", &none, NULL, NULL, id, NULL), FCT_ERROR_DATA);
    assert_int_equal(fct_scene_add_object(scene, "none", &none, NULL, NULL, id, labels), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "no faces"));
    assert_int_equal(fct_scene_get(scene).object_count, 1);
    fct_scene_destroy(scene);
    fct_mesh_release(&env, &mesh);
    assert_int_equal(r.alive, 0);
}

static void useless_rays_hit_nothing(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_scene *scene = make_scene(&env, FCT_BACKEND_OBB);
    fct_scene_hit hit;
    fct_ray rays[6] = {
        {{0, 0, 5}, 0, {0, 0, 0}, INFINITY},         {{0, NAN, 5}, 0, {0, 0, -1}, INFINITY},
        {{0, 0, 5}, 0, {0, 0, -INFINITY}, INFINITY}, {{0, -INFINITY, 0}, 0, {0, INFINITY, -1}, INFINITY},
        {{0, 0, 5}, 0, {0, NAN, -1}, INFINITY},      {{0, 0, 5}, 9, {0, 0, -1}, 1}};
    for (int k = 0; k < 6; ++k) {
        assert_false(fct_scene_closest_hit(scene, rays + k, &hit, NULL));
        assert_int_equal(hit.instance, FCT_NONE);
        assert_false(fct_scene_any_hit(scene, rays + k, NULL));
    }
    fct_scene_destroy(scene);
}

/* The least distance to any triangle, by many points on each: an upper bound close to the truth, and by the
 * same points a check that the answer is no nearer than it may be. */
static double brute_distance(const fct_scene_view *view, v3 p) {
    double best = INFINITY;
    enum { N = 12 };
    for (uint32_t i = 0; i < view->instance_count; ++i)
        for (uint32_t f = 0; f < face_count(view, i); ++f)
            for (int a = 0; a <= N; ++a)
                for (int b = 0; b + a <= N; ++b) {
                    v3 at = v3_scale(corner(view, i, f, 0), (N - a - b) / (double)N);
                    at = v3_mad(at, a / (double)N, corner(view, i, f, 1));
                    at = v3_mad(at, b / (double)N, corner(view, i, f, 2));
                    best = fmin(best, v3_norm(v3_sub(at, p)));
                }
    return best;
}

static void closest_points_agree_with_brute_force(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    for (int backend = 0; backend < 2; ++backend) {
        fct_scene *scene = make_scene(&env, backend ? FCT_BACKEND_EMBREE : FCT_BACKEND_OBB);
        fct_scene_view view = fct_scene_get(scene);
        int stretched = 0;
        for (int k = 0; k < 24; ++k) {
            float p[3] = {(float)between(-6, 6), (float)between(-6, 6), (float)between(-6, 6)};
            uint32_t instance;
            fct_closest closest;
            double expected = brute_distance(&view, v3_load(p));
            assert_true(fct_scene_closest_point(scene, p, INFINITY, &instance, &closest));
            stretched += view.instances[instance].uniform_scale == 0;
            assert_true(closest.distance <= expected + 1e-5);
            assert_true(closest.distance >= expected - .15); /* of the spacing of the points */
            assert_true(fabs(v3_norm(v3_sub(v3_load(closest.point), v3_load(p))) - closest.distance) < 1e-4);
            fct_tree_view tree = fct_tree_get(view.models[view.instances[instance].model].tree);
            uint32_t place = 0;
            while (tree.face_ids[place] != closest.face) ++place;
            v3 at = v3_scale(corner(&view, instance, place, 0), 1 - closest.u - closest.v);
            at = v3_mad(at, closest.u, corner(&view, instance, place, 1));
            at = v3_mad(at, closest.v, corner(&view, instance, place, 2));
            assert_true(v3_norm(v3_sub(at, v3_load(closest.point))) < 1e-4);
            assert_false(fct_scene_closest_point(scene, p, .99f * closest.distance, &instance, &closest));
            assert_int_equal(instance, FCT_NONE);
        }
        assert_true(stretched >= 4);
        fct_scene_destroy(scene);
    }
}

/* The attributes of a hit under transforms of every kind: the normal is the inverse transpose's, written with
 * a linear solve, and the others are those of the model. */
static void points_have_the_attributes_of_their_model(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    for (int kind = 0; kind < 6; ++kind) {
        fct_mesh grid = make_grid(&env, 3), mesh;
        unsigned colors = kind % 2 ? FCT_MESH_COLORS : FCT_MESH_FACE_COLORS;
        unsigned normals = kind % 3 ? FCT_MESH_NORMALS : FCT_MESH_CORNER_NORMALS;
        assert_int_equal(fct_mesh_create(&env, grid.vertex_count, grid.face_count,
                                         FCT_MESH_TEXCOORDS | colors | normals, &mesh),
                         FCT_OK);
        memcpy(mesh.positions, grid.positions, 12 * (size_t)grid.vertex_count);
        memcpy(mesh.triangles, grid.triangles, 12 * (size_t)grid.face_count);
        state = 3;
        for (size_t k = 0; k < 9 * (size_t)mesh.face_count; ++k) {
            double value = between(.1, 1);
            if (mesh.corner_normals) mesh.corner_normals[k] = (float)value;
            if (mesh.normals && k < 3 * (size_t)mesh.vertex_count) mesh.normals[k] = (float)value;
            if (mesh.colors && k < 3 * (size_t)mesh.vertex_count) mesh.colors[k] = (float)(2 * value);
            if (mesh.face_colors && k < 3 * (size_t)mesh.face_count) mesh.face_colors[k] = (float)(2 * value);
            if (k < 6 * (size_t)mesh.face_count) mesh.texcoords[k] = (float)(3 * value);
        }
        fct_scene *scene;
        fct_material material = {.name = "m"};
        uint32_t id;
        float m[12];
        random_transform(kind, m);
        assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
        assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
        assert_int_equal(fct_scene_add_object(scene, "object", &mesh, NULL, m, id, NULL), FCT_OK);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_tree_view tree = fct_tree_get(fct_scene_get(scene).models[0].tree);
        for (uint32_t place = 0; place < tree.face_count; ++place) {
            fct_surface_point p, expected;
            fct_scene_point(scene, 0, place, .3f, .1f, &p);
            fct_mesh_point(&mesh, tree.face_ids[place], .3f, .1f, &expected);
            assert_int_equal(p.found, FCT_MESH_TEXCOORDS | FCT_MESH_COLORS | FCT_MESH_NORMALS);
            assert_memory_equal(p.texcoord, expected.texcoord, sizeof p.texcoord);
            assert_memory_equal(p.color, expected.color, sizeof p.color);
            /* R^T n is along the normal of the model, on the same side. */
            v3 back = {0, 0, 0};
            for (size_t r = 0; r < 3; ++r)
                back = v3_mad(back, p.normal[r], v3_make(m[4 * r], m[4 * r + 1], m[4 * r + 2]));
            assert_true(fabs(v3_norm(v3_load(p.normal)) - 1) < 1e-6);
            assert_true(v3_norm(v3_sub(v3_unit(back), v3_load(expected.normal))) < 1e-5);
        }
        fct_scene_destroy(scene);
        fct_mesh_release(&env, &mesh);
        fct_mesh_release(&env, &grid);
    }
}

/* Each ray against every triangle; hits on rims leave the count in doubt. */
static void all_hits_are_sorted_and_complete(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    for (int backend = 0; backend < 2; ++backend) {
        fct_scene *scene = make_scene(&env, backend ? FCT_BACKEND_EMBREE : FCT_BACKEND_OBB);
        fct_scene_view view = fct_scene_get(scene);
        int checked = 0, several = 0;
        for (int k = 0; k < 400; ++k) {
            enum { MOST = 64 };
            fct_ray ray = random_ray(k);
            fct_scene_hit hits[MOST], fewer[3], first;
            size_t count = fct_scene_all_hits(scene, &ray, MOST, hits, NULL);
            assert_true(count <= MOST);
            assert_int_equal(fct_scene_all_hits(scene, &ray, 0, NULL, NULL), count);
            assert_int_equal(fct_scene_all_hits(scene, &ray, 3, fewer, NULL), count);
            assert_memory_equal(fewer, hits, (count < 3 ? count : 3) * sizeof *hits);
            assert_int_equal(fct_scene_closest_hit(scene, &ray, &first, NULL), count > 0);
            if (count && !backend) assert_memory_equal(&first, hits, sizeof first);
            size_t expected = 0, at = 0;
            bool certain = true;
            v3 o = v3_load(ray.origin), d = v3_load(ray.direction);
            for (uint32_t i = 0; i < view.instance_count; ++i)
                for (uint32_t f = 0; f < face_count(&view, i); ++f) {
                    double t, rim;
                    v3 a = corner(&view, i, f, 0), b = corner(&view, i, f, 1), c = corner(&view, i, f, 2);
                    if (!hit_triangle(o, d, a, b, c, &t, &rim)) continue;
                    if (t < ray.t_min - 1e-4 || t > ray.t_max + 1e-4) continue;
                    certain = certain && rim > 1e-4 && t > ray.t_min + 1e-4 && t < ray.t_max - 1e-4;
                    ++expected;
                    for (at = 0; at < count; ++at)
                        if (hits[at].instance == i && hits[at].place == f) break;
                    if (rim < 1e-4 || t < ray.t_min + 1e-4 || t > ray.t_max - 1e-4) continue;
                    assert_true(at < count && fabs(hits[at].t - t) < 1e-4);
                    double sign = view.instances[i].mirrored ? -1 : 1;
                    v3 n = v3_scale(v3_unit(v3_cross(v3_sub(b, a), v3_sub(c, a))), sign);
                    assert_true(v3_norm(v3_sub(v3_load(hits[at].normal), n)) < 1e-3);
                }
            if (certain) assert_int_equal(count, expected);
            for (size_t i = 1; i < count; ++i) {
                const fct_scene_hit *a = &hits[i - 1], *b = &hits[i];
                assert_true(a->t < b->t ||
                            (a->t == b->t && (a->instance < b->instance ||
                                              (a->instance == b->instance && a->face < b->face))));
            }
            checked += certain, several += count > 2;
        }
        assert_true(checked > 300 && several > 20);
        fct_scene_destroy(scene);
    }
}

/* Two grids in one place: equal t are in the order of the instances, then of the faces. */
static void equal_hits_are_in_order(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 2);
    fct_scene *scene;
    fct_material material = {.name = "m"};
    uint32_t id;
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "object", &mesh, NULL, NULL, id, NULL), FCT_OK);
    assert_int_equal(fct_scene_add_instance(scene, "again", 0, NULL, FCT_NONE), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    const float *middle = mesh.positions + 3 * (mesh.vertex_count / 2);
    fct_ray ray = {{middle[0], middle[1], middle[2] + 5}, 0, {0, 0, -1}, INFINITY};
    fct_scene_hit hits[32], last[32];
    size_t count = fct_scene_all_hits(scene, &ray, 32, hits, NULL);
    assert_true(count >= 4 && count <= 32 && count % 2 == 0);
    for (size_t i = 0; i < count; ++i) {
        assert_true(hits[i].t == hits[0].t);
        assert_int_equal(hits[i].instance, i >= count / 2);
        if (i % (count / 2)) assert_true(hits[i - 1].face < hits[i].face);
    }
    for (size_t capacity = 1; capacity < count; ++capacity) {
        assert_int_equal(fct_scene_all_hits(scene, &ray, capacity, last, NULL), count);
        assert_memory_equal(last, hits, capacity * sizeof *hits);
    }
    fct_scene_destroy(scene);
    fct_mesh_release(&env, &mesh);
}

static void instances_say_what_their_transforms_do(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_scene *scene = make_scene(&env, FCT_BACKEND_OBB);
    fct_scene_view view = fct_scene_get(scene);
    assert_int_equal(view.instance_count, OBJECTS);
    assert_int_equal(view.object_count, OBJECTS);
    assert_int_equal(view.model_count, OBJECTS / 2);
    assert_true(view.instances[0].uniform_scale == 1 && view.instances[1].uniform_scale > 0);
    assert_true(view.instances[2].uniform_scale > 0 && view.instances[2].mirrored);
    assert_true(view.instances[3].uniform_scale == 0 && view.instances[4].uniform_scale == 0);
    for (uint32_t i = 0; i < view.instance_count; ++i) {
        const fct_instance *instance = view.instances + i;
        v3 p = v3_make(.3, -.7, .2);
        v3 back = fct_transform_point(instance->to_model, fct_transform_point(instance->to_world, p));
        assert_true(v3_norm(v3_sub(back, p)) < 1e-5);
        double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
        for (uint32_t f = 0; f < face_count(&view, i); ++f) {
            fct_tree_view tree = fct_tree_get(view.models[instance->model].tree);
            v3 model[3], world[3];
            for (int c = 0; c < 3; ++c) {
                model[c] = v3_load(tree.positions + 3 * tree.triangles[3 * f + c]);
                world[c] = corner(&view, i, f, c);
                double at[3] = {world[c].x, world[c].y, world[c].z};
                for (int k = 0; k < 3; ++k)
                    lower[k] = fmin(lower[k], at[k]), upper[k] = fmax(upper[k], at[k]);
            }
            v3 s = v3_cross(v3_sub(model[1], model[0]), v3_sub(model[2], model[0])),
               w = v3_cross(v3_sub(world[1], world[0]), v3_sub(world[2], world[0]));
            v3 taken = fct_transform_normal(instance->normal_matrix, s);
            assert_true(v3_norm(v3_sub(taken, w)) < 1e-4);
        }
        for (int k = 0; k < 3; ++k) {
            double slack = .1 * (upper[k] - lower[k]) + 1e-4;
            assert_true(instance->bounds.lower[k] <= lower[k] && instance->bounds.upper[k] >= upper[k]);
            assert_true(instance->bounds.lower[k] > lower[k] - slack &&
                        instance->bounds.upper[k] < upper[k] + slack);
        }
    }
    fct_scene_destroy(scene);
}

static bool holds(const fct_bounds *outer, const fct_bounds *inner) {
    for (int c = 0; c < 3; ++c)
        if (inner->lower[c] < outer->lower[c] || inner->upper[c] > outer->upper[c]) return false;
    return true;
}

/* Every instance in one leaf, boxes inside their parents', children behind parents, depth bounded. */
static void check_volumes(const fct_volume *volumes, uint32_t count, const fct_bounds *bounds) {
    uint32_t nodes = 2 * count - 1, leaves = 0;
    unsigned char *seen = calloc(nodes, 1), *used = calloc(count, 1), *depth = calloc(nodes, 1);
    seen[0] = 1;
    for (uint32_t n = 0; n < nodes; ++n) {
        assert_true(seen[n]);
        assert_true(depth[n] <= FCT_SCENE_DEPTH);
        const fct_volume *v = volumes + n;
        if (v->instance != FCT_NONE) {
            assert_false(used[v->instance]++);
            assert_memory_equal(&v->bounds, bounds + v->instance, sizeof *bounds);
            ++leaves;
            continue;
        }
        for (int k = 0; k < 2; ++k) {
            assert_true(v->child[k] > n && v->child[k] < nodes);
            assert_false(seen[v->child[k]]++);
            depth[v->child[k]] = depth[n] + 1;
            assert_true(holds(&v->bounds, &volumes[v->child[k]].bounds));
        }
    }
    assert_int_equal(leaves, count);
    free(seen), free(used), free(depth);
}

static void volumes_hold_every_instance_once(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    static fct_bounds bounds[3000];
    static fct_volume volumes[6000];
    static const uint32_t counts[] = {1, 2, 3, 9, 500, 3000};
    for (int kind = 0; kind < 3; ++kind) /* scattered; all equal; each twice the one before */
        for (size_t k = 0; k < sizeof counts / sizeof *counts; ++k) {
            for (uint32_t i = 0; i < counts[k]; ++i)
                for (int c = 0; c < 3; ++c) {
                    double at = kind == 0 ? uniform() : kind == 1 ? 1 : ldexp(1, (int)(i % 200) - 100);
                    bounds[i].lower[c] = (float)at, bounds[i].upper[c] = (float)(at * 1.1);
                }
            assert_int_equal(fct_scene_build_volumes(&env, counts[k], bounds, volumes), FCT_OK);
            check_volumes(volumes, counts[k], bounds);
        }
}

/* Bounds against all transformed vertices, on transforms of every kind. */
static void bounds_are_exact(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_scene *scene = make_scene(&env, FCT_BACKEND_OBB);
    fct_scene_view view = fct_scene_get(scene);
    double lower[3], upper[3], low[3] = {INFINITY, INFINITY, INFINITY},
                               high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = 0; i < view.instance_count; ++i)
        for (uint32_t f = 0; f < face_count(&view, i); ++f)
            for (int k = 0; k < 3; ++k) {
                v3 p = corner(&view, i, f, k);
                const double x[3] = {p.x, p.y, p.z};
                for (int c = 0; c < 3; ++c) low[c] = fmin(low[c], x[c]), high[c] = fmax(high[c], x[c]);
            }
    fct_scene_bounds(scene, lower, upper);
    for (int c = 0; c < 3; ++c) {
        assert_true(fabs(lower[c] - low[c]) < 1e-12 && fabs(upper[c] - high[c]) < 1e-12);
        assert_true((double)view.bounds.lower[c] <= low[c] && (double)view.bounds.upper[c] >= high[c]);
    }
    fct_scene_destroy(scene);
}

/* A square at (4194304, 0, -2097152), placed by its vertices, by a transform, or by the mesh's own origin:
 * the scene gets an origin near it, and hits are exact there. */
static void far_scenes_have_an_origin(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    const double far[3] = {4194304, 0, -2097152};
    for (int way = 0; way < 3; ++way) {
        fct_scene *scene;
        fct_material material = {.name = "m", .reflectance = {.5f, .5f, .5f}};
        uint32_t id;
        assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
        assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
        fct_mesh mesh = make_grid(&env, 4); /* the unit square at z = 0 */
        float transform[12] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0};
        for (size_t k = 0; k < 3 * (size_t)mesh.vertex_count && way == 0; ++k)
            mesh.positions[k] += (float)(.5 * far[k % 3]);
        for (int c = 0; c < 3; ++c) {
            if (way == 1) transform[4 * c + 3] = (float)far[c];
            if (way == 2) mesh.origin[c] = .5 * far[c];
        }
        assert_int_equal(fct_scene_add_object(scene, "far", &mesh, NULL, transform, id, NULL), FCT_OK);
        fct_mesh_release(&env, &mesh);
        fct_camera camera = {
            .position = {4194306, 1, -2097142}, .target = {4194305, 1, -2097152}, .up = {0, 1, 0}};
        fct_scene_set_camera(scene, &camera);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_scene_view view = fct_scene_get(scene);
        double lower[3], upper[3];
        fct_scene_bounds(scene, lower, upper);
        fct_ray ray = {.direction = {0, 0, -1}, .t_max = INFINITY};
        for (int c = 0; c < 3; ++c) {
            assert_true(fabs(view.origin[c] - far[c]) <= 4);
            assert_true(lower[c] + view.origin[c] == far[c]);
            assert_true(upper[c] + view.origin[c] == far[c] + (c == 2 ? 0 : 2));
            assert_true(view.camera.position[c] + view.origin[c] == camera.position[c]);
            ray.origin[c] = (float)(far[c] + (c == 2 ? 1.0625 : .7001) - view.origin[c]);
        }
        fct_scene_hit hit;
        assert_true(fct_scene_closest_hit(scene, &ray, &hit, NULL));
        assert_true(hit.t == 1.0625f && hit.normal[2] == 1);
        v3 p = {0, 0, 0};
        for (int k = 0; k < 3; ++k) {
            const double weights[3] = {1 - (double)hit.u - hit.v, hit.u, hit.v};
            p = v3_mad(p, weights[k], corner(&view, hit.instance, hit.place, k));
        }
        assert_true(fabs(p.x - ray.origin[0]) < 1e-6 && fabs(p.y - ray.origin[1]) < 1e-6);
        fct_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_agree_with_brute_force),
        cmocka_unit_test(rays_in_the_plane_of_a_side_hit),
        cmocka_unit_test(what_has_no_area_is_refused),
        cmocka_unit_test(useless_rays_hit_nothing),
        cmocka_unit_test(closest_points_agree_with_brute_force),
        cmocka_unit_test(points_have_the_attributes_of_their_model),
        cmocka_unit_test(all_hits_are_sorted_and_complete),
        cmocka_unit_test(equal_hits_are_in_order),
        cmocka_unit_test(instances_say_what_their_transforms_do),
        cmocka_unit_test(volumes_hold_every_instance_once),
        cmocka_unit_test(bounds_are_exact),
        cmocka_unit_test(far_scenes_have_an_origin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
