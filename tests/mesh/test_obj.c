/* tests/mesh/test_obj.c: OBJ: indices of all forms, line ends, materials, left out attributes, refused files.
 */
#include "mesh_support.h"

static const char square[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

static void reads_every_index_form(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    static const char text[] =
        "# comment\r\nmtllib x.mtl\no thing\nv 0 0 0\nv\t1 0 0\r\nv 1 1 0\nv 0 1 0 1\n"
        "vt 0 0\nvt 1 0\nvt .5\nvn 0 0 1\ns off\n"
        "f 1/1/1 2/2/1 3/3/1\nf -4/-3/-1 -2//-1 -1/1/1 # tail\nf 5/1/1 \\\n 1/1/1 2/1/1\nv 5 5 5\n";
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    assert_int_equal(m.vertex_count, 5);
    const uint32_t expected[] = {0, 1, 2, 0, 2, 3, 4, 0, 1};
    assert_int_equal(m.face_count, 3);
    assert_memory_equal(m.triangles, expected, sizeof expected);
    const float texcoords[] = {0, 0, 1, 0, .5f, 0, 0, 0, 0, 0, 0, 0};
    assert_memory_equal(m.texcoords, texcoords, sizeof texcoords);
    assert_true(m.normals[2] == 1 && m.normals[14] == 1);
    assert_null(m.source_faces);
    assert_true(strstr(r.text, "1 corners have no texture coordinate") != NULL);
    release(&r, &m);
    starve("obj", text, sizeof text - 1);
}

/* A dart: the fan about its first corner would fold over. The texture coordinates equal x and y of the
 * vertices, so they must still do so in every corner of the triangles. */
static void concave_polygons_keep_their_texcoords(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_text(&r, "obj",
                                "v 2 -1 0\nv .5 0 0\nv 2 1 0\nv 0 0 0\n"
                                "vt 0 0\nvt 2 1\nvt .5 0\nvt 2 -1\nf 1/4 2/3 3/2 4/1\n",
                                &m),
                     FCT_OK);
    assert_int_equal(m.face_count, 2);
    for (int corner = 0; corner < 6; ++corner) {
        assert_true(m.texcoords[2 * corner] == m.positions[3 * m.triangles[corner]]);
        assert_true(m.texcoords[2 * corner + 1] == m.positions[3 * m.triangles[corner] + 1]);
    }
    for (int f = 0; f < 2; ++f) { /* halves of the dart, whose area is 1/2 */
        const float *a = m.positions + 3 * m.triangles[3 * f], *b = m.positions + 3 * m.triangles[3 * f + 1];
        const float *c = m.positions + 3 * m.triangles[3 * f + 2];
        assert_true((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) == .5f);
    }
    release(&r, &m);
}

static void numbers_materials_in_order_of_use(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    char text[512];
    snprintf(text, sizeof text,
             "%sf 1 2 3\nusemtl red brick \nf 1 2 3 4\nusemtl b#\\\nf 1 3 4\nusemtl red brick\nf 2 3 4\n",
             square);
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    const uint32_t materials[] = {0, 1, 1, 2, 1}, sources[] = {0, 1, 1, 2, 3};
    assert_int_equal(m.face_count, 5);
    assert_memory_equal(m.materials, materials, sizeof materials);
    assert_memory_equal(m.source_faces, sources, sizeof sources);
    assert_int_equal(m.material_count, 3);
    assert_string_equal(m.material_names[0], "");
    assert_string_equal(m.material_names[1], "red brick");
    assert_string_equal(m.material_names[2], "b#\\");
    release(&r, &m);
    starve("obj", text, strlen(text));
}

/* Many names, so that the table of names grows. */
static void keeps_many_materials_apart(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    static char text[16384];
    size_t size = (size_t)sprintf(text, "%s", square);
    for (int i = 0; i < 600; ++i) size += (size_t)sprintf(text + size, "usemtl m%d\nf 1 2 3\n", i % 300);
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    assert_int_equal(m.material_count, 300);
    for (uint32_t f = 0; f < 600; ++f) assert_int_equal(m.materials[f], f % 300);
    assert_string_equal(m.material_names[299], "m299");
    release(&r, &m);
}

/* Normals that differ by corner belong to no vertex. */
static void leaves_out_normals_of_corners(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    char text[512];
    snprintf(text, sizeof text, "%svn 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//2 3//1 4//1\n", square);
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    assert_null(m.normals);
    assert_true(strstr(r.text, "normals are left out") != NULL);
    release(&r, &m);
}

