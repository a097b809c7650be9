/* Shading normals: which corners are one vertex, what their normal is, and where their rays start. */
#include "../place.h"
#include "base/math/barycentric.h"
#include "radiosity/output/keep.h"
#include "radiosity/surface/refine.h"
#include "radiosity/surface/split.h"
#include "radiosity/surface/tessellate.h"
#include "scene/transform.h"

static fct_env plain; /* outlives every scene */
static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

static fct_scene *one_mesh(const fct_mesh *mesh, const float *transform) {
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    place_mesh(scene, mesh, place_material(scene, .5, 0, false), transform);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static fct_surface build(const fct_scene *scene, fct_normals rule, double crease, bool back, double edge) {
    const fct_shading shading = fct_shading_make(scene, 0, rule, crease, back);
    fct_surface s;
    assert_int_equal(fct_surface_build(&plain, &shading, edge, &s), FCT_OK);
    return s;
}

static v3 load(const float *values, size_t i) {
    return v3_load(values + 3 * i);
}

static void expect_near(v3 a, v3 b, double most) {
    if (!(v3_norm(v3_sub(a, b)) <= most))
        fail_msg("found %g %g %g, expected %g %g %g", a.x, a.y, a.z, b.x, b.y, b.z);
}

static v3 face_normal(const fct_mesh *m, size_t f) {
    const uint32_t *t = m->triangles + 3 * f;
    const v3 a = load(m->positions, t[0]);
    return v3_unit(v3_cross(v3_sub(load(m->positions, t[1]), a), v3_sub(load(m->positions, t[2]), a)));
}

/* The edges of a ball of four rings turn by more than 40 degrees. */
static void files_decide_creases(void **state) {
    (void)state;
    fct_mesh ball = make_smooth_ball(&plain, 4, false);
    fct_scene *scene = one_mesh(&ball, NULL);
    const double creases[] = {40, 90, 180};
    fct_surface s = build(scene, FCT_NORMALS_FILE, 40, false, 10);
    assert_int_equal(s.shading.rule, FCT_NORMALS_FILE);
    assert_int_equal(s.mesh.vertex_count, ball.vertex_count);
    for (size_t v = 0; v < s.mesh.vertex_count; ++v) {
        expect_near(load(s.normals, v), load(ball.positions, v), 1e-6);
        expect_near(load(s.sample_points, v), load(ball.positions, v), 1e-6); /* no vertex is on a rim */
        assert_true(s.flat[v] == 0 && s.offsets[v] > 0);
    }
    fct_surface_release(&plain, &s);
    for (int k = 0; k < 3; ++k) {
        s = build(scene, FCT_NORMALS_CREASE, creases[k], false, 10);
        assert_true((s.mesh.vertex_count > ball.vertex_count) == (k == 0));
        fct_surface_release(&plain, &s);
    }
    s = build(scene, FCT_NORMALS_FLAT, 40, false, 10);
    assert_int_equal(s.mesh.vertex_count, 3 * ball.face_count);
    for (size_t c = 0; c < 3 * (size_t)s.mesh.face_count; ++c) {
        expect_near(load(s.normals, s.mesh.triangles[c]), face_normal(&s.mesh, c / 3), 1e-6);
        assert_int_equal(s.flat[s.mesh.triangles[c]], 1);
    }
    fct_surface_release(&plain, &s);
    /* Parts of a divided face share their vertices. */
    s = build(scene, FCT_NORMALS_FLAT, 40, false, .3);
    assert_true(s.mesh.face_count > 4 * ball.face_count && s.mesh.vertex_count < 2 * s.mesh.face_count);
    for (size_t c = 0; c < 3 * (size_t)s.mesh.face_count; ++c)
        expect_near(load(s.normals, s.mesh.triangles[c]), face_normal(&s.mesh, c / 3), 1e-5);
    fct_surface_release(&plain, &s);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &ball);
}

/* Two unit squares at an edge that turns by `degrees`. split: each has its own vertices. The normals are
 * those of the squares, or one for both. */
