/* tests/memory/calls_mesh.c: calls of base.h, mesh.h, dual.h, simplify.h, simplifier.h and progressive.h. */
#include "tests/memory/calls.h"

static fct_result check_simd(const fct_env *env) {
    return STARVE(fct_simd_check(env));
}

static fct_result open_writer(const fct_env *env) {
    fct_writer *writer;
    fct_result result = STARVE(fct_writer_open(env, OUT "text", &writer));
    assert_int_equal(writer != NULL, result == FCT_OK);
    if (writer) fct_writer_close(writer, false);
    return result;
}

static fct_result close_writer(const fct_env *env) {
    fct_writer *writer;
    assert_int_equal(fct_writer_open(env, OUT "text", &writer), FCT_OK);
    fputs("text", fct_writer_stream(writer));
    return STARVE(fct_writer_close(writer, true));
}

static fct_result check_output(const fct_env *env) {
    return STARVE(fct_output_check(env, OUT "text"));
}

static fct_result finish_mesh(const fct_env *env, fct_mesh *mesh, fct_result result) {
    static const fct_mesh none;
    if (result != FCT_OK) assert_memory_equal(mesh, &none, sizeof none);
    fct_mesh_release(env, mesh);
    return result;
}

static fct_result create_mesh(const fct_env *env) {
    fct_mesh mesh;
    return finish_mesh(env, &mesh, STARVE(fct_mesh_create(env, 8, 9, 63, &mesh)));
}

static fct_result copy_mesh(const fct_env *env) {
    fct_mesh mesh;
    return finish_mesh(env, &mesh, STARVE(fct_mesh_copy(env, &inputs.sheet, &mesh)));
}

static fct_result join_meshes(const fct_env *env) {
    const fct_mesh parts[2] = {inputs.sheet, inputs.sheet};
    fct_mesh mesh;
    return finish_mesh(env, &mesh, STARVE(fct_mesh_join(env, parts, 2, &mesh)));
}

static fct_result extract_mesh(const fct_env *env) {
    static const uint32_t faces[3] = {9, 1, 7};
    fct_mesh mesh;
    uint32_t *ids = NULL;
    fct_result result = STARVE(fct_mesh_extract(env, &inputs.sheet, faces, 3, &mesh, &ids));
    assert_int_equal(ids != NULL, result == FCT_OK);
    if (ids) fct_memory_release(env, ids);
    return finish_mesh(env, &mesh, result);
}

static fct_result inspect_mesh(const fct_env *env) {
    fct_mesh_report report;
    return STARVE(fct_mesh_inspect(env, &inputs.sheet, &report));
}

static fct_result validate_mesh(const fct_env *env) {
    return STARVE(fct_mesh_validate(env, &inputs.sheet));
}

static fct_result load_mesh(const fct_env *env, const char *path) {
    fct_mesh mesh;
    return finish_mesh(env, &mesh, STARVE(fct_mesh_load(env, path, &mesh)));
}

/* A corner with two normals. */
static fct_result load_shaded(const fct_env *env) {
    fct_mesh mesh;
    return finish_mesh(env, &mesh, STARVE(fct_mesh_load_shaded(env, IN "shaded.obj", &mesh)));
}

static fct_result load_ply(const fct_env *env) {
    return load_mesh(env, IN "sheet.ply");
}

static fct_result load_text_ply(const fct_env *env) {
    return load_mesh(env, IN "text.ply");
}

static fct_result load_obj(const fct_env *env) {
    return load_mesh(env, IN "sheet.obj");
}

static fct_result load_off(const fct_env *env) {
    return load_mesh(env, IN "sheet.off");
}

static fct_result load_stl(const fct_env *env) {
    return load_mesh(env, IN "sheet.stl");
}

static fct_result load_text_stl(const fct_env *env) {
    return load_mesh(env, IN "text.stl");
}

static fct_result load_om(const fct_env *env) {
    return load_mesh(env, IN "sheet.om");
}

static fct_result load_glb(const fct_env *env) {
    return load_mesh(env, IN "sheet.glb");
}

static fct_result load_gltf(const fct_env *env) {
    return load_mesh(env, IN "corner.gltf");
}

static fct_result count_file(const fct_env *env) {
    bool known;
    uint32_t faces, vertices;
    return STARVE(fct_mesh_file_counts(env, IN "sheet.ply", &known, &faces, &vertices));
}