/* A quad with a comment, in which every line ends with `end`. */
static void reads_with_line_end(const char *end) {
    static const char *const lines[] = {"\xef\xbb\xbfmtllib x.mtl",
                                        "v 0 0 0",
                                        "v 1 0 0 # east",
                                        "# f 1 1 1",
                                        "v 1 1 0",
                                        "v 0 1 0",
                                        "usemtl red brick",
                                        "f 1 2 \\",
                                        "3 4",
                                        "fo 1 2 3",
                                        ""};
    recorder r = {0};
    fct_mesh m;
    char text[512] = "";
    for (size_t i = 0; i < sizeof lines / sizeof *lines; ++i) strcat(strcat(text, lines[i]), end);
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    const uint32_t expected[] = {0, 1, 2, 0, 2, 3, 0, 1, 2};
    assert_int_equal(m.vertex_count, 4);
    assert_int_equal(m.face_count, 3);
    assert_memory_equal(m.triangles, expected, sizeof expected);
    assert_string_equal(m.material_names[0], "red brick");
    assert_string_equal(r.text, "");
    release(&r, &m);
    strcat(text, "v 0 0 zero"); /* the message counts lines of every kind alike */
    refuse("obj", text, "name:12: expected a number, found 'zero'");
}

static void reads_every_line_end(void **state) {
    (void)state;
    reads_with_line_end("\n");
    reads_with_line_end("\r\n");
    reads_with_line_end("\r");
}

static void missing_indices_may_leave_their_slashes(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    char text[512];
    snprintf(text, sizeof text, "%svt 0 0\nvt .5 .25\nf 1/1/ 2/2/ 3/1/\nf 1/2 3/2 4/2\n", square);
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    const float texcoords[] = {0, 0, .5f, .25f, 0, 0, .5f, .25f, .5f, .25f, .5f, .25f};
    assert_memory_equal(m.texcoords, texcoords, sizeof texcoords);
    assert_null(m.normals);
    assert_string_equal(r.text, "");
    release(&r, &m);
    snprintf(text, sizeof text, "%sf 1// 2/ 3\nf 1// 3// 4//", square);
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    assert_int_equal(m.face_count, 2);
    assert_string_equal(r.text, "");
    release(&r, &m);
}

/* Polygons keep the numbers of the faces that stay. */
static void leaves_out_short_faces(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    char text[512];
    snprintf(text, sizeof text,
             "%svt 1 0\nusemtl a\nf 1/1 2/1\nf 1/1 2/1 3/1 4/1\nf\nusemtl b\nf 7 -9\nf 4 3 1\nf 2 \\\n 3\n",
             square);
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    const uint32_t triangles[] = {0, 1, 2, 0, 2, 3, 3, 2, 0}, materials[] = {0, 0, 1}, sources[] = {0, 0, 1};
    assert_int_equal(m.face_count, 3);
    assert_memory_equal(m.triangles, triangles, sizeof triangles);
    assert_memory_equal(m.materials, materials, sizeof materials);
    assert_memory_equal(m.source_faces, sources, sizeof sources);
    assert_true(m.texcoords[10] == 1 && m.texcoords[12] == 0);
    assert_non_null(strstr(r.text, "name: 4 faces of fewer than 3 corners are left out"));
    release(&r, &m);
    starve("obj", text, strlen(text));
}

static void expect_dropped(const char *lines, const char *message, bool texcoords, bool normals) {
    recorder r = {0};
    fct_mesh m;
    char text[512];
    snprintf(text, sizeof text, "%s%s", square, lines);
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    assert_int_equal(m.face_count, 2);
    assert_true((m.texcoords != NULL) == texcoords && (m.normals != NULL) == normals);
    if (!strstr(r.text, message)) fail_msg("expected '%s', got '%s'", message, r.text);
    release(&r, &m);
}

static void drops_unusable_normals(void **state) {
    (void)state;
    static const char *const values[] = {"nan nan nan", "0 -NaN(ind) 1", "0 0 -1.#IND",
                                         "1e39 0 0",    "0 inf 0",       "Infinity 0 0"};
    char text[256];
    for (size_t i = 0; i < sizeof values / sizeof *values; ++i) {
        snprintf(text, sizeof text, "vt 0 0\nvn 0 0 1\nvn %s\nf 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/1/1 4/1/2\n",
                 values[i]);
        expect_dropped(text, "name: normals are left out, because those of 1 corners are not finite", true,
                       false);
    }
    static const char *const indices[] = {"0", "2", "-2", "99999999999999999999999"};
    for (size_t i = 0; i < sizeof indices / sizeof *indices; ++i) {
        snprintf(text, sizeof text, "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1/1/%s 3/1/%s 4/1/1\n",
                 indices[i], indices[i]);
        expect_dropped(text,
                       "name: normals are left out, because 2 indices are out of range, on line 8 first",
                       true, false);
    }
    expect_dropped("f 1//1 2//2 3//3\nf 1//1 3//3 4//4\n",
                   "normals are left out, because 6 indices are out of range, on line 5 first", false, false);
}