static fct_mesh make_hinge(double degrees, bool split, bool shared) {
    static const uint32_t faces[12] = {0, 1, 2, 0, 2, 3, 5, 4, 6, 5, 6, 7};
    const double a = degrees * FCT_PI / 180;
    const v3 points[8] = {{-1, 0, 0},           {0, 0, 0},           {0, 1, 0},
                          {-1, 1, 0},           {0, 0, 0},           {0, 1, 0},
                          {cos(a), 0, -sin(a)}, {cos(a), 1, -sin(a)}};
    static const uint32_t welded[8] = {0, 1, 2, 3, 1, 2, 4, 5};
    fct_mesh mesh;
    plain = fct_env_default();
    assert_int_equal(fct_mesh_create(&plain, split ? 8 : 6, 4, FCT_MESH_NORMALS, &mesh), FCT_OK);
    for (int k = 0; k < 8; ++k) {
        const size_t v = split ? (size_t)k : welded[k];
        const double turn = shared ? a / 2 : k < 4 ? 0 : a;
        v3_store(mesh.positions + 3 * v, points[k]);
        v3_store(mesh.normals + 3 * v, v3_make(sin(turn), 0, cos(turn)));
    }
    for (int c = 0; c < 12; ++c) {
        uint32_t k = faces[c];
        if (c >= 6) k = (const uint32_t[]){4, 6, 5, 5, 6, 7}[c - 6];
        mesh.triangles[c] = split ? k : welded[k];
    }
    return mesh;
}

/* The normals of the corners at the origin: their least cosine. */
static double find_spread(const fct_surface *s) {
    double least = 1;
    v3 first = {0, 0, 0};
    for (size_t c = 0; c < 3 * (size_t)s->mesh.face_count; ++c) {
        const size_t v = s->mesh.triangles[c];
        if (v3_norm2(load(s->mesh.positions, v)) > 0) continue;
        if (v3_norm2(first) == 0) first = load(s->normals, v);
        least = fmin(least, v3_dot(first, load(s->normals, v)));
    }
    return least;
}

/* A file that splits the vertices of an edge means a crease, one that shares them a smooth edge. */
static void split_normals_are_creases(void **state) {
    (void)state;
    const struct {
        double degrees;
        bool split, shared;
        double file, crease; /* the turn in degrees that is expected */
    } cases[] = {{20, true, false, 20, 0}, {20, true, true, 0, 0},  {70, true, true, 0, 70},
                 {70, false, true, 0, 70}, {.5, true, false, 0, 0}, {1.5, true, false, 1.5, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        fct_mesh hinge = make_hinge(cases[i].degrees, cases[i].split, cases[i].shared);
        fct_scene *scene = one_mesh(&hinge, NULL);
        for (int rule = 0; rule < 2; ++rule) {
            const double turn = rule ? cases[i].crease : cases[i].file;
            fct_surface s = build(scene, rule ? FCT_NORMALS_CREASE : FCT_NORMALS_FILE, 40, false, 10);
            assert_true(fabs(find_spread(&s) - cos(turn * FCT_PI / 180)) < 1e-6);
            fct_surface_release(&plain, &s);
        }
        fct_scene_destroy(scene);
        fct_mesh_release(&plain, &hinge);
    }
}

/* A vertex of two faces without a common edge is one vertex in the file, and stays one. */
static void shared_vertices_stay_one(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&plain, 5, 2, FCT_MESH_NORMALS, &mesh), FCT_OK);
    const float positions[15] = {0, 0, 0, 1, 0, 0, 1, 1, 0, -1, 0, 0, -1, -1, 0};
    const uint32_t triangles[6] = {0, 1, 2, 0, 3, 4};
    memcpy(mesh.positions, positions, sizeof positions);
    memcpy(mesh.triangles, triangles, sizeof triangles);
    for (int v = 0; v < 5; ++v) v3_store(mesh.normals + 3 * (size_t)v, v3_make(0, 0, 2));
    fct_scene *scene = one_mesh(&mesh, NULL);
    for (int rule = 0; rule < 2; ++rule) {
        fct_surface s = build(scene, rule ? FCT_NORMALS_CREASE : FCT_NORMALS_FILE, 40, false, 10);
        assert_int_equal(s.mesh.vertex_count, rule ? 6 : 5);
        fct_surface_release(&plain, &s);
    }
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &mesh);
}

