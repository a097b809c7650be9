/* Colours against the formula of IEC 61966-2-1, in double: the conversion itself, and each reader's use of
 * it. */
#include "mesh/color.h"
#include "mesh_support.h"

/* Electro-optical transfer function of sRGB. */
static double linear_of(double s) {
    if (s <= 0.04045) return s / 12.92;
    return exp(2.4 * log((s + 0.055) / 1.055));
}

static void bytes_follow_the_standard(void **state) {
    (void)state;
    for (int byte = 0; byte < 256; ++byte) {
        double expected = linear_of(byte / 255.0);
        assert_true(fabs((double)fct_linear_from_srgb(byte / 255.0) - expected) <= 1e-7 * (expected + 1e-3));
        assert_int_equal(fct_srgb_byte(expected), byte);
    }
    assert_true(fct_srgb_byte(-1) == 0 && fct_srgb_byte(7) == 255);
}

/* A byte is the nearest one: between two neighbours it changes where the encoded value is half way. */
static void bytes_round_to_nearest(void **state) {
    (void)state;
    for (int byte = 0; byte < 255; ++byte) {
        assert_int_equal(fct_srgb_byte(linear_of((byte + 0.49) / 255)), byte);
        assert_int_equal(fct_srgb_byte(linear_of((byte + 0.51) / 255)), byte + 1);
    }
}

static void expect_colors(const char *format, const char *text, const double expected[9]) {
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_text(&r, format, text, &m), FCT_OK);
    assert_non_null(m.colors);
    for (int i = 0; i < 9; ++i) assert_true(fabs((double)m.colors[i] - expected[i]) <= 1e-6);
    release(&r, &m);
}

static void readers_take_integers_for_srgb_and_floats_for_linear(void **state) {
    (void)state;
    double decoded[9], plain[9] = {.25, .5, 1, 0, .125, .75, .5, .5, .5};
    static const int values[9] = {10, 100, 255, 0, 11, 200, 37, 128, 64};
    for (int i = 0; i < 9; ++i) decoded[i] = linear_of(values[i] / 255.0);
    expect_colors(
        "ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n"
        "0 0 0 10 100 255\n1 0 0 0 11 200\n0 1 0 37 128 64\n3 0 1 2\n",
        decoded);
    expect_colors(
        "ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "property float red\nproperty float green\nproperty float blue\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n"
        "0 0 0 .25 .5 1\n1 0 0 0 .125 .75\n0 1 0 .5 .5 .5\n3 0 1 2\n",
        plain);
    expect_colors("off",
                  "COFF\n3 1 0\n0 0 0 10 100 255 255\n1 0 0 0 11 200 255\n0 1 0 37 128 64 255\n3 0 1 2\n",
                  decoded);
    expect_colors("off",
                  "COFF\n3 1 0\n0 0 0 .25 .5 1.0 1.0\n1 0 0 0.0 .125 .75 1.0\n0 1 0 .5 .5 .5 1.0\n3 0 1 2\n",
                  plain);
}

/* Encoding is the inverse, above 1 too. */
static void the_curve_goes_on_above_one(void **state) {
    (void)state;
    for (double linear = 1e-4; linear < 1e6; linear *= 1.07) {
        double s = linear <= 0.0031308 ? 12.92 * linear : 1.055 * exp(log(linear) / 2.4) - 0.055;
        assert_true(fabs(fct_srgb_from_linear(linear) - s) <= 1e-12 * s);
        assert_true(fabs((double)fct_linear_from_srgb(s) - linear) <= 1e-6 * linear);
    }
    assert_true(fabs(fct_srgb_from_linear(-.001) + .01292) < 1e-15);
}

/* OBJ: expected[i] is sRGB, `message` a part of the only message, or "" for none. */
static void expect_obj_colors(const char *text, const double expected[9], const char *message) {
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_text(&r, "obj", text, &m), FCT_OK);
    assert_non_null(m.colors);
    for (int i = 0; i < 9; ++i) {
        double linear = linear_of(expected[i]);
        assert_true(fabs((double)m.colors[i] - linear) <= 1e-6 * (1 + linear));
    }
    if (*message ? !strstr(r.text, message) : *r.text) fail_msg("expected '%s', got '%s'", message, r.text);
    release(&r, &m);
    starve("obj", text, strlen(text));
}

static void obj_colors_are_srgb(void **state) {
    (void)state;
    static const double floats[9] = {.25, .5, 1, 0, .125, .75, .5, .02, .5};
    static const double bright[9] = {3.4, 0, 2, 1, 1, 1, 100, 300, 0};
    static const double whole[9] = {0, 0, 0, 0, 300, 0, 1, 1, 1};
    expect_obj_colors("v 0 0 0 .25 .5 1\nv 1 0 0 0 .125 .75\nv 0 1 0 .5 .02 .5\nf 1 2 3\n", floats, "");
    expect_obj_colors("v 0 0 0 3.4 0 2\nv 1 0 0 1 1 1\nv 0 1 0 100 300 0\n", bright, "");
    expect_obj_colors("v 0 0 0 0 0 0\nv 1 0 0 0 300 0\nv 0 1 0\n", whole, "name: 1 vertices have no colour");
}