static fct_result find_light(const fct_env *env) {
    bool lit;
    return STARVE(fct_mesh_file_holds_light(env, IN "sheet.glb", &lit));
}

static fct_result hash_file(const fct_env *env, const char *path) {
    uint64_t hash, whole;
    fct_env plain = fct_env_default();
    fct_result result = STARVE(fct_mesh_file_hash(env, path, &hash));
    assert_int_equal(fct_mesh_file_hash(&plain, path, &whole), FCT_OK);
    if (result == FCT_OK) assert_true(hash == whole);
    return result;
}

static fct_result hash_glb(const fct_env *env) {
    return hash_file(env, IN "sheet.glb");
}

static fct_result hash_gltf(const fct_env *env) {
    return hash_file(env, IN "corner.gltf");
}

static fct_result save_ply(const fct_env *env) {
    return STARVE(fct_mesh_save(env, OUT "sheet.ply", &inputs.sheet, NULL));
}

static fct_result save_text_ply(const fct_env *env) {
    fct_mesh_save_def def = fct_mesh_save_def_default();
    def.ascii = true;
    return STARVE(fct_mesh_save(env, OUT "sheet.ply", &inputs.sheet, &def));
}

static fct_result save_obj(const fct_env *env) {
    return STARVE(fct_mesh_save(env, OUT "sheet.obj", &inputs.sheet, NULL));
}

static fct_result save_off(const fct_env *env) {
    return STARVE(fct_mesh_save(env, OUT "sheet.off", &inputs.sheet, NULL));
}

static fct_result save_stl(const fct_env *env) {
    return STARVE(fct_mesh_save(env, OUT "sheet.stl", &inputs.sheet, NULL));
}

static fct_result save_om(const fct_env *env) {
    return STARVE(fct_mesh_save(env, OUT "sheet.om", &inputs.sheet, NULL));
}

static fct_result save_glb(const fct_env *env) {
    return STARVE(fct_mesh_save(env, OUT "sheet.glb", &inputs.sheet, NULL));
}

static fct_result open_gltf(const fct_env *env) {
    fct_gltf *gltf;
    fct_mesh mesh;
    fct_result result = STARVE(fct_gltf_open(env, IN "corner.gltf", &gltf, &mesh));
    assert_int_equal(gltf != NULL, result == FCT_OK);
    fct_gltf_close(gltf);
    return finish_mesh(env, &mesh, result);
}

static fct_result save_gltf(const fct_env *env) {
    fct_gltf *gltf;
    fct_mesh mesh;
    assert_int_equal(fct_gltf_open(env, IN "corner.gltf", &gltf, &mesh), FCT_OK);
    fct_result result = STARVE(fct_gltf_save(gltf, OUT "corner.glb", &mesh, NULL));
    fct_mesh_release(env, &mesh);
    fct_gltf_close(gltf);
    return result;
}

static fct_result build_dual(const fct_env *env) {
    fct_dual dual;
    fct_result result = STARVE(fct_dual_build(env, &inputs.sheet, &dual));
    if (result != FCT_OK) assert_null(dual.edges);
    fct_dual_release(env, &dual);
    return result;
}

static fct_result build_weld(const fct_env *env) {
    fct_mesh soup; /* each corner has a vertex of its own */
    assert_int_equal(
        fct_mesh_create(&inputs.env, 3 * inputs.ball.face_count, inputs.ball.face_count, 0, &soup), FCT_OK);
    for (uint32_t c = 0; c < soup.vertex_count; ++c) {
        memcpy(soup.positions + 3 * (size_t)c, inputs.ball.positions + 3 * (size_t)inputs.ball.triangles[c],
               12);
        soup.triangles[c] = c;
    }
    fct_weld weld;
    fct_result result = STARVE(fct_weld_build(env, &soup, &weld));
    if (result != FCT_OK) assert_null(weld.triangles);
    fct_weld_release(env, &weld);
    fct_mesh_release(&inputs.env, &soup);
    return result;
}

static fct_result find_inward(const fct_env *env) {
    uint32_t count;
    fct_result result = STARVE(fct_inward_find(env, &inputs.ball, &count, NULL));
    if (result == FCT_OK) assert_int_equal(count, 1);
    return result;
}

