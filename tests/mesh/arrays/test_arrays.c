/* Every array of a mesh survives copies, extractions, joins and turns. */
#include "mesh/mesh.h"
#include "mesh/mesh_support.h"

enum { VERTICES = 40, FACES = 30, FLOATS = 11 };

typedef struct floats {
    const char *what;
    size_t width;
    bool of_faces;
} floats;

static const floats kinds[FLOATS] = {
    {"positions", 3, false},  {"colors", 3, false},   {"irradiance", 3, false},   {"direct", 3, false},
    {"indirect", 3, false},   {"error", 1, false},    {"normals", 3, false},      {"texcoords", 6, true},
    {"face_colors", 3, true}, {"source_uv", 6, true}, {"corner_normals", 9, true}};

static void list_floats(const fct_mesh *m, const float *out[FLOATS]) {
    const float *all[FLOATS] = {m->positions,   m->colors,    m->irradiance,    m->direct,
                                m->indirect,    m->error,     m->normals,       m->texcoords,
                                m->face_colors, m->source_uv, m->corner_normals};
    memcpy(out, all, sizeof all);
}

static float value_of(int kind, size_t i, uint32_t seed) {
    return (float)(kind * 10000 + (int)i) + .25F * (float)seed;
}

static fct_mesh make_loaded(const fct_env *env, uint32_t seed, unsigned without) {
    fct_mesh m;
    const float *arrays[FLOATS];
    assert_int_equal(fct_mesh_create(env, VERTICES, FACES, ~without, &m), FCT_OK);
    list_floats(&m, arrays);
    for (int k = 0; k < FLOATS; ++k)
        for (size_t i = 0; arrays[k] && i < kinds[k].width * (kinds[k].of_faces ? FACES : VERTICES); ++i)
            ((float *)arrays[k])[i] = value_of(k, i, seed);
    for (uint32_t c = 0; c < 3 * FACES; ++c) m.triangles[c] = (c * 7 + seed) % VERTICES;
    for (uint32_t f = 0; f < FACES; ++f) m.source_faces[f] = 100 * seed + f;
    for (uint32_t f = 0; f < FACES && m.materials; ++f) m.materials[f] = f % 3;
    m.material_count = 3;
    m.origin[1] = 7;
    return m;
}

static void copies_have_all(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_loaded(&env, 1, 0), copy, part;
    const float *a[FLOATS], *b[FLOATS], *c[FLOATS];
    uint32_t faces[FACES], *ids;
    for (uint32_t f = 0; f < FACES; ++f) faces[f] = FACES - 1 - f;
    assert_int_equal(fct_mesh_copy(&env, &m, &copy), FCT_OK);
    assert_int_equal(fct_mesh_extract(&env, &m, faces, FACES, &part, &ids), FCT_OK);
    list_floats(&m, a), list_floats(&copy, b), list_floats(&part, c);
    for (int k = 0; k < FLOATS; ++k) {
        const size_t width = kinds[k].width * sizeof(float);
        assert_memory_equal(a[k], b[k], width * (kinds[k].of_faces ? FACES : VERTICES));
        for (size_t i = 0; i < (kinds[k].of_faces ? FACES : part.vertex_count); ++i)
            assert_memory_equal(c[k] + kinds[k].width * i,
                                a[k] + kinds[k].width * (kinds[k].of_faces ? faces[i] : ids[i]), width);
    }
    for (uint32_t f = 0; f < FACES; ++f) {
        assert_true(copy.source_faces[f] == 100 + f && part.source_faces[f] == 100 + faces[f]);
        assert_true(copy.materials[f] == f % 3 && part.materials[f] == faces[f] % 3);
        for (uint32_t k = 0; k < 3; ++k)
            assert_int_equal(ids[part.triangles[3 * f + k]], m.triangles[3 * faces[f] + k]);
    }
    assert_int_equal(fct_mesh_bits(&m), fct_mesh_bits(&part));
    fct_memory_release(&env, ids);
    fct_mesh_release(&env, &m), fct_mesh_release(&env, &copy), fct_mesh_release(&env, &part);
    assert_int_equal(r.alive, 0);
}

