/* tests/mesh/gltf/test_gltf.c: glTF documents: sparse and compressed accessors, buffers in files and data
 * URIs, scenes, versions, features that are left out, files outside of the folder. */
#include "mesh/mesh_support.h"

#include <xxhash.h>

#ifdef FCT_HAS_MESHOPT
#include <meshoptimizer.h>
#endif

static char folder[] = "/tmp/facetree-gltf-XXXXXX";

/* Four corners 0 0 0, 1 0 0, 1 1 0, 0 1 0 as floats, then the indices 0 1 2 0 2 3 as bytes. */
static void fill_square(unsigned char out[56]) {
    static const float corners[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    static const unsigned char indices[8] = {0, 1, 2, 0, 2, 3, 0, 0};
    memcpy(out, corners, 48);
    memcpy(out + 48, indices, 8);
}

static void write_bytes(const char *name, const void *data, size_t size) {
    char path[200];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static int set_up(void **unused) {
    (void)unused;
    char path[200];
    unsigned char square[56];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/in", folder);
    assert_int_equal(mkdir(path, 0777), 0);
    snprintf(path, sizeof path, "%s/in/deep er", folder);
    assert_int_equal(mkdir(path, 0777), 0);
    fill_square(square);
    write_bytes("outside.bin", square, sizeof square);
    write_bytes("in/square.bin", square, sizeof square);
    write_bytes("in/deep er/100%.bin", square, sizeof square);
    snprintf(path, sizeof path, "%s/in/link.bin", folder);
    assert_int_equal(symlink("../outside.bin", path), 0);
    snprintf(path, sizeof path, "%s/in/zero.bin", folder);
    assert_int_equal(symlink("/dev/zero", path), 0);
    snprintf(path, sizeof path, "%s/in/pipe.bin", folder);
    return mkfifo(path, 0666);
}

static int clear(void **unused) {
    (void)unused;
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

/* Counts warnings, and keeps all texts. */
typedef struct messages {
    char text[4096];
    int warnings, errors;
} messages;

static void take(void *user, fct_severity severity, const char *text) {
    messages *m = user;
    size_t used = strlen(m->text);
    m->warnings += severity == FCT_MESSAGE_WARNING;
    m->errors += severity == FCT_MESSAGE_ERROR;
    snprintf(m->text + used, sizeof m->text - used, "%s\n", text);
}

/* Parts of the document of the square. */
#define VIEWS                                                                                                \
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":48,\"byteLength\":8}],"
#define ACCESSORS                                                                                            \
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"                \
    "{\"bufferView\":1,\"componentType\":5121,\"count\":6,\"type\":\"SCALAR\"}],"
#define MESH  "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
#define ASSET "\"asset\":{\"version\":\"2.0\"}}"

/* Loads in/s.gltf, which has the text. */
static fct_result load(const char *text, messages *m, bool outside, fct_mesh *mesh) {
    char path[200];
    fct_env env = fct_env_default();
    *m = (messages){0};
    env.message = take, env.message_user = m, env.allow_outside = outside;
    write_bytes("in/s.gltf", text, strlen(text));
    snprintf(path, sizeof path, "%s/in/s.gltf", folder);
    return fct_mesh_load(&env, path, mesh);
}

static void check_square(const fct_mesh *mesh) {
    unsigned char square[56];
    static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    fill_square(square);
    assert_int_equal(mesh->vertex_count, 4);
    assert_int_equal(mesh->face_count, 2);
    assert_memory_equal(mesh->positions, square, 48);
    assert_memory_equal(mesh->triangles, triangles, sizeof triangles);
}

#define SQUARE "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAAAAAAAAAAgD8AAAAA"

static void reads_buffers_of_every_kind(void **state) {
    (void)state;
    static const char *const uris[] = {
        "square.bin", "./square.bin", "deep%20er/100%25.bin", "deep er/100%.bin", "deep er\\\\100%.bin",
        /* base64 of the square, once with the other alphabet, blanks and no padding */
        "data:application/octet-stream;base64," SQUARE "AAECAAIDAAA=", "DATA:;base64," SQUARE " AAECAAIDAAA",
        "data:;charset=x;BASE64," SQUARE "AAECAAIDAAA%3D"};
    for (size_t i = 0; i < sizeof uris / sizeof *uris; ++i) {
        char text[2000];
        messages m;
        fct_mesh mesh;
        snprintf(text, sizeof text, "\xef\xbb\xbf{\"buffers\":[{\"uri\":\"%s\"}]," VIEWS ACCESSORS MESH ASSET,
                 uris[i]);
        if (load(text, &m, false, &mesh) != FCT_OK) fail_msg("%s: %s", uris[i], m.text);
        assert_int_equal(m.warnings, 0);
        check_square(&mesh);
        fct_env env = fct_env_default();
        fct_mesh_release(&env, &mesh);
        if (i) continue; /* the document in memory has no folder */
        recorder r = {0};
        assert_int_equal(parse_text(&r, "gltf", text, &mesh), FCT_ERROR_DATA);
        assert_non_null(strstr(r.text, "has no folder"));
    }
}

/* The hash of in/s.gltf. Its messages are those of the reader, not of the hash. */
static uint64_t hash_document(const char *text) {
    char path[200];
    messages m = {0};
    uint64_t hash;
    fct_env env = fct_env_default();
    env.message = take, env.message_user = &m;
    if (text) write_bytes("in/s.gltf", text, strlen(text));
    snprintf(path, sizeof path, "%s/in/s.gltf", folder);
    assert_int_equal(fct_mesh_file_hash(&env, path, &hash), FCT_OK);
    assert_string_equal(m.text, "");
    return hash;
}

static void hashes_the_buffers_too(void **state) {
    (void)state;
    static const char square[] = "{\"buffers\":[{\"uri\":\"a.bin\"}]," VIEWS ACCESSORS MESH ASSET,
                      embedded[] = "{\"buffers\":[{\"uri\":\"data:;base64," SQUARE
                                   "AAECAAIDAAA=\"}]," VIEWS ACCESSORS MESH ASSET;
    unsigned char data[56];
    fill_square(data);
    uint64_t missing = hash_document(square);
    write_bytes("in/a.bin", data, sizeof data);
    uint64_t first = hash_document(square);
    assert_true(first == hash_document(NULL) && first != missing);
    data[0] ^= 1;
    write_bytes("in/a.bin", data, sizeof data);
    assert_true(hash_document(NULL) != first);
    assert_true(hash_document(embedded) == XXH3_64bits(embedded, strlen(embedded)));
    assert_true(hash_document("{no JSON") == XXH3_64bits("{no JSON", 8));
    uint64_t hash;
    fct_env env = fct_env_default();
    assert_int_equal(fct_mesh_file_hash(&env, "missing.gltf", &hash), FCT_ERROR_INPUT);
    assert_int_equal(fct_mesh_file_hash(&env, "missing.ply", &hash), FCT_ERROR_INPUT);
}

static void reads_only_files_of_the_folder(void **state) {
    (void)state;
    char absolute[200];
    snprintf(absolute, sizeof absolute, "%s/in/square.bin", folder);
    const struct {
        const char *uri, *message;
        fct_result inside, outside; /* without and with allow_outside */
    } cases[] = {
        {"../outside.bin", "outside of its folder", FCT_ERROR_DATA, FCT_OK},
        {"%2e%2E/outside.bin", "outside of its folder", FCT_ERROR_DATA, FCT_OK},
        {"..%2Foutside.bin", "outside of its folder", FCT_ERROR_DATA, FCT_OK},
        {"..\\\\outside.bin", "outside of its folder", FCT_ERROR_DATA, FCT_OK},
        {"deep er/../../outside.bin", "outside of its folder", FCT_ERROR_DATA, FCT_OK},
        {"link.bin", "outside of its folder", FCT_ERROR_DATA, FCT_OK},
        {absolute, "outside of its folder", FCT_ERROR_DATA, FCT_OK},
        {"/dev/zero", "outside of its folder", FCT_ERROR_DATA, FCT_ERROR_DATA},
        {"zero.bin", "not a regular file", FCT_ERROR_DATA, FCT_ERROR_DATA},
        {"pipe.bin", "not a regular file", FCT_ERROR_DATA, FCT_ERROR_DATA},
        {"deep er", "not a regular file", FCT_ERROR_DATA, FCT_ERROR_DATA},
        {"file:///dev/zero", "neither a data URI nor a file", FCT_ERROR_DATA, FCT_ERROR_DATA},
        {"gone.bin", "gone.bin cannot be read", FCT_ERROR_INPUT, FCT_ERROR_INPUT},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i)
        for (int outside = 0; outside < 2; ++outside) {
            char text[1000];
            messages m;
            fct_mesh mesh;
            fct_env env = fct_env_default();
            snprintf(text, sizeof text, "{\"buffers\":[{\"uri\":\"%s\"}]," VIEWS ACCESSORS MESH ASSET,
                     cases[i].uri);
            fct_result result = load(text, &m, outside, &mesh);
            if (result != (outside ? cases[i].outside : cases[i].inside) ||
                (!outside && !strstr(m.text, cases[i].message)))
                fail_msg("%s: result %d, %s", cases[i].uri, (int)result, m.text);
            fct_mesh_release(&env, &mesh);
        }
}

/* Parses a GLB of the document and the bytes. */
static fct_result parse(const char *json, const void *binary, size_t size, messages *m, fct_mesh *mesh) {
    fct_env env = fct_env_default();
    bytes b = make_glb(json, binary, size);
    *m = (messages){0};
    env.message = take, env.message_user = m;
    return fct_mesh_parse(&env, "name", b.data, b.size, "glb", mesh);
}

/* Corner 2 moves to (7, 8, 9); also in an accessor without a view, whose other corners are 0. */
static void replaces_sparse_elements(void **state) {
    (void)state;
    for (int zeros = 0; zeros < 2; ++zeros)
        for (int size = 1; size <= 4; size *= 2) {
            unsigned char binary[80] = {0};
            static const float moved[3] = {7, 8, 9};
            char json[1500];
            messages m;
            fct_mesh mesh;
            fill_square(binary);
            binary[56] = 2; /* a little-endian index of any size */
            memcpy(binary + 60, moved, sizeof moved);
            snprintf(json, sizeof json,
                     "{\"buffers\":[{\"byteLength\":72}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},"
                     "{\"buffer\":0,\"byteOffset\":48,\"byteLength\":8},{\"buffer\":0,\"byteOffset\":56,"
                     "\"byteLength\":16}],\"accessors\":[{%s\"componentType\":5126,\"count\":4,\"type\":"
                     "\"VEC3\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":2,\"componentType\":%d},"
                     "\"values\":{\"bufferView\":2,\"byteOffset\":4}}},{\"bufferView\":1,\"componentType\":"
                     "5121,\"count\":6,\"type\":\"SCALAR\"}]," MESH ASSET,
                     zeros ? "" : "\"bufferView\":0,",
                     size == 1   ? 5121
                     : size == 2 ? 5123
                                 : 5125);
            if (parse(json, binary, 72, &m, &mesh) != FCT_OK) fail_msg("%s", m.text);
            for (int i = 0; i < 12; ++i) {
                float base;
                memcpy(&base, binary + 4 * i, sizeof base);
                assert_true(mesh.positions[i] == (i / 3 == 2 ? moved[i % 3] : zeros ? 0 : base));
            }
            fct_env env = fct_env_default();
            fct_mesh_release(&env, &mesh);
            bytes b = make_glb(json, binary, 72);
            starve("glb", b.data, b.size);
            binary[56] = 4;
            assert_int_equal(parse(json, binary, 72, &m, &mesh), FCT_ERROR_DATA);
            assert_non_null(strstr(m.text, "replaces element 4 of 4"));
        }
}

/* Without scenes the roots are the nodes without parents; with several, the default one is read. */
static void chooses_the_scene(void **state) {
    (void)state;
    static const struct {
        const char *nodes;
        uint32_t faces;
        float least; /* x of the first vertex */
        int warnings;
    } cases[] = {
        {"\"nodes\":[{\"mesh\":0,\"translation\":[1,0,0]},{\"translation\":[4,0,0],\"children\":[0]}],", 2, 5,
         0},
        {"", 2, 0, 0},
        {"\"scenes\":[{\"nodes\":[1]},{\"nodes\":[0]}],\"scene\":1,\"nodes\":[{\"mesh\":0,\"translation\":"
         "[2,0,0]},{\"mesh\":0},{\"mesh\":0}],",
         2, 2, 1},
        {"\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"mesh\":0,\"translation\":[3,0,0]},{\"mesh\":0}],", 4,
         3, 0},
        /* a quaternion of length 2 is a rotation all the same: (0, 0, 1) by 180 degrees */
        {"\"nodes\":[{\"mesh\":0,\"rotation\":[0,0,2,0],\"translation\":[6,0,0]}],", 2, 6, 0},
    };
    unsigned char binary[56];
    fill_square(binary);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        char json[1500];
        messages m;
        fct_mesh mesh;
        snprintf(json, sizeof json, "{%s\"buffers\":[{\"byteLength\":56}]," VIEWS ACCESSORS MESH ASSET,
                 cases[i].nodes);
        if (parse(json, binary, sizeof binary, &m, &mesh) != FCT_OK) fail_msg("%zu: %s", i, m.text);
        assert_int_equal(mesh.face_count, cases[i].faces);
        assert_int_equal(m.warnings, cases[i].warnings);
        assert_true(mesh.positions[0] == cases[i].least);
        if (i == 4) assert_true(fabs((double)mesh.positions[3] - 5) < 1e-6); /* (1, 0, 0) turned */
        fct_env env = fct_env_default();
        fct_mesh_release(&env, &mesh);
    }
}

/* _ERROR is one number per vertex. An attribute of this name with vectors is another program's. */
static void reads_errors(void **state) {
    (void)state;
    unsigned char binary[72];
    static const float errors[4] = {.5F, 0, 2, .25F};
    fill_square(binary);
    memcpy(binary + 56, errors, sizeof errors);
    for (int accessor = 0; accessor < 4; ++accessor) {
        char json[1500];
        messages m;
        fct_mesh mesh;
        snprintf(json, sizeof json,
                 "{\"buffers\":[{\"byteLength\":72}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},"
                 "{\"buffer\":0,\"byteOffset\":48,\"byteLength\":8},{\"buffer\":0,\"byteOffset\":56,"
                 "\"byteLength\":16}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,"
                 "\"type\":\"VEC3\"},{\"bufferView\":1,\"componentType\":5121,\"count\":6,\"type\":"
                 "\"SCALAR\"},{\"bufferView\":2,\"componentType\":5126,\"count\":4,\"type\":\"SCALAR\"}],"
                 "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"_ERROR\":%d},\"indices\":"
                 "1}]}]," ASSET,
                 accessor);
        const fct_result result = parse(json, binary, sizeof binary, &m, &mesh);
        if (accessor == 1) { /* six numbers for four vertices */
            assert_int_equal(result, FCT_ERROR_DATA);
            continue;
        }
        if (result != FCT_OK) fail_msg("%s", m.text);
        assert_int_equal(mesh.error != NULL, accessor == 2);
        if (mesh.error) assert_memory_equal(mesh.error, errors, sizeof errors);
        fct_env env = fct_env_default();
        fct_mesh_release(&env, &mesh);
        bytes b = make_glb(json, binary, sizeof binary);
        starve("glb", b.data, b.size);
    }
}

static void reports_each_feature_once(void **state) {
    (void)state;
    static const struct {
        const char *document, *message;
    } cases[] = {
        {"\"extensionsUsed\":[\"KHR_lights_punctual\"],\"extensions\":{\"KHR_lights_punctual\":{\"lights\":"
         "[{},{}]}},",
         "2 lights"},
        {"\"nodes\":[{\"mesh\":0,\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}}],", "1 lights"},
        {"\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorTexture\":{}}},{\"pbrMetallicRoughness\":{"
         "\"baseColorTexture\":{}}}],",
         "2 materials have a base colour texture"},
        {"\"materials\":[{\"emissiveTexture\":{}}],", "1 materials have an emissive texture"},
        {"\"materials\":[{\"normalTexture\":{}}],", "1 materials have other textures"},
        {"\"materials\":[{\"extensions\":{\"KHR_x\":{\"someTexture\":{}}}}],",
         "1 materials have other textures"},
        {"\"materials\":[{\"alphaMode\":\"BLEND\"},{\"alphaMode\":\"OPAQUE\"}],",
         "1 materials are transparent"},
        {"\"extensionsUsed\":[\"EXT_mesh_gpu_instancing\"],\"nodes\":[{\"mesh\":0,\"extensions\":{"
         "\"EXT_mesh_gpu_instancing\":{}}}],",
         "1 nodes have instances"},
        {"\"animations\":[{},{},{}],", "3 animations"},
        {"\"nodes\":[{\"mesh\":0,\"skin\":0}],", "1 nodes have a skin"},
        {"\"extensionsUsed\":[\"KHR_materials_transmission\",\"KHR_mesh_quantization\"],",
         "the extension KHR_materials_transmission"},
        {"\"cameras\":[{\"orthographic\":{}}],", "1 cameras have no perspective"},
    };
    unsigned char binary[56];
    fill_square(binary);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        char json[1500];
        messages m;
        fct_mesh mesh;
        snprintf(json, sizeof json, "{%s\"buffers\":[{\"byteLength\":56}]," VIEWS ACCESSORS MESH ASSET,
                 cases[i].document);
        if (parse(json, binary, sizeof binary, &m, &mesh) != FCT_OK) fail_msg("%zu: %s", i, m.text);
        if (m.warnings != 1 || !strstr(m.text, cases[i].message))
            fail_msg("%zu: expected one warning '%s', found %d: %s", i, cases[i].message, m.warnings, m.text);
        fct_env env = fct_env_default();
        fct_mesh_release(&env, &mesh);
    }
}

/* Primitives: `members` belong to the one primitive; the mesh has `faces` faces and one warning. */
static void leaves_out_incomplete_primitives(void **state) {
    (void)state;
    static const struct {
        const char *members, *message;
        uint32_t faces;
    } cases[] = {
        {"\"attributes\":{\"POSITION\":0},\"indices\":2", "1 primitives end with an incomplete triangle", 1},
        {"\"attributes\":{\"POSITION\":0},\"mode\":4", "1 primitives end with an incomplete triangle", 1},
        {"\"attributes\":{\"POSITION\":0},\"indices\":3,\"mode\":5", "1 primitives end with an incomplete",
         0},
        {"\"attributes\":{\"POSITION\":0},\"mode\":3", "1 primitives of lines", 0},
        {"\"attributes\":{\"POSITION\":0},\"mode\":0", "1 primitives of points", 0},
        {"\"attributes\":{\"POSITION\":0},\"indices\":1,\"targets\":[{\"POSITION\":0}]",
         "1 primitives have morph targets", 2},
    };
    unsigned char binary[56];
    fill_square(binary);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        char json[1500];
        messages m;
        fct_mesh mesh;
        snprintf(json, sizeof json,
                 "{\"buffers\":[{\"byteLength\":56}]," VIEWS
                 "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
                 "{\"bufferView\":1,\"componentType\":5121,\"count\":6,\"type\":\"SCALAR\"},"
                 "{\"bufferView\":1,\"componentType\":5121,\"count\":5,\"type\":\"SCALAR\"},"
                 "{\"bufferView\":1,\"componentType\":5121,\"count\":2,\"type\":\"SCALAR\"}],"
                 "\"meshes\":[{\"primitives\":[{%s}]}]," ASSET,
                 cases[i].members);
        if (parse(json, binary, sizeof binary, &m, &mesh) != FCT_OK) fail_msg("%zu: %s", i, m.text);
        if (m.warnings != 1 || !strstr(m.text, cases[i].message) || mesh.face_count != cases[i].faces)
            fail_msg("%zu: %u faces, %d warnings: %s", i, mesh.face_count, m.warnings, m.text);
        fct_env env = fct_env_default();
        fct_mesh_release(&env, &mesh);
    }
}

/* Bytes after the end, zero bytes behind the JSON, and a false length in the head. */
static void reads_a_padded_glb(void **state) {
    (void)state;
    static const char json[] = "{\"buffers\":[{\"byteLength\":56}]," VIEWS ACCESSORS MESH ASSET;
    unsigned char square[56];
    fill_square(square);
    for (int form = 0; form < 4; ++form) {
        bytes b = make_glb(json, square, sizeof square);
        messages m = {0};
        fct_mesh mesh;
        fct_env env = fct_env_default();
        env.message = take, env.message_user = &m;
        if (form == 1) put(&b, "\0\0\0\0\0", 5);
        if (form == 2) memset(b.data + 8, 0xff, 2);
        if (form == 3)
            for (size_t i = 20 + sizeof json - 1; b.data[i] == ' '; ++i) b.data[i] = 0;
        assert_int_equal(fct_mesh_parse(&env, "name", b.data, b.size, "GLTF", &mesh), FCT_OK);
        check_square(&mesh);
        assert_int_equal(m.warnings, form == 1 || form == 2);
        if (form == 1) assert_non_null(strstr(m.text, "5 bytes after the end"));
        fct_mesh_release(&env, &mesh);
    }
    bytes old = make_glb(json, square, sizeof square);
    old.data[4] = 1;
    refuse_bytes("glb", old.data, old.size, "found glTF 1.0, expected glTF 2.0");
}

static void drops_attributes_that_are_not_finite(void **state) {
    (void)state;
    unsigned char binary[104];
    float normals[12] = {0, 0, 1, 0, 0, 1, 0, 0, NAN, 0, 0, 1};
    messages m;
    fct_mesh mesh;
    fill_square(binary);
    memcpy(binary + 56, normals, sizeof normals);
    static const char json[] =
        "{\"buffers\":[{\"byteLength\":104}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":104}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
        "{\"bufferView\":0,\"byteOffset\":48,\"componentType\":5121,\"count\":6,\"type\":\"SCALAR\"},"
        "{\"bufferView\":0,\"byteOffset\":56,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":2,\"COLOR_0\":2},"
        "\"indices\":1}]}]," ASSET;
    assert_int_equal(parse(json, binary, sizeof binary, &m, &mesh), FCT_OK);
    check_square(&mesh);
    assert_null(mesh.normals);
    assert_null(mesh.colors);
    assert_int_equal(m.warnings, 2);
    fct_env env = fct_env_default();
    fct_mesh_release(&env, &mesh);
}

