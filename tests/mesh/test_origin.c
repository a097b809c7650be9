/* tests/mesh/test_origin.c: coordinates far from 0 keep their digits in every format. */
#include "mesh_support.h"

#include "mesh/stream.h"

/* A cube of 2 cm in UTM metres. Its area is 6 * .02^2. */
static const double corner_of[3] = {500000.003, 4500000.007, 30};
static const double side = .02;
static const int sides[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                 {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};

static double coordinate(int corner, int axis) {
    return corner_of[axis] + (corner >> axis & 1) * side;
}

static void assert_far_cube(const fct_mesh *m) {
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh_report report;
    assert_true(m->origin[0] > 499999 && m->origin[1] > 4499999);
    assert_int_equal(fct_mesh_inspect(&env, m, &report), FCT_OK);
    assert_int_equal(report.vertices, 8);
    assert_true(fabs(report.area - 6 * side * side) < 1e-8);
    for (int k = 0; k < 3; ++k) {
        assert_true(fabs(m->origin[k] + (double)report.bounds.lower[k] - corner_of[k]) < 2e-9);
        assert_true(fabs(m->origin[k] + (double)report.bounds.upper[k] - corner_of[k] - side) < 2e-9);
    }
}

static void put_line(bytes *b, const char *format, const char *word, double x, double y, double z) {
    char line[128];
    snprintf(line, sizeof line, format, word, x, y, z);
    put_text(b, line);
}

static bytes cube_off(void) {
    bytes b = {.size = 0};
    put_text(&b, "OFF\n8 12 0\n");
    for (int c = 0; c < 8; ++c)
        put_line(&b, "%s%.12g %.12g %.12g\n", "", coordinate(c, 0), coordinate(c, 1), coordinate(c, 2));
    for (int f = 0; f < 12; ++f) put_line(&b, "%s %g %g %g\n", "3", sides[f][0], sides[f][1], sides[f][2]);
    return b;
}

static bytes cube_obj(void) {
    bytes b = {.size = 0};
    for (int c = 0; c < 8; ++c)
        put_line(&b, "%s %.12g %.12g %.12g\n", "v", coordinate(c, 0), coordinate(c, 1), coordinate(c, 2));
    for (int f = 0; f < 12; ++f)
        put_line(&b, "%s %g %g %g\n", "f", sides[f][0] + 1, sides[f][1] + 1, sides[f][2] + 1);
    return b;
}

static bytes cube_stl(void) {
    bytes b = {.size = 0};
    put_text(&b, "solid\n");
    for (int f = 0; f < 12; ++f) {
        put_text(&b, "facet normal 0 0 0 outer loop\n");
        for (int k = 0; k < 3; ++k) {
            int c = sides[f][k];
            put_line(&b, "%s %.12g %.12g %.12g\n", "vertex", coordinate(c, 0), coordinate(c, 1),
                     coordinate(c, 2));
        }
        put_text(&b, "endloop endfacet\n");
    }
    put_text(&b, "endsolid\n");
    return b;
}

static bytes cube_ply(bool big) {
    bytes b = {.size = 0};
    put_text(&b, big ? "ply\nformat binary_big_endian 1.0\n" : "ply\nformat binary_little_endian 1.0\n");
    put_text(&b, "element vertex 8\nproperty double x\nproperty double y\nproperty double z\n"
                 "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 12\n"
                 "property list uchar int vertex_indices\nend_header\n");
    for (int c = 0; c < 8; ++c) {
        for (int k = 0; k < 3; ++k) put_f64(&b, coordinate(c, k), big);
        put(&b, "\1\2\3", 3);
    }
    for (int f = 0; f < 12; ++f) {
        put_u8(&b, 3);
        for (int k = 0; k < 3; ++k) put_i32(&b, sides[f][k], big);
    }
    return b;
}

static void readers_keep_the_digits(void **state) {
    (void)state;
    bytes files[] = {cube_off(), cube_obj(), cube_stl(), cube_ply(false), cube_ply(true)};
    static const char *const formats[] = {"off", "obj", "stl", "ply", "ply"};
    for (int i = 0; i < 5; ++i) {
        recorder r = {0};
        fct_mesh m;
        assert_int_equal(parse_bytes(&r, formats[i], files[i].data, files[i].size, &m), FCT_OK);
        assert_far_cube(&m);
        assert_string_equal(r.text, "");
        release(&r, &m);
        starve(formats[i], files[i].data, files[i].size);
    }
}

/* The warning of a file that is read twice comes once. */
static void warns_once(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    bytes b = cube_off();
    b.data[7] = '3'; /* "8 13 0" */
    put_text(&b, "2 0 1\n");
    assert_int_equal(parse_bytes(&r, "off", b.data, b.size, &m), FCT_OK);
    assert_string_equal(r.text, "name: 1 face with fewer than three corners is left out");
    assert_far_cube(&m);
    release(&r, &m);
}

static void writers_keep_the_digits(void **state) {
    (void)state;
    static const char *const names[] = {"facetree_origin.ply", "facetree_origin.obj", "facetree_origin.off",
                                        "facetree_origin.stl"};
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m, copy, back;
    bytes b = cube_ply(false);
    assert_int_equal(fct_mesh_parse(&env, "name", b.data, b.size, "ply", &m), FCT_OK);
    assert_int_equal(fct_mesh_copy(&env, &m, &copy), FCT_OK);
    assert_memory_equal(copy.origin, m.origin, sizeof m.origin);
    for (int i = 0; i < 4; ++i)
        for (int ascii = i == 3; ascii < 2; ++ascii) {
            fct_mesh_save_def def = fct_mesh_save_def_default();
            def.ascii = ascii;
            assert_int_equal(fct_mesh_save(&env, names[i], &copy, &def), FCT_OK);
            assert_int_equal(fct_mesh_load(&env, names[i], &back), FCT_OK);
            assert_far_cube(&back);
            fct_mesh_release(&env, &back);
            remove(names[i]);
        }
    fct_mesh_release(&env, &copy);
    release(&r, &m);
}

/* A mesh read in parts has the same origin and positions. */
static void the_stream_has_the_same_origin(void **state) {
    (void)state;
    for (int big = 0; big < 2; ++big) {
        fct_env env = fct_env_default();
        fct_mesh m;
        fct_stream *stream;
        bytes b = cube_ply(big);
        FILE *file = fopen("facetree_origin.ply", "wb");
        assert_int_equal(fwrite(b.data, 1, b.size, file), b.size);
        fclose(file);
        assert_int_equal(fct_mesh_load(&env, "facetree_origin.ply", &m), FCT_OK);
        assert_int_equal(fct_stream_open(&env, "facetree_origin.ply", ".", NULL, &stream), FCT_OK);
        assert_memory_equal(fct_stream_get(stream).origin, m.origin, sizeof m.origin);
        float positions[24], colors[24];
        assert_int_equal(fct_stream_vertices(stream, 0, 8, positions, colors), FCT_OK);
        assert_memory_equal(positions, m.positions, sizeof positions);
        assert_memory_equal(colors, m.colors, sizeof colors);
        fct_stream_close(stream);
        fct_mesh_release(&env, &m);
        remove("facetree_origin.ply");
    }
}

/* Floats and coordinates near 0 stay as they are. */
static void other_meshes_have_none(void **state) {
    (void)state;
    static const char *const texts[] = {
        "OFF\n3 1 0\n500000 0 0\n500000.03125 0 0\n500000 0.03125 0\n3 0 1 2\n",
        "OFF\n3 1 0\n500000.031 0 0\n500000.062 0 0\n500000 0.100000001 0\n3 0 1 2\n",
        "OFF\n3 1 0\n.1 .2 .3\n1.1 .2 .3\n.1 1.2 .3\n3 0 1 2\n"};
    for (int i = 0; i < 3; ++i) {
        recorder r = {0};
        fct_mesh m;
        assert_int_equal(parse_text(&r, "off", texts[i], &m), FCT_OK);
        assert_true(m.origin[0] == 0 && m.origin[1] == 0 && m.origin[2] == 0);
        assert_true(i == 2 ? m.positions[0] == .1f : m.positions[0] >= 500000);
        release(&r, &m);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(readers_keep_the_digits), cmocka_unit_test(warns_once),
        cmocka_unit_test(writers_keep_the_digits), cmocka_unit_test(the_stream_has_the_same_origin),
        cmocka_unit_test(other_meshes_have_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
