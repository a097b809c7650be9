/* tests/mesh/mesh_support.h: files from text, comparisons of meshes, failing allocations. */
#ifndef FCT_TESTS_MESH_SUPPORT_H
#define FCT_TESTS_MESH_SUPPORT_H

#include <sys/stat.h>
#include <unistd.h>

#include "mesh/load.h"
#include "support.h"

/* A growing file in memory. */
typedef struct bytes {
    unsigned char data[4096];
    size_t size;
} bytes;

static inline void put(bytes *b, const void *data, size_t size) {
    assert_true(b->size + size <= sizeof b->data);
    memcpy(b->data + b->size, data, size);
    b->size += size;
}

static inline void put_text(bytes *b, const char *text) {
    put(b, text, strlen(text));
}

/* The scalar's bytes, turned round when `big`. */
static inline void put_scalar(bytes *b, const void *scalar, size_t size, bool big) {
    unsigned char turned[8];
    for (size_t i = 0; i < size; ++i) turned[i] = ((const unsigned char *)scalar)[big ? size - 1 - i : i];
    put(b, turned, size);
}

static inline void put_f32(bytes *b, float x, bool big) {
    put_scalar(b, &x, sizeof x, big);
}

static inline void put_f64(bytes *b, double x, bool big) {
    put_scalar(b, &x, sizeof x, big);
}

static inline void put_i32(bytes *b, int32_t x, bool big) {
    put_scalar(b, &x, sizeof x, big);
}

static inline void put_u8(bytes *b, unsigned x) {
    unsigned char byte = (unsigned char)x;
    put(b, &byte, 1);
}

/* A GLB file with one JSON chunk and, if size > 0, one BIN chunk. */
static inline bytes make_glb(const char *json, const void *binary, size_t size) {
    bytes b = {.size = 0};
    size_t length = strlen(json), padded = (length + 3) & ~(size_t)3;
    put_text(&b, "glTF");
    put_i32(&b, 2, false);
    put_i32(&b, (int32_t)(20 + padded + (size ? 8 + size : 0)), false);
    put_i32(&b, (int32_t)padded, false);
    put_text(&b, "JSON");
    put_text(&b, json);
    while (b.size & 3) put_text(&b, " ");
    if (size) {
        put_i32(&b, (int32_t)size, false);
        put(&b, "BIN", 4);
        put(&b, binary, size);
    }
    return b;
}

/* The data lie at the end of a block of their size, so that a sanitizer sees every read beyond them. */
static inline fct_result parse_bytes(recorder *r, const char *format, const void *data, size_t size,
                                     fct_mesh *mesh) {
    fct_env env = recorder_env(r);
    void *copy = malloc(size ? size : 1);
    assert_non_null(copy);
    memcpy(copy, data, size);
    fct_result result = fct_mesh_parse(&env, "name", copy, size, format, mesh);
    free(copy);
    return result;
}

static inline fct_result parse_text(recorder *r, const char *format, const char *text, fct_mesh *mesh) {
    return parse_bytes(r, format, text, strlen(text), mesh);
}

static inline void release(recorder *r, fct_mesh *mesh) {
    fct_env env = recorder_env(r);
    fct_mesh_release(&env, mesh);
    assert_int_equal(r->alive, 0);
}

/* Text that has to be refused with a message that contains `message`; nothing may be left. */
static inline void refuse_bytes(const char *format, const void *data, size_t size, const char *message) {
    recorder r = {0};
    fct_mesh mesh;
    fct_result result = parse_bytes(&r, format, data, size, &mesh);
    if (result != FCT_ERROR_DATA || !strstr(r.text, message))
        fail_msg("expected '%s', got result %d, '%s'", message, (int)result, r.text);
    assert_null(mesh.positions);
    assert_int_equal(mesh.face_count, 0);
    assert_int_equal(r.alive, 0);
}

static inline void refuse(const char *format, const char *text, const char *message) {
    refuse_bytes(format, text, strlen(text), message);
}

