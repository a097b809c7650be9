/* tests/scene/test_gltf.c: glTF scenes: materials, shared meshes, nodes, cameras, buffers in files and in the
 * text, refused files. */
#include "files.h"

#include "facetree/scene.h"
#include "scene/read/load.h"
#include "scene/transform.h"

static int set_up(void **unused) {
    (void)unused;
    static const unsigned char indices[6] = {0, 1, 2, 0, 2, 3};
    assert_non_null(mkdtemp(folder));
    write_bytes("six indices.bin", indices, sizeof indices);
    return 0;
}

/* Four corners of the unit square, floats: 0 0 0, 1 0 0, 1 1 0, 0 1 0. */
#define SQUARE                                                                                               \
    "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAAAAAAAAAAgD8AAAAA"
#define BUFFERS(bytes)                                                                                       \
    "\"buffers\": [{\"byteLength\": 48, \"uri\": \"" SQUARE "\"}, {\"byteLength\": " bytes                   \
    ", \"uri\": \"six%20indices.bin\"}],"
#define VIEWS                                                                                                \
    "\"bufferViews\": [{\"buffer\": 0, \"byteLength\": 48}, {\"buffer\": 1, \"byteLength\": 6}],"            \
    "\"accessors\": [{\"bufferView\": 0, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC3\"},"        \
    "{\"bufferView\": 1, \"componentType\": 5121, \"count\": 6, \"type\": \"SCALAR\"}],"
#define MESHES                                                                                               \
    "\"meshes\": [{\"name\": \"square\", \"primitives\": ["                                                  \
    "{\"attributes\": {\"POSITION\": 0}, \"indices\": 1, \"material\": 0},"                                  \
    "{\"attributes\": {\"POSITION\": 0}, \"mode\": 5, \"material\": 1}]}],"
#define MATERIALS                                                                                            \
    "\"materials\": [{\"name\": \"red\", \"doubleSided\": true, \"pbrMetallicRoughness\": "                  \
    "{\"baseColorFactor\": "                                                                                 \
    "[0.5, 0.25, 0.125, 1]}}, {\"emissiveFactor\": [1, 0.5, 0], \"extensions\": "                            \
    "{\"KHR_materials_emissive_strength\": {\"emissiveStrength\": 4}}}],"
#define NODES                                                                                                \
    "\"cameras\": [{\"type\": \"perspective\", \"perspective\": {\"yfov\": 0.5, \"znear\": 1}}],"            \
    "\"nodes\": [{\"name\": \"top\", \"translation\": [1, 2, 3], \"children\": [1, 2]},"                     \
    "{\"name\": \"left\", \"mesh\": 0, \"scale\": [-2, 2, 2]},"                                              \
    "{\"mesh\": 0, \"matrix\": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]},"                          \
    "{\"camera\": 0, \"translation\": [0, 0, 9]}],"
#define SCENES "\"scenes\": [{\"nodes\": [0, 3]}], \"scene\": 0, "
/* One triangle of zeros, whose buffer has this URI. */
#define BUFFER(uri)                                                                                          \
    "{\"buffers\": [{\"byteLength\": 36, \"uri\": " uri                                                      \
    "}], \"bufferViews\": [{\"buffer\": 0, \"byteLength\": 36}],"                                            \
    "\"accessors\": [{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"}],"       \
    "\"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], " ASSET
#define ASSET "\"asset\": {\"version\": \"2.0\"}}"

static fct_result load(const fct_env *env, const char *text, fct_scene **scene) {
    write_text("s.gltf", text);
    return fct_scene_load(env, path_of("s.gltf"), FCT_BACKEND_OBB, scene);
}

static void reads_nodes_materials_and_camera(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_scene *scene;
    assert_int_equal(load(&env, "{" BUFFERS("6") VIEWS MESHES MATERIALS NODES SCENES ASSET, &scene), FCT_OK);
    fct_scene_view v = fct_scene_get(scene);
    assert_int_equal(v.material_count, 3);
    assert_string_equal(v.materials[0].name, "red");
    assert_true(v.materials[0].two_sided && v.materials[0].reflectance[2] == .125f);
    assert_true(!v.materials[1].two_sided && v.materials[1].reflectance[0] == .9f);
    assert_true(v.materials[1].emission[0] == 4 && v.materials[1].emission[1] == 2);
    assert_int_equal(v.model_count, 2); /* the mesh's two materials, shared by both nodes */
    assert_int_equal(v.instance_count, 4);
    assert_int_equal(v.object_count, 2);
    assert_int_equal(v.face_count, 8); /* two triangles by indices, two of the strip, twice */
    for (int m = 0; m < 2; ++m) {      /* each triangle is half of the square */
        fct_tree_view tree = fct_tree_get(v.models[m].tree);
        for (uint32_t f = 0; f < tree.face_count; ++f) {
            v3 p[3];
            for (uint32_t k = 0; k < 3; ++k) p[k] = v3_load(tree.positions + 3 * tree.triangles[3 * f + k]);
            v3 cross = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
            assert_true(fabs(fabs(cross.z) - 1) < 1e-6);
        }
    }
    assert_string_equal(v.instances[0].name, "left");
    assert_true(v.instances[0].mirrored && v.instances[0].uniform_scale == 2);
    assert_true(v.instances[0].material == 0 && v.instances[1].material == 1);
    v3 at = fct_transform_point(v.instances[2].to_world, v3_make(1, 0, 0));
    assert_true(v3_norm(v3_sub(at, v3_make(6, 3, 3))) < 1e-6);
    assert_true(v.camera.given && v.camera.position[2] == 9 && v.camera.target[2] == 8 &&
                v.camera.up[1] == 1);
    assert_true(fabs(v.camera.vertical_fov - 28.6479) < 1e-3);
    fct_scene_destroy(scene);
}

