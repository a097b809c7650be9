/* tests/mesh/test_ply.c: PLY in every form; refused files. */
#include "mesh_support.h"

static const char head_ascii[] = "ply\nformat ascii 1.0\n";

static void reads_text(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(
        parse_text(&r, "ply",
                   "ply\r\nformat ascii 1.0\r\ncomment hello\r\nobj_info x\r\nelement vertex 4\r\n"
                   "property double x\r\nproperty float y\r\nproperty int z\r\nproperty float quality\r\n"
                   "property uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\n"
                   "element face 2\r\nproperty list uchar int vertex_index\r\nend_header\r\n"
                   "0 0 0 nan 255 0 128\r\n1 0 0 1 0 0 0\r\n1 1e0 0 2 1 2 3\r\n-.5 1 7 -1 9 9 9\r\n"
                   "3 0 1 2\r\n3 0 2 3\r\n",
                   &m),
        FCT_OK);
    assert_int_equal(m.vertex_count, 4);
    assert_int_equal(m.face_count, 2);
    assert_true(m.positions[9] == -.5f && m.positions[11] == 7);
    assert_true(m.colors[0] == 1 && m.colors[1] == 0);
    assert_true(fabsf(m.colors[2] - .2158605f) < 1e-6f);
    assert_null(m.source_faces);
    assert_null(m.normals);
    const uint32_t expected[] = {0, 1, 2, 0, 2, 3};
    assert_memory_equal(m.triangles, expected, sizeof expected);
    release(&r, &m);
}

/* Integer colours are sRGB: ushort from 0 to 65535, other types from 0 to 255. */
static void integer_colors_scale_by_their_type(void **state) {
    (void)state;
    static const struct {
        const char *type;
        double top;
    } cases[] = {{"uchar", 255}, {"ushort", 65535}, {"int", 255}};
    for (int i = 0; i < 3; ++i) {
        recorder r = {0};
        fct_mesh m;
        char text[512];
        int high = (int)(cases[i].top * .7), low = (int)(cases[i].top * .02);
        snprintf(text, sizeof text,
                 "%selement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                 "property %s red\nproperty %s green\nproperty %s blue\nend_header\n0 0 0 %d %d %d\n",
                 head_ascii, cases[i].type, cases[i].type, cases[i].type, (int)cases[i].top, high, low);
        assert_int_equal(parse_text(&r, "ply", text, &m), FCT_OK);
        assert_true(m.colors[0] == 1);
        assert_true(fabs((double)m.colors[1] - pow((high / cases[i].top + .055) / 1.055, 2.4)) < 1e-6);
        assert_true(fabs((double)m.colors[2] - low / cases[i].top / 12.92) < 1e-7);
        release(&r, &m);
    }
}

/* Doubles, shuffled properties, unknown elements with lists before and between, in both byte orders. */
static bytes make_binary(bool big, bool uniform) {
    bytes b = {.size = 0};
    put_text(&b, big ? "ply\nformat binary_big_endian 1.0\n" : "ply\nformat binary_little_endian 1.0\n");
    put_text(&b, "element camera 2\nproperty list uchar short values\nproperty double d\nelement vertex 5\n"
                 "property double z\nproperty uchar flag\nproperty double x\nproperty double y\n"
                 "property float radiosity_r\nproperty float radiosity_g\nproperty float radiosity_b\n"
                 "element face 2\nproperty short material_index\nproperty list uint uint vertex_indices\n"
                 "property list uchar float texcoord\nend_header\n");
    for (int i = 0; i < 2; ++i) {
        put_u8(&b, 2 * i);
        for (int k = 0; k < 4 * i; ++k) put_u8(&b, 7);
        put_f64(&b, 1, big);
    }
    for (int v = 0; v < 5; ++v) {
        put_f64(&b, .1 * v, big), put_u8(&b, 9), put_f64(&b, v & 1, big), put_f64(&b, v >> 1, big);
        for (int k = 0; k < 3; ++k) put_f32(&b, (float)(v + k), big);
    }
    for (int f = 0; f < 2; ++f) {
        int corners = uniform ? 3 : 3 + f;
        int16_t material = (int16_t)(2 * f);
        put_scalar(&b, &material, 2, big);
        put_i32(&b, corners, big);
        static const int quad[] = {0, 1, 3, 2};
        for (int k = 0; k < corners; ++k) put_i32(&b, quad[k] + f, big);
        put_u8(&b, 2 * corners);
        for (int k = 0; k < 2 * corners; ++k) put_f32(&b, (float)(10 * f + k), big);
    }
    return b;
}