/* Runs the parser with a failing nth allocation, for n = 1, 2, ... until it succeeds. */
static inline void starve(const char *format, const void *data, size_t size) {
    for (long n = 1;; ++n) {
        recorder r = {.fail_at = n};
        fct_mesh mesh;
        fct_result result = parse_bytes(&r, format, data, size, &mesh);
        if (result == FCT_OK) {
            assert_true(n > 1);
            release(&r, &mesh);
            return;
        }
        assert_int_equal(result, FCT_ERROR_MEMORY);
        assert_int_equal(r.alive, 0);
        assert_null(mesh.positions);
    }
}

static inline void assert_same_array(const void *a, const void *b, size_t size) {
    assert_int_equal(a == NULL, b == NULL);
    if (a && size) assert_memory_equal(a, b, size);
}

/* Checks that all arrays except source_faces have the same bits. */
static inline void assert_same_mesh(const fct_mesh *a, const fct_mesh *b) {
    size_t vertices = a->vertex_count, faces = a->face_count;
    assert_int_equal(a->vertex_count, b->vertex_count);
    assert_int_equal(a->face_count, b->face_count);
    assert_same_array(a->positions, b->positions, 12 * vertices);
    assert_same_array(a->triangles, b->triangles, 12 * faces);
    assert_same_array(a->colors, b->colors, 12 * vertices);
    assert_same_array(a->normals, b->normals, 12 * vertices);
    assert_same_array(a->texcoords, b->texcoords, 24 * faces);
    assert_same_array(a->face_colors, b->face_colors, 12 * faces);
    assert_same_array(a->materials, b->materials, 4 * faces);
    assert_int_equal(a->material_count, b->material_count);
    for (uint32_t i = 0; a->material_names && i < a->material_count; ++i)
        assert_string_equal(a->material_names[i], b->material_names[i]);
}

/* A mesh with every array: a grid of 2 x 2 squares with values that do not look alike. */
static inline fct_mesh make_full(const fct_env *env) {
    fct_mesh grid = make_grid(env, 2), mesh;
    unsigned arrays =
        FCT_MESH_COLORS | FCT_MESH_NORMALS | FCT_MESH_TEXCOORDS | FCT_MESH_FACE_COLORS | FCT_MESH_MATERIALS;
    assert_int_equal(fct_mesh_create(env, grid.vertex_count, grid.face_count, arrays, &mesh), FCT_OK);
    memcpy(mesh.triangles, grid.triangles, 12 * (size_t)mesh.face_count);
    for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i) {
        mesh.positions[i] = grid.positions[i] + (float)i / 700;
        mesh.colors[i] = (float)i / 7;
        mesh.normals[i] = i % 3 == 2;
    }
    for (size_t i = 0; i < 6 * (size_t)mesh.face_count; ++i) mesh.texcoords[i] = (float)(i % 7) / 3;
    for (size_t i = 0; i < 3 * (size_t)mesh.face_count; ++i) mesh.face_colors[i] = (float)i / 11;
    const char *names[] = {"red brick", "", "\"glass\" #2"};
    mesh.material_names = fct_allocate(env, 3, sizeof(char *));
    for (int i = 0; i < 3; ++i)
        mesh.material_names[i] = strcpy(fct_allocate(env, strlen(names[i]) + 1, 1), names[i]);
    mesh.material_count = 3;
    for (size_t f = 0; f < mesh.face_count; ++f) mesh.materials[f] = (uint32_t)(f * f % 3);
    fct_mesh_release(env, &grid);
    return mesh;
}

/* Saves a mesh, loads it, and returns the loaded mesh. */
static inline fct_mesh there_and_back(const fct_env *env, const fct_mesh *mesh, const char *path,
                                      bool ascii) {
    fct_mesh_save_def def = fct_mesh_save_def_default();
    def.ascii = ascii;
    fct_mesh back;
    assert_int_equal(fct_mesh_save(env, path, mesh, &def), FCT_OK);
    assert_int_equal(fct_mesh_load(env, path, &back), FCT_OK);
    remove(path);
    return back;
}

#endif
