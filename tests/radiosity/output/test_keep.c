/* Bakes that keep the mesh: the faces and vertices of the mesh as it was added, with means by their
 * definition. */
#include "../place.h"
#include "facetree/radiosity.h"

static fct_env plain; /* outlives every scene */

enum { ALL = FCT_MESH_IRRADIANCE | FCT_MESH_DIRECT | FCT_MESH_INDIRECT | FCT_MESH_ERROR };
static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
static const float mirror[12] = {-1, 0, .25F, 3, 0, 1.5F, 0, 0, 0, 0, 1, .2F};

/* Boxes of six sides of two triangles, of which two share vertices, and a face without area; vertex 3 and the
 * last one have no face. */
static fct_mesh make_box(void) {
    static const uint32_t sides[6][4] = {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1},
                                         {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&plain, 10, 13, 0, &mesh), FCT_OK);
    for (uint32_t v = 0; v < 8; ++v) {
        const uint32_t to = v < 3 ? v : v + 1;
        v3_store(mesh.positions + 3 * (size_t)to, v3_make(v & 1, 1.5 * (v >> 1 & 1), .5 * (v >> 2 & 1)));
    }
    v3_store(mesh.positions + 9, v3_make(7, 8, 9));
    v3_store(mesh.positions + 27, v3_make(-1, 2, 4));
    for (uint32_t s = 0; s < 6; ++s) {
        uint32_t q[4], *t = mesh.triangles + 6 * (size_t)s;
        for (int k = 0; k < 4; ++k) q[k] = sides[s][k] < 3 ? sides[s][k] : sides[s][k] + 1;
        const uint32_t two[6] = {q[0], q[2], q[1], q[0], q[3], q[2]};
        memcpy(t, two, sizeof two);
    }
    const uint32_t thin[3] = {0, 1, 0};
    memcpy(mesh.triangles + 36, thin, sizeof thin);
    return mesh;
}