static void joins_follow_each_other(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh parts[3] = {make_loaded(&env, 1, 0), {0}, make_loaded(&env, 2, FCT_MESH_NORMALS)}, all;
    assert_int_equal(fct_mesh_join(&env, parts, 3, &all), FCT_OK);
    assert_true(all.vertex_count == 2 * VERTICES && all.face_count == 2 * FACES && all.origin[1] == 7);
    assert_true(!all.normals && !all.materials); /* not all have normals; materials are left out */
    const float *values[FLOATS];
    list_floats(&all, values);
    for (int k = 0; k < FLOATS; ++k) {
        const size_t count = kinds[k].width * (kinds[k].of_faces ? FACES : VERTICES);
        for (size_t i = 0; values[k] && i < 2 * count; ++i)
            assert_true(values[k][i] == value_of(k, i % count, i < count ? 1 : 2));
    }
    for (uint32_t c = 0; c < 6 * FACES; ++c) {
        const fct_mesh *from = &parts[c < 3 * FACES ? 0 : 2];
        const uint32_t shift = c < 3 * FACES ? 0 : VERTICES;
        assert_int_equal(all.triangles[c], from->triangles[c % (3 * FACES)] + shift);
        assert_int_equal(all.source_faces[c / 3], from->source_faces[c / 3 % FACES]);
    }
    fct_mesh_release(&env, &all);
    assert_int_equal(fct_mesh_join(&env, NULL, 0, &all), FCT_OK);
    assert_true(all.vertex_count == 0 && all.face_count == 0 && !all.colors);
    fct_mesh_release(&env, &all);
    parts[1].vertex_count = INT32_MAX - 2 * VERTICES;
    assert_int_equal(fct_mesh_join(&env, parts, 3, &all), FCT_ERROR_MEMORY);
    fct_mesh_release(&env, &parts[0]), fct_mesh_release(&env, &parts[2]);
    assert_int_equal(r.alive, 0);
}

/* A turn swaps the second and the third corner with all that belongs to them. */
static void turns_swap_corners(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_loaded(&env, 1, 0), before;
    assert_int_equal(fct_mesh_copy(&env, &m, &before), FCT_OK);
    fct_mesh_turn_over(&m);
    for (size_t f = 0; f < FACES; ++f)
        for (size_t k = 0; k < 3; ++k) {
            const size_t corner = 3 * f + k, from = 3 * f + (3 - k) % 3;
            assert_int_equal(m.triangles[corner], before.triangles[from]);
            assert_memory_equal(m.texcoords + 2 * corner, before.texcoords + 2 * from, 8);
            assert_memory_equal(m.source_uv + 2 * corner, before.source_uv + 2 * from, 8);
            assert_memory_equal(m.corner_normals + 3 * corner, before.corner_normals + 3 * from, 12);
        }
    fct_mesh_release(&env, &m), fct_mesh_release(&env, &before);
}

/* PLY restores the lights; a display chooses the bytes, and the floats of the colours may be left out. */
static void ply_keeps_lights(void **state) {
    (void)state;
    static const char path[] = "arrays.ply";
    recorder r = {0};
    fct_env env = recorder_env(&r);
    for (int ascii = 0; ascii < 2; ++ascii) {
        fct_mesh m = make_loaded(&env, 1, FCT_MESH_MATERIALS), back;
        fct_mesh_save_def def = fct_mesh_save_def_default();
        m.origin[1] = 0;
        m.material_count = 0;
        r.text[0] = 0;
        def.ascii = ascii, def.sources = true;
        assert_int_equal(fct_mesh_save(&env, path, &m, &def), FCT_OK);
        assert_non_null(strstr(r.text, "normals that differ by corner are left out"));
        assert_int_equal(fct_mesh_load(&env, path, &back), FCT_OK);
        const float *a[FLOATS], *b[FLOATS];
        list_floats(&m, a), list_floats(&back, b);
        for (int k = 0; k < FLOATS - 2; ++k)
            assert_memory_equal(a[k], b[k],
                                kinds[k].width * sizeof(float) * (kinds[k].of_faces ? FACES : VERTICES));
        assert_memory_equal(m.triangles, back.triangles, sizeof(uint32_t) * 3 * FACES);
        assert_true(!back.source_uv && !back.corner_normals);
        fct_mesh_release(&env, &back);
        def.no_radiosity = true, def.display = FCT_MESH_DIRECT;
        assert_int_equal(fct_mesh_save(&env, path, &m, &def), FCT_OK);
        assert_int_equal(fct_mesh_load(&env, path, &back), FCT_OK);
        assert_memory_equal(back.colors, m.irradiance, 12 * VERTICES); /* the first light of the file */
        fct_mesh_release(&env, &back);
        fct_memory_release(&env, m.direct);
        m.direct = NULL;
        assert_int_equal(fct_mesh_save(&env, path, &m, &def), FCT_ERROR_DATA);
        assert_non_null(strstr(r.text, "light to display"));
        fct_mesh_release(&env, &m);
    }
    unlink(path);
    assert_int_equal(r.alive, 0);
}

