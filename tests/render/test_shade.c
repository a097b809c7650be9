/* Tone curves, the palette, light and lines of `facetree render`, against their formulas. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tools/render/palette.h"
#include "tools/render/shade.h"

static tool test_tool;

static void assert_rgb(const float got[3], double r, double g, double b, double tolerance) {
    assert_float_equal(got[0], r, tolerance);
    assert_float_equal(got[1], g, tolerance);
    assert_float_equal(got[2], b, tolerance);
}

static void the_soft_curve_bends_above_the_knee(void **state) {
    (void)state;
    for (double x = 0; x < 30; x += .37) {
        float grey[3] = {(float)x, (float)x, (float)x};
        picture_apply_tone(PICTURE_TONE_SOFT, grey);
        double want = x <= .7 ? x : 1 - .09 / (x - .4); /* continuous, with slope 1 at the knee */
        assert_rgb(grey, want, want, want, 2e-6);
        /* A colour keeps its peak, and its other channels fade towards it. */
        float rgb[3] = {(float)x, (float)(.5 * x), 0};
        picture_apply_tone(PICTURE_TONE_SOFT, rgb);
        double white = x <= .7 ? 0 : 1 - 1 / (1 + .12 * (x - want));
        assert_rgb(rgb, want, want * (.5 * (1 - white) + white), want * white, 2e-6);
    }
}

static void the_filmic_curve_is_narkowiczs(void **state) {
    (void)state;
    for (double x = 0; x < 5; x += .1) {
        float rgb[3] = {(float)x, 0, (float)x};
        double want = (2.51 * x * x + .03 * x) / (2.43 * x * x + .59 * x + .14);
        picture_apply_tone(PICTURE_TONE_FILMIC, rgb);
        assert_rgb(rgb, fmin(want, 1), 0, fmin(want, 1), 1e-6);
    }
    float rgb[3] = {-1, .4F, 7};
    picture_apply_tone(PICTURE_TONE_CLAMP, rgb);
    assert_rgb(rgb, 0, .4, 1, 1e-7);
}

/* Linear sRGB to OKLab (Ottosson 2020). */
static void to_oklab(const float rgb[3], double lab[3]) {
    static const double cones[3][3] = {{.4122214708, .5363325363, .0514459929},
                                       {.2119034982, .6806995451, .1073969566},
                                       {.0883024619, .2817188376, .6299787005}};
    static const double rows[3][3] = {{.2104542553, .7936177850, -.0040720468},
                                      {1.9779984951, -2.4285922050, .4505937099},
                                      {.0259040371, .7827717662, -.8086757660}};
    double root[3];
    for (int i = 0; i < 3; ++i)
        root[i] = cbrt(cones[i][0] * rgb[0] + cones[i][1] * rgb[1] + cones[i][2] * rgb[2]);
    for (int i = 0; i < 3; ++i) lab[i] = rows[i][0] * root[0] + rows[i][1] * root[1] + rows[i][2] * root[2];
}

static void the_palette_has_twelve_even_hues(void **state) {
    (void)state;
    bool seen[PALETTE] = {false};
    for (uint32_t i = 0; i < PALETTE; ++i) {
        float rgb[3], again[3];
        double lab[3];
        drawing_color(i, rgb);
        drawing_color(i + PALETTE, again);
        assert_memory_equal(rgb, again, sizeof rgb);
        to_oklab(rgb, lab);
        double chroma = hypot(lab[1], lab[2]), hue = atan2(lab[2], lab[1]) / 6.283185307179586;
        double step = (hue - floor(hue)) * PALETTE - .4;
        uint32_t number = (uint32_t)lrint(step);
        assert_true(number < PALETTE && !seen[number]);
        seen[number] = true;
        assert_float_equal(step, number, .02);
        assert_float_equal(lab[0], (number % 2 ? .68 : .80), 2e-3);
        assert_float_equal(chroma, (number % 2 ? .12 : .10), 2e-3);
    }
}

/* Equal steps have equal lengths in OKLab and become lighter, no channel leaves [0, 1], and the ends hold
 * outside of [0, 1]. */
static void false_colors_are_even(void **state) {
    (void)state;
    enum { STEPS = 64 };
    double before[3], shortest = INFINITY, longest = 0;
    float rgb[3], end[3];
    for (int i = 0; i <= STEPS; ++i) {
        double lab[3], square = 0;
        drawing_false_color((double)i / STEPS, rgb);
        for (int k = 0; k < 3; ++k) assert_true(rgb[k] > 0 && rgb[k] <= 1);
        to_oklab(rgb, lab);
        for (int k = 0; k < 3 && i; ++k) square += pow(lab[k] - before[k], 2);
        if (i) {
            assert_true(lab[0] > before[0] + .9 * .66 / STEPS);
            shortest = fmin(shortest, sqrt(square)), longest = fmax(longest, sqrt(square));
        }
        memcpy(before, lab, sizeof lab);
    }
    if (longest > 1.02 * shortest) fail_msg("steps of %g to %g", shortest, longest);
    assert_true(STEPS * longest > .75);
    drawing_false_color(7, end);
    assert_memory_equal(end, rgb, sizeof rgb);
    drawing_false_color(-1, end), drawing_false_color(0, rgb);
    assert_memory_equal(end, rgb, sizeof rgb);
}

