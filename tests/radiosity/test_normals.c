/* Bakes with shading normals: the light follows them, and the output has them. */
#include "place.h"

#include <unistd.h>

#include "facetree/radiosity.h"
#include "radiosity/output/probe.h"
#include "scene/transform.h"

static fct_env plain; /* outlives every scene */
static char folder[] = "/tmp/facetree-normals-XXXXXX";

static fct_scene *begin(void) {
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    return scene;
}

static fct_bake *start(const fct_scene *scene, fct_bake_def def) {
    fct_bake *bake;
    assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
    return bake;
}

static v3 load(const float *values, size_t i) {
    return v3_load(values + 3 * i);
}

/* ---- Light ---- */

#define FAR 300.

/* A coarse ball without any other surface under a small far lamp. */
static fct_scene *make_lit_ball(const float *transform) {
    fct_mesh ball = make_smooth_ball(&plain, 6, false);
    fct_scene *scene = begin();
    place_mesh(scene, &ball, place_material(scene, .5, 0, false), transform);
    place_sheet(&plain, scene, place_material(scene, 0, 1e5, false), 1, v3_make(-1, -1, FAR),
                v3_make(0, 2, 0), v3_make(2, 0, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_mesh_release(&plain, &ball);
    return scene;
}

/* The irradiance of the lamp at a point with a normal: e A cos cos' / (pi r^2). */
static double find_irradiance(v3 p, v3 n) {
    const v3 way = v3_sub(v3_make(0, 0, FAR), p);
    const double r2 = v3_norm2(way), cosine = v3_dot(n, way) / sqrt(r2);
    return cosine <= 0 ? 0 : 1e5 * 4 * cosine * (way.z / sqrt(r2)) / (FCT_PI * r2);
}

/* At every vertex the light follows the normal of the file, up to the horizon: no triangle hides the lamp
 * from itself, and none lets it through. */
static void light_follows_the_file(void **state) {
    (void)state;
    const float turned[12] = {0, 0, 1, 0, -1, 0, 0, 0, 0, 1, 0, 0}; /* mirrored */
    for (int k = 0; k < 4; ++k) {
        fct_scene *scene = make_lit_ball(k & 1 ? turned : NULL);
        fct_bake_def def = fct_bake_def_default();
        def.outputs = FCT_MESH_IRRADIANCE | FCT_MESH_NORMALS;
        def.max_edge = .2, def.error = 1e-3;
        def.method = k & 2 ? FCT_BAKE_REFERENCE : FCT_BAKE_FACE, def.samples = 64;
        fct_bake *bake = start(scene, def);
        fct_mesh m;
        assert_int_equal(fct_bake_instance(bake, 0, &m), FCT_OK);
        assert_true(m.normals && m.vertex_count > 300);
        size_t lit = 0, dark = 0;
        for (size_t v = 0; v < m.vertex_count; ++v) {
            const v3 p = load(m.positions, v), n = load(m.normals, v);
            const double expected = find_irradiance(p, n),
                         most = find_irradiance(v3_make(0, 0, 1), v3_make(0, 0, 1));
            const double found = (double)m.irradiance[3 * v + 1];
            assert_true(v3_dot(n, v3_unit(p)) > .98); /* on curved ground, as the file says */
            lit += expected > .1 * most, dark += expected == 0;
            if (expected > .1 * most && !(fabs(found / expected - 1) < .005))
                fail_msg("irradiance %g, expected %g, at normal %g %g %g", found, expected, n.x, n.y, n.z);
            if (v3_dot(n, v3_make(0, 0, 1)) < -.01) assert_true(found == 0);
        }
        assert_true(lit > 100 && dark > 100);
        fct_bake_error error = fct_bake_get_error(bake, 0);
        if (!(k & 2)) assert_true(error.error < .006); /* between the vertices, too */
        fct_mesh_release(&plain, &m);
        fct_bake_destroy(bake);
        fct_scene_destroy(scene);
    }
}

/* With the mean of the faces the same ball has visibly other light. */
static void creases_have_other_light(void **state) {
    (void)state;
    fct_scene *scene = make_lit_ball(NULL);
    for (int rule = FCT_NORMALS_CREASE; rule <= FCT_NORMALS_FLAT; ++rule) {
        fct_bake_def def = fct_bake_def_default();
        def.outputs = FCT_MESH_IRRADIANCE | FCT_MESH_NORMALS;
        def.max_edge = .2, def.error = 1e-3, def.normals = (fct_normals)rule;
        fct_bake *bake = start(scene, def);
        fct_mesh m;
        assert_int_equal(fct_bake_instance(bake, 0, &m), FCT_OK);
        assert_int_equal(fct_bake_get_normals(bake, 0), rule);
        size_t other = 0;
        for (size_t v = 0; v < m.vertex_count; ++v) {
            const v3 p = load(m.positions, v), n = load(m.normals, v);
            const double found = (double)m.irradiance[3 * v + 1], own = find_irradiance(p, n);
            if (own > 1) assert_true(found < 1.01 * own);
            other += fabs(found - find_irradiance(p, v3_unit(p))) > .05 * own;
        }
        assert_true(other > m.vertex_count / 5);
        fct_mesh_release(&plain, &m);
        fct_bake_destroy(bake);
    }
    fct_scene_destroy(scene);
}

/* Inside a closed sphere that shines evenly, any normal gets the light e / (1 - rho). */
static void furnaces_are_even(void **state) {
    (void)state;
    fct_mesh ball = make_smooth_ball(&plain, 8, true);
    fct_scene *scene = begin();
    place_mesh(scene, &ball, place_material(scene, .5, 1, false), NULL);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_bake_def def = fct_bake_def_default();
    def.outputs = FCT_MESH_IRRADIANCE, def.max_edge = .3;
    fct_bake *bake = start(scene, def);
    fct_mesh m;
    assert_int_equal(fct_bake_instance(bake, 0, &m), FCT_OK);
    assert_true(m.vertex_count > 2 * ball.vertex_count);
    double sum = 0;
    for (size_t i = 0; i < 3 * (size_t)m.vertex_count; ++i) {
        assert_true(fabs((double)m.irradiance[i] - 2) < .03 * 2); /* the noise of the solution */
        sum += (double)m.irradiance[i];
    }
    assert_true(fabs(sum / (3. * m.vertex_count) - 2) < .005 * 2);
    fct_mesh_release(&plain, &m);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &ball);
}

/* A probe takes its own normal, and its rays start on the curved surface: a lamp above the horizon of the
 * normal and below that of the triangle is seen. */
static void probes_start_on_the_curve(void **state) {
    (void)state;
    const float c20 = .9396926f, s20 = .3420201f;
    const float tilted[12] = {1, 0, 0, 0, 0, c20, -s20, 0, 0, s20, c20, 0};
    fct_scene *scene = make_lit_ball(tilted);
    const fct_scene_view view = fct_scene_get(scene);
    const fct_tree_view t = fct_tree_get(view.models[0].tree);
    int hidden = 0;
    for (int method = 0; method < 2; ++method) {
        fct_bake_def def = fct_bake_def_default();
        def.method = method ? FCT_BAKE_REFERENCE : FCT_BAKE_FACE, def.samples = 256, def.error = 1e-3;
        fct_bake *bake = start(scene, def);
        for (uint32_t place = 0; place < t.face_count; ++place) {
            v3 p = {0, 0, 0}, c[3];
            const double w[3] = {.6, .3, .1};
            for (size_t k = 0; k < 3; ++k)
                c[k] = fct_transform_point(tilted, load(t.positions, t.triangles[3 * place + k]));
            for (int k = 0; k < 3; ++k) p = v3_mad(p, w[k], c[k]);
            const v3 n = v3_unit(p), face = v3_unit(v3_cross(v3_sub(c[1], c[0]), v3_sub(c[2], c[0])));
            if (n.z < .05) continue;
            float point[3], normal[3];
            fct_probe probe;
            v3_store(point, p), v3_store(normal, n);
            assert_int_equal(fct_bake_probe(bake, 1, point, normal, &probe), FCT_OK);
            const double expected = find_irradiance(p, n);
            assert_true(fabs((double)probe.irradiance[1] / expected - 1) < .01);
            hidden += face.z < 0;
        }
        fct_bake_destroy(bake);
    }
    assert_true(hidden > 0);
    fct_scene_destroy(scene);
}

/* ---- Outputs ---- */

/* Two balls, one under a mirrored and stretched transform, a cube without normals, and a lamp. */
static fct_scene *make_objects(void) {
    const float stretched[12] = {-1, 0, 0, 4, 0, 2, 0, 0, 0, 0, .5f, 0};
    const float aside[12] = {1, 0, 0, 0, 0, 1, 0, 4, 0, 0, 1, 0};
    fct_mesh ball = make_smooth_ball(&plain, 5, false);
    fct_scene *scene = begin();
    const uint32_t grey = place_material(scene, .5, 0, false);
    place_mesh(scene, &ball, grey, NULL);
    place_mesh(scene, &ball, grey, stretched);
    fct_mesh_release(&plain, &ball);
    ball = make_sphere(&plain, 5);
    place_mesh(scene, &ball, grey, aside);
    fct_mesh_release(&plain, &ball);
    place_sheet(&plain, scene, place_material(scene, 0, 100, false), 1, v3_make(0, 0, 6), v3_make(0, 2, 0),
                v3_make(2, 0, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

/* The normal of the ellipsoid of the second ball, or of the first one. */
static v3 find_normal(uint32_t object, v3 p) {
    if (object == 0) return v3_unit(p);
    return v3_unit(v3_make(p.x - 4, p.y / 4, p.z * 4));
}

static fct_bake_def quick(fct_keep keep, unsigned outputs) {
    fct_bake_def def = fct_bake_def_default();
    def.final = FCT_FINAL_NONE, def.error = 1e-2, def.keep = keep, def.outputs = outputs;
    return def;
}

static void outputs_have_normals(void **state) {
    (void)state;
    fct_scene *scene = make_objects();
    fct_mesh ball = make_smooth_ball(&plain, 5, false);
    for (int keep = FCT_KEEP_NONE; keep <= FCT_KEEP_FACE; ++keep) {
        fct_bake *bake = start(scene, quick((fct_keep)keep, FCT_MESH_NORMALS));
        for (uint32_t object = 0; object < 2; ++object) {
            fct_mesh m;
            assert_int_equal(fct_bake_object(bake, object, &m), FCT_OK);
            assert_non_null(m.normals);
            if (keep != FCT_KEEP_NONE) assert_int_equal(m.vertex_count, ball.vertex_count);
            for (size_t v = 0; v < ball.vertex_count; ++v) {
                const v3 n = find_normal(object, load(m.positions, v));
                assert_true(v3_norm(v3_sub(load(m.normals, v), n)) < 1e-5);
            }
            fct_mesh_release(&plain, &m);
            assert_int_equal(fct_bake_get_normals(bake, object), FCT_NORMALS_FILE);
        }
        assert_int_equal(fct_bake_get_normals(bake, 2), FCT_NORMALS_CREASE);
        const fct_bake_stats stats = fct_bake_get_stats(bake);
        assert_true(stats.normals_unusable == 0 && stats.normals_given == 6 * (uint64_t)ball.face_count);
        fct_mesh all;
        assert_int_equal(fct_bake_mesh(bake, &all, NULL), FCT_OK);
        assert_non_null(all.normals);
        fct_mesh_release(&plain, &all);
        fct_bake_destroy(bake);
        bake = start(scene, quick((fct_keep)keep, 0)); /* not without request */
        assert_int_equal(fct_bake_mesh(bake, &all, NULL), FCT_OK);
        assert_null(all.normals);
        fct_mesh_release(&plain, &all);
        assert_int_equal(fct_bake_object(bake, 0, &all), FCT_OK);
        assert_null(all.normals);
        fct_mesh_release(&plain, &all);
        assert_int_equal(fct_bake_instance(bake, 0, &all), FCT_OK);
        assert_null(all.normals);
        fct_mesh_release(&plain, &all);
        fct_bake_destroy(bake);
    }
    fct_mesh_release(&plain, &ball);
    fct_scene_destroy(scene);
}

/* A two-sided sheet: the normals of each side point to it. */
static void both_sides_have_normals(void **state) {
    (void)state;
    for (int method = 0; method < 2; ++method)
        for (int keep = 0; keep < 2; ++keep) {
            fct_scene *scene = begin();
            place_sheet(&plain, scene, place_material(scene, .5, 0, true), 1, v3_make(0, 0, 0),
                        v3_make(1, 0, 0), v3_make(0, 1, 0));
            for (int k = 0; k < 2; ++k) /* the lower lamp is brighter */
                place_sheet(&plain, scene, place_material(scene, 0, k ? 20 : 10, false), 1,
                            v3_make(0, 0, k ? -1 : 1), k ? v3_make(1, 0, 0) : v3_make(0, 1, 0),
                            k ? v3_make(0, 1, 0) : v3_make(1, 0, 0));
            assert_int_equal(fct_scene_commit(scene), FCT_OK);
            fct_bake_def def = quick(keep ? FCT_KEEP_CORNER : FCT_KEEP_NONE, FCT_MESH_NORMALS);
            def.method = method ? FCT_BAKE_REFERENCE : FCT_BAKE_FACE, def.samples = 64, def.max_edge = 1;
            fct_bake *bake = start(scene, def);
            fct_mesh m;
            assert_int_equal(fct_bake_instance(bake, 0, &m), FCT_OK);
            for (size_t f = 0; f < m.face_count; ++f) {
                const double side = keep ? 1 : f < m.face_count / 2 ? -1 : 1;
                for (size_t k = 0; k < 3; ++k)
                    assert_true(m.normals[3 * (size_t)m.triangles[3 * f + k] + 2] == (float)side);
            }
            fct_mesh_release(&plain, &m);
            fct_bake_destroy(bake);
            fct_scene_destroy(scene);
        }
}

/* The normals of a .glb, in the world again, are those of the light. */
static void documents_have_normals(void **state) {
    (void)state;
    fct_scene *scene = make_objects();
    char path[128];
    snprintf(path, sizeof path, "%s/lit.glb", folder);
    for (int keep = FCT_KEEP_NONE; keep <= FCT_KEEP_FACE; ++keep) {
        fct_bake *bake = start(scene, quick((fct_keep)keep, 0));
        fct_mesh m, merged;
        assert_int_equal(fct_bake_save_scene(bake, path, NULL, NULL, &merged), FCT_OK);
        assert_null(merged.normals);
        fct_mesh_release(&plain, &merged);
        assert_int_equal(fct_mesh_load(&plain, path, &m), FCT_OK);
        assert_non_null(m.normals);
        size_t found[2] = {0, 0};
        for (size_t f = 0; f < m.face_count; ++f)
            for (size_t k = 0; k < 3; ++k) {
                const size_t v = m.triangles[3 * f + k];
                const v3 p = load(m.positions, v);
                const uint32_t object = p.x > 2;
                if (p.y > 2.5 || p.z > 3) continue; /* the others */
                if (fabs(v3_norm(object ? v3_make(p.x - 4, p.y / 2, p.z * 2) : p) - 1) > 1e-6) continue;
                assert_true(v3_norm(v3_sub(load(m.normals, v), find_normal(object, p))) < 1e-5);
                ++found[object];
            }
        assert_true(found[0] > 200 && found[1] > 200);
        fct_mesh_release(&plain, &m);
        fct_bake_destroy(bake);
    }
    remove(path);
    fct_scene_destroy(scene);
}

/* ---- Files ---- */

/* A room: a cube of quads around the origin with a normal per side. inward: wound to the inside, as the
 * normals are; one corner has none. */
static void write_cube(const char *path, bool inward) {
    static const int sides[6][4] = {{1, 3, 7, 5}, {2, 6, 8, 4}, {1, 5, 6, 2},
                                    {3, 4, 8, 7}, {1, 2, 4, 3}, {5, 7, 8, 6}};
    static const int normals[6][3] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    for (int v = 0; v < 8; ++v) fprintf(file, "v %d %d %d\n", v & 1, v >> 1 & 1, v >> 2);
    for (int s = 0; s < 6; ++s) {
        const int sign = inward ? -1 : 1;
        fprintf(file, "vn %d %d %d\nf", sign * normals[s][0], sign * normals[s][1], sign * normals[s][2]);
        for (int k = 0; k < 4; ++k) {
            const int v = sides[s][inward ? k : 3 - k];
            if (s == 0 && k == 0)
                fprintf(file, " %d", v);
            else
                fprintf(file, " %d//%d", v, s + 1);
        }
        fprintf(file, "\n");
    }
    fclose(file);
}

static void objs_have_normals_of_corners(void **state) {
    (void)state;
    char path[128];
    snprintf(path, sizeof path, "%s/cube.obj", folder);
    for (int k = 0; k < 3; ++k) { /* outward, inward, turned outward */
        const bool inward = k > 0;
        write_cube(path, inward);
        fct_scene *scene;
        plain = fct_env_default();
        plain.flip_inward = k == 2;
        assert_int_equal(fct_scene_load(&plain, path, FCT_BACKEND_OBB, &scene), FCT_OK);
        const fct_model *model = fct_scene_get(scene).models;
        const fct_tree_view t = fct_tree_get(model->tree);
        assert_true(!model->normals && model->corner_normals && t.face_count == 12);
        int zeros = 0;
        for (size_t place = 0; place < 12; ++place) {
            v3 c[3];
            for (size_t i = 0; i < 3; ++i) c[i] = load(t.positions, t.triangles[3 * place + i]);
            const v3 n = v3_unit(v3_cross(v3_sub(c[1], c[0]), v3_sub(c[2], c[0])));
            const v3 out = v3_sub(c[0], v3_make(.5, .5, .5));
            assert_true((v3_dot(n, out) > 0) == (k != 1));
            for (size_t i = 0; i < 3; ++i) {
                const v3 own = load(model->corner_normals, 3 * place + i);
                zeros += v3_norm2(own) == 0;
                if (v3_norm2(own) > 0) assert_true(v3_norm(v3_sub(own, n)) < 1e-6);
            }
        }
        assert_in_range(zeros, 1, 2);
        fct_scene_destroy(scene);
        fct_mesh m; /* a mesh alone keeps normals of vertices only */
        assert_int_equal(fct_mesh_load(&plain, path, &m), FCT_OK);
        assert_true(!m.normals && !m.corner_normals);
        fct_mesh_release(&plain, &m);
    }
    remove(path);
    plain = fct_env_default();
}

/* A hierarchy beside a mesh stores no normals: they come from the mesh. */
static void hierarchies_have_the_normals_of_their_mesh(void **state) {
    (void)state;
    char mesh_path[128], tree_path[128];
    const char *const endings[] = {"ply", "obj", "glb"};
    fct_mesh ball = make_smooth_ball(&plain, 6, false);
    for (int k = 0; k < 3; ++k)
        for (int with = 0; with < 2; ++with) {
            snprintf(mesh_path, sizeof mesh_path, "%s/ball.%s", folder, endings[k]);
            snprintf(tree_path, sizeof tree_path, "%s/ball.fct", folder);
            fct_mesh plain_ball = ball;
            if (!with) plain_ball.normals = NULL;
            assert_int_equal(fct_mesh_save(&plain, mesh_path, &plain_ball, NULL), FCT_OK);
            fct_tree *tree;
            fct_tree_def def = fct_tree_def_default();
            fct_mesh read;
            assert_int_equal(fct_mesh_load(&plain, mesh_path, &read), FCT_OK);
            assert_int_equal(fct_mesh_file_hash(&plain, mesh_path, &def.source_hash), FCT_OK);
            assert_int_equal(fct_tree_build(&plain, &read, &def, NULL, &tree), FCT_OK);
            assert_int_equal(fct_tree_save(&plain, tree, tree_path), FCT_OK);
            fct_tree_destroy(tree);
            fct_mesh_release(&plain, &read);
            char json[256], json_path[128];
            snprintf(json_path, sizeof json_path, "%s/scene.json", folder);
            snprintf(json, sizeof json,
                     "{\"materials\": {\"a\": {}}, \"models\": {\"ball\": \"ball.%s\"}, \"instances\": "
                     "[{\"model\": \"ball\", \"material\": \"a\"}]}",
                     endings[k]);
            FILE *file = fopen(json_path, "w");
            assert_non_null(file);
            fputs(json, file);
            fclose(file);
            fct_scene *scene;
            assert_int_equal(fct_scene_load(&plain, json_path, FCT_BACKEND_OBB, &scene), FCT_OK);
            const fct_model *model = fct_scene_get(scene).models;
            const fct_tree_view t = fct_tree_get(model->tree);
            assert_true(t.source_hash == def.source_hash && (model->normals != NULL) == (with == 1));
            for (size_t v = 0; with && v < t.vertex_count; ++v)
                assert_true(v3_norm(v3_sub(load(model->normals, v), load(t.positions, v))) < 1e-6);
            fct_scene_destroy(scene);
            remove(mesh_path), remove(tree_path), remove(json_path);
        }
    fct_mesh_release(&plain, &ball);
}

/* ---- Wrong input ---- */

static void wrong_input_is_named(void **state) {
    (void)state;
    fct_scene *scene = make_objects();
    const double angles[] = {0, -1, 180.1, NAN, INFINITY};
    for (size_t i = 0; i < sizeof angles / sizeof *angles; ++i) {
        fct_bake_def def = fct_bake_def_default();
        fct_bake *bake;
        def.crease = angles[i];
        assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_ERROR_DATA);
        assert_null(bake);
    }
    fct_scene_destroy(scene);
    scene = begin();
    fct_mesh ball = make_smooth_ball(&plain, 5, false);
    const uint32_t grey = place_material(scene, .5, 0, false);
    ball.normals[4] = NAN;
    assert_int_equal(fct_scene_add_object(scene, "ball", &ball, NULL, NULL, grey, NULL), FCT_ERROR_DATA);
    fct_scene_destroy(scene);
    /* Zeros and turned normals are counted once per model. */
    memset(ball.normals, 0, 3 * sizeof(float));
    for (int k = 3; k < 6; ++k) ball.normals[k] = -ball.positions[k];
    scene = begin();
    place_mesh(scene, &ball, place_material(scene, .5, 1, false), NULL);
    const float aside[12] = {1, 0, 0, 4, 0, 1, 0, 0, 0, 0, 1, 0};
    assert_int_equal(fct_scene_add_instance(scene, "twin", 0, aside, FCT_NONE), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    uint64_t expected = 0;
    for (size_t c = 0; c < 3 * (size_t)ball.face_count; ++c) expected += ball.triangles[c] < 2;
    fct_bake *bake = start(scene, quick(FCT_KEEP_NONE, 0));
    const fct_bake_stats stats = fct_bake_get_stats(bake);
    assert_true(expected > 6 && stats.normals_unusable == expected);
    assert_int_equal(stats.normals_given, 3 * ball.face_count);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &ball);
}

int main(void) {
    plain = fct_env_default();
    if (!mkdtemp(folder)) return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_follows_the_file),
        cmocka_unit_test(creases_have_other_light),
        cmocka_unit_test(furnaces_are_even),
        cmocka_unit_test(probes_start_on_the_curve),
        cmocka_unit_test(outputs_have_normals),
        cmocka_unit_test(both_sides_have_normals),
        cmocka_unit_test(documents_have_normals),
        cmocka_unit_test(objs_have_normals_of_corners),
        cmocka_unit_test(hierarchies_have_the_normals_of_their_mesh),
        cmocka_unit_test(wrong_input_is_named),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    rmdir(folder);
    return failed;
}
