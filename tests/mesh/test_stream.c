/* Meshes read range by range are those that are loaded whole, whatever the file; damaged ones are refused. */
#define _GNU_SOURCE
#include "support.h"

#include <sys/stat.h>
#include <unistd.h>

#include "mesh/stream.h"

static char folder[] = "/tmp/facetree-stream-XXXXXX";

static const char *path_of(const char *name) {
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void write_file(const char *name, const void *data, size_t size) {
    FILE *file = fopen(path_of(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    fclose(file);
}

static void check_against_load(const fct_env *env, const char *name, uint32_t step) {
    fct_stream *stream;
    fct_mesh mesh;
    assert_int_equal(fct_stream_open(env, path_of(name), folder, NULL, &stream), FCT_OK);
    assert_int_equal(fct_mesh_load(env, path_of(name), &mesh), FCT_OK);
    fct_stream_info info = fct_stream_get(stream);
    assert_int_equal(info.vertex_count, mesh.vertex_count);
    assert_int_equal(info.face_count, mesh.face_count);
    assert_int_equal(info.colors, mesh.colors != NULL);
    assert_int_equal(info.materials, mesh.materials != NULL);
    float *positions = malloc(12 * (size_t)step), *colors = malloc(12 * (size_t)step);
    uint32_t *triangles = malloc(12 * (size_t)step), *materials = malloc(4 * (size_t)step);
    for (uint32_t v = 0; v < mesh.vertex_count; v += step) {
        uint32_t count = mesh.vertex_count - v < step ? mesh.vertex_count - v : step;
        assert_int_equal(fct_stream_vertices(stream, v, count, positions, info.colors ? colors : NULL),
                         FCT_OK);
        assert_memory_equal(positions, mesh.positions + 3 * (size_t)v, 12 * (size_t)count);
        if (info.colors) assert_memory_equal(colors, mesh.colors + 3 * (size_t)v, 12 * (size_t)count);
    }
    for (uint32_t f = 0; f < mesh.face_count; f += step) {
        uint32_t count = mesh.face_count - f < step ? mesh.face_count - f : step;
        assert_int_equal(fct_stream_faces(stream, f, count, triangles, info.materials ? materials : NULL),
                         FCT_OK);
        assert_memory_equal(triangles, mesh.triangles + 3 * (size_t)f, 12 * (size_t)count);
        if (info.materials) assert_memory_equal(materials, mesh.materials + f, 4 * (size_t)count);
    }
    if (mesh.material_names)
        for (uint32_t i = 0; i < mesh.material_count; ++i)
            assert_string_equal(info.material_names[i], mesh.material_names[i]);
    free(positions);
    free(colors);
    free(triangles);
    free(materials);
    fct_mesh_release(env, &mesh);
    fct_stream_close(stream);
}

/* A sphere with every array that a mesh may have. */
static fct_mesh full_mesh(const fct_env *env) {
    fct_mesh plain = make_sphere(env, 60), mesh;
    unsigned arrays =
        FCT_MESH_COLORS | FCT_MESH_NORMALS | FCT_MESH_TEXCOORDS | FCT_MESH_FACE_COLORS | FCT_MESH_MATERIALS;
    assert_int_equal(fct_mesh_create(env, plain.vertex_count, plain.face_count, arrays, &mesh), FCT_OK);
    memcpy(mesh.positions, plain.positions, 12 * (size_t)plain.vertex_count);
    memcpy(mesh.triangles, plain.triangles, 12 * (size_t)plain.face_count);
    for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i)
        mesh.colors[i] = (float)(i % 17) / 16, mesh.normals[i] = mesh.positions[i];
    for (size_t i = 0; i < 6 * (size_t)mesh.face_count; ++i) mesh.texcoords[i] = (float)i;
    for (size_t i = 0; i < 3 * (size_t)mesh.face_count; ++i) mesh.face_colors[i] = (float)(i % 5);
    for (size_t i = 0; i < mesh.face_count; ++i) mesh.materials[i] = (uint32_t)(i % 3);
    mesh.material_count = 3;
    mesh.material_names = fct_allocate(env, 3, sizeof *mesh.material_names);
    for (uint32_t i = 0; i < 3; ++i) {
        mesh.material_names[i] = fct_allocate(env, 16, 1);
        snprintf(mesh.material_names[i], 16, "material %u", i);
    }
    fct_mesh_release(env, &plain);
    return mesh;
}

static void ranges_are_those_of_the_whole(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh full = full_mesh(&env), plain = make_grid(&env, 100);
    fct_mesh_save_def text = fct_mesh_save_def_default();
    text.ascii = true;
    assert_int_equal(fct_mesh_save(&env, path_of("full.ply"), &full, NULL), FCT_OK);
    assert_int_equal(fct_mesh_save(&env, path_of("plain.ply"), &plain, NULL), FCT_OK);
    assert_int_equal(fct_mesh_save(&env, path_of("text.ply"), &full, &text), FCT_OK);
    assert_int_equal(fct_mesh_save(&env, path_of("plain.obj"), &plain, NULL), FCT_OK);
    const char *names[] = {"full.ply", "plain.ply", "text.ply", "plain.obj"};
    for (int i = 0; i < 4; ++i)
        for (uint32_t step = 1000; step < 20000; step += 17000) check_against_load(&env, names[i], step);
    fct_mesh_release(&env, &full);
    fct_mesh_release(&env, &plain);
    assert_int_equal(r.alive, 0);
}

/* Big endian, doubles, short indices, an element before the vertices: each byte as written here. */
static void other_layouts(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    static const char header[] =
        "ply\nformat binary_big_endian 1.0\nelement camera 1\nproperty short view\n"
        "element vertex 3\nproperty uchar mark\nproperty double x\nproperty double y\nproperty double z\n"
        "element face 2\nproperty uchar flags\nproperty list ushort short vertex_indices\nend_header\n";
    unsigned char data[512];
    size_t size = sizeof header - 1;
    memcpy(data, header, size);
    data[size++] = 1, data[size++] = 2;
    for (int v = 0; v < 3; ++v) {
        data[size++] = 9;
        for (int k = 0; k < 3; ++k) {
            static const unsigned char one[8] = {0x3F, 0xF0}, none[8] = {0};
            memcpy(data + size, v == k ? one : none, 8);
            size += 8;
        }
    }
    for (int f = 0; f < 2; ++f) {
        unsigned char face[9] = {7, 0, 3, 0, (unsigned char)f, 0, 1, 0, 2};
        memcpy(data + size, face, sizeof face);
        size += sizeof face;
    }
    write_file("big.ply", data, size);
    check_against_load(&env, "big.ply", 2);
    fct_stream *stream;
    assert_int_equal(fct_stream_open(&env, path_of("big.ply"), "/nowhere/at/all", NULL, &stream), FCT_OK);
    fct_stream_close(stream); /* it was read in place, without a spool */

    data[size - 1] = 3; /* a vertex out of range */
    write_file("range.ply", data, size);
    uint32_t triangles[6];
    assert_int_equal(fct_stream_open(&env, path_of("range.ply"), folder, NULL, &stream), FCT_OK);
    assert_int_equal(fct_stream_faces(stream, 0, 1, triangles, NULL), FCT_OK);
    assert_int_equal(fct_stream_faces(stream, 1, 1, triangles, NULL), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "face 1: vertex index 3 is out of range"));
    fct_stream_close(stream);
    data[sizeof header - 1 + 2 + 1] = 0x7F, data[sizeof header - 1 + 2 + 2] = 0xF0; /* infinite */
    write_file("finite.ply", data, size);
    float positions[9];
    assert_int_equal(fct_stream_open(&env, path_of("finite.ply"), folder, NULL, &stream), FCT_OK);
    assert_int_equal(fct_stream_vertices(stream, 0, 3, positions, NULL), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "vertex 0: its position is not finite"));
    fct_stream_close(stream);
    for (size_t cut = 0; cut < size; cut += cut < sizeof header ? 16 : 1) { /* the whole reader's answer */
        write_file("cut.ply", data, cut);
        assert_int_not_equal(fct_stream_open(&env, path_of("cut.ply"), folder, NULL, &stream), FCT_OK);
        assert_null(stream);
    }
    assert_int_equal(fct_stream_open(&env, path_of("missing.ply"), folder, NULL, &stream), FCT_ERROR_INPUT);
    assert_int_equal(r.alive, 0);
}

