/* Progressive mesh files: what is saved is loaded; small; readable from the front; damage is found. */
#define _GNU_SOURCE
#include "levels.h"
#include "mend_levels.h"

static fct_env env;
static recorder heard;

static unsigned char *read_bytes(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    unsigned char *bytes = malloc(*size + 1);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

static void write_bytes(const char *path, const unsigned char *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

static fct_progressive *loaded(const char *path) {
    fct_progressive *progressive;
    assert_int_equal(fct_progressive_load(&env, path, &progressive), FCT_OK);
    return progressive;
}

static bool same_info(const fct_progressive_info *a, const fct_progressive_info *b) {
    return a->least_faces == b->least_faces && a->most_faces == b->most_faces &&
           a->split_count == b->split_count && a->total_faces == b->total_faces && a->faces == b->faces &&
           a->error == b->error;
}

/* Saves to a.fpm, loads, and compares all levels and the file of what was loaded. */
static void check_round_trip(const fct_mesh *mesh, uint32_t faces) {
    fct_progressive *made = progressive_of(&env, mesh, fct_simplify_def_default(), faces);
    assert_int_equal(fct_progressive_save(made, "a.fpm"), FCT_OK);
    fct_progressive *read = loaded("a.fpm");
    fct_progressive_info a, b;
    fct_progressive_inspect(made, &a);
    fct_progressive_inspect(read, &b);
    assert_true(same_info(&a, &b));
    for (uint32_t i = 0; i <= 10; ++i) {
        uint32_t target = mesh->face_count * (i * 7 % 11) / 10;
        fct_mesh x = level_mesh(made, target), y = level_mesh(read, target);
        assert_true(same_mesh(&x, &y));
        assert_int_equal(x.material_count, y.material_count);
        fct_mesh_release(&env, &x);
        fct_mesh_release(&env, &y);
        fct_progressive_inspect(made, &a);
        fct_progressive_inspect(read, &b);
        assert_true(same_info(&a, &b));
    }
    assert_int_equal(fct_progressive_save(read, "b.fpm"), FCT_OK);
    fct_progressive_inspect(read, &b);
    assert_int_equal(a.faces, b.faces);
    size_t size_a, size_b;
    unsigned char *bytes_a = read_bytes("a.fpm", &size_a), *bytes_b = read_bytes("b.fpm", &size_b);
    assert_int_equal(size_a, size_b);
    assert_memory_equal(bytes_a, bytes_b, size_a);
    free(bytes_a), free(bytes_b);
    fct_progressive_destroy(made);
    fct_progressive_destroy(read);
}

/* A cone whose tip has more corners than a list of the stream names; two faces share texture coordinates
 * there.
 */
static fct_mesh make_cone(uint32_t n) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, n + 1, n, FCT_MESH_TEXCOORDS, &mesh), FCT_OK);
    for (uint32_t v = 0; v <= n; ++v) {
        double a = 2 * 3.14159265358979 * v / n;
        const float p[3] = {v < n ? (float)cos(a) : 0, v < n ? (float)sin(a) : 0, v == n};
        memcpy(mesh.positions + 3 * v, p, sizeof p);
    }
    for (uint32_t f = 0; f < n; ++f) {
        const uint32_t t[3] = {n, f, (f + 1) % n};
        const float uv[6] = {(float)(f / 2), 0, (float)f, 1, (float)f + 1, 1};
        memcpy(mesh.triangles + 3 * f, t, sizeof t);
        memcpy(mesh.texcoords + 6 * f, uv, sizeof uv);
    }
    return mesh;
}

static void loads_what_was_saved(void **state) {
    (void)state;
    fct_mesh meshes[] = {make_sphere(&env, 20),
                         make_grid(&env, 20),
                         make_cube(&env, 8),
                         make_torus(&env, 12, false, false),
                         make_torus(&env, 12, false, true),
                         make_torus(&env, 12, true, true),
                         make_needles(&env, 80),
                         make_cone(300)};
    for (size_t i = 0; i < FCT_LENGTH(meshes); ++i) {
        check_round_trip(&meshes[i], 0);
        check_round_trip(&meshes[i], meshes[i].face_count / 3);
        check_round_trip(&meshes[i], meshes[i].face_count);
        fct_mesh_release(&env, &meshes[i]);
    }
}

