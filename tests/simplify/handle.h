/* tests/simplify/handle.h: handles of the simplifier, and the bytes of their states. */
#ifndef FCT_TESTS_SIMPLIFY_HANDLE_H
#define FCT_TESTS_SIMPLIFY_HANDLE_H

#include "facetree/simplifier.h"
#include "levels.h"

typedef struct state_bytes {
    unsigned char *data;
    size_t size;
} state_bytes;

static inline state_bytes read_whole(const char *path) {
    state_bytes b;
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    b.size = (size_t)ftell(file);
    rewind(file);
    b.data = malloc(b.size + 1);
    assert_int_equal(fread(b.data, 1, b.size, file), b.size);
    fclose(file);
    return b;
}

/* The state as the bytes of its file. The caller frees them. */
static inline state_bytes state_of(fct_simplifier *s) {
    assert_int_equal(fct_simplifier_save(s, "state.fst"), FCT_OK);
    return read_whole("state.fst");
}

static inline bool same_bytes(state_bytes a, state_bytes b) {
    return a.size == b.size && !memcmp(a.data, b.data, a.size);
}

/* Whether the state has these bytes, which are freed. */
static inline bool has_state(fct_simplifier *s, state_bytes expected) {
    state_bytes found = state_of(s);
    bool same = same_bytes(found, expected);
    free(found.data), free(expected.data);
    return same;
}

static inline fct_simplifier *made(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def) {
    fct_simplifier *s;
    assert_int_equal(fct_simplifier_create(env, mesh, def, &s), FCT_OK);
    return s;
}

static inline void run_to(fct_simplifier *s, uint32_t faces) {
    assert_int_equal(fct_simplifier_run(s, faces, INFINITY, NULL), FCT_OK);
}

/* Saves, destroys and loads. */
static inline fct_simplifier *stopped(const fct_env *env, fct_simplifier *s) {
    assert_int_equal(fct_simplifier_save(s, "stop.fst"), FCT_OK);
    fct_simplifier_destroy(s);
    assert_int_equal(fct_simplifier_load(env, "stop.fst", &s), FCT_OK);
    return s;
}

static inline fct_mesh mesh_of(fct_simplifier *s, bool refit) {
    fct_mesh mesh;
    assert_int_equal(fct_simplifier_mesh(s, refit, &mesh, NULL), FCT_OK);
    return mesh;
}

/* Whether the mesh of the state, with its refit, is `expected`, which is released. */
static inline bool has_mesh(const fct_env *env, fct_simplifier *s, fct_mesh expected) {
    fct_mesh mesh = mesh_of(s, true);
    bool same = same_mesh(&mesh, &expected) && !memcmp(mesh.origin, expected.origin, sizeof mesh.origin) &&
                mesh.material_count == expected.material_count;
    fct_mesh_release(env, &mesh);
    fct_mesh_release(env, &expected);
    return same;
}

#endif