/* The properties of a PLY, and the bytes of the light that is shown. */
static void ply_shows_the_display(void **state) {
    (void)state;
    static const char path[] = "display.ply";
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m;
    char text[2048] = "";
    assert_int_equal(
        fct_mesh_create(&env, 3, 1,
                        FCT_MESH_COLORS | FCT_MESH_INDIRECT | FCT_MESH_SOURCE_FACES | FCT_MESH_SOURCE_UV, &m),
        FCT_OK);
    for (int i = 0; i < 9; ++i) m.positions[i] = (float)(i % 4), m.colors[i] = .125F, m.indirect[i] = .5F;
    for (uint32_t k = 0; k < 3; ++k) m.triangles[k] = k;
    for (int k = 0; k < 6; ++k) m.source_uv[k] = .0625F * (float)k;
    m.source_faces[0] = 41;
    fct_mesh_save_def def = fct_mesh_save_def_default();
    def.ascii = true, def.display = FCT_MESH_INDIRECT, def.no_radiosity = true, def.sources = true;
    assert_int_equal(fct_mesh_save(&env, path, &m, &def), FCT_OK);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = 0;
    fclose(file);
    assert_non_null(strstr(text, "property uchar blue\nproperty float indirect_r\nproperty float indirect_g\n"
                                 "property float indirect_b\nelement face 1\n"
                                 "property list uchar int vertex_indices\nproperty int source_face\n"
                                 "property list uchar float source_uv\nend_header\n"));
    assert_non_null(strstr(text, "0 1 2 188 188 188 0.5 0.5 0.5\n")); /* 188 = sRGB of 1/2 */
    assert_non_null(strstr(text, "\n3 0 1 2 41 6 0 0.0625 0.125 0.1875 0.25 0.3125\n"));
    fct_mesh_release(&env, &m);
    unlink(path);
}

/* GLB stores the errors; OBJ and OFF name them among the arrays that they leave out. */
static void glb_keeps_errors(void **state) {
    (void)state;
    static const char *const paths[] = {"errors.glb", "errors.obj", "errors.off"};
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_loaded(&env, 1, ~(unsigned)(FCT_MESH_COLORS | FCT_MESH_ERROR | FCT_MESH_SOURCE_FACES)),
             back;
    m.origin[1] = 0, m.material_count = 0;
    for (int k = 0; k < 3; ++k) {
        r.text[0] = 0;
        assert_int_equal(fct_mesh_save(&env, paths[k], &m, NULL), FCT_OK);
        assert_int_equal(strstr(r.text, "the error of light") != NULL, k > 0);
        assert_int_equal(fct_mesh_load(&env, paths[k], &back), FCT_OK);
        assert_int_equal(back.error != NULL, k == 0);
        if (back.error) assert_memory_equal(back.error, m.error, sizeof(float) * VERTICES);
        fct_mesh_release(&env, &back);
        unlink(paths[k]);
    }
    m.error[3] = NAN;
    assert_int_equal(fct_mesh_save(&env, paths[0], &m, NULL), FCT_ERROR_DATA);
    fct_mesh_release(&env, &m);
    assert_int_equal(r.alive, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(copies_have_all),       cmocka_unit_test(joins_follow_each_other),
        cmocka_unit_test(turns_swap_corners),    cmocka_unit_test(ply_keeps_lights),
        cmocka_unit_test(ply_shows_the_display), cmocka_unit_test(glb_keeps_errors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
