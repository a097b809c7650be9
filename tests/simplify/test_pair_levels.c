/* Progressive meshes with pairs of points: levels, files, and files that are changed. */
#define _GNU_SOURCE
#include "bodies.h"
#include "levels.h"
#include "mend_levels.h"

static fct_env env;
static recorder heard;

enum { HEAD_FLAGS = 28, HAS_PAIRS = 64 };

/* Boxes in a square, each with its own colour, normals by its corners, and a texture per face. */
static fct_mesh make_city(uint32_t side, uint32_t n, unsigned arrays) {
    v3 *places = malloc((size_t)side * side * sizeof *places);
    uint64_t seed = 9;
    for (uint32_t i = 0; i < side * side; ++i)
        places[i] =
            v3_add((v3){1.05 * (i % side), 1.05 * (i / side), 0}, v3_scale(random_vector(&seed), .02));
    fct_mesh mesh = make_boxes(&env, places, side * side, (v3){1, 1, 1}, n, arrays);
    uint32_t own = mesh.vertex_count / (side * side);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        const float rgb[3] = {.1f * (float)(v / own % 10), .5f, .1f * (float)(v / own % 7)};
        if (mesh.colors) memcpy(mesh.colors + 3 * v, rgb, 12);
        v3 up = v3_unit(v3_sub(vertex(&mesh, v), v3_add(places[v / own], (v3){.5, .5, .5})));
        if (mesh.normals) v3_store(mesh.normals + 3 * v, up);
    }
    for (size_t c = 0; c < 3 * (size_t)mesh.face_count; ++c) {
        if (mesh.texcoords)
            mesh.texcoords[2 * c] = (float)(c / 6 % 2), mesh.texcoords[2 * c + 1] = (float)(c % 3);
        if (mesh.materials) mesh.materials[c / 3] = c / 36 % 2;
        if (mesh.face_colors) mesh.face_colors[c] = .25f * (float)(c / 36 % 4);
    }
    if (mesh.materials) mesh.material_count = 2;
    free(places);
    return mesh;
}

static fct_simplify_def with_pairs(uint32_t faces) {
    fct_simplify_def def = fct_simplify_def_default();
    def.pair_distance = .15;
    def.target_faces = faces;
    def.refit_passes = 0;
    return def;
}

/* Each level has the faces of a simplification with the same target. */
static void check_levels(const fct_mesh *mesh) {
    fct_progressive *progressive = progressive_of(&env, mesh, with_pairs(0), 10);
    fct_progressive_info info;
    for (uint32_t i = 0; i <= 20; ++i) {
        uint32_t target = 10 + (mesh->face_count - 10) * (i * 8 % 21) / 20;
        fct_simplify_def def = with_pairs(target);
        fct_simplify_stats stats;
        fct_mesh expected = simplified(&env, mesh, &def, &stats), level = level_mesh(progressive, target);
        assert_int_equal(fct_mesh_validate(&env, &level), FCT_OK);
        assert_true(same_faces(&level, &expected));
        fct_progressive_inspect(progressive, &info);
        assert_float_equal(info.error, stats.max_cost, 1e-6 * stats.max_cost);
        fct_mesh_release(&env, &expected);
        fct_mesh_release(&env, &level);
    }
    fct_progressive_destroy(progressive);
}

static void levels_are_simplifications(void **state) {
    (void)state;
    static const unsigned sets[] = {0, FCT_MESH_COLORS | FCT_MESH_NORMALS, FCT_MESH_TEXCOORDS,
                                    FCT_MESH_MATERIALS | FCT_MESH_FACE_COLORS};
    for (size_t i = 0; i < FCT_LENGTH(sets); ++i) {
        fct_mesh mesh = make_city(4, 1 + i % 2, sets[i]);
        check_levels(&mesh);
        fct_mesh_release(&env, &mesh);
    }
}

static unsigned char *write_levels(fct_progressive *made, size_t *size) {
    char *bytes = NULL;
    FILE *stream = open_memstream(&bytes, size);
    assert_int_equal(fct_progressive_write(made, stream), FCT_OK);
    fclose(stream);
    return (unsigned char *)bytes;
}

