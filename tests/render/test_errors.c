/* The error of a bake as numbers for false colours. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tools/render/errors.h"

static tool test_tool;

/* Separate triangles in a row. Face i has the area 2^i, light count - i and the error errors[i]. */
static void make_faces(uint32_t count, const float *errors, drawing *d) {
    *d = (drawing){.shading = DRAWING_AUTO};
    assert_int_equal(
        fct_mesh_create(&test_tool.env, 3 * count, count, FCT_MESH_COLORS | FCT_MESH_ERROR, &d->mesh),
        FCT_OK);
    for (uint32_t f = 0; f < count; ++f) {
        const float size = (float)(1 << f), at[9] = {0, 0, 5, 2 * size, 0, 5, 0, 1, 5};
        memcpy(d->mesh.positions + 9 * (size_t)f, at, sizeof at);
        for (uint32_t k = 0; k < 3; ++k) {
            const size_t v = 3 * (size_t)f + k;
            d->mesh.triangles[v] = (uint32_t)v;
            d->mesh.error[v] = errors[f];
            for (size_t c = 0; c < 3; ++c) d->mesh.colors[3 * v + c] = (float)(count - f);
        }
    }
}

static void release(drawing *d) {
    fct_mesh_release(&test_tool.env, &d->mesh);
    tool_release(&test_tool, d->values);
}

/* Areas 8, 4, 2, 1 with light 1 to 4: the largest face has 53 % of the area, so the median light is its 1. */
static void errors_are_shares_of_the_median(void **state) {
    (void)state;
    static const float errors[4] = {.02F, .3F, 0, .04F};
    drawing d;
    double end = 0;
    make_faces(4, errors, &d);
    assert_int_equal(drawing_show_errors(&test_tool, "x", &d, &end), TOOL_DONE);
    /* Of the area with errors, 1 + 2 + 8, the face with the largest error has 18 %: .3 / 1 = 30 %. */
    assert_true(end == 50 && d.shading == DRAWING_LIGHT);
    for (size_t v = 0; v < 12; ++v) assert_float_equal(d.values[v], errors[v / 3] * 100 / 50, 1e-6);
    release(&d);
    make_faces(4, errors, &d);
    end = 4;
    assert_int_equal(drawing_show_errors(&test_tool, "x", &d, &end), TOOL_DONE);
    assert_true(end == 4);
    assert_float_equal(d.values[11], .04 * 100 / 4, 1e-6);
    release(&d);
}

/* The end is 1, 2 or 5 times a power of ten, and outliers on under 2 % of the area do not count. */
static void ends_are_round(void **state) {
    (void)state;
    static const struct {
        float error;
        double end;
    } cases[] = {{1e-4F, .005}, {.0011F, .05}, {.0039F, .1}, {.0041F, .2}, {.084F, 5}, {.21F, 10}, {6, 200}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        /* The first two faces have 3 / 255 of the area. */
        const float errors[8] = {9, 9, 0, 0, 0, 0, 0, cases[i].error};
        drawing d;
        double end = 0;
        make_faces(8, errors, &d);
        for (size_t k = 0; k < 72; ++k) d.mesh.colors[k] = 4;
        for (size_t v = 6; v < 21; ++v) d.mesh.error[v] = cases[i].error / 2;
        assert_int_equal(drawing_show_errors(&test_tool, "x", &d, &end), TOOL_DONE);
        if (fabs(end - cases[i].end) > 1e-9 * end)
            fail_msg("case %zu: %g, expected %g", i, end, cases[i].end);
        release(&d);
    }
}

static void dark_meshes_have_no_errors(void **state) {
    (void)state;
    static const float errors[2] = {1, 2}, none[2] = {0, 0};
    for (int dark = 0; dark < 2; ++dark) {
        drawing d;
        double end = 0;
        make_faces(2, dark ? errors : none, &d);
        if (dark) memset(d.mesh.colors, 0, 18 * sizeof(float));
        assert_int_equal(drawing_show_errors(&test_tool, "x", &d, &end), TOOL_DONE);
        assert_true(end == 1);
        for (size_t v = 0; v < 6; ++v) assert_true(d.values[v] == 0);
        release(&d);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(errors_are_shares_of_the_median),
                                       cmocka_unit_test(ends_are_round),
                                       cmocka_unit_test(dark_meshes_have_no_errors)};
    test_tool.env = fct_env_default();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
