/* tests/mesh/test_off.c: OFF in every form; refused files. */
#include "mesh_support.h"

/* A tetrahedron: vertices and faces in free format. */
#define TETRAHEDRON "0 0 0  1 0 0\n0 1 0  0 0 1\n"

static double linear(double s) {
    return s <= .04045 ? s / 12.92 : pow((s + .055) / 1.055, 2.4);
}

static void reads_off(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    static const char text[] = "# a comment\nSTCNOFF # tail\n4 2 0\n"
                               "0 0 0 0 0 1 255 127.5 51 255 .1 .2\n1 0 0 0 0 1 255 0 0 1 0\n"
                               "# between\n1 1 0 0 0 1 0. 0. 2. 1 1\n0 1 0 0 0 1 0 0 0 0 1\n"
                               "4 0 1 2 3 0 255 0\n3 0 1 1 # no colour\n";
    assert_int_equal(parse_text(&r, "off", text, &m), FCT_OK);
    assert_int_equal(m.vertex_count, 4);
    assert_int_equal(m.face_count, 3);
    assert_true(fabsf(m.colors[1] - (float)linear(.5)) < 1e-7f && m.colors[3] == 1);
    assert_true(fabsf(m.colors[8] - 2 / 255.f / 12.92f) < 1e-8f);
    assert_true(m.normals[5] == 1 && m.texcoords[0] == .1f && m.texcoords[1] == .2f && m.texcoords[2] == 1);
    assert_true(m.face_colors[1] == 1 && m.face_colors[3] == 0 && m.face_colors[6] == 1);
    assert_int_equal(m.source_faces[2], 1);
    release(&r, &m);
    starve("off", text, sizeof text - 1);
}