/* A shared vertex with a normal per corner: the normals of the corners decide, in mirrored instances too. */
static void corners_have_normals(void **state) {
    (void)state;
    const float mirror[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (int k = 0; k < 4; ++k) {
        fct_mesh hinge = make_hinge(20, false, true);
        const bool bent = k & 1;
        hinge.corner_normals = fct_allocate(&plain, hinge.face_count, 9 * sizeof(float));
        assert_non_null(hinge.corner_normals);
        for (size_t c = 0; c < 12; ++c) {
            const double turn = (!bent ? 10 : c < 6 ? 5 : 15) * FCT_PI / 180;
            v3_store(hinge.corner_normals + 3 * c, v3_make(sin(turn), c % 3 * .01, cos(turn)));
        }
        fct_release(&plain, hinge.normals);
        hinge.normals = NULL;
        fct_scene *scene = one_mesh(&hinge, k & 2 ? mirror : NULL);
        fct_surface s = build(scene, FCT_NORMALS_FILE, 40, false, 10);
        assert_int_equal(s.shading.rule, FCT_NORMALS_FILE);
        const double least = find_spread(&s);
        assert_true(bent ? fabs(least - cos(10 * FCT_PI / 180)) < 1e-3 : least > 1 - 1e-6);
        for (size_t c = 0; c < 12 && bent; ++c) {
            const size_t corner = c - c % 3 + (k & 2 && c % 3 ? 3 - c % 3 : c % 3);
            const v3 n = v3_unit(load(hinge.corner_normals, corner));
            expect_near(load(s.normals, s.mesh.triangles[c]), v3_make(k & 2 ? -n.x : n.x, n.y, n.z), .02);
        }
        fct_surface_release(&plain, &s);
        fct_scene_destroy(scene);
        fct_mesh_release(&plain, &hinge);
    }
}

/* The unit cube around the origin with a normal per corner. */
static void smooth_cubes_have_eight_vertices(void **state) {
    (void)state;
    static const uint32_t faces[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    plain = fct_env_default();
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&plain, 8, 12, FCT_MESH_NORMALS, &mesh), FCT_OK);
    for (int i = 0; i < 24; ++i) mesh.normals[i] = mesh.positions[i] = (float)(i / 3 >> i % 3 & 1) - .5f;
    memcpy(mesh.triangles, faces, sizeof faces);
    fct_scene *scene = one_mesh(&mesh, NULL);
    fct_surface s = build(scene, FCT_NORMALS_FILE, 40, false, 10);
    assert_int_equal(s.mesh.vertex_count, 8);
    for (size_t v = 0; v < 8; ++v) expect_near(load(s.normals, v), v3_unit(load(mesh.positions, v)), 1e-6);
    fct_surface_release(&plain, &s);
    s = build(scene, FCT_NORMALS_CREASE, 89.9, false, 10);
    assert_int_equal(s.mesh.vertex_count, 24);
    fct_surface_release(&plain, &s);
    s = build(scene, FCT_NORMALS_CREASE, 90, false, 10);
    assert_int_equal(s.mesh.vertex_count, 8);
    fct_surface_release(&plain, &s);
    /* Normals at more than 45 degrees lift no point. */
    s = build(scene, FCT_NORMALS_FILE, 40, false, .3);
    for (size_t f = 0; f < s.mesh.face_count; ++f)
        for (size_t k = 0; k < 3; ++k) {
            const v3 p = load(s.sample_points, s.mesh.triangles[3 * f + k]);
            assert_true(fabs(fmax(fmax(fabs(p.x), fabs(p.y)), fabs(p.z)) - .5) < 1e-6);
        }
    fct_surface_release(&plain, &s);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &mesh);
}