/* Values are interpolated before they become a colour, without exposure and tone. */
static void values_are_shown_as_false_colors(void **state) {
    (void)state;
    float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, values[3] = {.1F, .5F, .9F}, rgb[3], expected[3];
    uint32_t triangles[3] = {0, 1, 2};
    const drawing d = {
        .mesh = {.vertex_count = 3, .face_count = 1, .positions = positions, .triangles = triangles},
        .values = values,
        .shading = DRAWING_LIGHT,
        .exposure = 3};
    const raster_point point = {.weight = {.5, .25, .25}};
    drawing_shade((void *)&d, &point, rgb);
    drawing_false_color(.05 + .125 + .225, expected);
    assert_rgb(rgb, (double)expected[0], (double)expected[1], (double)expected[2], 1e-6);
}

/* Two squares that meet along the y axis; the right one is turned up by `degrees`. */
static drawing make_roof(double degrees, float *positions, uint32_t *triangles) {
    double turn = degrees * 3.14159265358979323846 / 180, c = cos(turn), s = sin(turn);
    const float p[18] = {-1, 0, 0, 0, 0, 0, 0, 1, 0, -1, 1, 0, (float)c, 0, (float)s, (float)c, 1, (float)s};
    const uint32_t t[12] = {0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2};
    memcpy(positions, p, sizeof p);
    memcpy(triangles, t, sizeof t);
    return (drawing){
        .mesh = {.vertex_count = 6, .face_count = 4, .positions = positions, .triangles = triangles},
        .shading = DRAWING_SMOOTH,
        .exposure = 1};
}

static void normals_are_smooth_below_the_crease_angle(void **state) {
    (void)state;
    for (int sharp = 0; sharp < 2; ++sharp) {
        float positions[18];
        uint32_t triangles[12];
        double degrees = sharp ? 42 : 38, turn = degrees * 3.14159265358979323846 / 180;
        drawing d = make_roof(degrees, positions, triangles);
        assert_int_equal(drawing_prepare(&test_tool, &d, cos(40 * 3.14159265358979323846 / 180), false),
                         TOOL_DONE);
        const float *at_ridge = d.normals + 9 * 0 + 3 * 1; /* face 0, vertex 1 */
        /* Around vertex 1: faces 0, 2 and 3, of equal area. */
        double x = sharp ? 0 : -2 * sin(turn), z = sharp ? 1 : 1 + 2 * cos(turn), length = hypot(x, z);
        assert_rgb(at_ridge, x / length, 0, z / length, 1e-6);
        assert_rgb(d.normals, 0, 0, 1, 1e-6);
        d.mesh = (fct_mesh){0};
        tool_release(&test_tool, d.normals);
    }
}

