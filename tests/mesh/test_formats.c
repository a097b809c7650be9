/* tests/mesh/test_formats.c: GLB, OM: writing and reading back; refused files. */
#include "mesh/color.h"
#include "mesh_support.h"

/* One triangle at (0,0,0) (1,0,0) (0,1,0), indices as bytes, placed by two nodes, one of which mirrors. */
#define GLB_JSON(nodes, attributes, accessor)                                                                \
    "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}]," nodes                       \
    "\"meshes\":[{\"primitives\":[{\"attributes\":{" attributes "},\"indices\":1}]}],"                       \
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}," accessor "],"  \
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,\"byteLength\":4}],"  \
    "\"buffers\":[{\"byteLength\":40}]}"
#define NODES                                                                                                \
    "\"nodes\":[{\"mesh\":0,\"translation\":[5,0,0],\"children\":[1]},{\"mesh\":0,\"scale\":[-2,2,2]}],"
#define BYTES "{\"bufferView\":1,\"componentType\":5121,\"count\":3,\"type\":\"SCALAR\"}"

static size_t glb_binary(unsigned char binary[40]) {
    const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    memcpy(binary, positions, sizeof positions);
    memcpy(binary + 36, "\0\1\2", 4);
    return 40;
}

static void reads_glb(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    unsigned char binary[40];
    glb_binary(binary);
    bytes b = make_glb(GLB_JSON(NODES, "\"POSITION\":0", BYTES), binary, sizeof binary);
    assert_int_equal(parse_bytes(&r, "glb", b.data, b.size, &m), FCT_OK);
    const float positions[] = {5, 0, 0, 6, 0, 0, 5, 1, 0, 5, 0, 0, 3, 0, 0, 5, 2, 0};
    const uint32_t triangles[] = {0, 1, 2, 3, 5, 4};
    assert_int_equal(m.vertex_count, 6);
    assert_int_equal(m.face_count, 2);
    assert_memory_equal(m.positions, positions, sizeof positions);
    assert_memory_equal(m.triangles, triangles, sizeof triangles);
    release(&r, &m);
    starve("glb", b.data, b.size);
    for (size_t size = 0; size < b.size; ++size) refuse_bytes("glb", b.data, size, "name");
}

static void refuses_glb(void **state) {
    (void)state;
    static const struct {
        const char *json, *message;
    } cases[] = {
        {"{", "name:1:"},
        {"[]", "its JSON is no object"},
        {GLB_JSON(NODES, "\"POSITION\":7", BYTES), "accessors[7] does not exist"},
        {GLB_JSON(NODES, "\"POSITION\":\"x\"", BYTES), "'POSITION' is no whole number"},
        {GLB_JSON(NODES, "\"POSITION\":1", BYTES), "accessors[1] is not of the type expected"},
        {GLB_JSON(NODES, "\"POSITION\":0",
                  "{\"bufferView\":1,\"componentType\":5125,\"count\":3,\"type\":\"SCALAR\"}"),
         "accessors[1] reaches beyond its bufferView"},
        {GLB_JSON(
             NODES, "\"POSITION\":0",
             "{\"bufferView\":1,\"componentType\":5121,\"count\":9223372036854775807,\"type\":\"SCALAR\"}"),
         "accessors[1] reaches beyond its bufferView"},
        {GLB_JSON(NODES, "\"POSITION\":0",
                  "{\"bufferView\":1,\"byteOffset\":9223372036854775807,\"componentType\":5121,\"count\":3,"
                  "\"type\":\"SCALAR\"}"),
         "accessors[1] reaches beyond its bufferView"},
        {GLB_JSON(NODES, "\"POSITION\":0",
                  "{\"bufferView\":1,\"componentType\":5121,\"count\":5,\"type\":\"SCALAR\"}"),
         "accessors[1] reaches beyond its bufferView"},
        {GLB_JSON(NODES, "\"POSITION\":0",
                  "{\"componentType\":5121,\"count\":30000000000,\"type\":\"SCALAR\"}"),
         "accessors[1] has 30000000000 elements that the file does not hold"},
        {GLB_JSON("\"nodes\":[{\"mesh\":0,\"children\":[0]}],", "\"POSITION\":0", BYTES),
         "nodes[0] has two parents"},
        {GLB_JSON("\"nodes\":[{\"mesh\":3}],", "\"POSITION\":0", BYTES), "meshes[3] does not exist"},
        {GLB_JSON("\"nodes\":[{\"mesh\":0,\"scale\":[1e200,1,1]}],", "\"POSITION\":0", BYTES), "not finite"},
        {GLB_JSON("\"nodes\":[{\"mesh\":0,\"scale\":[1,1]}],", "\"POSITION\":0", BYTES),
         "scale is not 3 numbers"},
        {GLB_JSON("\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],", "\"POSITION\":0", BYTES),
         "draco"},
    };
    unsigned char binary[40];
    glb_binary(binary);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        bytes b = make_glb(cases[i].json, binary, sizeof binary);
        refuse_bytes("glb", b.data, b.size, cases[i].message);
    }
    binary[38] = 3;
    bytes b = make_glb(GLB_JSON(NODES, "\"POSITION\":0", BYTES), binary, sizeof binary);
    refuse_bytes("glb", b.data, b.size, "vertex index 3 is out of range");
    b = make_glb(GLB_JSON(NODES, "\"POSITION\":0", BYTES), NULL, 0);
    refuse_bytes("glb", b.data, b.size, "buffers[0] has neither a uri nor a BIN chunk");
    refuse("glb", "glTF", "the file ends after 4 bytes");
}