/* Two boxes of one mesh, the second one mirrored, on a floor under a small lamp. parts: two materials. */
static fct_scene *make_scene(const fct_env *env, const fct_mesh *box, bool parts) {
    fct_scene *scene;
    assert_int_equal(fct_scene_create(env, FCT_BACKEND_OBB, &scene), FCT_OK);
    const uint32_t ids[3] = {place_colours(scene, 1, .5, .8, 0, false),
                             place_colours(scene, 2, .1, .4, .3, false), place_material(scene, 0, 60, false)};
    uint32_t materials[13];
    for (uint32_t f = 0; f < 13; ++f) materials[f] = ids[parts && f % 3 == 1];
    assert_int_equal(
        fct_scene_add_object(scene, "box", box, NULL, identity, ids[0], parts ? materials : NULL), FCT_OK);
    assert_int_equal(fct_scene_add_instance(scene, "twin", 0, mirror, FCT_NONE), FCT_OK);
    place_sheet(env, scene, ids[0], 1, v3_make(-2, -2, -.1), v3_make(7, 0, 0), v3_make(0, 6, 0));
    place_sheet(env, scene, ids[2], 1, v3_make(1.4, .2, 2), v3_make(0, .5, 0), v3_make(.5, 0, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static double error = 1e-3; /* of the bakes that follow */

static fct_bake *start(const fct_scene *scene, const fct_env *env, fct_keep keep, unsigned outputs) {
    fct_bake_def def = fct_bake_def_default();
    fct_bake *bake;
    def.keep = keep, def.outputs = outputs;
    def.error = error;
    assert_int_equal(fct_bake_create(env, scene, &def, &bake), FCT_OK);
    return bake;
}

static fct_mesh light(const fct_scene *scene, fct_keep keep, unsigned outputs, uint32_t object) {
    fct_bake *bake = start(scene, &plain, keep, outputs);
    fct_mesh mesh;
    assert_int_equal(fct_bake_object(bake, object, &mesh), FCT_OK);
    fct_bake_destroy(bake);
    return mesh;
}

static size_t turned(bool mirrored, size_t k) {
    return mirrored && k ? 3 - k : k;
}

/* The faces, in the order of the input, and the place of each of its vertices. */
static void expect_input(const fct_mesh *out, const fct_mesh *box, const float m[12], bool mirrored) {
    assert_int_equal(out->face_count, box->face_count);
    assert_true(out->vertex_count >= box->vertex_count);
    for (uint32_t f = 0; f < box->face_count; ++f) {
        assert_int_equal(out->source_faces[f], f);
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t v = out->triangles[3 * (size_t)f + k],
                           w = box->triangles[3 * (size_t)f + turned(mirrored, k)];
            const float *uv = out->source_uv + 6 * (size_t)f + 2 * k;
            assert_true(uv[0] == (turned(mirrored, k) == 1) && uv[1] == (turned(mirrored, k) == 2));
            assert_true(v == w || v >= box->vertex_count);
            assert_memory_equal(out->positions + 3 * (size_t)v, out->positions + 3 * (size_t)w, 12);
        }
    }
    for (size_t v = 0; v < box->vertex_count; ++v)
        for (size_t r = 0; r < 3; ++r) {
            const float *p = box->positions + 3 * v, *row = m + 4 * r;
            const double at = (double)row[0] * p[0] + (double)row[1] * p[1] + (double)row[2] * p[2] + row[3];
            assert_true(fabs(out->positions[3 * v + r] - at) < 2e-6);
        }
}

static double area_of(const fct_mesh *m, size_t f) {
    const uint32_t *t = m->triangles + 3 * f;
    const v3 a = v3_load(m->positions + 3 * (size_t)t[0]);
    return .5 * v3_norm(v3_cross(v3_sub(v3_load(m->positions + 3 * (size_t)t[1]), a),
                                 v3_sub(v3_load(m->positions + 3 * (size_t)t[2]), a)));
}

static void expect_means(const fct_mesh *sides, const float *of_sides, const fct_mesh *means,
                         const float *of_means, size_t width) {
    for (uint32_t v = 0; v < means->vertex_count; ++v) {
        double sum[3] = {0, 0, 0}, weight = 0;
        for (size_t c = 0; c < 3 * (size_t)means->face_count; ++c) {
            if (means->triangles[c] != v) continue;
            const double area = area_of(means, c / 3);
            for (size_t k = 0; k < width; ++k)
                sum[k] += area * (double)of_sides[width * sides->triangles[c] + k];
            weight += area;
        }
        for (size_t k = 0; k < width; ++k) {
            const double mean = weight > 0 ? sum[k] / weight : 0, found = of_means[width * v + k];
            if (!(fabs(found - mean) <= 1e-5 * mean)) fail_msg("vertex %u: %g, expected %g", v, found, mean);
        }
    }
}

static void expect_mean(const fct_mesh *sides, const float *of_sides, const fct_mesh *means,
                        const float *of_means) {
    expect_means(sides, of_sides, means, of_means, 3);
}

/* One material or two, plain and mirrored: the sides of a crease, and their means. */
static void vertices_have_the_mean_of_their_sides(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_mesh box = make_box();
    for (int kind = 0; kind < 4; ++kind) {
        const bool parts = kind >= 2, mirrored = kind % 2;
        fct_scene *scene = make_scene(&plain, &box, parts);
        assert_int_equal(fct_scene_get(scene).models[0].loose_count, parts ? 2 : 0);
        fct_mesh sides = light(scene, FCT_KEEP_CORNER, ALL, mirrored),
                 means = light(scene, FCT_KEEP_VERTEX, ALL, mirrored);
        expect_input(&sides, &box, mirrored ? mirror : identity, mirrored);
        expect_input(&means, &box, mirrored ? mirror : identity, mirrored);
        assert_int_equal(means.vertex_count, box.vertex_count);
        /* A box has 24 sides of vertices, and the face without area has 2 of its own. With two materials, the
         * halves of a side are apart too. */
        if (!parts) assert_int_equal(sides.vertex_count, 24 + 2 + 2);
        if (parts) assert_in_range(sides.vertex_count, 24 + 2 + 3, 36 + 2 + 2);
        expect_mean(&sides, sides.colors, &means, means.colors);
        expect_mean(&sides, sides.irradiance, &means, means.irradiance);
        expect_mean(&sides, sides.direct, &means, means.direct);
        expect_mean(&sides, sides.indirect, &means, means.indirect);
        expect_means(&sides, sides.error, &means, means.error, 1);
        double lowest = INFINITY, highest = 0;
        for (size_t i = 0; i < 3 * (size_t)box.vertex_count; i += 3)
            lowest = fmin(lowest, means.colors[i]), highest = fmax(highest, means.colors[i]);
        if (!(lowest == 0 && highest > .3)) fail_msg("%g to %g", lowest, highest);
        fct_mesh_release(&plain, &sides), fct_mesh_release(&plain, &means);
        fct_scene_destroy(scene);
    }
    fct_mesh_release(&plain, &box);
}

/* Where no edge is split, the plain output is the same mesh with the same light. */
static void corners_have_the_light_of_the_plain_output(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_mesh box = make_box();
    fct_scene *scene = make_scene(&plain, &box, false);
    fct_mesh results[2];
    for (int k = 0; k < 2; ++k) {
        fct_bake_def def = fct_bake_def_default();
        def.max_edge = 100, def.outputs = FCT_MESH_DIRECT, def.error = 1e-3;
        def.keep = k ? FCT_KEEP_NONE : FCT_KEEP_CORNER;
        fct_bake *bake;
        assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
        assert_int_equal(fct_bake_instance(bake, 0, &results[k]), FCT_OK);
        fct_bake_destroy(bake);
    }
    fct_mesh kept = results[0], whole = results[1];
    assert_int_equal(whole.vertex_count, kept.vertex_count); /* edges are too short to be split */
    assert_memory_equal(whole.triangles, kept.triangles, 12 * (size_t)kept.face_count);
    assert_memory_equal(whole.positions, kept.positions, 12 * (size_t)kept.vertex_count);
    assert_memory_equal(whole.direct, kept.direct, 12 * (size_t)kept.vertex_count);
    assert_memory_equal(whole.colors, kept.colors, 12 * (size_t)kept.vertex_count);
    fct_mesh_release(&plain, &kept), fct_mesh_release(&plain, &whole);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &box);
}

/* (corners + 9 times the centre) / 12, with the corners of the other mode and the centre by a probe; the mean
 * of the corners for a face without area. */
static void expect_face(fct_bake *bake, const fct_mesh *corners, const fct_mesh *faces, size_t f,
                        double tolerance) {
    v3 p[3], sum = {0, 0, 0}, centre = {0, 0, 0};
    for (size_t k = 0; k < 3; ++k) {
        const size_t v = corners->triangles[3 * f + k];
        p[k] = v3_load(corners->positions + 3 * v);
        sum = v3_add(sum, v3_load(corners->colors + 3 * v));
        centre = v3_mad(centre, 1. / 3, p[k]);
    }
    const v3 n = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    const bool flat = v3_norm(n) > 0;
    float point[3], normal[3];
    v3_store(point, centre), v3_store(normal, v3_unit(n));
    fct_probe probe = {0};
    if (flat) assert_int_equal(fct_bake_probe(bake, 1, point, normal, &probe), FCT_OK);
    for (int c = 0; c < 3; ++c) {
        const double corner = c == 0 ? sum.x : c == 1 ? sum.y : sum.z;
        const double mean = flat ? corner / 12 + .75 * (double)probe.radiosity[c] : corner / 3;
        const double found = faces->face_colors[3 * f + (size_t)c];
        if (!(fabs(found - mean) <= tolerance * (mean + .03)))
            fail_msg("face %zu: %g, expected %g", f, found, mean);
    }
}

/* Three triangles in the plane z = 0, and between them face 1, whose corners lie on a line. */
static fct_mesh make_thin(void) {
    static const float positions[15] = {3, 1, 0, 5, 1, 0, 4, 3, 0, 4, 1, 0, 4, -1, 0};
    static const uint32_t triangles[12] = {0, 1, 2, 1, 0, 3, 0, 4, 3, 3, 4, 1};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&plain, 5, 4, 0, &mesh), FCT_OK);
    memcpy(mesh.positions, positions, sizeof positions);
    memcpy(mesh.triangles, triangles, sizeof triangles);
    return mesh;
}