static void check_file(const fct_mesh *mesh, uint32_t faces) {
    fct_progressive *made = progressive_of(&env, mesh, with_pairs(0), faces), *read;
    fct_progressive_info info;
    size_t size, size_again;
    unsigned char *bytes = write_levels(made, &size);
    assert_true(bytes[HEAD_FLAGS] & HAS_PAIRS);
    assert_int_equal(fct_progressive_read(&env, "a file", bytes, size, &read), FCT_OK);
    fct_progressive_inspect(made, &info);
    assert_int_equal(info.most_faces, mesh->face_count);
    for (uint32_t i = 0; i <= 20; ++i) {
        uint32_t target = mesh->face_count * (i * 8 % 21) / 20;
        fct_mesh x = level_mesh(made, target), y = level_mesh(read, target);
        assert_true(same_mesh(&x, &y));
        fct_mesh_release(&env, &x);
        fct_mesh_release(&env, &y);
    }
    fct_progressive_go(read, FCT_NONE);
    fct_mesh half;
    assert_int_equal(fct_progressive_morph(read, mesh->face_count / 2, .5, &half), FCT_OK);
    assert_int_equal(half.face_count, mesh->face_count);
    fct_mesh_release(&env, &half);
    unsigned char *again = write_levels(read, &size_again);
    assert_int_equal(size, size_again);
    assert_memory_equal(bytes, again, size);
    free(bytes), free(again);
    fct_progressive_destroy(made);
    fct_progressive_destroy(read);
}

static void files_hold_pairs(void **state) {
    (void)state;
    for (int i = 0; i < ARRAY_SETS; ++i) {
        fct_mesh mesh = make_city(4, 1 + (uint32_t)i % 2, array_sets[i]);
        check_file(&mesh, 0);
        check_file(&mesh, mesh.face_count / 6);
        fct_mesh_release(&env, &mesh);
    }
    for (unsigned arrays = 0; arrays <= FCT_MESH_COLORS; arrays += FCT_MESH_COLORS) {
        fct_mesh mesh = make_city(20, 3, arrays); /* sweeps */
        check_file(&mesh, 500);
        fct_mesh_release(&env, &mesh);
    }
}

/* A file says that it has pairs, and only then; a split without faces is refused without that. */
static void files_declare_pairs(void **state) {
    (void)state;
    fct_mesh mesh = make_city(3, 1, 0);
    fct_simplify_def edges = with_pairs(0);
    edges.pair_distance = 0;
    size_t size;
    fct_progressive *made = progressive_of(&env, &mesh, edges, 10), *read;
    unsigned char *bytes = write_levels(made, &size);
    assert_false(bytes[HEAD_FLAGS] & HAS_PAIRS);
    free(bytes);
    fct_progressive_destroy(made);
    made = progressive_of(&env, &mesh, with_pairs(0), 10);
    bytes = write_levels(made, &size);
    bytes[HEAD_FLAGS] &= (unsigned char)~HAS_PAIRS;
    mend_levels(bytes, size);
    heard = (recorder){0};
    assert_int_equal(fct_progressive_read(&env, "a file", bytes, size, &read), FCT_ERROR_DATA);
    assert_non_null(strstr(heard.text, "malformed"));
    bytes[HEAD_FLAGS] |= 2 * HAS_PAIRS;
    mend_levels(bytes, size);
    assert_int_equal(fct_progressive_read(&env, "a file", bytes, size, &read), FCT_ERROR_DATA);
    assert_non_null(strstr(heard.text, "flags"));
    free(bytes);
    fct_progressive_destroy(made);
    fct_mesh_release(&env, &mesh);
}

static void require(bool condition, const char *what) {
    if (!condition) fail_msg("%s", what);
}

static void malformed_streams_are_harmless(void **state) {
    (void)state;
    uint32_t seed = 1, read = 0;
    for (int i = 0; i < ARRAY_SETS; ++i) {
        fct_mesh mesh = make_city(3, 1, array_sets[i]);
        fct_progressive *made = progressive_of(&env, &mesh, with_pairs(0), 20);
        size_t size;
        unsigned char *bytes = write_levels(made, &size), *copy = malloc(size);
        for (int k = 0; k < 200; ++k) {
            memcpy(copy, bytes, size);
            for (int x = 0; x < 1 + k % 3; ++x) {
                seed = seed * 1664525u + 1013904223u;
                copy[MEND_HEAD + (seed >> 8) % (size - MEND_HEAD)] ^= (unsigned char)(1 << (seed >> 4) % 8);
            }
            mend_levels(copy, size);
            read += mend_try_levels(&env, copy, size, require);
        }
        free(bytes), free(copy);
        fct_progressive_destroy(made);
        fct_mesh_release(&env, &mesh);
    }
    assert_true(read < ARRAY_SETS * 190);
}

int main(void) {
    env = fct_env_default();
    env.message = recorder_message;
    env.message_user = &heard;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_are_simplifications), cmocka_unit_test(files_hold_pairs),
        cmocka_unit_test(files_declare_pairs), cmocka_unit_test(malformed_streams_are_harmless)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