static void everything_round_trips_through_ply(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_full(&env);
    for (int ascii = 0; ascii < 2; ++ascii) {
        fct_mesh back = there_and_back(&env, &m, "facetree_test.ply", ascii);
        assert_same_mesh(&m, &back);
        fct_mesh_release(&env, &back);
    }
    release(&r, &m);
}

static void obj_and_off_keep_what_they_can(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_full(&env);
    fct_mesh obj = there_and_back(&env, &m, "facetree_test.obj", false);
    fct_mesh off = there_and_back(&env, &m, "facetree_test.off", false);
    assert_same_array(m.positions, obj.positions, 12 * (size_t)m.vertex_count);
    assert_same_array(m.triangles, obj.triangles, 12 * (size_t)m.face_count);
    assert_same_array(m.colors, obj.colors, 12 * (size_t)m.vertex_count);
    assert_same_array(m.normals, obj.normals, 12 * (size_t)m.vertex_count);
    assert_same_array(m.texcoords, obj.texcoords, 24 * (size_t)m.face_count);
    for (uint32_t f = 0; f < m.face_count; ++f)
        assert_string_equal(obj.material_names[obj.materials[f]], m.material_names[m.materials[f]]);
    assert_same_array(m.positions, off.positions, 12 * (size_t)m.vertex_count);
    assert_same_array(m.triangles, off.triangles, 12 * (size_t)m.face_count);
    assert_same_array(m.colors, off.colors, 12 * (size_t)m.vertex_count);
    assert_same_array(m.normals, off.normals, 12 * (size_t)m.vertex_count);
    assert_same_array(m.face_colors, off.face_colors, 12 * (size_t)m.face_count);
    fct_mesh_release(&env, &obj);
    fct_mesh_release(&env, &off);
    release(&r, &m);
}

/* Vertices are split where texture coordinates differ, faces are grouped by material: corners are compared.
 */