static void reads_both_byte_orders(void **state) {
    (void)state;
    for (int i = 0; i < 4; ++i) {
        recorder r = {0};
        fct_mesh m;
        bytes b = make_binary(i & 1, i & 2);
        assert_int_equal(parse_bytes(&r, "ply", b.data, b.size, &m), FCT_OK);
        assert_int_equal(m.vertex_count, 5);
        assert_int_equal(m.face_count, i & 2 ? 2 : 3);
        assert_true(m.positions[12] == 0 && m.positions[13] == 2 && m.positions[14] == (float).4);
        assert_true(m.colors[12] == 4 && m.colors[14] == 6);
        assert_int_equal(m.triangles[3], 1);
        assert_int_equal(m.materials[1], 2);
        assert_int_equal(m.material_count, 3);
        assert_true(m.texcoords[6] == 10 && m.texcoords[11] == 15);
        assert_int_equal(m.source_faces != NULL, !(i & 2));
        release(&r, &m);
        starve("ply", b.data, b.size);
    }
}

/* Whatever is cut off a file, it is refused; nothing is read beyond its end. */
static void refuses_every_truncation(void **state) {
    (void)state;
    for (int i = 0; i < 4; ++i) {
        bytes b = make_binary(i & 1, i & 2);
        for (size_t size = 0; size < b.size; ++size) refuse_bytes("ply", b.data, size, "name");
    }
}

/* OpenMesh drops strips without a word. Strip 0 1 2 3 is 012, 213; the winding stays. */
static void reads_strips(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    static const char text[] =
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n9 0 1 2 3 -1 2 3 4 2\n";
    assert_int_equal(parse_text(&r, "ply", text, &m), FCT_OK);
    const uint32_t expected[] = {0, 1, 2, 2, 1, 3, 2, 3, 4, 4, 3, 2};
    assert_int_equal(m.face_count, 4);
    assert_memory_equal(m.triangles, expected, sizeof expected);
    release(&r, &m);
    starve("ply", text, sizeof text - 1);
}

/* OpenMesh drops faces with a repeated index; here they stay, and are counted. */
static void keeps_degenerate_faces(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m;
    fct_mesh_report report;
    assert_int_equal(
        parse_text(&r, "ply",
                   "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                   "property float z\nelement face 3\nproperty list uchar int vertex_indices\n"
                   "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 1\n3 2 2 2\n",
                   &m),
        FCT_OK);
    assert_int_equal(m.face_count, 3);
    assert_int_equal(fct_mesh_inspect(&env, &m, &report), FCT_OK);
    assert_int_equal(report.degenerate_faces, 2);
    release(&r, &m);
}

static void header_of(char *text, size_t size, const char *vertices, const char *faces, const char *body) {
    snprintf(text, size,
             "%selement vertex %s\nproperty float x\nproperty float y\nproperty float z\nelement face %s\n"
             "property list uchar int vertex_indices\nend_header\n%s",
             head_ascii, vertices, faces, body);
}

