/* tests/scene/test_attributes.c: the models of a scene keep texture coordinates, normals and colours. Those
 * of these meshes follow from the positions, so each can be checked wherever it is. */
#include "files.h"

#include "facetree/scene.h"

static int set_up(void **unused) {
    (void)unused;
    assert_non_null(mkdtemp(folder));
    return 0;
}

static void expect_normal(const float p[3], float n[3]) {
    float length = sqrtf(p[0] * p[0] + 4 * p[1] * p[1] + 1);
    n[0] = p[0] / length, n[1] = 2 * p[1] / length, n[2] = 1 / length;
}

/* Flat squares with texture coordinates x, y / 2. Two materials share them as on a chess board. */
static fct_mesh make_board(const fct_env *env) {
    fct_mesh grid = make_grid(env, 6), mesh;
    assert_int_equal(
        fct_mesh_create(env, grid.vertex_count, grid.face_count,
                        FCT_MESH_COLORS | FCT_MESH_NORMALS | FCT_MESH_TEXCOORDS | FCT_MESH_MATERIALS, &mesh),
        FCT_OK);
    memcpy(mesh.positions, grid.positions, 12 * (size_t)grid.vertex_count);
    memcpy(mesh.triangles, grid.triangles, 12 * (size_t)grid.face_count);
    for (size_t v = 0; v < mesh.vertex_count; ++v) {
        expect_normal(mesh.positions + 3 * v, mesh.normals + 3 * v);
        for (size_t k = 0; k < 3; ++k) mesh.colors[3 * v + k] = (1 + mesh.positions[3 * v]) / 4;
    }
    for (size_t c = 0; c < 3 * (size_t)mesh.face_count; ++c) {
        const float *p = mesh.positions + 3 * (size_t)mesh.triangles[c];
        mesh.texcoords[2 * c] = p[0], mesh.texcoords[2 * c + 1] = p[1] / 2;
    }
    for (uint32_t f = 0; f < mesh.face_count; ++f) mesh.materials[f] = f / 2 % 2;
    mesh.material_count = 2;
    mesh.material_names = fct_allocate_zero(env, 2, sizeof *mesh.material_names);
    for (uint32_t m = 0; m < 2; ++m) {
        mesh.material_names[m] = fct_allocate(env, 4, 1);
        strcpy(mesh.material_names[m], m ? "two" : "one");
    }
    fct_mesh_release(env, &grid);
    return mesh;
}

static void check_models(const fct_scene *scene, bool from_top, bool with_colors, uint32_t models) {
    const fct_scene_view view = fct_scene_get(scene);
    assert_int_equal(view.model_count, models);
    for (uint32_t m = 0; m < models; ++m) {
        const fct_model *model = &view.models[m];
        const fct_tree_view t = fct_tree_get(model->tree);
        assert_non_null(model->texcoords);
        assert_non_null(model->normals);
        assert_int_equal(t.colors != NULL, with_colors);
        for (size_t v = 0; v < t.vertex_count; ++v) {
            float n[3];
            const float *p = t.positions + 3 * v;
            expect_normal(p, n);
            for (size_t k = 0; k < 3; ++k) assert_true(fabsf(model->normals[3 * v + k] - n[k]) < 1e-5F);
            if (with_colors) assert_true(fabsf(t.colors[3 * v + 1] - (1 + p[0]) / 4) < .01F);
        }
        for (size_t c = 0; c < 3 * (size_t)t.face_count; ++c) {
            const float *p = t.positions + 3 * (size_t)t.triangles[c];
            const float v = from_top ? p[1] / 2 : 1 - p[1] / 2;
            assert_true(fabsf(model->texcoords[2 * c] - p[0]) < 1e-5F);
            assert_true(fabsf(model->texcoords[2 * c + 1] - v) < 1e-5F);
        }
    }
}

static void check_file(const char *name, bool from_top, bool with_colors, uint32_t models) {
    const fct_env env = fct_env_default();
    fct_scene *scene;
    assert_int_equal(fct_scene_load(&env, path_of(name), FCT_BACKEND_OBB, &scene), FCT_OK);
    check_models(scene, from_top, with_colors, models);
    fct_scene_destroy(scene);
}

