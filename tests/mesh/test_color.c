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
    expect_colors("obj", "v 0 0 0 .25 .5 1\nv 1 0 0 0 .125 .75\nv 0 1 0 .5 .5 .5\nf 1 2 3\n", plain);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bytes_follow_the_standard), cmocka_unit_test(bytes_round_to_nearest),
        cmocka_unit_test(readers_take_integers_for_srgb_and_floats_for_linear)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