static void reads_what_the_mesh_writer_writes(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_scene *scene;
    const char *path = path_of("sphere.glb");
    fct_mesh mesh = make_sphere(&env, 6);
    assert_int_equal(fct_mesh_save(&env, path, &mesh, NULL), FCT_OK);
    assert_int_equal(fct_scene_load(&env, path, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_get(scene).face_count, mesh.face_count);
    fct_mesh_release(&env, &mesh);
    fct_scene_destroy(scene);
}

static void refuses_bad_files(void **unused) {
    (void)unused;
    static const struct {
        const char *text, *message;
        fct_result result;
    } cases[] = {
        {"", "s.gltf:1", FCT_ERROR_DATA},
        {"{\"buffers\":", "s.gltf:1:", FCT_ERROR_DATA},
        {"[]", "its JSON is no object", FCT_ERROR_DATA},
        {"{" ASSET, "at least one face", FCT_ERROR_DATA},
        {BUFFER("\"gone.bin\""), "gone.bin", FCT_ERROR_INPUT},
        {BUFFER("\"data:;base64,?\""), "not base64", FCT_ERROR_DATA},
        {BUFFER("\"data:,x\""), "not base64", FCT_ERROR_DATA},
        {BUFFER("\"http://host/six.bin\""), "neither a data URI nor a file", FCT_ERROR_DATA},
        {BUFFER("\"six%00.bin\""), "zero byte", FCT_ERROR_DATA},
        {BUFFER("7"), "buffers[0] has neither a uri nor a BIN chunk", FCT_ERROR_DATA},
        {BUFFER("\"data:;base64,AAAAAA==\""), "bufferViews[0] reaches beyond buffers[0], which has 4 bytes",
         FCT_ERROR_DATA},
        {"{" BUFFERS("6") VIEWS MESHES NODES SCENES ASSET, "materials[0] does not exist", FCT_ERROR_DATA},
        {"{\"materials\": [{\"emissiveFactor\": [-1, 0, 0]}], " ASSET,
         "materials[0]: expected a base colour and an emission >= 0", FCT_ERROR_DATA},
        {"{\"materials\": [{\"emissiveFactor\": [1, 0]}], " ASSET,
         "materials[0]: emissiveFactor is not 3 numbers", FCT_ERROR_DATA},
        {"{\"materials\": [{\"pbrMetallicRoughness\": {\"baseColorFactor\": [-2, 0, 0, 1]}}], " ASSET,
         "materials[0]: expected a base colour and an emission >= 0", FCT_ERROR_DATA},
        {"{\"nodes\": [{\"children\": [0]}], " SCENES ASSET, "nodes[0] has two parents", FCT_ERROR_DATA},
        {"{\"nodes\": [{\"mesh\": 4}], \"scenes\": [{\"nodes\": [0]}], " ASSET, "meshes[4] does not exist",
         FCT_ERROR_DATA},
        {"{\"nodes\": [{\"rotation\": [1]}], \"scenes\": [{\"nodes\": [0]}], " ASSET,
         "nodes[0]: rotation is not 4 numbers", FCT_ERROR_DATA},
        {"{\"nodes\": [{}], \"scenes\": [{\"nodes\": [0]}], " ASSET, "at least one face", FCT_ERROR_DATA},
        {"{" BUFFERS("6") VIEWS MESHES MATERIALS
         "\"nodes\": [{\"mesh\": 0, \"scale\": [0, 1, 1]}], \"scenes\": [{\"nodes\": [0]}], " ASSET,
         "at least one face", FCT_ERROR_DATA},
        {"{\"asset\": {\"version\": \"1.0\"}, \"nodes\": {}}", "found glTF 1.0", FCT_ERROR_DATA},
        {"{\"nodes\": {}}", "found glTF 1.0", FCT_ERROR_DATA},
        {"{\"asset\": {\"version\": \"2.1\", \"minVersion\": \"2.1\"}}", "found glTF 2.1", FCT_ERROR_DATA},
        {"{\"extensionsRequired\": [\"KHR_lights_punctual\"], " ASSET,
         "the required extension KHR_lights_punctual is not supported", FCT_ERROR_DATA},
        {"{\"extensionsRequired\": [\"KHR_materials_transmission\"], " ASSET, "KHR_materials_transmission",
         FCT_ERROR_DATA},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        fct_scene *scene;
        fct_result result = load(&env, cases[k].text, &scene);
        if (result != cases[k].result || !strstr(r.text, cases[k].message))
            fail_msg("case %zu: result %d, message: %s\nexpected: %s", k, result, r.text, cases[k].message);
        assert_null(scene);
        assert_int_equal(r.alive, 0);
    }
}

static void fails_cleanly_at_every_allocation(void **unused) {
    (void)unused;
    for (long n = 1;; ++n) {
        recorder r = {.fail_at = n};
        fct_env env = recorder_env(&r);
        fct_scene *scene;
        fct_result result = load(&env, "{" BUFFERS("6") VIEWS MESHES MATERIALS NODES SCENES ASSET, &scene);
        if (result == FCT_OK) fct_scene_destroy(scene);
        assert_int_equal(r.alive, 0);
        assert_int_equal(result, r.allocations < n ? FCT_OK : FCT_ERROR_MEMORY);
        if (result == FCT_OK) break;
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_nodes_materials_and_camera),
        cmocka_unit_test(reads_what_the_mesh_writer_writes),
        cmocka_unit_test(refuses_bad_files),
        cmocka_unit_test(fails_cleanly_at_every_allocation),
    };
    return cmocka_run_group_tests(tests, set_up, remove_folder);
}