static void refuses_off(void **state) {
    (void)state;
    static const char *const cases[][2] = {
        {"", "the file is empty"},
        {"ply\n", "name:1: expected OFF"},
        {"4OFF\n1 0 0\n", "expected OFF"},
        {"OFF BINARY\n", "binary OFF is not read"},
        {"OFF\n1\n", "expected the number of faces"},
        {"OFF\nx\n", "expected the number of vertices, found 'x'"},
        {"OFF\n-1 0 0\n", "expected the number of vertices"},
        {"OFF\n100000000 0 0\n0 0 0\n", "100000000 vertices and 0 faces are declared, but"},
        {"OFF\n1 100000000 0\n0 0 0\n", "are declared, but"},
        {"OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "name:4: vertex index 1 is out of range, of 1"},
        {"OFF\n1 1 0\n0 0 0\n3 0 0 -1\n", "vertex index -1 is out of range"},
        {"OFF\n1 1 0\n0 0 0\n-2 0 0\n", "expected a face's number of corners, found '-2'"},
        {"OFF8\n", "expected the number of faces, found the end"},
        {"OFFX 1 0 0\n0 0 0\n", "name:1: expected OFF"},
        {"COFF\n1 0 0\n0 0 0 17 -1 0\n", "a colour component of -1 at a vertex, expected 0 to 1 or 0 to 255"},
        {"OFF\n2 0 0\n0 0 0\n1 1     \n", "name:4: expected a coordinate, found the end of the line"},
        {"OFF\n1 1 0\n0 0 0\n9999999 0 0 0\n", "no room"},
        {"OFF\n1 1 0\n0 0 x\n3 0 0 0\n", "name:3: expected a coordinate, found 'x'"},
        {"OFF\n1 1 0\n0 0 nan\n3 0 0 0\n", "name:3: expected a coordinate, found 'nan'"},
        {"OFF\n1 1 0\n0 0\n3 0 0 0 0\n", "expected a coordinate, found the end of the line"},
        {"COFF\n1 0 0\n0 0 0 256 0 0\n", "a colour component of 256 at a vertex"},
        {"OFF\n1 0 0\n0 0 0\n1 1 1\n", "expected the end of the file, found '1'"},
        {"OFF\n2 0 0\n0 0 0\n#######\n", "expected another vertex, found the end of the file"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) refuse("off", cases[i][0], cases[i][1]);
}

static void assert_tetrahedron(const char *text) {
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_text(&r, "off", text, &m), FCT_OK);
    assert_string_equal(r.text, "");
    const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    assert_int_equal(m.vertex_count, 4);
    assert_int_equal(m.face_count, 4);
    assert_memory_equal(m.positions, positions, sizeof positions);
    assert_memory_equal(m.triangles, triangles, sizeof triangles);
    release(&r, &m);
}

/* The head may be missing or joined to the counts. Line ends mean nothing. */
static void reads_free_format(void **state) {
    (void)state;
    static const char *const heads[] = {"OFF\n4 4 6\n",     "OFF 4 4 6\n",
                                        "OFF4 4 6\n",       "4 4 6\n",
                                        "off\n4 4\n",       "OFF\n\n4\n4\n6\n",
                                        "OFF 4\n4 6\n",     "OFF\r\n4 4 6\r\n",
                                        "OFF # a\n4 4 6\n", "# b\nOFF\n# c\n4 4 6 # d\n"};
    static const char *const bodies[] = {
        "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n",
        "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1 255 0 0\n3 0 1 3 1 0 0\n3 1 2 3 9 9 9\n3 2 0 3 0 0 0\n",
        TETRAHEDRON "3 0 2 1 3 0 1 3 3 1 2 3 3 2 0 3",
        "0 0 0 1 0 0 0 1 0 0 0 1\n3 0\n2 1 3 0 1\n3 3 1 2 3\n# a comment\n3 2 0 3\n",
        TETRAHEDRON "3 0 2 1 255 0 0 3 0 1 3 255 0 0\n3 1 2 3 255 0 0 3 2 0 3 0 0 255\n",
        TETRAHEDRON "3 0 2 1 .5 0 0 1 3 0 1 3 1 0 0 1\n3 1 2 3 1 0 0 1 3 2 0 3 0 0 1 1\n",
        TETRAHEDRON "3 0 2 1 7 3 0 1 3 7\n3 1 2 3 7 3 2 0 3 7\n"};
    for (size_t h = 0; h < sizeof heads / sizeof *heads; ++h)
        for (size_t b = 0; b < sizeof bodies / sizeof *bodies; ++b) {
            char text[1024];
            snprintf(text, sizeof text, "%s%s", heads[h], bodies[b]);
            assert_tetrahedron(text);
        }
    static const char text[] = "OFF4 4 6 " TETRAHEDRON "3 0 2 1 3 0 1 3 3 1 2 3 3 2 0 3";
    starve("off", text, sizeof text - 1);
}

/* Values behind the indices are a colour in free format too. */
static void free_format_keeps_colors(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_text(&r, "off",
                                "COFF 3 2 0\n0 0 0 1 0 0 1 1 0 0\n0 1 0 1 0 1 0 0 0 1 1\n"
                                "3 0 1 2 255 0 0 3 2 1 0 0 255 0\n",
                                &m),
                     FCT_OK);
    const float colors[] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, faces[] = {1, 0, 0, 0, 1, 0};
    assert_memory_equal(m.colors, colors, sizeof colors);
    assert_memory_equal(m.face_colors, faces, sizeof faces);
    release(&r, &m);
}

/* 3 or 4 more values on the lines of the vertices: colours, or normals if some are negative. */
static void reads_vertex_values_without_a_prefix(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(
        parse_text(&r, "off", "OFF\n3 1 0\n0 0 0 255 0 0 128\n1 0 0 0 255 0 255\n0 1 0 0 0 255 0\n3 0 1 2\n",
                   &m),
        FCT_OK);
    const float colors[] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    assert_memory_equal(m.colors, colors, sizeof colors);
    assert_null(m.normals);
    release(&r, &m);
    assert_int_equal(
        parse_text(&r, "off", "OFF\n3 1 0\n0 0 0 1 0 0\n1 0 0 0 1 0\n0 1 0 0 0 1\n3 0 1 2\n", &m), FCT_OK);
    assert_memory_equal(m.colors, colors, sizeof colors);
    assert_null(m.normals);
    release(&r, &m);
    assert_int_equal(
        parse_text(&r, "off", "OFF\n3 1 0\n0 0 0 0 0 -1\n1 0 0 0 0 1\n0 1 0 0 1 0\n3 0 1 2\n", &m), FCT_OK);
    const float normals[] = {0, 0, -1, 0, 0, 1, 0, 1, 0};
    assert_memory_equal(m.normals, normals, sizeof normals);
    assert_null(m.colors);
    release(&r, &m);
    assert_int_equal(
        parse_text(&r, "off",
                   "STOFF\n3 1 0\n0 0 0 255 0 0 .5 1\n1 0 0 0 255 0 0 0\n0 1 0 0 0 255 1 1\n3 0 1 2\n", &m),
        FCT_OK);
    assert_memory_equal(m.colors, colors, sizeof colors);
    assert_true(m.texcoords[0] == .5f && m.texcoords[1] == 1);
    release(&r, &m);
}