static void all_readers_pass_them_on(void **unused) {
    (void)unused;
    const fct_env env = fct_env_default();
    static const char *const files[] = {"board.ply", "board.obj", "board.glb"};
    fct_mesh mesh = make_board(&env);
    for (int k = 0; k < 3; ++k) assert_int_equal(fct_mesh_save(&env, path_of(files[k]), &mesh, NULL), FCT_OK);
    write_text("whole.json", "{\"materials\": {\"w\": {}}, \"models\": {\"b\": \"board.ply\"}, "
                             "\"instances\": [{\"model\": \"b\", \"material\": \"w\"}]}");
    write_text("parts.json", "{\"materials\": {\"w\": {}}, \"models\": {\"b\": \"board.obj\"}, "
                             "\"instances\": [{\"model\": \"b\", \"materials\": {\"*\": \"w\"}}]}");
    check_file("board.ply", false, true, 1);
    check_file("whole.json", false, true, 1);
    check_file("parts.json", false, true, 2);
    check_file("board.obj", false, true, 2);
    /* Radiosity and exposed colours are light, not colours of the surface. */
    check_file("board.glb", true, false, 2);
    fct_mesh_release(&env, &mesh);
}

/* A mesh beside a given tree, and a mesh whose bodies are turned. */
static void a_tree_takes_them_from_its_mesh(void **unused) {
    (void)unused;
    const fct_env env = fct_env_default();
    fct_mesh mesh = make_board(&env);
    fct_scene *scene;
    fct_tree *tree;
    const fct_material white = {.name = "white"};
    uint32_t id;
    for (uint32_t roots = 1; roots <= 80; roots += 79) { /* a tree of 80 roots is built again */
        fct_tree_def def = fct_tree_def_default();
        def.root_count = roots;
        assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
        assert_int_equal(fct_scene_add_material(scene, &white, &id), FCT_OK);
        assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_OK);
        const uint32_t faces = mesh.face_count;
        if (roots == 1) {
            recorder r = {0};
            fct_scene *other;
            fct_tree *copy;
            fct_env recording = recorder_env(&r);
            assert_int_equal(fct_scene_create(&recording, FCT_BACKEND_OBB, &other), FCT_OK);
            assert_int_equal(fct_scene_add_material(other, &white, &id), FCT_OK);
            assert_int_equal(fct_tree_build(&recording, &mesh, &def, NULL, &copy), FCT_OK);
            mesh.face_count = faces - 1;
            assert_int_equal(fct_scene_add_object(other, "b", &mesh, copy, NULL, id, NULL), FCT_ERROR_DATA);
            mesh.face_count = faces;
            assert_non_null(strstr(r.text, "its mesh 71 and 49"));
            fct_scene_destroy(other);
            assert_int_equal(r.alive, 0);
        }
        assert_int_equal(fct_scene_add_object(scene, "b", &mesh, tree, NULL, id, NULL), FCT_OK);
        check_models(scene, true, true, 1);
        fct_scene_destroy(scene);
    }
    fct_mesh_release(&env, &mesh);
}

/* A closed body of inward winding: texture coordinates follow their corners, and normals turn around. */
static void turned_bodies_keep_them(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    env.flip_inward = true;
    fct_mesh plain = make_sphere(&env, 8), mesh;
    assert_int_equal(fct_mesh_create(&env, plain.vertex_count, plain.face_count,
                                     FCT_MESH_NORMALS | FCT_MESH_TEXCOORDS, &mesh),
                     FCT_OK);
    memcpy(mesh.positions, plain.positions, 12 * (size_t)plain.vertex_count);
    for (size_t f = 0; f < mesh.face_count; ++f)
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t v = mesh.triangles[3 * f + k] = plain.triangles[3 * f + 2 - k];
            memcpy(mesh.texcoords + 6 * f + 2 * k, mesh.positions + 3 * (size_t)v, 8);
        }
    for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i) mesh.normals[i] = -mesh.positions[i];
    const fct_material white = {.name = "white"};
    uint32_t id;
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &white, &id), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "ball", &mesh, NULL, NULL, id, NULL), FCT_OK);
    const fct_model *model = fct_scene_get(scene).models;
    const fct_tree_view t = fct_tree_get(model->tree);
    assert_false(t.inward);
    for (size_t c = 0; c < 3 * (size_t)t.face_count; ++c)
        assert_memory_equal(model->texcoords + 2 * c, t.positions + 3 * (size_t)t.triangles[c], 8);
    for (size_t i = 0; i < 3 * (size_t)t.vertex_count; ++i) assert_true(model->normals[i] == t.positions[i]);
    fct_scene_destroy(scene);
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &plain);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_readers_pass_them_on),
        cmocka_unit_test(a_tree_takes_them_from_its_mesh),
        cmocka_unit_test(turned_bodies_keep_them),
    };
    return cmocka_run_group_tests(tests, set_up, remove_folder);
}
