/* tests/mesh/test_stl.c: STL: text and binary as many programs write them, and refused files. */
#include "mesh_support.h"

static void reads_text_stl(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    static const char text[] = "solid a b c\nfacet normal nan 0 0\n outer loop\n vertex 0 0 0\n vertex 1 0 "
                               "0\n vertex 0 1 0\n endloop\n"
                               "endfacet\nendsolid a\nsolid b\nfacet normal 0 0 1 outer loop vertex 1 -0 0 "
                               "vertex 0 1 0 vertex 1 1 0\n"
                               "endloop endfacet\nendsolid\n";
    assert_int_equal(parse_text(&r, "stl", text, &m), FCT_OK);
    const uint32_t expected[] = {0, 1, 2, 1, 2, 3};
    assert_int_equal(m.vertex_count, 4);
    assert_int_equal(m.face_count, 2);
    assert_memory_equal(m.triangles, expected, sizeof expected);
    release(&r, &m);
    starve("stl", text, sizeof text - 1);
    for (const char *facet = text; (facet = strstr(facet, "\nfacet normal"));) { /* cut in a facet */
        const char *end = strstr(facet, "endfacet") + 8;
        for (++facet; facet + 1 < end; ++facet) refuse_bytes("stl", text, (size_t)(facet + 1 - text), "name");
    }
}

static bytes binary_stl(uint32_t declared, uint32_t there, float odd) {
    bytes b = {.size = 0};
    char head[80] = "solid but binary";
    put(&b, head, sizeof head);
    put_scalar(&b, &declared, 4, false);
    for (uint32_t f = 0; f < there; ++f) {
        for (int k = 0; k < 12; ++k)
            put_f32(&b, k < 3 ? 0 : k == 11 ? odd : (float)((f + (uint32_t)k * k) % 5), false);
        put_u8(&b, 0), put_u8(&b, 0);
    }
    return b;
}

static void reads_binary_stl(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    bytes b = binary_stl(3, 3, 2);
    assert_int_equal(parse_bytes(&r, "stl", b.data, b.size, &m), FCT_OK);
    assert_int_equal(m.face_count, 3);
    release(&r, &m);
    starve("stl", b.data, b.size);
    b = binary_stl(2000000000, 3, 2);
    memcpy(b.data, "xxxxx", 5);
    refuse_bytes("stl", b.data, b.size, "2000000000 triangles take 100000000084 bytes, but the file has 234");
    b = binary_stl(2, 2, NAN);
    refuse_bytes("stl", b.data, b.size, "triangle 0: a coordinate is not finite (nan)");
    refuse("stl", "hello", "neither text that begins with 'solid' nor");
    refuse("stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 zero\n",
           "name:4: expected a coordinate, found 'zero'");
    refuse("stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nendloop\n",
           "expected 'vertex'");
}

#define TRIANGLE(facet, normal, outer, loop, vertex, endloop, endfacet)                                      \
    facet " " normal " 0 0 1\n " outer " " loop "\n  " vertex " 0 0 0\n  " vertex " 1 0 0\n  " vertex        \
          " 0 1 0\n " endloop "\n" endfacet "\n"
#define FACET TRIANGLE("facet", "normal", "outer", "loop", "vertex", "endloop", "endfacet")

static void expect_triangles(const void *data, size_t size, uint32_t count, const char *message) {
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_bytes(&r, "stl", data, size, &m), FCT_OK);
    assert_int_equal(m.face_count, count);
    if (*message ? !strstr(r.text, message) : *r.text) fail_msg("expected '%s', got '%s'", message, r.text);
    release(&r, &m);
}

static void expect_text(const char *text, uint32_t count, const char *message) {
    expect_triangles(text, strlen(text), count, message);
}

static void keywords_may_have_any_case_and_a_blank(void **state) {
    (void)state;
    expect_text("SOLID X\n" TRIANGLE("FACET", "NORMAL", "OUTER", "LOOP", "VERTEX", "ENDLOOP",
                                     "ENDFACET") "ENDSOLID X\n",
                1, "");
    expect_text(
        "Solid\n" TRIANGLE("Facet", "Normal", "Outer", "Loop", "Vertex", "EndLoop", "EndFacet") "EndSolid\n",
        1, "");
    expect_text("solid a\n" TRIANGLE("facet", "normal", "outer", "loop", "vertex", "end loop",
                                     "end\tfacet") "end solid a\n",
                1, "");
    expect_text("\xef\xbb\xbfsolid a\n" FACET "End Solid a\nsolid b\nend solid", 1, "");
    refuse("stl", "solid a\n" FACET "end\n", "expected 'facet' or 'endsolid', found 'end'");
    refuse("stl", "solid a\n" FACET "end loop\n", "expected 'facet' or 'endsolid', found 'end'");
    refuse("stl", "solida\n" FACET, "name:1: expected 'solid', found 'solida'");
}