static void refuses(void **state) {
    (void)state;
    static const struct {
        const char *vertices, *faces, *body, *message;
    } cases[] = {
        {"3", "1", "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "vertex index 3 is out of range, of 3 vertices"},
        {"3", "1", "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", "vertex index -1 is out of range"},
        {"3", "1", "0 0 0\n1 0 0\n0 1 0\n3 0 1\n",
         "name:13: expected an integer in the range of its type, found the end"},
        {"3", "1", "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 2\n", "name:13: expected the end of the line, found '2'"},
        {"3", "1", "0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n", "name:11: expected a number, found 'zero'"},
        {"3", "1", "0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n", "name: vertex 1: its position is not finite (nan)"},
        {"4", "1", "0 0 0\n1 0 0\n0 1 0\n0 0 nan\n3 0 1 2\n", "name: vertex 3: its position is not finite"},
        {"3", "1", "0 0 0\n1e39 0 0\n0 1 0\n3 0 1 2\n", "name: vertex 1: its position is not finite (inf)"},
        {"3", "1", "0 0 0\n1 0 0\n0 1 0\n3 0 1 1.5\n", "found '1.5'"},
        {"3", "1", "0 0 0\n1 0 0\n0 1 0\n300 0 1 2\n", "found '300'"},
        {"3", "1", "0 0 0\n1 0 0\n0 1 0\n", "expected another record"},
        {"3", "2", "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
         "name:14: expected another record, found the end of the file"},
        {"4000000000", "1", "0 0 0\n", "at most"},
        {"2000000000", "1", "0 0 0\n", "2000000000 records of at least 6 bytes are declared"},
        {"-1", "1", "", "expected an element's count"},
        {"1", "x", "", "expected an element's count"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        char text[1024];
        header_of(text, sizeof text, cases[i].vertices, cases[i].faces, cases[i].body);
        refuse("ply", text, cases[i].message);
    }
    refuse("ply", "", "the file is empty");
    refuse("ply", "solid", "name:1: expected 'ply'");
    refuse("ply", "ply\nformat ascii 1.0\n", "expected 'end_header'");
    refuse("ply", "ply\nend_header\n", "no format line");
    refuse("ply", "ply\nformat ascii 1.0\nend_header\n", "declares no vertices");
    refuse("ply", "ply\nformat klingon 1.0\nend_header\n", "name:2: expected ascii");
    refuse("ply", "ply\nformat ascii 1.0\nproperty float x\nend_header\n",
           "a property before the first element");
    refuse("ply", "ply\nformat ascii 1.0\nelement vertex 0\nproperty list float int x\nend_header\n",
           "has to be an integer");
    refuse("ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
           "lacks one of");
    refuse("ply",
           "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
           "element vertex 0\nend_header\n",
           "declared twice");
}

static void refuses_binary_nan_and_lies(void **state) {
    (void)state;
    for (int i = 0; i < 3; ++i) {
        bytes b = {.size = 0};
        put_text(
            &b, "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                "property double z\nelement face 1\nproperty list int uint vertex_indices\nend_header\n");
        put_f32(&b, 0, false), put_f32(&b, i == 0 ? NAN : 1, false), put_f64(&b, i == 1 ? 1e300 : 0, false);
        put_i32(&b, i == 2 ? -3 : 3, false);
        for (int k = 0; k < 3; ++k) put_i32(&b, 0, false);
        static const char *messages[] = {"vertex 0: its position is not finite (nan)",
                                         "vertex 0: its position is not finite (inf)", "face 0"};
        refuse_bytes("ply", b.data, b.size, messages[i]);
    }
}

/* Parses a text PLY with the header lines and the body. */
static fct_result parse_ply(recorder *r, const char *header, const char *body, fct_mesh *m) {
    char text[2048];
    snprintf(text, sizeof text, "%s%send_header\n%s", head_ascii, header, body);
    return parse_text(r, "ply", text, m);
}

static const char xyz[] = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
static const char corners[] = "element face 1\nproperty list uchar int vertex_indices\n";

/* Line ends mean nothing where the records fit no other way. */
static void reads_rows_over_lines(void **state) {
    (void)state;
    static const char *const bodies[] = {"0 0\n0\n1 0 0\n0 1 0\n3 0 1 2\n", "0 0 0 1 0 0 0 1 0 3 0 1 2",
                                         "0\n0\n0\n\n1 0 0 0\n1 0 3\n0 1\n2\n"};
    char header[512];
    snprintf(header, sizeof header, "%s%s", xyz, corners);
    for (int i = 0; i < 3; ++i) {
        recorder r = {0};
        fct_mesh m;
        assert_int_equal(parse_ply(&r, header, bodies[i], &m), FCT_OK);
        const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        const uint32_t triangle[] = {0, 1, 2};
        assert_memory_equal(m.positions, positions, sizeof positions);
        assert_memory_equal(m.triangles, triangle, sizeof triangle);
        release(&r, &m);
        char text[1024];
        snprintf(text, sizeof text, "%s%send_header\n%s", head_ascii, header, bodies[i]);
        starve("ply", text, strlen(text));
    }
    /* A row that is longer than the header says stays an error of its line. */
    char text[1024];
    snprintf(text, sizeof text, "%s%send_header\n0 0 0 9\n1 0 0 9\n0 1 0 9\n3 0 1 2\n", head_ascii, header);
    refuse("ply", text, "name:10: expected the end of the line, found '9'");
    snprintf(text, sizeof text, "%s%send_header\n0 0 0 1 0 0 0 1 0 3 0 1 3\n", head_ascii, header);
    refuse("ply", text, "name:10: expected the end of the line, found '1'");
}

/* Faces of 0 to 2 corners give no triangle. The others keep their numbers and values. */
static void leaves_out_small_faces(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    char header[512];
    snprintf(header, sizeof header, "%s%s", xyz,
             "element face 5\nproperty list uchar int vertex_indices\nproperty uchar red\n"
             "property uchar green\nproperty uchar blue\n");
    assert_int_equal(parse_ply(&r, header,
                               "0 0 0\n1 0 0\n0 1 0\n2 0 1 1 1 1\n3 0 1 2 255 0 0\n0 2 2 2\n1 7 3 3 3\n"
                               "3 2 1 0 0 255 0\n",
                               &m),
                     FCT_OK);
    assert_string_equal(r.text, "name: 3 faces with fewer than three corners are left out");
    const uint32_t triangles[] = {0, 1, 2, 2, 1, 0}, sources[] = {1, 4};
    const float colors[] = {1, 0, 0, 0, 1, 0};
    assert_int_equal(m.face_count, 2);
    assert_memory_equal(m.triangles, triangles, sizeof triangles);
    assert_memory_equal(m.source_faces, sources, sizeof sources);
    assert_memory_equal(m.face_colors, colors, sizeof colors);
    release(&r, &m);
}

/* An attribute with a value that is no number is dropped as a whole. */
static void drops_attributes_that_are_not_finite(void **state) {
    (void)state;
    static const struct {
        const char *properties, *rows, *message;
    } cases[] = {
        {"property float nx\nproperty float ny\nproperty float nz\n",
         "0 0 0 0 0 1\n1 0 0 -nan(ind) 0 1\n0 1 0 0 0 NaN\n",
         "name: the normals are left out, because 2 of 3 are wrong (vertex 1 first)"},
        {"property float s\nproperty float t\n", "0 0 0 0 0\n1 0 0 1 inf\n0 1 0 0 0\n",
         "name: the texture coordinates are left out, because 1 of 3 are wrong (corner 1 first)"},
        {"property float red\nproperty float green\nproperty float blue\n",
         "0 0 0 0 0 0\n1 0 0 1 1 1\n0 1 0 1.#QNAN 0 0\n",
         "name: the colours are left out, because 1 of 3 are wrong (vertex 2 first)"},
        {"property int red\nproperty int green\nproperty int blue\n",
         "0 0 0 0 0 0\n1 0 0 1 256 1\n0 1 0 0 0 -1\n",
         "name: the colours are left out, because 2 of 3 are wrong (vertex 1 first)"},
    };
    for (int i = 0; i < 4; ++i) {
        recorder r = {0};
        fct_mesh m;
        char header[512], body[512];
        snprintf(header, sizeof header, "%s%s%s", xyz, cases[i].properties, corners);
        snprintf(body, sizeof body, "%s3 0 1 2\n", cases[i].rows);
        assert_int_equal(parse_ply(&r, header, body, &m), FCT_OK);
        assert_string_equal(r.text, cases[i].message);
        assert_null(m.normals);
        assert_null(m.texcoords);
        assert_null(m.colors);
        release(&r, &m);
    }
}

/* Every name of colours, of vertices and of faces. */
static void reads_names_of_colors(void **state) {
    (void)state;
    static const char *const names[][4] = {{"r", "g", "b", "a"},
                                           {"diffuse_r", "diffuse_g", "diffuse_b", "diffuse_a"},
                                           {"diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"},
                                           {"red", "green", "blue", "alpha"}};
    for (int i = 0; i < 4; ++i) {
        recorder r = {0};
        fct_mesh m;
        char header[1024], values[256] = "";
        for (int k = 0; k < 4; ++k)
            snprintf(values + strlen(values), sizeof values - strlen(values), "property uchar %s\n",
                     names[i][k]);
        snprintf(header, sizeof header, "%s%s%s%s", xyz, values, corners, values);
        assert_int_equal(parse_ply(&r, header,
                                   "0 0 0 255 0 0 9\n1 0 0 0 255 0 9\n0 1 0 0 0 255 9\n3 0 1 2 0 255 255 9\n",
                                   &m),
                         FCT_OK);
        const float colors[] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, face[] = {0, 1, 1};
        assert_memory_equal(m.colors, colors, sizeof colors);
        assert_memory_equal(m.face_colors, face, sizeof face);
        release(&r, &m);
    }
}

/* One rule per file: floats up to 255 with one over 1 are sRGB; below, or over 255, they are linear. */
static void float_colors_have_one_scale(void **state) {
    (void)state;
    static const struct {
        const char *color;
        double divisor;
    } cases[] = {{"255 51 0", 255}, {"127.5 51 0", 255}, {"2 1 0", 255}, {"1 0.2 0", 0},
                 {"1.5 0.2 0", 0},  {"300 51 0", 0},     {"51 -1 0", 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        recorder r = {0};
        fct_mesh m;
        char header[512], body[512];
        snprintf(header, sizeof header, "%sproperty float red\nproperty float green\nproperty float blue\n",
                 xyz);
        snprintf(body, sizeof body, "0 0 0 0 0 0\n1 0 0 1 1 1\n0 1 0 %s\n", cases[i].color);
        assert_int_equal(parse_ply(&r, header, body, &m), FCT_OK);
        double c[3];
        assert_int_equal(sscanf(cases[i].color, "%lf %lf %lf", c, c + 1, c + 2), 3);
        for (int k = 0; k < 3; ++k) {
            double s = c[k] / 255, linear = s <= .04045 ? s / 12.92 : pow((s + .055) / 1.055, 2.4);
            assert_true(fabs((double)m.colors[6 + k] - (cases[i].divisor > 0 ? linear : c[k])) <
                        1e-6 * fabs(c[k]) + 1e-7);
        }
        assert_true(cases[i].divisor > 0 ? m.colors[3] < .001f : m.colors[3] == 1);
        assert_int_equal(strstr(r.text, "taken as 0 to 255") != NULL, cases[i].divisor > 0);
        release(&r, &m);
    }
}

/* Heads whose lines end with CR, CR LF or LF. The first byte of the body is a line end itself. */
static void finds_the_body_behind_any_line_end(void **state) {
    (void)state;
    static const char *const ends[] = {"\n", "\r\n", "\r"};
    static const char *const lines[] = {"ply",
                                        "format binary_little_endian 1.0",
                                        "comment an end_header of a comment",
                                        "element vertex 1",
                                        "property uchar x",
                                        "property uchar y",
                                        "property uchar z",
                                        "end_header"};
    for (int e = 0; e < 3; ++e) {
        recorder r = {0};
        fct_mesh m;
        bytes b = {.size = 0};
        for (size_t i = 0; i < sizeof lines / sizeof *lines; ++i)
            put_text(&b, lines[i]), put_text(&b, ends[e]);
        put_text(&b, "\n\r\n");
        assert_int_equal(parse_bytes(&r, "ply", b.data, b.size, &m), FCT_OK);
        assert_true(m.positions[0] == 10 && m.positions[1] == 13 && m.positions[2] == 10);
        assert_string_equal(r.text, "");
        release(&r, &m);
    }
}

/* 2^31 faces in a file of a few bytes must fail before memory is asked for. */
static void lies_cost_no_memory(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    char text[1024];
    header_of(text, sizeof text, "1", "2000000000", "0 0 0\n3 0 0 0\n");
    assert_int_equal(parse_text(&r, "ply", text, &m), FCT_ERROR_DATA);
    assert_true(strstr(r.text, "2000000000 records") != NULL);
}

static void a_mesh_without_faces_is_valid(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(
        parse_text(&r, "ply",
                   "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                   "property float z\nend_header\n1 2 3\n",
                   &m),
        FCT_OK);
    assert_int_equal(m.vertex_count, 1);
    assert_int_equal(m.face_count, 0);
    assert_non_null(m.triangles);
    release(&r, &m);
}

/* 1e-30 and 1e30 in one file keep every bit. */
static void keeps_extreme_extents(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m;
    char text[1024];
    header_of(text, sizeof text, "3", "1", "0 0 1e30\n1e-30 0 0\n0 3.40282347e38 0\n3 0 1 2\n");
    assert_int_equal(parse_text(&r, "ply", text, &m), FCT_OK);
    assert_true(m.positions[2] == 1e30f && m.positions[3] == 1e-30f && m.positions[7] == 3.40282347e38f);
    fct_mesh_report report;
    assert_int_equal(fct_mesh_inspect(&env, &m, &report), FCT_OK);
    assert_true(isfinite(report.area) && report.area > 0 && isfinite(report.diagonal));
    release(&r, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_text),
        cmocka_unit_test(integer_colors_scale_by_their_type),
        cmocka_unit_test(reads_both_byte_orders),
        cmocka_unit_test(refuses_every_truncation),
        cmocka_unit_test(reads_strips),
        cmocka_unit_test(keeps_degenerate_faces),
        cmocka_unit_test(refuses),
        cmocka_unit_test(refuses_binary_nan_and_lies),
        cmocka_unit_test(reads_rows_over_lines),
        cmocka_unit_test(leaves_out_small_faces),
        cmocka_unit_test(drops_attributes_that_are_not_finite),
        cmocka_unit_test(reads_names_of_colors),
        cmocka_unit_test(float_colors_have_one_scale),
        cmocka_unit_test(finds_the_body_behind_any_line_end),
        cmocka_unit_test(lies_cost_no_memory),
        cmocka_unit_test(a_mesh_without_faces_is_valid),
        cmocka_unit_test(keeps_extreme_extents),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