/* Under a scale of 1, 2 and 1/2 the ball becomes an ellipsoid with the normals p_i / s_i^2. */
static void transforms_turn_normals(void **state) {
    (void)state;
    const double c = cos(.7), d = sin(.7);
    for (int mirrored = 0; mirrored < 2; ++mirrored) {
        const double scale[3] = {mirrored ? -1 : 1, 2, .5};
        /* Scale, then a turn about z. */
        const float m[12] = {(float)(c * scale[0]),
                             (float)(-d * scale[1]),
                             0,
                             3,
                             (float)(d * scale[0]),
                             (float)(c * scale[1]),
                             0,
                             1,
                             0,
                             0,
                             (float)scale[2],
                             -2};
        fct_mesh ball = make_smooth_ball(&plain, 12, false);
        fct_scene *scene = one_mesh(&ball, m);
        fct_surface s = build(scene, FCT_NORMALS_FILE, 40, false, 10);
        assert_int_equal(s.mesh.vertex_count, ball.vertex_count);
        for (size_t v = 0; v < ball.vertex_count; ++v) {
            const v3 p = load(ball.positions, v);
            const v3 n = v3_unit(v3_make(p.x / scale[0], p.y / scale[1], p.z / scale[2]));
            expect_near(load(s.normals, v), v3_make(c * n.x - d * n.y, d * n.x + c * n.y, n.z), 1e-5);
        }
        fct_surface_release(&plain, &s);
        fct_scene_destroy(scene);
        fct_mesh_release(&plain, &ball);
    }
}

/* What a corner of a surface lies on: the triangle of the mesh, its weights, normal and lifted place. */
static void find_source(const fct_mesh *mesh, const fct_surface *s, size_t corner, double side, v3 *normal,
                        v3 *lifted) {
    const uint32_t *t = mesh->triangles + 3 * (size_t)s->mesh.source_faces[corner / 3];
    const float *uv = s->mesh.source_uv + 2 * corner;
    const double w[3] = {1 - (double)uv[0] - (double)uv[1], uv[0], uv[1]};
    v3 p = {0, 0, 0}, n = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
        p = v3_mad(p, w[k], load(mesh->positions, t[k]));
        n = v3_mad(n, w[k], load(mesh->normals, t[k]));
    }
    *normal = v3_unit(n), *lifted = p;
    for (int k = 0; k < 3; ++k) {
        const v3 m = v3_scale(load(mesh->normals, t[k]), side);
        const double height = v3_dot(v3_sub(p, load(mesh->positions, t[k])), m);
        *lifted = v3_sub(*lifted, v3_scale(m, w[k] * fmin(0, height)));
    }
}

static double cut_long(void *user, uint32_t a, uint32_t b) {
    const fct_mesh *m = user;
    return v3_norm(v3_sub(load(m->positions, a), load(m->positions, b))) > .12 ? .3 : 0;
}

static void expect_phong(const fct_mesh *mesh, const fct_surface *s, bool back) {
    size_t lifted = 0;
    for (size_t c = 0; c < 3 * (size_t)s->mesh.face_count; ++c) {
        const size_t v = s->mesh.triangles[c];
        v3 n, p;
        find_source(mesh, s, c, back ? -1 : 1, &n, &p);
        expect_near(load(s->normals, v), n, 2e-6);
        expect_near(load(s->sample_points, v), p, 2e-6);
        lifted += v3_norm(v3_sub(p, load(s->mesh.positions, v))) > 1e-3;
    }
    assert_true(lifted > 0);
}

