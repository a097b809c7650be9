/* tests/memory/calls_scene.c: calls of scene.h and radiosity.h. */
#include "tests/memory/calls.h"

static const float far_away[12] = {1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0};

static fct_scene *create_plain(const fct_env *env) {
    static const fct_material white = {.name = "white", .reflectance = {.5F, .5F, .5F}};
    fct_scene *scene;
    uint32_t id;
    assert_int_equal(fct_scene_create(env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &white, &id), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "ball", &inputs.ball, NULL, NULL, 0, NULL), FCT_OK);
    return scene;
}

static fct_result finish_scene(fct_scene *scene, fct_result result) {
    fct_scene_destroy(scene);
    return result;
}

static fct_result create_scene(const fct_env *env) {
    fct_scene *scene;
    fct_result result = STARVE(fct_scene_create(env, FCT_BACKEND_OBB, &scene));
    assert_int_equal(scene != NULL, result == FCT_OK);
    if (scene) fct_scene_destroy(scene);
    return result;
}

static fct_result add_materials(const fct_env *env) {
    fct_scene *scene = create_plain(env);
    fct_material material = {.name = "grey"};
    uint32_t id;
    fct_result result = FCT_OK;
    for (int i = 0; i < 100 && result == FCT_OK; ++i)
        result = STARVE(fct_scene_add_material(scene, &material, &id));
    return finish_scene(scene, result);
}

static const fct_texture dots = {"a name of more than thirty-two bytes", 2, 1,
                                 (const uint8_t[6]){9, 8, 7, 6, 5, 4}};

static fct_result add_textures(const fct_env *env) {
    fct_scene *scene = create_plain(env);
    uint32_t id;
    fct_result result = FCT_OK;
    for (int i = 0; i < 40 && result == FCT_OK; ++i)
        result = STARVE(fct_scene_add_texture(scene, &dots, &id));
    return finish_scene(scene, result);
}

static fct_result read_texture(const fct_env *env) {
    fct_scene *scene = create_plain(env);
    uint32_t id;
    return finish_scene(scene, STARVE(fct_scene_read_texture(scene, IN "picture.png", &id)));
}

static fct_result paint_material(const fct_env *env) {
    fct_scene *scene = create_plain(env);
    fct_paint paint = fct_paint_default();
    assert_int_equal(fct_scene_add_texture(scene, &dots, &paint.texture), FCT_OK);
    return finish_scene(scene, STARVE(fct_scene_paint_material(scene, 0, &paint)));
}