static void drops_unusable_texcoords(void **state) {
    (void)state;
    expect_dropped("vt nan 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1//1 3//1 4/1/1\n",
                   "name: texture coordinates are left out, because those of 4 corners are not finite", false,
                   true);
    expect_dropped("vt 0 0\nvn 0 0 1\nf 1/0/1 2/1/1 3/1/1\nf 1/1/1 3/1/1 4/5/1\n",
                   "texture coordinates are left out, because 2 indices are out of range, on line 7 first",
                   false, true);
    expect_dropped("f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n",
                   "texture coordinates are left out, because 6 indices are out of range", false, false);
}

/* The third texture coordinate has no array. */
static void keeps_attributes_beside_unused_bad_values(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    char text[512];
    snprintf(text, sizeof text,
             "%svt 0 0 nan\nvt nan nan\nvn nan 0 0\nvn 0 0 1\nf 1/1/2 2/1/2 3/1/2\nf 1/1/2 3/1/2 4/1/2\n",
             square);
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    assert_true(m.texcoords[0] == 0 && m.normals[2] == 1);
    assert_string_equal(r.text, "");
    release(&r, &m);
}

static void numbers_that_are_none_are_shown(void **state) {
    (void)state;
    static const char *const words[] = {"3.1+e2", "0,5", "1.0D+05", "1e", "1e+", "--1", "0x1p3", ".", "+"};
    for (size_t i = 0; i < sizeof words / sizeof *words; ++i) {
        char text[64], message[64];
        snprintf(text, sizeof text, "v 0 0 0\nv 1 %s 0\n", words[i]);
        snprintf(message, sizeof message, "name:2: expected a number, found '%s'", words[i]);
        refuse("obj", text, message);
        snprintf(text, sizeof text, "v 0 0 0 %s 0 0\n", words[i]);
        refuse("obj", text, "name:1: expected a number, found '");
    }
}