/* Every prefix of a file is an error or a coarse level, and the first kilobytes are enough for one. */
static void truncated_files_give_coarse_levels(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, 30, false, false);
    fct_progressive *made = progressive_of(&env, &torus, fct_simplify_def_default(), 100), *read;
    assert_int_equal(fct_progressive_save(made, "whole.fpm"), FCT_OK);
    size_t size;
    unsigned char *bytes = read_bytes("whole.fpm", &size);
    uint32_t last = 0;
    bool began = false;
    for (size_t length = 0; length < size; length += length < 5000 ? 97 : 1009) {
        write_bytes("part.fpm", bytes, length);
        heard = (recorder){0};
        fct_result result = fct_progressive_load(&env, "part.fpm", &read);
        if (result != FCT_OK) {
            assert_false(began);
            assert_true(result == FCT_ERROR_DATA && !read && length < 6000);
            assert_non_null(strstr(heard.text, length < 8 ? "mark" : "truncated"));
            continue;
        }
        began = true;
        assert_non_null(strstr(heard.text, "truncated"));
        fct_progressive_info info;
        fct_progressive_inspect(read, &info);
        assert_int_equal(info.total_faces, torus.face_count);
        assert_in_range(info.most_faces, last > info.least_faces ? last : info.least_faces,
                        torus.face_count - 1);
        last = info.most_faces;
        fct_mesh x = level_mesh(read, FCT_NONE), y = level_mesh(made, last);
        assert_true(same_mesh(&x, &y));
        fct_mesh_release(&env, &x);
        fct_mesh_release(&env, &y);
        fct_progressive_destroy(read);
    }
    assert_true(last > 2 * 100);
    free(bytes);
    fct_progressive_destroy(made);
    fct_mesh_release(&env, &torus);
}

/* A file with one byte changed, or with something appended, is refused. */
static void damage_is_found(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, 8, true, true);
    fct_progressive *made = progressive_of(&env, &torus, fct_simplify_def_default(), 50), *read;
    assert_int_equal(fct_progressive_save(made, "whole.fpm"), FCT_OK);
    size_t size;
    unsigned char *bytes = read_bytes("whole.fpm", &size);
    for (size_t i = 0; i < size; i += i < 200 ? 1 : 61) {
        bytes[i] ^= 0x10;
        write_bytes("part.fpm", bytes, size);
        bytes[i] ^= 0x10;
        heard = (recorder){0};
        fct_result result = fct_progressive_load(&env, "part.fpm", &read);
        /* A block that claims to be longer than the file looks like a truncated one. */
        assert_true(result == FCT_ERROR_DATA || strstr(heard.text, "truncated"));
        fct_progressive_destroy(read);
    }
    bytes[size] = 0;
    write_bytes("part.fpm", bytes, size + 1);
    assert_int_equal(fct_progressive_load(&env, "part.fpm", &read), FCT_ERROR_DATA);
    assert_non_null(strstr(heard.text, "appended"));
    assert_int_equal(fct_progressive_load(&env, "absent.fpm", &read), FCT_ERROR_INPUT);
    uint32_t faces = fct_progressive_go(made, 200);
    fct_progressive_info info;
    assert_int_equal(fct_progressive_save(made, "absent/x.fpm"), FCT_ERROR_OUTPUT);
    fct_progressive_inspect(made, &info);
    assert_true(faces > 190 && info.faces == faces);
    /* One byte more in the last block, with right checksums. */
    size_t at = MEND_HEAD;
    uint32_t length;
    for (;; at += MEND_BLOCK + length) {
        memcpy(&length, bytes + at + MEND_BLOCK_SIZE, sizeof length);
        if (at + MEND_BLOCK + length == size) break;
    }
    ++length;
    memcpy(bytes + at + MEND_BLOCK_SIZE, &length, sizeof length);
    mend_levels(bytes, size + 1);
    write_bytes("part.fpm", bytes, size + 1);
    heard = (recorder){0};
    assert_int_equal(fct_progressive_load(&env, "part.fpm", &read), FCT_ERROR_DATA);
    assert_non_null(strstr(heard.text, "wrong length"));
    free(bytes);
    fct_progressive_destroy(made);
    fct_mesh_release(&env, &torus);
}

static void require(bool condition, const char *what) {
    if (!condition) fail_msg("%s", what);
}