/* The components of all vertices decide the scale, those of all faces another. */
static void colors_have_one_scale(void **state) {
    (void)state;
    static const struct {
        const char *first, *second;
        double value[2];
    } cases[] = {{"1 0 0 1", ".25 .5 .5 1", {1, .25}}, {"1 0 0 1", "1 1 1 1", {1, 1}},
                 {"1 0 0 255", "51 0 0 255", {0, .2}}, {"2 0 0", "0 0 0", {0, 0}},
                 {"1.0 0 0", "102 0 0", {0, .4}},      {"1.5 0 0", "0.25 0 0", {1.5, .25}}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        recorder r = {0};
        fct_mesh m;
        char text[512];
        snprintf(text, sizeof text, "COFF\n3 1 0\n0 0 0 %s\n1 0 0 %s\n0 1 0 0 0 0\n3 0 1 2 1 0 0\n",
                 cases[i].first, cases[i].second);
        assert_int_equal(parse_text(&r, "off", text, &m), FCT_OK);
        bool whole = i >= 2 && i < 5;
        for (int k = 0; k < 2; ++k) {
            double written = atof(k ? cases[i].second : cases[i].first);
            double right = whole ? linear(written / 255) : cases[i].value[k];
            assert_true(fabs((double)m.colors[3 * k] - right) < 1e-6);
        }
        assert_true(m.face_colors[0] == 1 && m.face_colors[1] == 0);
        release(&r, &m);
    }
}

/* Colours over 1 come back, because the file says that they are linear. */
static void keeps_bright_colors(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_text(&r, "off", "COFF\n# facetree linear\n1 0 0\n0 0 0 17 300 -1\n", &m), FCT_OK);
    assert_true(m.colors[0] == 17 && m.colors[1] == 300 && m.colors[2] == -1);
    release(&r, &m);
}

/* The word in any case, but nOFF is another format. */
static void reads_words_in_any_case(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_text(&r, "off", "cOff 1 0 0\n0 0 0 255 0 0\n", &m), FCT_OK);
    assert_true(m.colors && m.colors[0] == 1);
    release(&r, &m);
    refuse("off", "nOFF 3\n1 0 0\n0 0 0\n", "expected OFF");
}

static void leaves_out_small_faces(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_text(&r, "off", "OFF\n3 4 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n3 0 1 2\n0\n1 2\n", &m),
                     FCT_OK);
    assert_string_equal(r.text, "name: 3 faces with fewer than three corners are left out");
    assert_int_equal(m.face_count, 1);
    assert_int_equal(m.source_faces[0], 1);
    release(&r, &m);
}

/* The other arrays stay. */
static void drops_attributes_that_are_not_finite(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(
        parse_text(&r, "off",
                   "CNOFF\n3 1 0\n0 0 0 nan 0 1 1 0 0\n1 0 0 0 0 1 0 1 0\n0 1 0 0 0 1 0 0 1\n3 0 1 2\n", &m),
        FCT_OK);
    assert_string_equal(r.text, "name: the normals are left out, because 1 of 3 are wrong (vertex 0 first)");
    assert_null(m.normals);
    assert_true(m.colors[0] == 1);
    release(&r, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_off),
        cmocka_unit_test(refuses_off),
        cmocka_unit_test(reads_free_format),
        cmocka_unit_test(free_format_keeps_colors),
        cmocka_unit_test(reads_vertex_values_without_a_prefix),
        cmocka_unit_test(colors_have_one_scale),
        cmocka_unit_test(keeps_bright_colors),
        cmocka_unit_test(reads_words_in_any_case),
        cmocka_unit_test(leaves_out_small_faces),
        cmocka_unit_test(drops_attributes_that_are_not_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