/* Whole numbers up to 255, one over 1. */
static void obj_colors_may_be_bytes(void **state) {
    (void)state;
    static const double eight[9] = {1, 128 / 255., 0, 1 / 255., 2 / 255., 254 / 255., 1, 1, 1};
    static const double unit[9] = {1, 0, 1, 0, 1, 1, 1, 1, 1};
    expect_obj_colors("v 0 0 0 255 128 0\nv 1 0 0 1 2 254\nv 0 1 0\n", eight, "1 vertices have no colour");
    expect_obj_colors("v 0 0 0 255.0 128. 0\nv 1 0 0 1 2 2.54e2\nv 0 1 0 255 255 255\n", eight, "");
    expect_obj_colors("v 0 0 0 1 0 1\nv 1 0 0 0 1 1\nv 0 1 0 1 1 1\n", unit, "");
    for (int k = 2; k < 256; ++k) { /* every byte finds itself */
        char text[128];
        double expected[9] = {k / 255., 0, 1 / 255., 1, 1, 1, k / 255., k / 255., 0};
        snprintf(text, sizeof text, "v 0 0 0 %d 0 1\nv 0 0 0 255 255 255\nv 0 0 0 %d %d 0\n", k, k, k);
        expect_obj_colors(text, expected, "");
    }
}

/* x y z w r g b or x y z r g b a */
static void obj_vertices_of_seven_numbers(void **state) {
    (void)state;
    static const double c[9] = {.25, .5, .75, 1, 1, 1, 1, .5, .25}, d[9] = {1, .5, .25, .5, .5, .25, 1, 1, 1};
    static const double e[9] = {1, 0, 0, 1, .5, 0, 1, 1, 1}, f[9] = {1, 1, 0, 0, 1 / 255., 1, 0, 0, 0};
    expect_obj_colors("v 0 0 0 1 .25 .5 .75\nv 1 0 0\nv 0 1 0 1 1 .5 .25\n", c, "1 vertices have no colour");
    expect_obj_colors("v 0 0 0 1 .5 .25 1\nv 1 0 0 .5 .5 .25 1\nv 0 1 0 1 1 1\n", d, "");
    expect_obj_colors("v 0 0 0 1 .5 .25 .5\nv 1 0 0 .5 .5 .25 1\nv 0 1 0 1 1 1\n", d,
                      "the alpha of vertex colours is left out");
    expect_obj_colors("v 0 0 0 1 0 0 1\nv 1 0 0 1 .5 0 1\nv 0 1 0 1 1 1 1\n", e,
                      "read as x y z r g b a, but x y z w r g b is possible");
    expect_obj_colors("v 0 0 0 255 255 0 255\nv 1 0 0 0 1 255 255\nv 0 1 0 0 0 0 255\n", f, "");
    expect_obj_colors("v 0 0 0 1 255 255 0\nv 1 0 0 1 0 1 255\nv 0 1 0 1 0 0 0\n", f, "");
}

/* Only the seventh numbers show that these are bytes. */
static void obj_weights_before_bytes(void **state) {
    (void)state;
    static const double c[9] = {0, 1 / 255., 0, 1 / 255., 0, 128 / 255., 0, 0, 0};
    expect_obj_colors("v 0 0 0 1 0 1 0\nv 1 0 0 1 1 0 128\nv 0 1 0 1 0 0 0\n", c, "");
}

static void obj_drops_colors_that_are_not_finite(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_text(&r, "obj", "v 0 0 0 nan 1 inf\nv 1 0 0 1 1 1\nv 0 1 0\nf 1 2 3\n", &m),
                     FCT_OK);
    assert_null(m.colors);
    assert_non_null(strstr(r.text, "name: vertex colours are left out, because 2 components are not finite"));
    release(&r, &m);
}

/* A lamp of 17 is 3.38 in sRGB. */
static void obj_is_written_as_srgb(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_grid(&env, 1), back;
    m.colors = fct_allocate(&env, m.vertex_count, 12);
    for (uint32_t i = 0; i < 3 * m.vertex_count; ++i) m.colors[i] = i == 0 ? 17 : (float)i / 10;
    assert_int_equal(fct_mesh_save(&env, "facetree_test_color.obj", &m, NULL), FCT_OK);
    FILE *file = fopen("facetree_test_color.obj", "r");
    double v[6];
    assert_int_equal(
        fscanf(file, "# %*[^\n] v %lf %lf %lf %lf %lf %lf", v, v + 1, v + 2, v + 3, v + 4, v + 5), 6);
    fclose(file);
    for (int k = 0; k < 3; ++k) assert_true(fabs(linear_of(v[3 + k]) - (double)m.colors[k]) < 1e-6);
    assert_int_equal(fct_mesh_load(&env, "facetree_test_color.obj", &back), FCT_OK);
    remove("facetree_test_color.obj");
    assert_memory_equal(m.colors, back.colors, 12 * m.vertex_count);
    fct_mesh_release(&env, &back);
    release(&r, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(bytes_follow_the_standard),
                                       cmocka_unit_test(bytes_round_to_nearest),
                                       cmocka_unit_test(readers_take_integers_for_srgb_and_floats_for_linear),
                                       cmocka_unit_test(the_curve_goes_on_above_one),
                                       cmocka_unit_test(obj_colors_are_srgb),
                                       cmocka_unit_test(obj_colors_may_be_bytes),
                                       cmocka_unit_test(obj_vertices_of_seven_numbers),
                                       cmocka_unit_test(obj_weights_before_bytes),
                                       cmocka_unit_test(obj_drops_colors_that_are_not_finite),
                                       cmocka_unit_test(obj_is_written_as_srgb)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