#ifdef FCT_HAS_MESHOPT
/* The square through the encoder of meshoptimizer: positions as attributes, indices as triangles or as a
 * sequence, of two or four bytes. */
static void decompresses_meshopt(void **state) {
    (void)state;
    static const unsigned indices[6] = {0, 1, 2, 0, 2, 3};
    for (int form = 0; form < 4; ++form) {
        bool sequence = form & 1, wide = form & 2;
        unsigned char square[56], binary[1024] = {0};
        fill_square(square);
        size_t vertices = meshopt_encodeVertexBuffer(binary, 500, square, 4, 12), from = (vertices + 3) & ~3u;
        size_t corners = sequence ? meshopt_encodeIndexSequence(binary + from, 500, indices, 6)
                                  : meshopt_encodeIndexBuffer(binary + from, 500, indices, 6);
        assert_true(vertices > 0 && corners > 0);
        char json[2000];
        snprintf(
            json, sizeof json,
            "{\"extensionsRequired\":[\"EXT_meshopt_compression\"],\"buffers\":[{\"byteLength\":%zu},{"
            "\"byteLength\":99,\"extensions\":{\"EXT_meshopt_compression\":{\"fallback\":true}}}],"
            "\"bufferViews\":[{\"buffer\":1,\"byteLength\":48,\"byteStride\":12,\"extensions\":{"
            "\"EXT_meshopt_compression\":{\"buffer\":0,\"byteLength\":%zu,\"byteStride\":12,\"count\":4,"
            "\"mode\":\"ATTRIBUTES\"}}},{\"buffer\":1,\"byteOffset\":48,\"byteLength\":24,\"extensions\":{"
            "\"EXT_meshopt_compression\":{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,"
            "\"byteStride\":%d,\"count\":6,\"mode\":\"%s\"}}}],\"accessors\":[{\"bufferView\":0,"
            "\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},{\"bufferView\":1,\"componentType\":%d,"
            "\"count\":6,\"type\":\"SCALAR\"}]," MESH ASSET,
            from + corners, vertices, from, corners, wide ? 4 : 2, sequence ? "INDICES" : "TRIANGLES",
            wide ? 5125 : 5123);
        messages m;
        fct_mesh mesh;
        fct_env env = fct_env_default();
        if (parse(json, binary, from + corners, &m, &mesh) != FCT_OK) fail_msg("%d: %s", form, m.text);
        assert_int_equal(mesh.face_count, 2);
        assert_memory_equal(mesh.positions, square, 48);
        for (int i = 0; i < 6; ++i) /* the codec of triangles may turn each about */
            assert_true(mesh.triangles[i] < 4 && mesh.triangles[3 * (i / 3)] == 0);
        fct_mesh_release(&env, &mesh);
        bytes b = make_glb(json, binary, from + corners);
        starve("glb", b.data, b.size);
        binary[0] = 0; /* the byte that tells the codec */
        assert_int_equal(parse(json, binary, from + corners, &m, &mesh), FCT_ERROR_DATA);
        assert_non_null(strstr(m.text, "its compressed data is damaged"));
    }
}
#endif

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hashes_the_buffers_too),
        cmocka_unit_test(reads_buffers_of_every_kind),
        cmocka_unit_test(reads_only_files_of_the_folder),
        cmocka_unit_test(replaces_sparse_elements),
        cmocka_unit_test(chooses_the_scene),
        cmocka_unit_test(reads_errors),
        cmocka_unit_test(reports_each_feature_once),
        cmocka_unit_test(leaves_out_incomplete_primitives),
        cmocka_unit_test(reads_a_padded_glb),
        cmocka_unit_test(drops_attributes_that_are_not_finite),
#ifdef FCT_HAS_MESHOPT
        cmocka_unit_test(decompresses_meshopt),
#endif
    };
    return cmocka_run_group_tests(tests, set_up, clear);
}