/* A quad among triangles, as long as triangles alone would be only by chance: it is loaded whole. */
static void polygons_are_loaded_whole(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    static const char text[] = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n3 0 1 3\n";
    write_file("quad.off", text, sizeof text - 1);
    check_against_load(&env, "quad.off", 2);
    assert_int_equal(r.alive, 0);
}

static void no_memory_anywhere(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = full_mesh(&env);
    assert_int_equal(fct_mesh_save(&env, path_of("memory.ply"), &mesh, NULL), FCT_OK);
    assert_int_equal(fct_mesh_save(&env, path_of("memory.obj"), &mesh, NULL), FCT_OK);
    fct_mesh_release(&env, &mesh);
    const char *names[] = {"memory.ply", "memory.obj"};
    for (int i = 0; i < 2; ++i) {
        fct_stream *stream = NULL;
        for (long n = 1; !stream; ++n) {
            r = (recorder){.fail_at = n};
            fct_result result = fct_stream_open(&env, path_of(names[i]), folder, NULL, &stream);
            assert_true(result == FCT_OK || (result == FCT_ERROR_MEMORY && !stream && r.alive == 0));
            assert_true(n < 1000);
        }
        fct_stream_close(stream);
        assert_int_equal(r.alive, 0);
    }
}

static int make_folder(void **state) {
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state) {
    (void)state;
    static const char *const names[] = {"full.ply", "plain.ply",  "text.ply",   "plain.obj",
                                        "big.ply",  "range.ply",  "finite.ply", "cut.ply",
                                        "quad.off", "memory.ply", "memory.obj"};
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i) unlink(path_of(names[i]));
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ranges_are_those_of_the_whole), cmocka_unit_test(other_layouts),
        cmocka_unit_test(polygons_are_loaded_whole), cmocka_unit_test(no_memory_anywhere)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