static void cross_of(const float *a, const float *b, const float *c, double out[3]) {
    double u[3], v[3];
    for (int k = 0; k < 3; ++k) u[k] = (double)b[k] - (double)a[k], v[k] = (double)c[k] - (double)a[k];
    for (int k = 0; k < 3; ++k) out[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
}

static double length_of(const double v[3]) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Rough and uneven grids: the normal of a corner is the sum of the area vectors of those faces around its
 * vertex whose normals are within the crease angle of the face's own. */
static void normals_are_sums_of_area_vectors(void **state) {
    (void)state;
    enum { N = 5, M = N + 1, FACES = 2 * N * N };
    uint64_t seed = 1;
    for (int run = 0; run < 40; ++run) {
        float positions[3 * M * M];
        uint32_t triangles[3 * FACES], count = 0;
        for (int i = 0; i < 3 * M * M; ++i) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            double random = (double)(seed >> 11) * 0x1p-53, place = i % 3 == 0   ? i / 3 % M
                                                                    : i % 3 == 1 ? i / 3 / M
                                                                                 : 0;
            positions[i] = (float)(place + .4 * random + .3 * place * place);
        }
        for (uint32_t y = 0; y < N; ++y)
            for (uint32_t x = 0; x < N; ++x) {
                uint32_t a = y * M + x, t[6] = {a, a + 1, a + M + 1, a, a + M + 1, a + M};
                memcpy(triangles + count, t, sizeof t);
                count += 6;
            }
        double crease = cos((5 + run) * 3.14159265358979323846 / 180), sums[FACES][3];
        drawing d = {.mesh = {.vertex_count = M * M,
                              .face_count = FACES,
                              .positions = positions,
                              .triangles = triangles},
                     .shading = DRAWING_SMOOTH,
                     .exposure = 1};
        assert_int_equal(drawing_prepare(&test_tool, &d, crease, false), TOOL_DONE);
        for (uint32_t f = 0; f < FACES; ++f) {
            const uint32_t *t = triangles + 3 * (size_t)f;
            cross_of(positions + 3 * t[0], positions + 3 * t[1], positions + 3 * t[2], sums[f]);
        }
        for (uint32_t c = 0; c < 3 * FACES; ++c) {
            double sum[3] = {0, 0, 0}, *own = sums[c / 3];
            bool close = false;
            for (uint32_t f = 0; f < FACES; ++f) {
                const uint32_t *t = triangles + 3 * (size_t)f;
                if (t[0] != triangles[c] && t[1] != triangles[c] && t[2] != triangles[c]) continue;
                double dot = own[0] * sums[f][0] + own[1] * sums[f][1] + own[2] * sums[f][2];
                double cosine = dot / length_of(own) / length_of(sums[f]);
                close = close || fabs(cosine - crease) < 1e-6;
                for (int k = 0; k < 3 && cosine >= crease; ++k) sum[k] += sums[f][k];
            }
            double length = length_of(sum);
            if (!close)
                assert_rgb(d.normals + 3 * c, sum[0] / length, sum[1] / length, sum[2] / length, 1e-6);
        }
        d.mesh = (fct_mesh){0};
        tool_release(&test_tool, d.normals);
    }
}

/* The faces of other clusters across the side opposite a corner. Returns their number. */
static uint32_t list_across(const drawing *d, uint32_t face, uint32_t corner, uint32_t *found) {
    const uint32_t *t = d->mesh.triangles;
    uint32_t a = t[3 * face + (corner + 1) % 3], b = t[3 * face + (corner + 2) % 3], count = 0;
    for (uint32_t f = 0; f < d->mesh.face_count; ++f) {
        bool has_a = false, has_b = false;
        for (uint32_t k = 0; k < 3; ++k) has_a |= t[3 * f + k] == a, has_b |= t[3 * f + k] == b;
        if (has_a && has_b && d->labels[f] != d->labels[face]) found[count++] = f;
    }
    return count;
}

/* Random triangles between 20 points in clusters of 1 to 4 faces, so that a cluster has neighbours of all
 * colours. Each cluster, in order, has the colour that occurs least along its borders: the first of those
 * from its number on. Borders have lines. */
static void clusters_have_the_rarest_color_around(void **state) {
    (void)state;
    enum { FACES = 240, POINTS = 20 };
    float positions[3 * POINTS], paint[3 * FACES], palette[PALETTE][3];
    uint32_t triangles[3 * FACES], labels[FACES], found[FACES], random = 1, label = 0;
    uint8_t colors[FACES];
    for (uint32_t i = 0; i < PALETTE; ++i) drawing_color(i, palette[i]);
    for (uint32_t i = 0; i < 3 * POINTS; ++i)
        positions[i] = (float)((random = random * 1664525u + 1013904223u) >> 8) * 0x1p-24F;
    for (uint32_t f = 0; f < FACES; ++f) {
        uint32_t first = (random = random * 1664525u + 1013904223u) >> 12,
                 second = (random = random * 1664525u + 1013904223u) >> 12;
        triangles[3 * f] = first % POINTS, triangles[3 * f + 1] = (first + 1 + second % 6) % POINTS;
        triangles[3 * f + 2] = (first + 7 + second / 6 % 6) % POINTS;
        if (f && second / 36 % 4 == 0) ++label;
        labels[f] = label;
    }
    drawing d = {
        .mesh = {.vertex_count = POINTS, .face_count = FACES, .positions = positions, .triangles = triangles},
        .paint = paint,
        .labels = labels,
        .shading = DRAWING_FLAT};
    assert_int_equal(drawing_prepare(&test_tool, &d, 0, false), TOOL_DONE);
    for (uint32_t begin = 0, end; begin < FACES; begin = end) {
        unsigned used[PALETTE] = {0};
        for (end = begin; end < FACES && labels[end] == labels[begin]; ++end)
            for (uint32_t k = 0; k < 3; ++k) {
                uint32_t count = list_across(&d, end, k, found);
                assert_int_equal(d.lines[end] >> k & 1, count > 0);
                for (uint32_t i = 0; i < count; ++i)
                    if (labels[found[i]] < labels[begin]) ++used[colors[labels[found[i]]]];
            }
        uint32_t best = labels[begin] % PALETTE;
        for (uint32_t i = 1; i < PALETTE; ++i) {
            uint32_t other = (labels[begin] + i) % PALETTE;
            if (used[other] < used[best]) best = other;
        }
        colors[labels[begin]] = (uint8_t)best;
        for (uint32_t f = begin; f < end; ++f)
            assert_memory_equal(paint + 3 * f, palette[best], sizeof palette[best]);
    }
    tool_release(&test_tool, d.lines);
}