/* New vertices have the normals of the source triangle between its corners, on the curved surface. */
static void new_vertices_interpolate(void **state) {
    (void)state;
    for (int hollow = 0; hollow < 2; ++hollow) {
        fct_mesh ball = make_smooth_ball(&plain, 6, hollow);
        fct_scene *scene = one_mesh(&ball, NULL);
        const bool back = hollow; /* the side on which the ball bulges */
        fct_surface s = build(scene, FCT_NORMALS_FILE, 40, back, .3);
        assert_true(s.mesh.vertex_count > 2 * ball.vertex_count);
        expect_phong(&ball, &s, back);
        uint32_t added;
        assert_int_equal(fct_surface_refine(&plain, &s, cut_long, &s.mesh, &added), FCT_OK);
        assert_true(added > 100 && s.shading.rule == FCT_NORMALS_FILE);
        expect_phong(&ball, &s, back);
        fct_surface_release(&plain, &s);
        /* The hollow side lifts nothing. */
        s = build(scene, FCT_NORMALS_FILE, 40, !back, .3);
        for (size_t v = 0; v < s.mesh.vertex_count; ++v)
            expect_near(load(s.sample_points, v), load(s.mesh.positions, v), 2e-6);
        fct_surface_release(&plain, &s);
        fct_scene_destroy(scene);
        fct_mesh_release(&plain, &ball);
    }
}

static void centres_interpolate(void **state) {
    (void)state;
    fct_mesh ball = make_smooth_ball(&plain, 6, false);
    fct_scene *scene = one_mesh(&ball, NULL);
    fct_surface s = build(scene, FCT_NORMALS_FILE, 40, false, INFINITY);
    const uint32_t first = s.mesh.vertex_count;
    assert_int_equal(fct_keep_centres(&plain, &s), FCT_OK);
    for (size_t f = 0; f < s.mesh.face_count; ++f) {
        const uint32_t *t = ball.triangles + 3 * f;
        v3 p = {0, 0, 0}, n = {0, 0, 0}, lifted;
        for (int k = 0; k < 3; ++k) {
            p = v3_mad(p, 1. / 3, load(ball.positions, t[k]));
            n = v3_add(n, load(ball.normals, t[k]));
        }
        lifted = p;
        for (int k = 0; k < 3; ++k) {
            const v3 m = load(ball.normals, t[k]);
            lifted = v3_sub(lifted, v3_scale(m, v3_dot(v3_sub(p, load(ball.positions, t[k])), m) / 3));
        }
        expect_near(load(s.normals, first + f), v3_unit(n), 1e-5);
        expect_near(load(s.sample_points, first + f), lifted, 1e-5);
        assert_int_equal(s.flat[first + f], v3_dot(v3_unit(n), face_normal(&ball, f)) > 1 - 1e-5);
    }
    fct_surface_release(&plain, &s);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &ball);
}

/* A shell just above the ball lies between a point and its lifted place. */
static void lifts_stop_at_surfaces(void **state) {
    (void)state;
    fct_mesh ball = make_smooth_ball(&plain, 6, false);
    for (int near = 0; near < 2; ++near) {
        fct_scene *scene;
        const float scale = near ? 1.001f : 1.2f;
        const float around[12] = {scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0};
        plain = fct_env_default();
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        const uint32_t grey = place_material(scene, .5, 0, false);
        place_mesh(scene, &ball, grey, NULL);
        place_mesh(scene, &ball, grey, around);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        const fct_shading shading = fct_shading_make(scene, 0, FCT_NORMALS_FILE, 40, false);
        for (uint32_t place = 0; place < ball.face_count; ++place) {
            fct_shaded_face face;
            fct_shading_face(&shading, place, &face);
            v3 p = v3_add(v3_add(face.positions[0], face.positions[1]), face.positions[2]);
            p = v3_scale(p, 1. / 3);
            const double moved = v3_norm(v3_sub(fct_shading_lift(&shading, place, p), p));
            assert_true(near ? moved == 0 : moved > .01);
        }
        fct_scene_destroy(scene);
    }
    fct_mesh_release(&plain, &ball);
}