/* Without reflections between surfaces the light is exact. */
static void faces_have_the_mean_of_corners_and_centre(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    const uint32_t floor = place_colours(scene, 1, .5, .8, .2, false),
                   lamp = place_material(scene, 0, 60, false);
    place_sheet(&plain, scene, floor, 2, v3_make(-2, -2, -.1), v3_make(7, 0, 0), v3_make(0, 6, 0));
    place_sheet(&plain, scene, lamp, 1, v3_make(1.4, .2, 2), v3_make(0, .5, 0), v3_make(.5, 0, 0));
    fct_mesh thin = make_thin();
    place_mesh(scene, &thin, floor, NULL);
    fct_mesh_release(&plain, &thin);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_mesh corners = light(scene, FCT_KEEP_CORNER, 0, 0), faces = light(scene, FCT_KEEP_FACE, 0, 0);
    fct_bake *bake = start(scene, &plain, FCT_KEEP_NONE, 0);
    assert_true(!faces.colors && faces.face_count == 8 && faces.vertex_count == 9);
    for (size_t f = 0; f < 8; ++f) expect_face(bake, &corners, &faces, f, .01);
    fct_mesh_release(&plain, &corners), fct_mesh_release(&plain, &faces);
    corners = light(scene, FCT_KEEP_CORNER, 0, 2), faces = light(scene, FCT_KEEP_FACE, 0, 2);
    for (size_t f = 0; f < 4; ++f) expect_face(bake, &corners, &faces, f, .02);
    assert_true(faces.face_colors[3] > .1F); /* its corners are lit */
    fct_bake_destroy(bake);
    fct_mesh_release(&plain, &corners), fct_mesh_release(&plain, &faces);
    fct_scene_destroy(scene);
}