/* Streams with right checksums and wrong contents: an error or valid levels. */
static void malformed_streams_are_harmless(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; ++kind) {
        fct_mesh torus = make_torus(&env, 6, kind & 1, kind & 2);
        fct_progressive *made = progressive_of(&env, &torus, fct_simplify_def_default(), 20);
        assert_int_equal(fct_progressive_save(made, "whole.fpm"), FCT_OK);
        size_t size;
        uint32_t read = 0, seed = 1;
        unsigned char *bytes = read_bytes("whole.fpm", &size), *copy = malloc(size);
        for (int i = 0; i < 300; ++i) {
            memcpy(copy, bytes, size);
            for (int k = 0; k < 1 + i % 3; ++k) {
                seed = seed * 1664525u + 1013904223u;
                copy[MEND_HEAD + (seed >> 8) % (size - MEND_HEAD)] ^= (unsigned char)(1 << (seed >> 4) % 8);
            }
            mend_levels(copy, size);
            heard = (recorder){0};
            if (mend_try_levels(&env, copy, size, require))
                ++read;
            else
                assert_true(strstr(heard.text, "a file: ") == heard.text);
        }
        assert_true(read < 290);
        mend_levels(bytes, size);
        assert_true(mend_try_levels(&env, bytes, size, require));
        free(bytes), free(copy);
        fct_progressive_destroy(made);
        fct_mesh_release(&env, &torus);
    }
}

/* A stream whose values a mesh cannot have is not written, or refused. */
static void impossible_values_are_refused(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, 6, false, true);
    for (int fault = 0; fault < 7; ++fault) {
        fct_progressive *made = progressive_of(&env, &torus, fct_simplify_def_default(), 50), *read;
        if (fault == 1) made->positions[3 * (size_t)made->node_count - 1] = INFINITY;
        if (fault == 2) made->values[7] = NAN;
        if (fault == 3) made->values[(size_t)made->value_count * made->node_count - 1] = INFINITY;
        if (fault == 4) made->face_colors[3 * (size_t)made->face_count - 1] = NAN;
        if (fault == 5) made->material_count = 0;
        if (fault == 6) made->errors[9] = 2 * made->errors[8];
        char *bytes = NULL;
        size_t size = 0;
        FILE *stream = open_memstream(&bytes, &size);
        heard = (recorder){0};
        fct_result written = fct_progressive_write(made, stream);
        assert_true(written == FCT_OK || strstr(heard.text, "values that a file cannot have"));
        fclose(stream);
        fct_result result = fct_progressive_read(&env, "a file", (unsigned char *)bytes, size, &read);
        /* The writer looks at most values too. */
        assert_int_equal(written != FCT_OK ? written : result, fault ? FCT_ERROR_DATA : FCT_OK);
        free(bytes);
        fct_progressive_destroy(made);
        fct_progressive_destroy(read);
    }
    fct_mesh_release(&env, &torus);
}

/* Limits are 5 % above what was measured. */
static void files_are_smaller_than_binary_plys(void **state) {
    (void)state;
    static const double limits[] = {.50, .19, .42, .36};
    fct_mesh meshes[] = {make_sphere(&env, 60), make_grid(&env, 60), make_torus(&env, 40, false, false),
                         make_torus(&env, 40, false, true)};
    for (size_t i = 0; i < FCT_LENGTH(meshes); ++i) {
        fct_progressive *made = progressive_of(&env, &meshes[i], fct_simplify_def_default(), 100);
        size_t small, large;
        assert_int_equal(fct_progressive_save(made, "a.fpm"), FCT_OK);
        assert_int_equal(fct_mesh_save(&env, "a.ply", &meshes[i], NULL), FCT_OK);
        free(read_bytes("a.fpm", &small)), free(read_bytes("a.ply", &large));
        assert_true((double)small < limits[i] * (double)large);
        fct_progressive_destroy(made);
        fct_mesh_release(&env, &meshes[i]);
    }
}

int main(void) {
    env = fct_env_default();
    env.message = recorder_message;
    env.message_user = &heard;
    const struct CMUnitTest tests[] = {cmocka_unit_test(loads_what_was_saved),
                                       cmocka_unit_test(truncated_files_give_coarse_levels),
                                       cmocka_unit_test(damage_is_found),
                                       cmocka_unit_test(malformed_streams_are_harmless),
                                       cmocka_unit_test(impossible_values_are_refused),
                                       cmocka_unit_test(files_are_smaller_than_binary_plys)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
