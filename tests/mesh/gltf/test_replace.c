/* Replacing the triangles of a glTF document: everything else stays, and the triangles stay where they were.
 */
#include "mesh/mesh_support.h"

#include <jansson.h>

#include "base/math/vec.h"

static char folder[] = "/tmp/facetree-replace-XXXXXX";

static const char *path_of(const char *name) {
    static char path[2][200];
    static int next;
    char *out = path[next ^= 1];
    snprintf(out, sizeof path[0], "%s/%s", folder, name);
    return out;
}

static void write_file(const char *name, const void *data, size_t size) {
    FILE *file = fopen(path_of(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

/* A roof of three corners on a ridge and four below, in two primitives; a tetrahedron; points. The roof is
 * placed twice, the first time mirrored; the tetrahedron below a turned node; nothing places the last mesh.
 * %s: a translation. */
static const char *const document =
    "{\"asset\":{\"version\":\"2.0\",\"copyright\":\"us\"},\"scene\":1,"
    "\"scenes\":[{\"name\":\"empty\"},{\"name\":\"hall\",\"nodes\":[0,1,2,5]}],"
    "\"nodes\":[{\"name\":\"left roof\",\"mesh\":0,\"scale\":[-2,1,3],\"translation\":[%s,5,6]},"
    "{\"name\":\"right roof\",\"mesh\":0,\"translation\":[9,0,0]},"
    "{\"name\":\"turned\",\"rotation\":[0.5,0.5,0.5,0.5],\"children\":[3,4],\"extras\":{\"key\":7}},"
    "{\"name\":\"tip\",\"mesh\":1,\"matrix\":[1,0,0,0,0.5,2,0,0,0,0,1,0,3,4,%s,1]},"
    "{\"name\":\"eye\",\"camera\":0},{\"name\":\"dust\",\"mesh\":2}],"
    "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":1,\"znear\":0.1}}],"
    "\"materials\":[{\"name\":\"tile\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}},"
    "{\"name\":\"stone\",\"doubleSided\":true},{\"name\":\"gold\",\"emissiveFactor\":[1,0.5,0.25]}],"
    "\"textures\":[{\"source\":0},{\"source\":1},{\"source\":2}],"
    "\"images\":[{\"uri\":\"tile.png\",\"name\":\"tile\"},{\"uri\":\"data:image/png;base64,iVBORw0KGgo=\"},"
    "{\"uri\":\"lost.png\"}],"
    "\"meshes\":[{\"name\":\"roof\",\"extras\":[1,2],\"primitives\":["
    "{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1,\"NORMAL\":2},\"indices\":3,\"material\":0},"
    "{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1,\"NORMAL\":2},\"indices\":4,\"material\":1,\"extras\":"
    "\"south\"}]},"
    "{\"name\":\"tip\",\"primitives\":[{\"attributes\":{\"POSITION\":5,\"NORMAL\":6},\"indices\":7,"
    "\"material\":2}]},"
    "{\"name\":\"dust\",\"primitives\":[{\"attributes\":{\"POSITION\":5},\"mode\":0}]},"
    "{\"name\":\"spare\",\"primitives\":[{\"attributes\":{\"POSITION\":5,\"NORMAL\":6},\"indices\":7}]}],"
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":6,\"type\":\"VEC3\"},"
    "{\"bufferView\":1,\"componentType\":5126,\"count\":6,\"type\":\"VEC2\"},"
    "{\"bufferView\":2,\"componentType\":5126,\"count\":6,\"type\":\"VEC3\"},"
    "{\"bufferView\":3,\"componentType\":5121,\"count\":6,\"type\":\"SCALAR\"},"
    "{\"bufferView\":3,\"byteOffset\":6,\"componentType\":5121,\"count\":6,\"type\":\"SCALAR\"},"
    "{\"bufferView\":4,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
    "{\"bufferView\":2,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
    "{\"bufferView\":5,\"componentType\":5121,\"count\":12,\"type\":\"SCALAR\"}],"
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":72},{\"buffer\":0,\"byteOffset\":72,\"byteLength\":48},"
    "{\"buffer\":0,\"byteOffset\":120,\"byteLength\":72},{\"buffer\":0,\"byteOffset\":192,\"byteLength\":12},"
    "{\"buffer\":0,\"byteOffset\":204,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":252,\"byteLength\":12}]"
    ","
    "\"buffers\":[{\"byteLength\":264,\"uri\":\"roof.bin\"}]}";

typedef struct document_bytes {
    float roof[18], texcoords[12], normals[18];
    unsigned char sides[12];
    float tip[12];
    unsigned char corners[12];
} document_bytes;

static int set_up(void **unused) {
    (void)unused;
    static const document_bytes all = {
        {0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 1, 0, 2, 0, 1, 2, 0},
        {0, 0, 1, 0, 0, .5f, 1, .5f, 0, 1, 1, 1},
        {0, -.6f, .8f, 0, -.6f, .8f, 0, 0, 1, 0, 0, 1, 0, .6f, .8f, 0, .6f, .8f},
        {0, 1, 3, 0, 3, 2, 2, 3, 5, 2, 5, 4},
        {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1},
        {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}};
    char text[8192];
    assert_non_null(mkdtemp(folder));
    write_file("roof.bin", &all, sizeof all);
    write_file("tile.png", "\x89PNG\r\n\x1a\nnot really", 18);
    write_file("near.gltf", text, (size_t)snprintf(text, sizeof text, document, "4", "5"));
    write_file("far.gltf", text,
               (size_t)snprintf(text, sizeof text, document, "10000000.25", "10000000.125"));
    return 0;
}

static int clear(void **unused) {
    (void)unused;
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

/* The JSON of a GLB. */
static json_t *read_root(const char *name) {
    FILE *file = fopen(path_of(name), "rb");
    unsigned char head[20];
    assert_non_null(file);
    assert_int_equal(fread(head, 1, 20, file), 20);
    size_t length = head[12] | (size_t)head[13] << 8 | (size_t)head[14] << 16;
    char *text = malloc(length);
    assert_int_equal(fread(text, 1, length, file), length);
    fclose(file);
    json_t *root = json_loadb(text, length, 0, NULL);
    assert_non_null(root);
    free(text);
    return root;
}

static json_t *item(json_t *root, const char *list, size_t index) {
    return json_array_get(json_object_get(root, list), index);
}

/* Whether an object equals the text. */
static void assert_json(const json_t *object, const char *text) {
    json_t *expected = json_loads(text, JSON_DECODE_ANY, NULL);
    assert_non_null(expected);
    assert_true(json_equal(object, expected));
    json_decref(expected);
}

static v3 world_corner(const fct_mesh *m, uint32_t face, int c) {
    const float *p = m->positions + 3 * (size_t)m->triangles[3 * face + (uint32_t)c];
    return v3_make(m->origin[0] + (double)p[0], m->origin[1] + (double)p[1], m->origin[2] + (double)p[2]);
}

/* The same faces, corner for corner. */
static void assert_same_surface(const fct_mesh *a, const fct_mesh *b) {
    assert_int_equal(a->face_count, b->face_count);
    for (uint32_t f = 0; f < a->face_count; ++f) {
        assert_int_equal(a->materials[f], b->materials[f]);
        for (int c = 0; c < 3; ++c) {
            uint32_t i = 3 * f + (uint32_t)c;
            assert_true(v3_norm(v3_sub(world_corner(a, f, c), world_corner(b, f, c))) < 1e-5);
            v3 n = v3_load(a->normals + 3 * a->triangles[i]), m = v3_load(b->normals + 3 * b->triangles[i]);
            assert_true(v3_norm(v3_sub(n, m)) < 1e-6);
            bool tip = a->materials[f] > 1;
            for (int k = 0; k < 2 && !tip; ++k)
                assert_true(a->texcoords[2 * i + (uint32_t)k] == b->texcoords[2 * i + (uint32_t)k]);
        }
    }
}

static void the_rest_of_a_document_stays(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    for (int far = 0; far < 2; ++far) {
        fct_gltf *gltf, *again;
        fct_mesh mesh, copy;
        assert_int_equal(fct_gltf_open(&env, path_of(far ? "far.gltf" : "near.gltf"), &gltf, &mesh), FCT_OK);
        assert_int_equal(mesh.face_count, 4 + 4 + 4);
        assert_int_equal(mesh.material_count, 4);
        assert_true((mesh.origin[0] != 0) == (far == 1));
        /* The mirrored roof still faces up: its winding is turned. */
        v3 up = v3_cross(v3_sub(world_corner(&mesh, 0, 1), world_corner(&mesh, 0, 0)),
                         v3_sub(world_corner(&mesh, 0, 2), world_corner(&mesh, 0, 0)));
        assert_true(up.z > 0);
        assert_int_equal(fct_gltf_save(gltf, path_of("out.glb"), &mesh, NULL), FCT_OK);
        json_t *root = read_root("out.glb");
        assert_json(json_object_get(root, "scenes"),
                    "[{\"name\":\"empty\"},{\"name\":\"hall\",\"nodes\":[0,1,2,5]}]");
        assert_int_equal(json_integer_value(json_object_get(root, "scene")), 1);
        assert_string_equal(json_string_value(json_object_get(json_object_get(root, "asset"), "copyright")),
                            "us");
        assert_json(item(root, "nodes", 1), "{\"name\":\"right roof\",\"mesh\":0,\"translation\":[9,0,0]}");
        assert_json(item(root, "nodes", 2),
                    "{\"name\":\"turned\",\"rotation\":[0.5,0.5,0.5,0.5],\"children\":[3,4],"
                    "\"extras\":{\"key\":7}}");
        assert_json(item(root, "nodes", 5), "{\"name\":\"dust\"}");
        assert_json(item(root, "materials", 2), "{\"name\":\"gold\",\"emissiveFactor\":[1,0.5,0.25]}");
        assert_int_equal(json_array_size(json_object_get(root, "cameras")), 1);
        assert_int_equal(json_array_size(json_object_get(root, "meshes")), 3);
        assert_string_equal(json_string_value(json_object_get(item(root, "meshes", 2), "name")), "spare");
        json_t *south = json_array_get(json_object_get(item(root, "meshes", 0), "primitives"), 1);
        assert_string_equal(json_string_value(json_object_get(south, "extras")), "south");
        assert_int_equal(json_integer_value(json_object_get(south, "material")), 1);
        json_t *tip = json_array_get(json_object_get(item(root, "meshes", 1), "primitives"), 0);
        assert_null(json_object_get(json_object_get(tip, "attributes"), "TEXCOORD_0"));
        /* Images are in the file, except for the lost one. */
        assert_null(json_object_get(item(root, "images", 0), "uri"));
        assert_string_equal(json_string_value(json_object_get(item(root, "images", 0), "mimeType")),
                            "image/png");
        size_t view = (size_t)json_integer_value(json_object_get(item(root, "images", 0), "bufferView"));
        assert_int_equal(json_integer_value(json_object_get(item(root, "bufferViews", view), "byteLength")),
                         18);
        assert_int_equal(
            json_integer_value(json_object_get(item(root, "bufferViews", view + 1), "byteLength")), 8);
        assert_int_equal(
            json_integer_value(json_object_get(item(root, "bufferViews", view + 1), "byteOffset")) % 4, 0);
        assert_json(item(root, "images", 2), "{\"uri\":\"lost.png\"}");
        assert_int_equal(fct_gltf_open(&env, path_of("out.glb"), &again, &copy), FCT_OK);
        assert_same_surface(&mesh, &copy);
        json_decref(root);
        fct_gltf_close(gltf), fct_gltf_close(again);
        fct_mesh_release(&env, &mesh), fct_mesh_release(&env, &copy);
    }
}

/* Keeps the faces of one material. */
static void keep_material(const fct_env *env, const fct_mesh *mesh, uint32_t material, fct_mesh *out) {
    uint32_t faces[16], count = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f)
        if (mesh->materials[f] == material) faces[count++] = f;
    assert_int_equal(fct_mesh_extract(env, mesh, faces, count, out, NULL), FCT_OK);
}

static void empty_primitives_and_meshes_are_left_out(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_gltf *gltf;
    fct_mesh mesh, part;
    assert_int_equal(fct_gltf_open(&env, path_of("near.gltf"), &gltf, &mesh), FCT_OK);
    keep_material(&env, &mesh, 1, &part);
    assert_int_equal(fct_gltf_save(gltf, path_of("part.glb"), &part, NULL), FCT_OK);
    json_t *root = read_root("part.glb");
    assert_int_equal(json_array_size(json_object_get(root, "meshes")), 1);
    json_t *primitives = json_object_get(item(root, "meshes", 0), "primitives");
    assert_int_equal(json_array_size(primitives), 1);
    assert_int_equal(json_integer_value(json_object_get(json_array_get(primitives, 0), "material")), 1);
    assert_int_equal(json_integer_value(json_object_get(item(root, "nodes", 0), "mesh")), 0);
    assert_null(json_object_get(item(root, "nodes", 3), "mesh"));
    json_decref(root);
    fct_mesh_release(&env, &part);

    keep_material(&env, &mesh, 99, &part);
    assert_int_equal(fct_gltf_save(gltf, path_of("none.glb"), &part, NULL), FCT_OK);
    root = read_root("none.glb");
    assert_null(json_object_get(root, "meshes"));
    assert_null(json_object_get(root, "accessors"));
    assert_string_equal(json_string_value(json_object_get(item(root, "nodes", 0), "name")), "left roof");
    json_decref(root);
    fct_mesh_release(&env, &part);
    fct_mesh_release(&env, &mesh);
    fct_gltf_close(gltf);
}

/* A triangle whose second colour is half clear, in a document without an asset. */
static void alpha_is_reported_and_an_asset_is_made(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    const char *format =
        "{\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"COLOR_0\":1}}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":5121,\"normalized\":true,\"count\":3,\"type\":\"VEC4\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},"
        "{\"buffer\":0,\"byteOffset\":36,\"byteLength\":12}],"
        "\"buffers\":[{\"byteLength\":48,\"uri\":\"%s\"}]}";
    struct {
        float corners[9];
        unsigned char colors[12];
    } data = {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255}};
    for (int clear = 0; clear < 2; ++clear) {
        char text[1024];
        fct_gltf *gltf;
        fct_mesh mesh;
        if (clear) data.colors[7] = 128;
        write_file("colors.bin", &data, 48);
        write_file("colors.gltf", text, (size_t)snprintf(text, sizeof text, format, "colors.bin"));
        r.text[0] = 0, r.messages = 0;
        assert_int_equal(fct_gltf_open(&env, path_of("colors.gltf"), &gltf, &mesh), FCT_OK);
        assert_int_equal(r.messages, clear);
        assert_true(!clear || strstr(r.text, "alpha"));
        assert_int_equal(fct_gltf_save(gltf, path_of("colors.glb"), &mesh, NULL), FCT_OK);
        fct_mesh plain; /* a plain mesh loses the alpha too */
        r.text[0] = 0, r.messages = 0;
        assert_int_equal(fct_mesh_load(&env, path_of("colors.gltf"), &plain), FCT_OK);
        assert_int_equal(r.messages, clear);
        assert_true(!clear || strstr(r.text, "1 vertices have a colour with an alpha below 1"));
        fct_mesh_release(&env, &plain);
        json_t *root = read_root("colors.glb");
        assert_string_equal(json_string_value(json_object_get(json_object_get(root, "asset"), "version")),
                            "2.0");
        json_decref(root);
        fct_mesh_release(&env, &mesh);
        fct_gltf_close(gltf);
    }
}

static void other_meshes_are_refused(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_gltf *gltf;
    fct_mesh mesh;
    assert_int_equal(fct_gltf_open(&env, path_of("near.gltf"), &gltf, &mesh), FCT_OK);
    assert_int_equal(fct_gltf_save(gltf, path_of("out.ply"), &mesh, NULL), FCT_ERROR_DATA);
    mesh.material_count = 5, mesh.materials[3] = 4;
    assert_int_equal(fct_gltf_save(gltf, path_of("no.glb"), &mesh, NULL), FCT_ERROR_DATA);
    uint32_t *materials = mesh.materials;
    mesh.materials = NULL;
    assert_int_equal(fct_gltf_save(gltf, path_of("no.glb"), &mesh, NULL), FCT_ERROR_DATA);
    mesh.materials = materials;
    assert_null(fopen(path_of("no.glb"), "rb"));
    fct_mesh_release(&env, &mesh);
    fct_gltf_close(gltf);
    assert_int_equal(fct_gltf_open(&env, path_of("absent.glb"), &gltf, &mesh), FCT_ERROR_INPUT);
    assert_null(gltf);
    assert_int_equal(fct_gltf_open(&env, path_of("tile.png"), &gltf, &mesh), FCT_ERROR_DATA);
    assert_null(gltf);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_rest_of_a_document_stays),
        cmocka_unit_test(empty_primitives_and_meshes_are_left_out),
        cmocka_unit_test(alpha_is_reported_and_an_asset_is_made),
        cmocka_unit_test(other_meshes_are_refused),
    };
    return cmocka_run_group_tests(tests, set_up, clear);
}