/* Two materials, a mirror, a face without area. Gathers of dim faces differ by up to a fifth. */
static void faces_of_parts_are_kept(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_mesh box = make_box();
    fct_scene *scene = make_scene(&plain, &box, true);
    error = 1e-4;
    fct_mesh corners = light(scene, FCT_KEEP_CORNER, 0, 1), faces = light(scene, FCT_KEEP_FACE, 0, 1);
    fct_bake *bake = start(scene, &plain, FCT_KEEP_NONE, 0);
    expect_input(&faces, &box, mirror, true);
    assert_int_equal(faces.vertex_count, box.vertex_count);
    for (size_t f = 0; f < faces.face_count; ++f) expect_face(bake, &corners, &faces, f, .3);
    error = 1e-3;
    fct_bake_destroy(bake);
    fct_mesh_release(&plain, &corners), fct_mesh_release(&plain, &faces);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &box);
}

/* A sheet with a bright lamp above and a faint one below, or the other way round. */
static void two_sided_surfaces_show_the_brighter_side(void **state) {
    (void)state;
    plain = fct_env_default();
    for (int kind = 0; kind < 8; ++kind) {
        const bool below = kind % 2;
        fct_scene *scene;
        fct_bake_def def = fct_bake_def_default();
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        const uint32_t sheet = place_material(scene, .5, 0, true),
                       lamps[2] = {place_material(scene, 0, below ? 1 : 9, false),
                                   place_material(scene, 0, below ? 9 : 1, false)};
        place_sheet(&plain, scene, sheet, 2, v3_make(0, 0, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
        place_sheet(&plain, scene, lamps[0], 1, v3_make(0, 0, 1), v3_make(0, 1, 0), v3_make(1, 0, 0));
        place_sheet(&plain, scene, lamps[1], 1, v3_make(0, 0, -1), v3_make(1, 0, 0), v3_make(0, 1, 0));
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        def.method = kind % 4 < 2 ? FCT_BAKE_FACE : FCT_BAKE_REFERENCE;
        def.keep = kind < 4 ? FCT_KEEP_VERTEX : FCT_KEEP_CORNER, def.error = 1e-3;
        fct_bake *bake;
        fct_mesh mesh;
        assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
        assert_int_equal(fct_bake_instance(bake, 0, &mesh), FCT_OK);
        assert_int_equal(fct_bake_get_stats(bake).sides_left_out, 1);
        assert_true(mesh.vertex_count == 9 && mesh.face_count == 8);
        const uint32_t first[3] = {0, 1, 4}; /* the winding of the front */
        assert_memory_equal(mesh.triangles, first, sizeof first);
        assert_true(mesh.source_uv[2] == 1 && mesh.source_uv[5] == 1);
        /* 9 times .2 (the form factor of equal squares at distance 1) times .5 on average */
        double mean = 0;
        for (size_t v = 0; v < 9; ++v) mean += mesh.colors[3 * v] / 9.;
        assert_true(mean > .6 && mean < 1.1);
        fct_mesh_release(&plain, &mesh);
        fct_bake_destroy(bake);
        fct_scene_destroy(scene);
    }
}

static void parts_are_kept_as_a_whole(void **state) {
    (void)state;
    recorder r = {0};
    plain = recorder_env(&r);
    fct_mesh box = make_box(), all, object;
    uint32_t counts[6];
    fct_scene *scene = make_scene(&plain, &box, true);
    fct_bake *bake = start(scene, &plain, FCT_KEEP_VERTEX, 0);
    assert_int_equal(fct_bake_instance(bake, 1, &object), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "instance 1 is a part of object \"box\""));
    assert_null(object.positions);
    assert_int_equal(fct_bake_mesh(bake, &all, counts), FCT_OK);
    assert_true(all.face_count == 2 * 13 + 4 && all.vertex_count == 2 * 10 + 8 && !all.source_uv);
    assert_true(counts[0] == 9 && counts[1] == 4 && counts[2] == 9 && counts[3] == 4 && counts[4] == 2);
    assert_int_equal(fct_bake_object(bake, 1, &object), FCT_OK);
    assert_memory_equal(all.colors + 30, object.colors, 12 * 10);
    fct_mesh_release(&plain, &all), fct_mesh_release(&plain, &object);
    fct_bake_destroy(bake);
    fct_bake_def def = fct_bake_def_default();
    def.keep = FCT_KEEP_FACE, def.outputs = FCT_MESH_IRRADIANCE;
    assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_ERROR_DATA);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &box);
    assert_int_equal(r.alive, 0);
}