/* Normals that are zero or turn away count, and the geometry replaces them. */
static void bad_normals_fall_back(void **state) {
    (void)state;
    fct_mesh ball = make_smooth_ball(&plain, 8, false);
    const uint32_t zero = 20, turned = 50;
    uint64_t expected = 0, corners = 0;
    for (size_t k = 0; k < 3; ++k) ball.normals[3 * zero + k] = 0, ball.normals[3 * turned + k] *= -1;
    for (size_t c = 0; c < 3 * (size_t)ball.face_count; ++c)
        expected += ball.triangles[c] == zero || ball.triangles[c] == turned;
    fct_scene *scene = one_mesh(&ball, NULL);
    const fct_shading shading = fct_shading_make(scene, 0, FCT_NORMALS_FILE, 40, false);
    assert_true(expected == 12 && fct_shading_count_unusable(&shading, &corners) == expected);
    assert_int_equal(corners, 3 * ball.face_count);
    fct_surface s = build(scene, FCT_NORMALS_FILE, 40, false, 10);
    fct_surface plain_s = build(scene, FCT_NORMALS_CREASE, 40, false, 10);
    assert_int_equal(s.mesh.vertex_count, ball.vertex_count);
    for (size_t v = 0; v < s.mesh.vertex_count; ++v) {
        const bool bad = v == zero || v == turned;
        expect_near(load(s.normals, v), bad ? load(plain_s.normals, v) : load(ball.positions, v), 1e-6);
    }
    fct_surface_release(&plain, &s);
    fct_surface_release(&plain, &plain_s);
    fct_scene_destroy(scene);
    /* A mesh of zeros alone has no normals. */
    memset(ball.normals, 0, 3 * (size_t)ball.vertex_count * sizeof(float));
    scene = one_mesh(&ball, NULL);
    assert_null(fct_scene_get(scene).models[0].normals);
    const fct_shading bare = fct_shading_make(scene, 0, FCT_NORMALS_FILE, 180, false);
    assert_int_equal(bare.rule, FCT_NORMALS_CREASE);
    assert_true(fabs(bare.crease_cosine - cos(40 * FCT_PI / 180)) < 1e-5);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &ball);
}

/* 88 degrees from the face is the limit, and a degree apart is the same. */
static void limits(void **state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        const double a = (k ? 88.2 : 87.8) * FCT_PI / 180;
        fct_mesh hinge = make_hinge(0, false, false);
        for (size_t v = 0; v < 6; ++v) v3_store(hinge.normals + 3 * v, v3_make(0, sin(a), cos(a)));
        fct_scene *scene = one_mesh(&hinge, identity);
        const fct_shading shading = fct_shading_make(scene, 0, FCT_NORMALS_FILE, 40, false);
        uint64_t corners;
        assert_int_equal(fct_shading_count_unusable(&shading, &corners), k ? 12 : 0);
        fct_surface s = build(scene, FCT_NORMALS_FILE, 40, false, 10);
        expect_near(load(s.normals, 0), k ? v3_make(0, 0, 1) : v3_make(0, sin(a), cos(a)), 1e-6);
        fct_surface_release(&plain, &s);
        fct_scene_destroy(scene);
        fct_mesh_release(&plain, &hinge);
    }
    const v3 up = {0, 0, 1};
    assert_true(fct_shading_same(up, v3_make(0, sin(.016), cos(.016))));
    assert_false(fct_shading_same(up, v3_make(0, sin(.019), cos(.019))));
}

int main(void) {
    plain = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(files_decide_creases),
        cmocka_unit_test(split_normals_are_creases),
        cmocka_unit_test(shared_vertices_stay_one),
        cmocka_unit_test(corners_have_normals),
        cmocka_unit_test(smooth_cubes_have_eight_vertices),
        cmocka_unit_test(transforms_turn_normals),
        cmocka_unit_test(new_vertices_interpolate),
        cmocka_unit_test(centres_interpolate),
        cmocka_unit_test(lifts_stop_at_surfaces),
        cmocka_unit_test(bad_normals_fall_back),
        cmocka_unit_test(limits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