static fct_result flip_inward(const fct_env *env) {
    fct_mesh mesh;
    uint32_t count;
    assert_int_equal(fct_mesh_copy(&inputs.env, &inputs.ball, &mesh), FCT_OK);
    fct_result result = STARVE(fct_inward_flip(env, &mesh, &count));
    bool unchanged = memcmp(mesh.triangles, inputs.ball.triangles, 12 * (size_t)mesh.face_count) == 0;
    assert_int_equal(unchanged, result != FCT_OK);
    fct_mesh_release(&inputs.env, &mesh);
    return result;
}

static fct_result simplify(const fct_env *env) {
    fct_mesh mesh;
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 10;
    return finish_mesh(env, &mesh, STARVE(fct_simplify(env, &inputs.sheet, &def, &mesh, NULL)));
}

/* Two sheets, one above the other, join. */
static fct_result simplify_pairs(const fct_env *env) {
    fct_mesh mesh, both;
    const fct_mesh *sheet = &inputs.sheet;
    fct_progressive *progressive;
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 10, def.pair_distance = .2;
    assert_int_equal(fct_mesh_create(&inputs.env, 2 * sheet->vertex_count, 2 * sheet->face_count, 0, &both),
                     FCT_OK);
    for (uint32_t v = 0; v < both.vertex_count; ++v) {
        const float *p = sheet->positions + 3 * (size_t)(v % sheet->vertex_count);
        float *to = both.positions + 3 * (size_t)v;
        to[0] = p[0], to[1] = p[1], to[2] = p[2] + (v < sheet->vertex_count ? 0 : .1F);
    }
    for (uint32_t c = 0; c < 3 * both.face_count; ++c) {
        uint32_t second = c >= 3 * sheet->face_count;
        both.triangles[c] = sheet->triangles[c % (3 * sheet->face_count)] + second * sheet->vertex_count;
    }
    fct_result result = STARVE(fct_simplify_progressive(env, &both, &def, &mesh, NULL, &progressive));
    fct_progressive_destroy(progressive);
    fct_mesh_release(&inputs.env, &both);
    return finish_mesh(env, &mesh, result);
}

static fct_result simplify_levels(const fct_env *env) {
    fct_mesh levels[2];
    fct_simplify_def def = fct_simplify_def_default();
    const uint32_t targets[2] = {inputs.sheet.face_count / 2, inputs.sheet.face_count / 4};
    fct_result result = STARVE(fct_simplify_levels(env, &inputs.sheet, &def, targets, 2, levels, NULL));
    return finish_mesh(env, &levels[0], finish_mesh(env, &levels[1], result));
}

static fct_result simplify_progressive(const fct_env *env) {
    fct_mesh mesh;
    fct_progressive *progressive;
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 10;
    fct_result result = STARVE(fct_simplify_progressive(env, &inputs.sheet, &def, &mesh, NULL, &progressive));
    assert_int_equal(progressive == NULL, result != FCT_OK);
    fct_progressive_destroy(progressive);
    return finish_mesh(env, &mesh, result);
}

/* A progressive mesh of `env`. */
static fct_progressive *make_progressive(const fct_env *env) {
    fct_mesh mesh;
    fct_progressive *progressive;
    fct_simplify_def def = fct_simplify_def_default();
    assert_int_equal(fct_simplify_progressive(env, &inputs.sheet, &def, &mesh, NULL, &progressive), FCT_OK);
    fct_mesh_release(env, &mesh);
    return progressive;
}

static fct_result save_progressive(const fct_env *env) {
    fct_progressive *progressive = make_progressive(env);
    fct_result result = STARVE(fct_progressive_save(progressive, OUT "mesh.fpm"));
    fct_progressive_destroy(progressive);
    return result;
}

static fct_result load_progressive(const fct_env *env) {
    fct_progressive *progressive;
    fct_result result = STARVE(fct_progressive_load(env, IN "sheet.fpm", &progressive));
    assert_int_equal(progressive == NULL, result != FCT_OK);
    fct_progressive_destroy(progressive);
    return result;
}

static fct_result write_level(const fct_env *env) {
    fct_mesh mesh;
    fct_progressive *progressive = make_progressive(env);
    fct_progressive_go(progressive, 10);
    fct_result result = STARVE(fct_progressive_mesh(progressive, &mesh));
    finish_mesh(env, &mesh, result);
    fct_progressive_destroy(progressive);
    return result;
}