static void baked_colors_are_shown_as_light(void **state) {
    (void)state;
    float positions[18], colors[18] = {0}, glow[12] = {0}, rgb[3];
    uint32_t triangles[12];
    uint8_t lines[4] = {0, 0, 2, 0};
    drawing d = make_roof(0, positions, triangles);
    d.mesh.colors = colors, d.shading = DRAWING_LIGHT, d.tone = PICTURE_TONE_CLAMP, d.exposure = .5F;
    for (int k = 0; k < 3; ++k) colors[3 + k] = .2F * (float)k, colors[12 + k] = .6F, colors[15 + k] = .1F;
    raster_point point = {.face = 2, .weight = {.5, .3, .2}, .side = {9, 9, 9}};
    drawing_shade(&d, &point, rgb);
    for (int k = 0; k < 3; ++k) assert_float_equal(rgb[k], .5 * (.5 * .2 * k + .3 * .6 + .2 * .1), 1e-6);
    d.glow = glow, glow[6] = .4F;
    drawing_shade(&d, &point, rgb);
    assert_float_equal(rgb[0], .5 * (.2 + .4), 1e-6);
    /* A line darkens by 80 %, and ends half a pixel beyond its width. */
    d.lines = lines, d.line_width = .6F;
    const double sides[4] = {0, .6, .85, 1.2}, covers[4] = {1, .5, .25, 0};
    for (int i = 0; i < 4; ++i) {
        point.side[1] = sides[i];
        drawing_shade(&d, &point, rgb);
        assert_float_equal(rgb[0], .3 * (1 - .8 * covers[i]), 1e-6);
    }
}

/* The studio's light on a flat face with the normal (0, 0, 1), from its parts. */
static void studio_light_is_a_sum_of_lamps(void **state) {
    (void)state;
    const double sky[3] = {.30, .335, .40}, ground[3] = {.20, .175, .155}, key[3] = {.92, .85, .75},
                 fill[3] = {.07, .09, .13}, plaster[3] = {.62, .59, .55}, inside[3] = {.62, .52, .46};
    float positions[18], rgb[3];
    uint32_t triangles[12];
    const double eye[3] = {0, 0, 4};
    drawing d = make_roof(0, positions, triangles);
    d.shading = DRAWING_FLAT, d.tone = PICTURE_TONE_CLAMP, d.eye = eye;
    const float lights[3][3] = {{0, .6F, .8F}, {.96F, 0, .28F}, {0, .8F, .6F}};
    memcpy(d.light, lights, sizeof lights);
    raster_point point = {
        .face = 0, .weight = {0, 1, 0}, .side = {9, 9, 9}}; /* at the origin, below the eye */
    for (int back = 0; back < 2; ++back) {
        double z = back ? -1 : 1, up = .5 + .5 * .6 * z, f = fmax(.28 * z, 0),
               k = fmax(.8 * z + .12, 0) / 1.12;
        double rim = back ? .12 * up : 0; /* 1 - n . eye is 1 from behind, where n . eye < 0 */
        double gloss = back ? 0 : .06 * pow(1.8 / sqrt(.36 + 1.8 * 1.8), 30);
        point.back = back;
        drawing_shade(&d, &point, rgb);
        for (int i = 0; i < 3; ++i) {
            double light = ground[i] + (sky[i] - ground[i]) * up + key[i] * k + fill[i] * f + rim;
            assert_float_equal(rgb[i], plaster[i] * light * (back ? inside[i] : 1) + gloss, 1e-5);
        }
    }
}

int main(void) {
    test_tool = (tool){.name = "test", .quiet = true};
    tool_env_open(&test_tool, NULL);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_soft_curve_bends_above_the_knee),
        cmocka_unit_test(the_filmic_curve_is_narkowiczs),
        cmocka_unit_test(the_palette_has_twelve_even_hues),
        cmocka_unit_test(false_colors_are_even),
        cmocka_unit_test(values_are_shown_as_false_colors),
        cmocka_unit_test(normals_are_smooth_below_the_crease_angle),
        cmocka_unit_test(normals_are_sums_of_area_vectors),
        cmocka_unit_test(clusters_have_the_rarest_color_around),
        cmocka_unit_test(baked_colors_are_shown_as_light),
        cmocka_unit_test(studio_light_is_a_sum_of_lamps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