static void refuses(void **state) {
    (void)state;
    static const char *const cases[][2] = {
        {"v 0 0\n", "name:1: expected a number, found the end of the line"},
        {"v 0 0 zero\n", "name:1: expected a number, found 'zero'"},
        {"v 0 0 nan\n", "found 'nan'"},
        {"v 0 inf 0\n", "found 'inf'"},
        {"v 0 1e39 0\n", "expected a number that fits a float, found '1e39'"},
        {"v 0 0 0 1 1\n", "3, 4, 6 or 7 numbers, not 5"},
        {"v 0 0 0 1 1 1 1 1\n", "expected the end of the line"},
        {"v 1 2 3\n# x\nf 1 1 2\n", "name:3: vertex index 2 is out of range, of 1"},
        {"v 1 2 3\nf 1 1 0\n", "vertex index 0 is out of range"},
        {"v 1 2 3\nf -2 1 1\n", "vertex index -2 is out of range"},
        {"v 1 2 3\nf 1 1 99999999999999999999999\n", "is out of range"},
        {"v 1 2 3\nf 1 1 x\n", "expected an index such as 1, 1/2, 1//3 or 1/2/3, found 'x'"},
        {"v 1 2 3\nf 1/1/1/1 1 1\n", "name:2: expected the end of a corner"},
        {"v 1 2 3\nf 1/x 1 1\n", "expected an index such as 1, 1/2, 1//3 or 1/2/3, found 'x'"},
        {"v 1 2 3\nf 1 1 1\\2\n", "expected an index"},
        {"v 1 2 3\nvn 0 0 up\nf 1 1 1\n", "name:2: expected a number, found 'up'"},
        {"v 1 2 3\nvn 0 0\nf 1 1 1\n", "name:2: expected a number, found the end of the line"},
        {"v 1 2 3\nvt\nf 1 1 1\n", "name:2: expected a number, found the end of the line"},
        {"v 1 2 3 red green blue\n", "name:1: expected a number, found 'red'"},
        {"v\n", "name:1: expected a number, found the end of the line"},
        {"ply\nformat ascii 1.0\n", "name:1: expected an OBJ statement, found 'ply'"},
        {"\x7f"
         "ELF\x02\x01\x01",
         "expected an OBJ statement, found '?ELF"},
        {"# nothing\n\n", "no OBJ statement"},
        {"", "the file is empty"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) refuse("obj", cases[i][0], cases[i][1]);
}

/* Lines whose cutting the counting pass must see like the reading pass. */
static void survives_odd_continuations(void **state) {
    (void)state;
    static const char *const texts[] = {"v 0 0 0\nf 1 1 1\\\n 1\n",
                                        "v 0 0 0\nfoo bar\\\nv 1 2 3\n",
                                        "v 0 0 0\nf 1 1 1\\\n\\\n1\n",
                                        "v 0 0 0\ng a\\\nf 1 1 1\n",
                                        "v 0 0 0\nf 1 1 1 # x\\\nf 1 1 1\n",
                                        "v 0 0 0\nusemtlx \\\nf 1 1 1\n",
                                        "v 0 0 0\nusemtl a\\\nf 1 1 1\n",
                                        "v 0\\\n 0 0\nf 1 1 1",
                                        "v 0 0 0\nv\\\n 1 1 1\n",
                                        "v 0 0 0\nvtx 1\nvn\nf 1 1 1\n",
                                        "v 0 0 0\nf 1 1 1\\",
                                        "v 0 0 0\nf 1 1 1\\\r\n1\n",
                                        "\\\nv 0 0 0\nf 1 1 1",
                                        "v 0 0 0\n\\\n# f 1 1 1\nf 1 1\\\n 1",
                                        "v 0 0 0\nf 1\\1 1 1\n",
                                        "v 0 0 0\nf 1 1 1\\\r1\r\\"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; ++i) {
        recorder r = {0};
        fct_mesh m;
        fct_result result = parse_text(&r, "obj", texts[i], &m);
        assert_true(result == FCT_OK || result == FCT_ERROR_DATA);
        release(&r, &m);
    }
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_text(&r, "obj", texts[0], &m), FCT_OK);
    assert_int_equal(m.face_count, 2);
    release(&r, &m);
}

/* A number printed with nine digits gives the same float back, whatever its size. */
static void numbers_round_trip(void **state) {
    (void)state;
    uint32_t bits = 12345;
    for (int i = 0; i < 3000; ++i) {
        float values[3];
        for (int k = 0; k < 3; ++k) {
            do {
                bits = bits * 1664525u + 1013904223u;
                memcpy(values + k, &bits, sizeof bits);
            } while (!isfinite(values[k]));
        }
        char text[128];
        snprintf(text, sizeof text, "v %.9g %.12e %.40f\n", (double)values[0], (double)values[1],
                 (double)values[2]);
        if (fabsf(values[2]) < 1e-20f || strlen(text) > 126)
            snprintf(text, sizeof text, "v %.9g %.12e %.17g\n", (double)values[0], (double)values[1],
                     (double)values[2]);
        recorder r = {0};
        fct_mesh m;
        assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
        assert_memory_equal(m.positions, values, sizeof values);
        release(&r, &m);
    }
}

static bool stop(void *user, const char *phase, double done) {
    (void)user, (void)phase, (void)done;
    return false;
}
static void cancels(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    env.progress = stop;
    fct_mesh m;
    assert_int_equal(fct_mesh_parse(&env, "name", square, sizeof square - 1, "OBJ", &m), FCT_ERROR_CANCELLED);
    assert_int_equal(r.alive, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_every_index_form),
        cmocka_unit_test(concave_polygons_keep_their_texcoords),
        cmocka_unit_test(reads_every_line_end),
        cmocka_unit_test(missing_indices_may_leave_their_slashes),
        cmocka_unit_test(leaves_out_short_faces),
        cmocka_unit_test(drops_unusable_normals),
        cmocka_unit_test(drops_unusable_texcoords),
        cmocka_unit_test(keeps_attributes_beside_unused_bad_values),
        cmocka_unit_test(numbers_that_are_none_are_shown),
        cmocka_unit_test(numbers_materials_in_order_of_use),
        cmocka_unit_test(keeps_many_materials_apart),
        cmocka_unit_test(leaves_out_normals_of_corners),
        cmocka_unit_test(refuses),
        cmocka_unit_test(survives_odd_continuations),
        cmocka_unit_test(numbers_round_trip),
        cmocka_unit_test(cancels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