static void threads_give_the_same_bytes(void **state) {
    (void)state;
    fct_mesh results[2];
    plain = fct_env_default();
    fct_mesh box = make_box();
    for (int keep = FCT_KEEP_CORNER; keep <= FCT_KEEP_FACE; ++keep) {
        for (uint32_t k = 0; k < 2; ++k) {
            fct_env env = fct_env_default();
            env.thread_count = 1 + 2 * k;
            fct_scene *scene = make_scene(&env, &box, true);
            fct_bake *bake = start(scene, &env, (fct_keep)keep, 0);
            assert_int_equal(fct_bake_mesh(bake, &results[k], NULL), FCT_OK);
            fct_bake_destroy(bake);
            fct_scene_destroy(scene);
        }
        const fct_mesh *a = &results[0], *b = &results[1];
        const float *x = a->colors ? a->colors : a->face_colors, *y = b->colors ? b->colors : b->face_colors;
        assert_true(a->vertex_count == b->vertex_count);
        assert_memory_equal(x, y, 12 * (size_t)(a->colors ? a->vertex_count : a->face_count));
        for (int k = 0; k < 2; ++k) fct_mesh_release(&plain, &results[k]);
    }
    fct_mesh_release(&plain, &box);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vertices_have_the_mean_of_their_sides),
        cmocka_unit_test(corners_have_the_light_of_the_plain_output),
        cmocka_unit_test(faces_have_the_mean_of_corners_and_centre),
        cmocka_unit_test(faces_of_parts_are_kept),
        cmocka_unit_test(two_sided_surfaces_show_the_brighter_side),
        cmocka_unit_test(parts_are_kept_as_a_whole),
        cmocka_unit_test(threads_give_the_same_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