static void glb_keeps_corners(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_full(&env), back = there_and_back(&env, &m, "facetree_test.glb", false);
    assert_int_equal(back.face_count, m.face_count);
    assert_true(back.vertex_count > m.vertex_count);
    uint32_t g = 0;
    for (uint32_t material = 0; material < 3; ++material)
        for (uint32_t f = 0; f < m.face_count; ++f) {
            if (m.materials[f] != material) continue;
            for (size_t k = 0; k < 3; ++k) {
                size_t a = 3 * (size_t)m.triangles[3 * f + k], b = 3 * (size_t)back.triangles[3 * g + k];
                assert_memory_equal(m.positions + a, back.positions + b, 12);
                assert_memory_equal(m.colors + a, back.colors + b, 12);
                assert_memory_equal(m.normals + a, back.normals + b, 12);
            }
            assert_memory_equal(m.texcoords + 6 * f, back.texcoords + 6 * g, 24);
            assert_string_equal(m.material_names[material], back.material_names[back.materials[g]]);
            ++g;
        }
    fct_mesh_release(&env, &back);
    release(&r, &m);
}

/* An edge of four faces, a doubled face, a face with a repeated index: a mesh of OpenMesh would drop or
 * detach them, its half-edges in the file keep them. */
static void om_keeps_non_manifold_faces(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh full = make_full(&env), m;
    static const uint32_t triangles[] = {0, 1, 2, 1, 0, 3, 0, 1, 4, 0, 1, 5, 0, 1, 2, 6, 6, 7, 8, 8, 8};
    assert_int_equal(
        fct_mesh_create(&env, 9, 7, FCT_MESH_COLORS | FCT_MESH_NORMALS | FCT_MESH_FACE_COLORS, &m), FCT_OK);
    memcpy(m.triangles, triangles, sizeof triangles);
    memcpy(m.positions, full.positions, 27 * sizeof(float));
    memcpy(m.colors, full.colors, 27 * sizeof(float));
    memcpy(m.normals, full.normals, 27 * sizeof(float));
    memcpy(m.face_colors, full.face_colors, 21 * sizeof(float));
    fct_mesh back = there_and_back(&env, &m, "facetree_test.om", false);
    /* Colours come back as the bytes they were written as; all else bit for bit. */
    for (int i = 0; i < 27; ++i) {
        assert_true(back.colors[i] == fct_linear_from_srgb(fct_srgb_byte((double)m.colors[i]) / 255.0));
        m.colors[i] = back.colors[i];
    }
    for (int i = 0; i < 21; ++i) {
        assert_true(back.face_colors[i] ==
                    fct_linear_from_srgb(fct_srgb_byte((double)m.face_colors[i]) / 255.0));
        m.face_colors[i] = back.face_colors[i];
    }
    assert_same_mesh(&m, &back);
    fct_mesh_release(&env, &back);
    fct_mesh_release(&env, &full);
    release(&r, &m);
}

/* OpenMesh believes the counts in the head; cut files and flipped bytes must come back as errors or meshes.
 */
static void om_survives_damage(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_grid(&env, 1), back;
    assert_int_equal(fct_mesh_save(&env, "facetree_test.om", &m, NULL), FCT_OK);
    bytes b = {.size = 0};
    FILE *file = fopen("facetree_test.om", "rb");
    b.size = fread(b.data, 1, sizeof b.data, file);
    fclose(file);
    remove("facetree_test.om");
    release(&r, &m);
    assert_true(b.size > 16);
    for (size_t size = 0; size + 2 < b.size; ++size) refuse_bytes("om", b.data, size, "name");
    for (size_t i = 0; i < b.size; ++i)
        for (int bit = 0; bit < 8; ++bit) {
            bytes c = b;
            c.data[i] = (unsigned char)(c.data[i] ^ 1 << bit);
            recorder q = {0};
            if (parse_bytes(&q, "om", c.data, c.size, &back) == FCT_OK) release(&q, &back);
            assert_int_equal(q.alive, 0);
        }
    bytes lie = b;
    memset(lie.data + 4, 0x7f, 12);
    refuse_bytes("om", lie.data, lie.size, "more elements than the file has bytes");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_glb),
        cmocka_unit_test(refuses_glb),
        cmocka_unit_test(everything_round_trips_through_ply),
        cmocka_unit_test(obj_and_off_keep_what_they_can),
        cmocka_unit_test(glb_keeps_corners),
        cmocka_unit_test(om_keeps_non_manifold_faces),
        cmocka_unit_test(om_survives_damage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