static void text_lines_may_end_with_cr(void **state) {
    (void)state;
    char text[] = "solid a\n" FACET "endsolid a\nsolid b\n" FACET "endsolid b\n";
    for (char *p = text; *p; ++p)
        if (*p == '\n') *p = '\r';
    expect_text(text, 2, "");
}

static void solids_may_be_empty_or_lack_their_end(void **state) {
    (void)state;
    expect_text("solid\nendsolid\n", 0, "");
    expect_text("solid a\nendsolid a\nsolid b\n" FACET "endsolid b\n solid c\n end solid c", 1, "");
    expect_text("solid a\n" FACET FACET, 2, "name: 1 solids have no endsolid");
    expect_text("solid a\n" FACET "solid b\n" FACET "solid c\n" FACET "endsolid\n", 3,
                "2 solids have no endsolid");
    expect_text("solid a\n" FACET "endsolid\nsolid b\n", 1, "1 solids have no endsolid");
    refuse("stl", "solid x\n", "expected 'facet' or 'endsolid', found the end of the file");
    refuse("stl", "solid x\n" FACET "endsolid x\nhello\n", "name:10: expected 'solid', found 'hello'");
    refuse("stl", "solid x\n" FACET "hello\n", "name:9: expected 'facet' or 'endsolid', found 'hello'");
    static const char padded[] = "solid x\n" FACET "endsolid x\n\x1a\0\0\0";
    expect_triangles(padded, sizeof padded - 1, 1, "");
}

/* The head begins with "solid" in all of them. */
static void the_size_decides_about_binary_files(void **state) {
    (void)state;
    static const unsigned char junk[50] = {7};
    bytes b = binary_stl(3, 3, 2);
    expect_triangles(b.data, b.size, 3, "");
    for (size_t more = 1; more < 50; ++more) { /* other bytes behind the triangles */
        b = binary_stl(3, 3, 2);
        put(&b, junk, more);
        char message[80];
        snprintf(message, sizeof message, "name: %zu bytes behind the last triangle are left out", more);
        expect_triangles(b.data, b.size, 3, message);
    }
    b = binary_stl(2, 3, 2);
    expect_triangles(b.data, b.size, 3, "the head counts 2 triangles, but the size of the file gives 3");
    put(&b, junk, 6);
    expect_triangles(b.data, b.size, 2, "56 bytes behind the last triangle are left out");
    b = binary_stl(0, 3, 2);
    expect_triangles(b.data, b.size, 3, "the head counts 0 triangles, but the size of the file gives 3");
    b = binary_stl(0xffffffff, 3, 2);
    expect_triangles(b.data, b.size, 3,
                     "the head counts 4294967295 triangles, but the size of the file gives 3");
    put(&b, junk, 6);
    expect_triangles(b.data, b.size, 3, "the size of the file gives 3");
    b = binary_stl(0, 0, 2);
    expect_triangles(b.data, b.size, 0, "");
    put(&b, junk, 6);
    expect_triangles(b.data, b.size, 0, "6 bytes behind");
}

static void padding_is_no_triangle(void **state) {
    (void)state;
    static const unsigned char zeros[50];
    bytes b = binary_stl(3, 3, 2);
    put(&b, zeros, 50);
    expect_triangles(b.data, b.size, 3, "50 bytes behind the last triangle are left out");
    b = binary_stl(2, 3, NAN); /* 50 bytes that are no triangle */
    for (int k = 0; k < 2; ++k) memset(b.data + 84 + 50 * k, 0, 50);
    expect_triangles(b.data, b.size, 2, "50 bytes behind the last triangle are left out");
    b = binary_stl(0, 2, NAN);
    refuse_bytes("stl", b.data, b.size, "0 triangles take 84 bytes, but the file has 184");
    b = binary_stl(4, 3, 2); /* a triangle is missing */
    refuse_bytes("stl", b.data, b.size, "4 triangles take 284 bytes, but the file has 234");
    b = binary_stl(3, 3, 2);
    refuse_bytes("stl", b.data, b.size - 1, "3 triangles take 234 bytes, but the file has 233");
}

static void stl_keeps_triangles(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_sphere(&env, 5);
    for (int ascii = 0; ascii < 2; ++ascii) {
        fct_mesh back = there_and_back(&env, &m, "facetree_test.stl", ascii);
        assert_int_equal(back.vertex_count, m.vertex_count);
        for (size_t i = 0; i < 3 * (size_t)m.face_count; ++i)
            assert_memory_equal(m.positions + 3 * (size_t)m.triangles[i],
                                back.positions + 3 * (size_t)back.triangles[i], 12);
        fct_mesh_release(&env, &back);
    }
    release(&r, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_text_stl),
        cmocka_unit_test(reads_binary_stl),
        cmocka_unit_test(keywords_may_have_any_case_and_a_blank),
        cmocka_unit_test(text_lines_may_end_with_cr),
        cmocka_unit_test(solids_may_be_empty_or_lack_their_end),
        cmocka_unit_test(the_size_decides_about_binary_files),
        cmocka_unit_test(padding_is_no_triangle),
        cmocka_unit_test(stl_keeps_triangles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