static fct_result write_morph(const fct_env *env) {
    fct_mesh mesh;
    fct_progressive *progressive = make_progressive(env);
    fct_progressive_go(progressive, 10);
    fct_result result = STARVE(fct_progressive_morph(progressive, 4, .5, &mesh));
    finish_mesh(env, &mesh, result);
    fct_progressive_destroy(progressive);
    return result;
}

static fct_result create_simplifier(const fct_env *env) {
    fct_simplifier *s;
    fct_simplify_def def = fct_simplify_def_default();
    fct_result result = STARVE(fct_simplifier_create(env, &inputs.sheet, &def, &s));
    assert_int_equal(s == NULL, result != FCT_OK);
    fct_simplifier_destroy(s);
    return result;
}

/* A simplifier of `env` after one run. */
static fct_simplifier *make_simplifier(const fct_env *env) {
    fct_simplifier *s;
    fct_simplify_def def = fct_simplify_def_default();
    assert_int_equal(fct_simplifier_create(env, &inputs.sheet, &def, &s), FCT_OK);
    assert_int_equal(fct_simplifier_run(s, 40, INFINITY, NULL), FCT_OK);
    return s;
}

static fct_result run_simplifier(const fct_env *env) {
    fct_simplifier *s = make_simplifier(env);
    uint32_t before = fct_simplifier_faces(s);
    fct_result result = STARVE(fct_simplifier_run(s, 10, INFINITY, NULL));
    assert_int_equal(fct_simplifier_faces(s) == before, result != FCT_OK);
    fct_simplifier_destroy(s);
    return result;
}

static fct_result undo_runs(const fct_env *env) {
    fct_simplifier *s = make_simplifier(env);
    assert_int_equal(fct_simplifier_run(s, 10, INFINITY, NULL), FCT_OK);
    uint32_t before = fct_simplifier_faces(s);
    fct_result result = STARVE(fct_simplifier_undo(s, 30));
    assert_int_equal(fct_simplifier_faces(s) == before, result != FCT_OK);
    fct_simplifier_destroy(s);
    return result;
}

static fct_result paint_simplifier(const fct_env *env) {
    fct_simplifier *s = make_simplifier(env);
    float *weights = fct_allocate(&inputs.env, inputs.sheet.vertex_count, sizeof *weights);
    for (uint32_t v = 0; v < inputs.sheet.vertex_count; ++v) weights[v] = 1 + (float)v;
    fct_result result = STARVE(fct_simplifier_paint(s, FCT_PAINT_INPUT, weights, inputs.sheet.vertex_count));
    fct_release(&inputs.env, weights);
    fct_simplifier_destroy(s);
    return result;
}

static fct_result constrain(const fct_env *env, bool late) {
    fct_simplifier *s;
    fct_simplify_def def = fct_simplify_def_default();
    assert_int_equal(fct_simplifier_create(env, &inputs.sheet, &def, &s), FCT_OK);
    if (late) assert_int_equal(fct_simplifier_run(s, 40, INFINITY, NULL), FCT_OK);
    fct_constrain_def marks = fct_constrain_def_default();
    marks.contour = inputs.sheet.triangles, marks.contour_count = 1;
    marks.points = inputs.sheet.triangles + 9, marks.point_count = 2;
    fct_result result = STARVE(fct_simplifier_constrain(s, &marks));
    assert_int_equal(fct_simplifier_run(s, 10, INFINITY, NULL), FCT_OK); /* the state is whole */
    fct_simplifier_destroy(s);
    return result;
}

static fct_result constrain_early(const fct_env *env) {
    return constrain(env, false);
}

static fct_result constrain_late(const fct_env *env) {
    return constrain(env, true);
}

static fct_result write_simplifier(const fct_env *env) {
    fct_mesh mesh;
    fct_simplifier *s = make_simplifier(env);
    fct_result result = STARVE(fct_simplifier_mesh(s, true, &mesh, NULL));
    fct_simplifier_destroy(s);
    return finish_mesh(env, &mesh, result);
}

static fct_result save_simplifier(const fct_env *env) {
    fct_simplifier *s = make_simplifier(env);
    fct_result result = STARVE(fct_simplifier_save(s, OUT "sheet.fst"));
    fct_simplifier_destroy(s);
    return result;
}

static fct_result load_simplifier(const fct_env *env) {
    fct_simplifier *s;
    fct_result result = STARVE(fct_simplifier_load(env, IN "sheet.fst", &s));
    assert_int_equal(s == NULL, result != FCT_OK);
    fct_simplifier_destroy(s);
    return result;
}