/* After a failure, the scene is as it was: the same object can be added. */
static fct_result add_object_with(const fct_env *env, const uint32_t *face_materials) {
    fct_scene *scene = create_plain(env);
    uint32_t id;
    fct_material material = {.name = "grey"};
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    fct_result result =
        STARVE(fct_scene_add_object(scene, "sheet", &inputs.sheet, NULL, far_away, id, face_materials));
    if (result != FCT_OK)
        assert_int_equal(
            fct_scene_add_object(scene, "sheet", &inputs.sheet, NULL, far_away, id, face_materials), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    assert_int_equal(fct_scene_get(scene).instance_count, face_materials ? 3 : 2);
    assert_int_equal(fct_scene_get(scene).object_count, 2);
    return finish_scene(scene, result);
}

static fct_result add_object(const fct_env *env) {
    return add_object_with(env, NULL);
}

static fct_result add_object_of_materials(const fct_env *env) {
    return add_object_with(env, inputs.sheet.materials);
}

/* The scene destroys the tree, also if it has no memory for it. */
static fct_result add_tree(const fct_env *env) {
    fct_scene *scene = create_plain(env);
    fct_tree *tree;
    assert_int_equal(fct_tree_open(env, IN "sheet.fct", &tree), FCT_OK);
    return finish_scene(scene, STARVE(fct_scene_add_object(scene, "sheet", NULL, tree, far_away, 0, NULL)));
}

static fct_result add_instances(const fct_env *env) {
    fct_scene *scene = create_plain(env);
    fct_result result = FCT_OK;
    for (int i = 0; i < 100 && result == FCT_OK; ++i)
        result = STARVE(fct_scene_add_instance(scene, "ball", 0, far_away, FCT_NONE));
    return finish_scene(scene, result);
}

static fct_result add_groups(const fct_env *env) {
    fct_scene *scene = create_plain(env);
    uint32_t id;
    fct_result result = FCT_OK;
    for (int i = 0; i < 100 && result == FCT_OK; ++i)
        result = STARVE(fct_scene_add_light_group(scene, "a group", &id));
    return finish_scene(scene, result);
}

static fct_result commit_with(const fct_env *env, fct_backend backend) {
    fct_scene *scene;
    uint32_t id;
    fct_material material = {.name = "grey"};
    assert_int_equal(fct_scene_create(env, backend, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "ball", &inputs.ball, NULL, NULL, id, NULL), FCT_OK);
    assert_int_equal(fct_scene_add_instance(scene, "ball", 0, far_away, FCT_NONE), FCT_OK);
    return finish_scene(scene, STARVE(fct_scene_commit(scene)));
}

static fct_result commit(const fct_env *env) {
    return commit_with(env, FCT_BACKEND_OBB);
}

static fct_result commit_embree(const fct_env *env) {
    return commit_with(env, FCT_BACKEND_EMBREE);
}

static fct_result commit_multires(const fct_env *env) {
    return commit_with(env, FCT_BACKEND_MULTIRES);
}

static fct_result complete_scene(const fct_env *env) {
    fct_scene *scene;
    assert_int_equal(fct_scene_load(env, IN "lit.json", FCT_BACKEND_MULTIRES, &scene), FCT_OK);
    fct_result result = STARVE(fct_scene_complete(scene));
    fct_scene_destroy(scene);
    return result;
}

static fct_result load_scene(const fct_env *env, const char *path) {
    fct_scene *scene;
    fct_result result = STARVE(fct_scene_load(env, path, FCT_BACKEND_OBB, &scene));
    assert_int_equal(scene != NULL, result == FCT_OK);
    if (scene) fct_scene_destroy(scene);
    return result;
}

static fct_result load_json(const fct_env *env) {
    return load_scene(env, IN "lit.json");
}

static fct_result load_obj(const fct_env *env) {
    return load_scene(env, IN "lit.obj");
}

static fct_result load_gltf(const fct_env *env) {
    return load_scene(env, IN "corner.gltf");
}

static fct_result load_glb(const fct_env *env) {
    return load_scene(env, IN "sheet.glb");
}

static fct_result load_tree(const fct_env *env) {
    return load_scene(env, IN "sheet.fct");
}

static fct_result load_mesh(const fct_env *env) {
    fct_env turning = *env;
    turning.flip_inward = true;
    return load_scene(&turning, IN "ball.ply");
}

static fct_result find_library(const fct_env *env) {
    bool found;
    return STARVE(fct_scene_obj_has_library(env, IN "lit.obj", &found));
}

static fct_bake_def coarse(fct_bake_method method, fct_final final) {
    fct_bake_def def = fct_bake_def_default();
    def.method = method;
    def.final = final;
    def.error = 1e-2;
    def.max_edge = 1;
    def.samples = 4;
    return def;
}

static fct_result create_bake(const fct_env *env) {
    fct_bake_def def = coarse(FCT_BAKE_FACE, FCT_FINAL_GATHER);
    fct_bake *bake;
    fct_result result = STARVE(fct_bake_create(env, inputs.scene, &def, &bake));
    assert_int_equal(bake != NULL, result == FCT_OK);
    fct_bake_destroy(bake);
    return result;
}

static fct_bake *must_bake(const fct_env *env, fct_bake_method method, fct_final final) {
    fct_bake_def def = coarse(method, final);
    fct_bake *bake;
    assert_int_equal(fct_bake_create(env, inputs.scene, &def, &bake), FCT_OK);
    return bake;
}

static fct_result finish_bake(const fct_env *env, fct_bake *bake, fct_mesh *mesh, fct_result result) {
    if (result != FCT_OK) assert_null(mesh->positions);
    fct_mesh_release(env, mesh);
    fct_bake_destroy(bake);
    return result;
}

static fct_result bake_instance_with(const fct_env *env, fct_bake_method method, fct_final final) {
    fct_bake *bake = must_bake(env, method, final);
    fct_mesh mesh;
    return finish_bake(env, bake, &mesh, STARVE(fct_bake_instance(bake, 0, &mesh)));
}

static fct_result bake_lights(const fct_env *env) {
    fct_bake_def def = coarse(FCT_BAKE_FACE, FCT_FINAL_DIRECT);
    def.outputs = FCT_MESH_IRRADIANCE | FCT_MESH_DIRECT | FCT_MESH_INDIRECT | FCT_MESH_ERROR;
    fct_bake *bake;
    fct_mesh mesh;
    assert_int_equal(fct_bake_create(env, inputs.scene, &def, &bake), FCT_OK);
    return finish_bake(env, bake, &mesh, STARVE(fct_bake_instance(bake, 0, &mesh)));
}

static fct_result bake_object_with(const fct_env *env, fct_keep keep) {
    fct_bake_def def = coarse(FCT_BAKE_FACE, FCT_FINAL_DIRECT);
    def.keep = keep;
    fct_bake *bake;
    fct_mesh mesh;
    assert_int_equal(fct_bake_create(env, inputs.scene, &def, &bake), FCT_OK);
    return finish_bake(env, bake, &mesh, STARVE(fct_bake_object(bake, 0, &mesh)));
}

static fct_result bake_object(const fct_env *env) {
    return bake_object_with(env, FCT_KEEP_NONE);
}

static fct_result bake_corners(const fct_env *env) {
    return bake_object_with(env, FCT_KEEP_CORNER);
}

static fct_result bake_vertices(const fct_env *env) {
    return bake_object_with(env, FCT_KEEP_VERTEX);
}

static fct_result bake_faces(const fct_env *env) {
    return bake_object_with(env, FCT_KEEP_FACE);
}

static fct_result bake_instance(const fct_env *env) {
    return bake_instance_with(env, FCT_BAKE_FACE, FCT_FINAL_GATHER);
}

static fct_result bake_instance_direct(const fct_env *env) {
    return bake_instance_with(env, FCT_BAKE_FACE, FCT_FINAL_DIRECT);
}

static fct_result bake_instance_plain(const fct_env *env) {
    return bake_instance_with(env, FCT_BAKE_FACE, FCT_FINAL_NONE);
}

static fct_result bake_reference(const fct_env *env) {
    return bake_instance_with(env, FCT_BAKE_REFERENCE, FCT_FINAL_GATHER);
}

static fct_result bake_mesh(const fct_env *env) {
    fct_bake *bake = must_bake(env, FCT_BAKE_FACE, FCT_FINAL_NONE);
    fct_mesh mesh;
    return finish_bake(env, bake, &mesh, STARVE(fct_bake_mesh(bake, &mesh, NULL)));
}

static fct_result save_bake(const fct_env *env, fct_bake *bake, const char *document, bool merge) {
    fct_mesh merged = {0};
    fct_result result =
        STARVE(fct_bake_save_scene(bake, OUT "lit.glb", document, NULL, merge ? &merged : NULL));
    if (result != FCT_OK) assert_null(merged.positions);
    fct_mesh_release(env, &merged);
    fct_bake_destroy(bake);
    return result;
}

static fct_result save_scene(const fct_env *env) {
    return save_bake(env, must_bake(env, FCT_BAKE_FACE, FCT_FINAL_NONE), NULL, true);
}

static fct_result save_faces(const fct_env *env) {
    fct_bake_def def = coarse(FCT_BAKE_FACE, FCT_FINAL_NONE);
    def.keep = FCT_KEEP_FACE;
    fct_bake *bake;
    assert_int_equal(fct_bake_create(env, inputs.scene, &def, &bake), FCT_OK);
    return save_bake(env, bake, NULL, false);
}

static fct_result save_document(const fct_env *env) {
    fct_bake_def def = coarse(FCT_BAKE_FACE, FCT_FINAL_NONE);
    fct_scene *scene;
    fct_bake *bake;
    assert_int_equal(fct_scene_load(env, IN "corner.gltf", FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_bake_create(env, scene, &def, &bake), FCT_OK);
    fct_result result = save_bake(env, bake, IN "corner.gltf", false);
    fct_scene_destroy(scene);
    return result;
}

static fct_result bake_probe_with(const fct_env *env, fct_bake_method method) {
    static const float points[6] = {.2F, .2F, 0, .5F, .5F, .5F}, normals[6] = {0, 0, 1, 0, 0, 1};
    fct_bake *bake = must_bake(env, method, FCT_FINAL_GATHER);
    fct_probe probes[2];
    fct_result result = STARVE(fct_bake_probe(bake, 2, points, normals, probes));
    fct_bake_destroy(bake);
    return result;
}

static fct_result bake_probe(const fct_env *env) {
    return bake_probe_with(env, FCT_BAKE_FACE);
}

static fct_result bake_probe_reference(const fct_env *env) {
    return bake_probe_with(env, FCT_BAKE_REFERENCE);
}

const memory_call scene_calls[] = {{"fct_scene_create", "", create_scene, false},
                                   {"fct_scene_add_material", "", add_materials, false},
                                   {"fct_scene_add_texture", "", add_textures, false},
                                   {"fct_scene_read_texture", "", read_texture, false},
                                   {"fct_scene_paint_material", "", paint_material, false},
                                   {"fct_scene_add_object", "one material", add_object, false},
                                   {"fct_scene_add_object", "two materials", add_object_of_materials, false},
                                   {"fct_scene_add_object", "tree", add_tree, false},
                                   {"fct_scene_add_instance", "", add_instances, false},
                                   {"fct_scene_add_light_group", "", add_groups, false},
                                   {"fct_scene_commit", "obb", commit, false},
                                   {"fct_scene_commit", "embree", commit_embree, true},
                                   {"fct_scene_commit", "multires", commit_multires, false},
                                   {"fct_scene_complete", "", complete_scene, false},
                                   {"fct_scene_load", "json", load_json, false},
                                   {"fct_scene_load", "obj", load_obj, false},
                                   {"fct_scene_load", "gltf", load_gltf, false},
                                   {"fct_scene_load", "glb", load_glb, false},
                                   {"fct_scene_load", "fct", load_tree, false},
                                   {"fct_scene_load", "ply", load_mesh, false},
                                   {"fct_scene_obj_has_library", "", find_library, false},
                                   {"fct_bake_create", "", create_bake, false},
                                   {"fct_bake_instance", "gather", bake_instance, false},
                                   {"fct_bake_instance", "direct", bake_instance_direct, false},
                                   {"fct_bake_instance", "none", bake_instance_plain, false},
                                   {"fct_bake_instance", "reference", bake_reference, false},
                                   {"fct_bake_instance", "all outputs", bake_lights, false},
                                   {"fct_bake_object", "", bake_object, false},
                                   {"fct_bake_object", "corner", bake_corners, false},
                                   {"fct_bake_object", "vertex", bake_vertices, false},
                                   {"fct_bake_object", "face", bake_faces, false},
                                   {"fct_bake_mesh", "", bake_mesh, false},
                                   {"fct_bake_save_scene", "new", save_scene, false},
                                   {"fct_bake_save_scene", "faces", save_faces, false},
                                   {"fct_bake_save_scene", "document", save_document, false},
                                   {"fct_bake_probe", "face", bake_probe, false},
                                   {"fct_bake_probe", "reference", bake_probe_reference, false},
                                   {NULL, NULL, NULL, false}};