static fct_result write_view(const fct_env *env) {
    fct_mesh mesh;
    fct_progressive *progressive = make_progressive(env);
    fct_view view = fct_view_default();
    view.position[2] = 3, view.tolerance = view.silhouette_tolerance = .1;
    fct_result result = STARVE(fct_progressive_view(progressive, &view, &mesh, NULL));
    finish_mesh(env, &mesh, result);
    /* A view without memory leaves nothing that the next one could stumble over. */
    assert_int_equal(fct_progressive_view(progressive, &view, &mesh, NULL), FCT_OK);
    fct_mesh_release(env, &mesh);
    fct_progressive_destroy(progressive);
    return result;
}

const memory_call mesh_calls[] = {{"fct_simd_check", "", check_simd, false},
                                  {"fct_writer_open", "", open_writer, false},
                                  {"fct_writer_close", "", close_writer, false},
                                  {"fct_output_check", "", check_output, false},
                                  {"fct_mesh_create", "", create_mesh, false},
                                  {"fct_mesh_copy", "", copy_mesh, false},
                                  {"fct_mesh_join", "", join_meshes, false},
                                  {"fct_mesh_extract", "", extract_mesh, false},
                                  {"fct_mesh_inspect", "", inspect_mesh, false},
                                  {"fct_mesh_validate", "", validate_mesh, false},
                                  {"fct_mesh_load_shaded", "", load_shaded, false},
                                  {"fct_mesh_load", "ply", load_ply, false},
                                  {"fct_mesh_load", "text ply", load_text_ply, false},
                                  {"fct_mesh_load", "obj", load_obj, false},
                                  {"fct_mesh_load", "off", load_off, false},
                                  {"fct_mesh_load", "stl", load_stl, false},
                                  {"fct_mesh_load", "text stl", load_text_stl, false},
                                  {"fct_mesh_load", "om", load_om, false},
                                  {"fct_mesh_load", "glb", load_glb, false},
                                  {"fct_mesh_load", "gltf", load_gltf, false},
                                  {"fct_mesh_file_counts", "", count_file, false},
                                  {"fct_mesh_file_holds_light", "", find_light, false},
                                  {"fct_mesh_file_hash", "glb", hash_glb, false},
                                  {"fct_mesh_file_hash", "gltf", hash_gltf, false},
                                  {"fct_mesh_save", "ply", save_ply, false},
                                  {"fct_mesh_save", "text ply", save_text_ply, false},
                                  {"fct_mesh_save", "obj", save_obj, false},
                                  {"fct_mesh_save", "off", save_off, false},
                                  {"fct_mesh_save", "stl", save_stl, false},
                                  {"fct_mesh_save", "om", save_om, false},
                                  {"fct_mesh_save", "glb", save_glb, false},
                                  {"fct_gltf_open", "", open_gltf, false},
                                  {"fct_gltf_save", "", save_gltf, false},
                                  {"fct_dual_build", "", build_dual, false},
                                  {"fct_weld_build", "", build_weld, false},
                                  {"fct_inward_find", "", find_inward, false},
                                  {"fct_inward_flip", "", flip_inward, false},
                                  {"fct_simplify", "", simplify, false},
                                  {"fct_simplify_levels", "", simplify_levels, false},
                                  {"fct_simplify_progressive", "", simplify_progressive, false},
                                  {"fct_simplifier_create", "", create_simplifier, false},
                                  {"fct_simplifier_run", "", run_simplifier, false},
                                  {"fct_simplifier_undo", "", undo_runs, false},
                                  {"fct_simplifier_paint", "", paint_simplifier, false},
                                  {"fct_simplifier_constrain", "first", constrain_early, false},
                                  {"fct_simplifier_constrain", "later", constrain_late, false},
                                  {"fct_simplifier_mesh", "", write_simplifier, false},
                                  {"fct_simplifier_save", "", save_simplifier, false},
                                  {"fct_simplifier_load", "", load_simplifier, false},
                                  {"fct_simplify_progressive", "with pairs", simplify_pairs, false},
                                  {"fct_progressive_save", "", save_progressive, false},
                                  {"fct_progressive_load", "", load_progressive, false},
                                  {"fct_progressive_mesh", "", write_level, false},
                                  {"fct_progressive_morph", "", write_morph, false},
                                  {"fct_progressive_view", "", write_view, false},
                                  {NULL, NULL, NULL, false}};
