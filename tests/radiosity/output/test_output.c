/* Outputs: the smoothing filter against a direct evaluation, borders, sides, sites of probes, radiosities. */
#include "../place.h"
#include "../soup.h"
#include "radiosity/output/output.h"
#include "radiosity/output/probe.h"
#include "radiosity/output/smooth.h"
#include "radiosity/surface/tessellate.h"
#include "scene/transform.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

static fct_scene *begin(void) {
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    return scene;
}

/* Two passes of c = (c + sum w c') / (1 + sum w) over all sides of all faces, w = (1 - x^2)^2, x = difference
 * over 10 % of the sum. */
static void smooth_directly(const fct_surface *s, const uint8_t *covered, double *c) {
    size_t n = s->mesh.vertex_count;
    double *sum = malloc(4 * n * sizeof *sum);
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t v = 0; v < n; ++v) {
            for (int k = 0; k < 3; ++k) sum[4 * v + (size_t)k] = c[3 * v + (size_t)k];
            sum[4 * v + 3] = 1;
        }
        for (size_t i = 0; i < 3 * (size_t)s->mesh.face_count; ++i) {
            size_t ends[2] = {s->mesh.triangles[i], s->mesh.triangles[i % 3 == 2 ? i - 2 : i + 1]};
            double difference = 0, level = 0;
            for (size_t k = 0; k < 3; ++k) {
                difference += fabs(c[3 * ends[0] + k] - c[3 * ends[1] + k]);
                level += c[3 * ends[0] + k] + c[3 * ends[1] + k];
            }
            double x = difference / (.1 * level), w = x < 1 ? (1 - x * x) * (1 - x * x) : 0;
            if (!s->flat[ends[0]] || !s->flat[ends[1]] || covered[ends[0]] || covered[ends[1]]) w = 0;
            for (size_t e = 0; e < 2; ++e) {
                for (size_t k = 0; k < 3; ++k) sum[4 * ends[e] + k] += w * c[3 * ends[1 - e] + k];
                sum[4 * ends[e] + 3] += w;
            }
        }
        for (size_t v = 0; v < n; ++v)
            for (size_t k = 0; k < 3; ++k) c[3 * v + k] = sum[4 * v + k] / sum[4 * v + 3];
    }
    free(sum);
}

static void noise_on_flat_surfaces_is_smoothed(void **state) {
    (void)state;
    fct_scene *scene = begin();
    place_sheet(&plain, scene, place_material(scene, .5, 0, false), 12, v3_make(0, 0, 0), v3_make(1, 0, 0),
                v3_make(0, 1, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_surface s;
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, 0), 10, &s), FCT_OK);
    size_t n = s.mesh.vertex_count;
    double *expected = malloc(3 * n * sizeof *expected), before = 0, after = 0;
    for (size_t v = 0; v < n; ++v)
        for (size_t k = 0; k < 3; ++k) {
            double level = s.mesh.positions[3 * v] > .5F ? 1 : .5,
                   noise = fct_uniform(fct_hash3(v, k, 1)) - .5;
            expected[3 * v + k] = s.mesh.colors[3 * v + k] = (float)(level * (1 + .07 * noise));
        }
    uint8_t *covered = calloc(n, 1);
    smooth_directly(&s, covered, expected);
    float *noisy = malloc(3 * n * sizeof *noisy);
    memcpy(noisy, s.mesh.colors, 3 * n * sizeof *noisy);
    assert_int_equal(fct_light_smooth(&plain, &s, covered, s.mesh.colors), FCT_OK);
    for (size_t i = 0; i < 3 * n; ++i) {
        double level = s.mesh.positions[i - i % 3] > .5F ? 1 : .5;
        assert_near(s.mesh.colors[i], expected[i], 1e-5);
        before += pow(noisy[i] / level - 1, 2), after += pow(s.mesh.colors[i] / level - 1, 2);
    }
    assert_true(after < .2 * before);
    /* Vertices that are covered or not flat keep their light and give none. */
    for (size_t v = 0; v < n; ++v) s.flat[v] = fct_hash(v) % 3 > 0, covered[v] = fct_hash(v) % 5 == 0;
    for (size_t i = 0; i < 3 * n; ++i) expected[i] = s.mesh.colors[i] = noisy[i];
    smooth_directly(&s, covered, expected);
    assert_int_equal(fct_light_smooth(&plain, &s, covered, s.mesh.colors), FCT_OK);
    for (size_t i = 0; i < 3 * n; ++i) assert_near(s.mesh.colors[i], expected[i], 1e-5);
    memset(s.flat, 0, n);
    memcpy(s.mesh.colors, noisy, 3 * n * sizeof *noisy);
    assert_int_equal(fct_light_smooth(&plain, &s, covered, s.mesh.colors), FCT_OK);
    assert_memory_equal(noisy, s.mesh.colors, 3 * n * sizeof *noisy);
    free(noisy), free(expected), free(covered);
    fct_surface_release(&plain, &s);
    fct_scene_destroy(scene);
}

/* The sheet of 12 x 12 squares, and the same triangles without common vertices. */
static void make_sheets(fct_scene *scene, fct_surface *sheet, fct_surface *loose) {
    const uint32_t grey = place_material(scene, .5, 0, false);
    fct_mesh mesh = make_sheet(&plain, 12, v3_make(0, 0, 0), v3_make(1, .2, 0), v3_make(0, 1, .3)), apart;
    assert_int_equal(fct_mesh_create(&plain, 3 * mesh.face_count, mesh.face_count, 0, &apart), FCT_OK);
    for (size_t c = 0; c < 3 * (size_t)mesh.face_count; ++c) {
        apart.triangles[c] = (uint32_t)c;
        memcpy(apart.positions + 3 * c, mesh.positions + 3 * (size_t)mesh.triangles[c], 12);
    }
    place_mesh(scene, &mesh, grey, NULL);
    place_mesh(scene, &apart, grey, NULL);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, 0), 10, sheet), FCT_OK);
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, 1), 10, loose), FCT_OK);
    assert_int_equal(sheet->mesh.vertex_count, mesh.vertex_count);
    assert_int_equal(loose->mesh.vertex_count, 3 * mesh.face_count);
    fct_mesh_release(&plain, &mesh), fct_mesh_release(&plain, &apart);
}

/* The vertex of the sheet at the position of a vertex of the loose triangles. */
static size_t find_in_sheet(const fct_surface *sheet, const fct_surface *loose, size_t v) {
    for (size_t u = 0; u < sheet->mesh.vertex_count; ++u)
        if (!memcmp(sheet->mesh.positions + 3 * u, loose->mesh.positions + 3 * v, 12)) return u;
    fail();
    return 0;
}

/* Triangles without common vertices have the light of the sheet that they form, with the mean of the vertices
 * at each position. A vertex that is covered takes no part. */
static void triangles_without_common_vertices_are_smoothed_alike(void **state) {
    (void)state;
    fct_scene *scene = begin();
    fct_surface sheet, loose;
    make_sheets(scene, &sheet, &loose);
    const size_t n = sheet.mesh.vertex_count, m = loose.mesh.vertex_count;
    double *expected = calloc(3 * n, sizeof *expected);
    float *first = calloc(3 * m, sizeof *first);
    int *counts = calloc(n, sizeof *counts);
    uint8_t *covered = calloc(m, 1), *bare = calloc(n, 1);
    covered[5] = 1;
    for (size_t v = 0; v < m; ++v) {
        const size_t u = find_in_sheet(&sheet, &loose, v);
        for (size_t k = 0; k < 3; ++k) {
            first[3 * v + k] = loose.mesh.colors[3 * v + k] =
                (float)(1 + .07 * fct_uniform(fct_hash3(v, k, 2)));
            if (!covered[v]) expected[3 * u + k] += first[3 * v + k];
        }
        counts[u] += !covered[v];
    }
    for (size_t i = 0; i < 3 * n; ++i) expected[i] /= counts[i / 3];
    smooth_directly(&sheet, bare, expected);
    assert_int_equal(fct_light_smooth(&plain, &loose, covered, loose.mesh.colors), FCT_OK);
    int compared = 0;
    for (size_t v = 0; v < m; ++v) {
        const size_t u = find_in_sheet(&sheet, &loose, v);
        if (covered[v]) assert_memory_equal(loose.mesh.colors + 3 * v, first + 3 * v, 12);
        /* The two sides of the covered vertex's triangle give no light twice to their ends. */
        if (v3_norm(v3_sub(v3_load(loose.mesh.positions + 3 * v), v3_load(loose.mesh.positions + 15))) < .3)
            continue;
        for (size_t k = 0; k < 3; ++k) assert_near(loose.mesh.colors[3 * v + k], expected[3 * u + k], 1e-5);
        ++compared;
    }
    assert_true(compared > 600);
    free(expected), free(first), free(counts), free(covered), free(bare);
    fct_surface_release(&plain, &sheet), fct_surface_release(&plain, &loose);
    fct_scene_destroy(scene);
}

/* A wall above the seam of triangles keeps its two sides apart: light of 1 on the left, of 1.3 on the right.
 */
static void light_does_not_pass_walls_above_seams(void **state) {
    (void)state;
    fct_scene *scene = begin();
    fct_surface sheet, loose;
    make_sheets(scene, &sheet, &loose);
    const size_t m = loose.mesh.vertex_count;
    fct_sight *sights = calloc(m, sizeof *sights);
    uint8_t *covered = calloc(m, 1);
    float *light = malloc(3 * m * sizeof *light);
    int seam = 0;
    for (size_t v = 0; v < m; ++v) {
        const float *p = loose.mesh.positions + 9 * (v / 3); /* triangle k has the vertices 3 k to 3 k + 2 */
        const bool right = p[0] + p[3] + p[6] > 1.5F;
        for (size_t k = 0; k < 3; ++k) light[3 * v + k] = right ? 1.3F : 1;
        sights[v].variance = 1e-3F;
        seam += right && fabsf(loose.mesh.positions[3 * v] - .5F) < 1e-4F;
    }
    assert_true(seam > 12);
    memcpy(loose.mesh.colors, light, 3 * m * sizeof *light);
    assert_int_equal(fct_light_smooth(&plain, &loose, covered, loose.mesh.colors), FCT_OK);
    for (size_t i = 0; i < 3 * m; ++i) assert_near(loose.mesh.colors[i], light[i], 1e-5);
    assert_int_equal(fct_direct_smooth(&plain, &loose, covered, sights, loose.mesh.colors), FCT_OK);
    for (size_t i = 0; i < 3 * m; ++i) assert_near(loose.mesh.colors[i], light[i], 1e-5);
    free(sights), free(covered), free(light);
    fct_surface_release(&plain, &sheet), fct_surface_release(&plain, &loose);
    fct_scene_destroy(scene);
}

/* Solves the 3 x 3 system for several right sides by elimination. */
static void eliminate(double a[3][3], double b[3][4]) {
    for (int i = 0; i < 3; ++i)
        for (int r = 0; r < 3; ++r) {
            if (r == i) continue;
            const double q = a[r][i] / a[i][i];
            for (int c = 0; c < 3; ++c) a[r][c] -= q * a[i][c];
            for (int c = 0; c < 4; ++c) b[r][c] -= q * b[i][c];
        }
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < 4; ++c) b[i][c] /= a[i][i];
}

/* Marks the vertices that share a face with a marked one. */
static void grow_marks(const fct_mesh *m, uint8_t *marks) {
    uint8_t *old = malloc(m->vertex_count);
    memcpy(old, marks, m->vertex_count);
    for (size_t f = 0; f < m->face_count; ++f) {
        const uint32_t *t = m->triangles + 3 * f;
        if (old[t[0]] || old[t[1]] || old[t[2]]) marks[t[0]] = marks[t[1]] = marks[t[2]] = 1;
    }
    free(old);
}

/* The light at vertex v of the sheet: least squares over the marked vertices, in the parameters of the sheet.
 * Returns chi-square per degree of freedom. */
static double fit_directly(const fct_surface *s, const fct_sight *sights, const float *light, size_t v,
                           const uint8_t *marks, double out[3]) {
    double a[3][3] = {{0}}, b[3][4] = {{0}}, rows[64][8], misfit = 0;
    const float *own = light + 3 * v;
    const double level = (double)own[0] + own[1] + own[2];
    int n = 0;
    for (size_t other = 0; other < s->mesh.vertex_count; ++other) {
        if (!marks[other]) continue;
        const float *l = light + 3 * other, *x = s->mesh.positions + 3 * other;
        const double sum = (double)l[0] + l[1] + l[2], least = .005 * fmax(sum, level);
        const double variance = (double)sights[other].variance + .1 * (double)sights[v].variance;
        const double w = 1 / (variance + least * least);
        const double row[8] = {1, x[0], x[2], l[0], l[1], l[2], sum, w}; /* x and z span the sheet */
        assert_true(n < 64);
        memcpy(rows[n++], row, sizeof row);
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) a[r][c] += w * row[r] * row[c];
            for (int c = 0; c < 4; ++c) b[r][c] += w * row[r] * row[3 + c];
        }
    }
    eliminate(a, b);
    for (int i = 0; i < n; ++i) {
        const double r = b[0][3] + b[1][3] * rows[i][1] + b[2][3] * rows[i][2] - rows[i][6];
        misfit += rows[i][7] * r * r;
    }
    for (int k = 0; k < 3; ++k)
        out[k] = b[0][k] + b[1][k] * s->mesh.positions[3 * v] + b[2][k] * s->mesh.positions[3 * v + 2];
    return n > 3 ? misfit / (n - 3) : (double)INFINITY;
}

/* The light that the fits within one edge and within two give. Returns the number of fits that explain it. */
static int fit_twice(const fct_surface *s, const fct_sight *sights, const float *light, size_t v,
                     double out[3]) {
    uint8_t *marks = calloc(s->mesh.vertex_count, 1);
    int taken = 0;
    marks[v] = 1;
    for (int k = 0; k < 3; ++k) out[k] = (double)light[3 * v + (size_t)k];
    for (int ring = 0; ring < 2; ++ring) {
        double plane[3];
        grow_marks(&s->mesh, marks);
        const double misfit = fit_directly(s, sights, light, v, marks, plane);
        for (int k = 0; k < 3 && misfit < INFINITY; ++k)
            out[k] += pow(fmin(6 / misfit, 1), 2) * (plane[k] - out[k]);
        taken += misfit <= 6;
    }
    free(marks);
    return taken;
}

/* Light with known noise: linear, with a step along the middle, and without variance at some vertices. */
static void noise_of_shadow_rays_is_smoothed(void **state) {
    (void)state;
    fct_scene *scene = begin();
    fct_surface sheet, loose;
    make_sheets(scene, &sheet, &loose);
    const size_t n = sheet.mesh.vertex_count, m = loose.mesh.vertex_count;
    fct_sight *sights = calloc(n, sizeof *sights), *all = calloc(m, sizeof *all);
    float *light = sheet.mesh.colors, *before = malloc(3 * n * sizeof *before);
    uint8_t *covered = calloc(m, 1);
    double noise = 0, rest = 0;
    for (size_t v = 0; v < n; ++v) {
        const float *p = sheet.mesh.positions + 3 * v;
        const double level = 1 + .3 * (double)p[0] + (p[0] > .5F ? 1 : 0), deviation = .06;
        sights[v].variance = fct_hash(v) % 7 ? (float)(deviation * deviation) : 0;
        double error = 0; /* of about one deviation */
        for (uint64_t k = 0; k < 12; ++k) error += fct_uniform(fct_hash3(v, k, 3)) - .5;
        if (sights[v].variance == 0) error = 0;
        for (size_t k = 0; k < 3; ++k)
            light[3 * v + k] = before[3 * v + k] =
                (float)(level * (double)(k + 1) / 6 + deviation * error / 3);
    }
    for (size_t v = 0; v < m; ++v) {
        const size_t u = find_in_sheet(&sheet, &loose, v);
        size_t twins = 0;
        for (size_t w = 0; w < m; ++w) twins += find_in_sheet(&sheet, &loose, w) == u;
        memcpy(loose.mesh.colors + 3 * v, light + 3 * u, 12);
        all[v].variance = sights[u].variance * (float)twins; /* the mean has the variance of the sheet */
    }
    assert_int_equal(fct_direct_smooth(&plain, &sheet, covered, sights, light), FCT_OK);
    int taken = 0, left = 0, sure = 0;
    double step[2] = {0, 0}, count[2] = {0, 0}; /* mean error of all channels left and right of the step */
    for (size_t v = 0; v < n; ++v) {
        double expected[3];
        const bool noisy = sights[v].variance > 0;
        const int fits = noisy ? fit_twice(&sheet, sights, before, v, expected) : 0;
        for (size_t k = 0; k < 3; ++k) {
            if (noisy)
                assert_near(light[3 * v + k], expected[k], 2e-6);
            else
                assert_true(light[3 * v + k] == before[3 * v + k]);
            const float x = sheet.mesh.positions[3 * v];
            if (x > .1F && x < .9F && (x < .4F || x > .6F)) {
                const double level = (1 + .3 * (double)x + (x > .5F ? 1 : 0)) * (double)(k + 1) / 6;
                noise += pow(before[3 * v + k] - level, 2), rest += pow(light[3 * v + k] - level, 2);
            }
        }
        const float *p = sheet.mesh.positions + 3 * v, *l = light + 3 * v;
        if (p[0] > .4F && p[0] < .6F) {
            const bool high = p[0] > .5F;
            step[high] += (double)l[0] + l[1] + l[2] - (1 + .3 * (double)p[0] + high), ++count[high];
        }
        taken += fits == 2, left += noisy && fits == 0, sure += !noisy;
    }
    printf("    %d fits, %d misfits, %d without noise; the noise is %.2f of that before\n", taken, left, sure,
           sqrt(rest / noise));
    printf("    beside the step: %.3f and %.3f\n", step[0] / count[0], step[1] / count[1]);
    /* The step is 1, and stays hard. */
    assert_true(fabs(step[0] / count[0]) < .1 && fabs(step[1] / count[1]) < .1);
    assert_true(taken > 90 && left > 10 && sure > 10 && rest < .15 * noise);
    assert_int_equal(fct_direct_smooth(&plain, &loose, covered, all, loose.mesh.colors), FCT_OK);
    for (size_t v = 0; v < m; ++v)
        for (size_t k = 0; k < 3; ++k)
            assert_near(loose.mesh.colors[3 * v + k], light[3 * find_in_sheet(&sheet, &loose, v) + k], 2e-6);
    /* Covered vertices, and those that are not flat, neither give nor take. */
    memset(covered, 1, m), memcpy(light, before, 3 * n * sizeof *light);
    assert_int_equal(fct_direct_smooth(&plain, &sheet, covered, sights, light), FCT_OK);
    assert_memory_equal(light, before, 3 * n * sizeof *light);
    memset(covered, 0, m), memset(sheet.flat, 0, n);
    assert_int_equal(fct_direct_smooth(&plain, &sheet, covered, sights, light), FCT_OK);
    assert_memory_equal(light, before, 3 * n * sizeof *light);
    free(sights), free(all), free(before), free(covered);
    fct_surface_release(&plain, &sheet), fct_surface_release(&plain, &loose);
    fct_scene_destroy(scene);
}

/* A fan around one vertex: a search through all of its neighbours for each of them would take minutes. Each
 * thread count gives the same bytes. */
static void hubs_are_smoothed_in_linear_time(void **state) {
    (void)state;
    enum { RIM = 60000 };
    fct_surface fan;
    float *first = NULL;
    fct_sight *sights = calloc(RIM + 1, sizeof *sights);
    uint8_t *covered = calloc(RIM + 1, 1);
    for (uint32_t threads = 1; threads <= 3; threads += 2) {
        plain = fct_env_default();
        plain.thread_count = threads;
        assert_int_equal(fct_surface_allocate(&plain, RIM + 1, RIM, &fan), FCT_OK);
        float *light = calloc(3 * (RIM + 1), sizeof *light);
        for (uint32_t v = 0; v <= RIM; ++v) {
            const double angle = 6.283185307179586 * v / RIM, radius = v ? 1 : 0;
            v3_store(fan.mesh.positions + 3 * (size_t)v,
                     v3_make(radius * cos(angle), radius * sin(angle), 0));
            fan.normals[3 * (size_t)v + 2] = 1, fan.flat[v] = 1, sights[v].variance = 1e-4F;
            for (size_t c = 0; c < 3; ++c)
                light[3 * (size_t)v + c] = 1 + .02F * (float)fct_uniform(fct_hash(v));
        }
        for (uint32_t f = 0; f < RIM; ++f) {
            uint32_t *t = fan.mesh.triangles + 3 * (size_t)f;
            t[0] = 0, t[1] = 1 + f, t[2] = 1 + (f + 1) % RIM;
        }
        assert_int_equal(fct_direct_smooth(&plain, &fan, covered, sights, light), FCT_OK);
        if (first) assert_memory_equal(light, first, 3 * (RIM + 1) * sizeof *light);
        free(first), first = light;
        fct_surface_release(&plain, &fan);
    }
    double noise = 0, rest = 0;
    for (size_t i = 3; i < 3 * (RIM + 1); ++i)
        noise += pow(.02 * fct_uniform(fct_hash(i / 3)) - .01, 2), rest += pow((double)first[i] - 1.01, 2);
    printf("    the noise is %.2f of that before\n", sqrt(rest / noise));
    assert_true(rest < .7 * noise);
    free(first), free(sights), free(covered);
}

/* Difference against 10 % of the sum plus 4 % of the scene's mean, summed over channels. */
static void borders_are_relative_and_absolute(void **state) {
    (void)state;
    const float a[3] = {1, 1, 1}, near[3] = {1, 1, .413F}, far[3] = {1, 1, .375F}, dark[3] = {0, 0, 0},
                dim[3] = {.03F, 0, 0};
    /* 3 + 2 + x: |1 - x| = .1 (5 + x) + .04 at x = .41818 */
    assert_false(fct_output_crosses_border(a, (const float[3]){1, 1, .44F}, 1, false));
    assert_true(fct_output_crosses_border(a, near, 1, false));
    /* without the scene's level at x = .4545 */
    assert_true(fct_output_crosses_border(a, (const float[3]){1, 1, .44F}, 0, false));
    assert_true(fct_output_crosses_border(far, a, 1, false));
    /* .6 times that: |1 - x| = .06 (5 + x) + .024 at x = .6377 */
    assert_true(fct_output_crosses_border(a, (const float[3]){1, 1, .636F}, 1, true));
    assert_false(fct_output_crosses_border(a, (const float[3]){1, 1, .64F}, 1, true));
    assert_false(fct_output_crosses_border(dark, dim, 1, false)),
        assert_true(fct_output_crosses_border(dark, dim, .5, false));
}

static void smaller_errors_get_more_rays(void **state) {
    (void)state;
    fct_solution s = {0};
    const double fineness[4] = {.25, 1, 3, 16};
    const uint32_t rays[4] = {4, 4, 12, 64};
    for (int k = 0; k < 4; ++k) {
        s.fineness = fineness[k];
        assert_int_equal(fct_solution_lamp_rays(&s, 4), rays[k]);
    }
}

static void radiosity_is_emission_plus_reflection(void **state) {
    (void)state;
    fct_scene *scene = begin();
    place_sheet(&plain, scene, place_material(scene, .25, 3, false), 1, v3_make(0, 0, 0), v3_make(1, 0, 0),
                v3_make(0, 1, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_solution s = {.env = &plain, .scene = scene};
    s.elements.view = fct_scene_get(scene);
    const double irradiance[3] = {1, 2, 4};
    const float rho[3] = {.25F, .25F, .125F};
    float b[3];
    fct_solution_radiosity(&s, 0, rho, irradiance, b);
    assert_near(b[0], 3.25, 1e-6), assert_near(b[1], 3.5, 1e-6), assert_near(b[2], 3.5, 1e-6);
    s.def.indirect_only = true;
    fct_solution_radiosity(&s, 0, rho, irradiance, b);
    assert_near(b[0], .25, 1e-6), assert_near(b[2], .5, 1e-6);
    fct_scene_destroy(scene);
}

static void lit_sides_are_shown(void **state) {
    (void)state;
    fct_scene *scene = begin();
    place_sheet(&plain, scene, place_material(scene, .5, 0, true), 2, v3_make(0, 0, 0), v3_make(1, 0, 0),
                v3_make(0, 1, 0));
    place_sheet(&plain, scene, place_material(scene, .5, 0, false), 2, v3_make(0, 0, 1), v3_make(1, 0, 0),
                v3_make(0, 1, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_solution s = {.env = &plain, .scene = scene};
    assert_int_equal(fct_elements_create(&plain, scene, 1, &s.elements), FCT_OK);
    fct_element *front = &s.elements.items[s.elements.roots[0]];
    assert_true(front[1].back && !front[0].back);
    bool back[2];
    assert_int_equal(fct_output_sides(&s, 0, back), 1); /* both are dark */
    assert_false(back[0]);
    front[1].radiosity[2] = .1;
    assert_int_equal(fct_output_sides(&s, 0, back), 1);
    assert_true(back[0]);
    front[0].radiosity[0] = .2;
    assert_int_equal(fct_output_sides(&s, 0, back), 2);
    assert_true(!back[0] && back[1]);
    front[1].radiosity[2] = 1.9e-5;
    assert_int_equal(fct_output_sides(&s, 0, back), 1);
    front[1].radiosity[2] = .3;
    assert_int_equal(fct_output_sides(&s, 0, back), 2);
    assert_true(back[0] && !back[1]);
    s.elements.items[s.elements.roots[1]].radiosity[0] = 1;
    assert_int_equal(fct_output_sides(&s, 1, back), 1); /* one-sided */
    assert_false(back[0]);
    fct_elements_release(&s.elements);
    fct_scene_destroy(scene);
}

/* Sheets of side 10 at heights 0 (one-sided), .01 (two-sided) and 5 (one-sided, mirrored, facing up); the
 * scene's diagonal is about 15, so probes look .015 around them. */
static void probes_find_their_surface(void **state) {
    (void)state;
    fct_scene *scene = begin();
    uint32_t one = place_material(scene, .5, 0, false), two = place_material(scene, .5, 0, true);
    place_sheet(&plain, scene, one, 1, v3_make(0, 0, 0), v3_make(10, 0, 0), v3_make(0, 10, 0));
    place_sheet(&plain, scene, two, 1, v3_make(0, 0, .01), v3_make(10, 0, 0), v3_make(0, 10, 0));
    fct_mesh mesh = make_sheet(&plain, 1, v3_make(0, 0, 5), v3_make(0, 10, 0), v3_make(10, 0, 0));
    const float flipped[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 10};
    place_mesh(scene, &mesh, one, flipped); /* front down, then mirrored: front up */
    fct_mesh_release(&plain, &mesh);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    const struct {
        float point[3], normal[3];
        uint32_t instance;
        bool back;
        float height;
    } cases[] = {
        {{2, 3, .001F}, {0, 0, 1}, 0, false, 0},
        {{2, 3, .009F}, {0, 0, 1}, 1, false, .01F},
        {{2, 3, .009F}, {0, 0, -1}, 1, true, .01F},
        {{2, 3, .001F}, {0, 0, -1}, 1, true, .01F},
        {{2, 3, 5.01F}, {0, 0, 1}, 2, false, 5},
        {{2, 3, 4.99F}, {0, 0, -1}, FCT_NONE, false, 4.99F},
        {{2, 3, 2}, {0, 0, 1}, FCT_NONE, false, 2},
        {{10.005F, 3, 5}, {.6F, 0, .8F}, 2, false, 5},
        {{10.005F, 3, 5}, {.6F, 0, -.8F}, FCT_NONE, false, 5},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        fct_site s = fct_probe_site(scene, cases[i].point, cases[i].normal);
        if (s.instance != cases[i].instance || (s.instance != FCT_NONE && s.back != cases[i].back))
            fail_msg("case %zu: instance %u, back %d", i, s.instance, s.back);
        assert_near(s.point[2], cases[i].height, 1e-5);
        assert_near(s.offset, 1e-6 * sqrt(10 * 10 + 10 * 10 + 5 * 5), 1e-9);
    }
    fct_scene_destroy(scene);
}

/* Beside the rim of a sheet, at any transform, a probe belongs to the sheet if its normal is on the sheet's
 * front, or if both sides are lit. */
static void probes_beside_a_rim_know_the_side(void **state) {
    (void)state;
    uint64_t seed = 5;
    int fronts = 0, backs = 0, none = 0;
    for (int run = 0; run < 400; ++run) {
        double r[12], q[4], length = 0;
        for (int k = 0; k < 12; ++k) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            r[k] = 2 * (double)(seed >> 11) * 0x1p-53 - 1;
        }
        for (int k = 0; k < 4; ++k) length += r[k] * r[k];
        for (int k = 0; k < 4; ++k) q[k] = r[k] / sqrt(length);
        const double scale[3] = {(run & 1 ? -1 : 1) * (1 + .5 * r[4]), 1 + .5 * r[5], 1 + .5 * r[6]};
        double m[12];
        float transform[12], point[3], normal[3];
        fct_transform_compose(r + 7, q, scale, m);
        for (int k = 0; k < 12; ++k) transform[k] = (float)m[k];
        fct_scene *scene = begin();
        fct_mesh mesh = make_sheet(&plain, 2, v3_make(0, 0, 0), v3_make(1, 0, .2), v3_make(0, 1, .3));
        bool both = run & 2;
        place_mesh(scene, &mesh, place_material(scene, .5, 0, both), transform);
        fct_mesh_release(&plain, &mesh);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        /* a little outside, beside the middle of the side through the corner; the front is that of the face
         */
        v3 a = fct_transform_point(transform, v3_make(0, 0, 0)),
           b = fct_transform_point(transform, v3_make(1, 0, .2)),
           c = fct_transform_point(transform, v3_make(0, 1, .3));
        v3 u = v3_sub(b, a), v = v3_sub(c, a), front = v3_unit(v3_cross(u, v));
        if (run & 1) front = v3_scale(front, -1); /* a mirrored sheet keeps its front */
        v3 out = v3_unit(v3_cross(u, v3_cross(u, v)));
        v3_store(point, v3_mad(v3_mad(a, .4, u), 5e-4, out));
        v3 n = v3_unit(v3_mad(v3_mad(front, .3, out), .2, v3_unit(u)));
        bool behind = run & 4;
        v3_store(normal, behind ? v3_scale(n, -1) : n);
        fct_site s = fct_probe_site(scene, point, normal);
        bool belongs = both || !behind;
        assert_int_equal(s.instance, belongs ? 0 : FCT_NONE);
        if (belongs) {
            assert_int_equal(s.back, behind);
            assert_true(v3_norm(v3_sub(v3_load(s.point), v3_load(point))) < 6e-4);
        }
        ++*(!belongs ? &none : behind ? &backs : &fronts);
        fct_scene_destroy(scene);
    }
    assert_true(fronts > 100 && backs > 50 && none > 50);
}

/* The point of a triangle nearest to x. */
static v3 find_nearest_point(const v3 p[3], v3 x) {
    v3 e = v3_sub(p[1], p[0]), f = v3_sub(p[2], p[0]), n = v3_cross(e, f), d = v3_sub(x, p[0]), best = p[0];
    double u = v3_dot(v3_cross(d, f), n) / v3_norm2(n), v = v3_dot(v3_cross(e, d), n) / v3_norm2(n);
    if (u >= 0 && v >= 0 && u + v <= 1) return v3_mad(v3_mad(p[0], u, e), v, f);
    for (int k = 0; k < 3; ++k) {
        v3 side = v3_sub(p[(k + 1) % 3], p[k]);
        double t = v3_dot(v3_sub(x, p[k]), side) / v3_norm2(side);
        v3 y = v3_mad(p[k], t < 0 ? 0 : t > 1 ? 1 : t, side);
        if (v3_norm(v3_sub(y, x)) < v3_norm(v3_sub(best, x))) best = y;
    }
    return best;
}

/* Sites among random patches against brute force: of the surfaces that the normal's line meets within reach
 * and that face it or have two sides, the one nearest to the point; else the nearest surface within reach, if
 * it faces it or has two sides. */
static void sites_equal_brute_force(void **state) {
    (void)state;
    int on_line = 0, beside = 0, backs = 0, none = 0;
    for (uint64_t seed = 0; seed < 6; ++seed) {
        fct_scene *scene = begin();
        uint32_t one = place_material(scene, .5, 0, false), two = place_material(scene, .5, 0, true);
        fct_mesh patch = make_sheet(&plain, 2, v3_make(0, 0, 0), v3_make(.9, .1, 0), v3_make(0, .8, .1));
        for (uint64_t k = 0; k < 25; ++k) {
            float m[12];
            for (uint64_t i = 0; i < 12; ++i)
                m[i] =
                    (float)(fct_uniform(fct_hash3(seed, k, i)) * (i % 4 == 3 ? 1 : 2) - (i % 4 == 3 ? 0 : 1));
            place_mesh(scene, &patch, k % 3 ? one : two, m);
        }
        const float away[12] = {.01F, 0, 0, 80, 0, .01F, 0, 60, 0, 0, .01F, 0}; /* makes the reach about .1 */
        place_mesh(scene, &patch, one, away);
        fct_mesh_release(&plain, &patch);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_scene_view view = fct_scene_get(scene);
        soup s = list_triangles(scene);
        double diagonal = v3_norm(v3_sub(v3_load(view.bounds.upper), v3_load(view.bounds.lower))),
               reach = 1e-3 * diagonal;
        for (uint64_t q = 0; q < 400; ++q) {
            float point[3], normal[3];
            for (uint64_t k = 0; k < 3; ++k)
                point[k] = (float)(1.4 * fct_uniform(fct_hash3(seed, q, 50 + k)) - .2);
            v3_store(normal, v3_unit(v3_make(fct_uniform(fct_hash3(seed, q, 53)) - .5,
                                             fct_uniform(fct_hash3(seed, q, 54)) - .5,
                                             fct_uniform(fct_hash3(seed, q, 55)) - .5)));
            v3 x = v3_load(point), n = v3_load(normal), at = x;
            double least = INFINITY, nearest = INFINITY;
            uint32_t found = FCT_NONE, closest = FCT_NONE;
            bool back = false;
            for (uint32_t t = 0; t < s.count; ++t) {
                const v3 *p = s.corners + 3 * (size_t)t;
                uint32_t i = t / 8;
                v3 m = v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
                double facing = v3_dot(m, n) * (view.instances[i].mirrored ? -1 : 1);
                double along = v3_dot(v3_sub(x, p[0]), m) / v3_dot(n, m);
                bool usable = facing > 0 || view.materials[view.instances[i].material].two_sided;
                v3 hit = v3_mad(x, -along, n), near = find_nearest_point(p, x);
                bool inside = v3_norm(v3_sub(find_nearest_point(p, hit), hit)) < 1e-9;
                if (inside && usable && fabs(along) < reach && fabs(along) < least)
                    least = fabs(along), found = i, at = hit, back = facing < 0;
                if (v3_norm(v3_sub(near, x)) < nearest) nearest = v3_norm(v3_sub(near, x)), closest = t;
            }
            on_line += found != FCT_NONE;
            if (found == FCT_NONE && nearest < reach) {
                const v3 *p = s.corners + 3 * (size_t)closest;
                uint32_t i = closest / 8;
                double facing = v3_dot(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), n) *
                                (view.instances[i].mirrored ? -1 : 1);
                if (facing > 0 || view.materials[view.instances[i].material].two_sided)
                    found = i, at = find_nearest_point(p, x), back = facing < 0, ++beside;
            }
            fct_site site = fct_probe_site(scene, point, normal);
            assert_near(site.offset, 1e-3 * reach, 1e-6 * reach);
            if (found == FCT_NONE) {
                assert_true(site.instance == FCT_NONE && site.face == FCT_NONE), ++none;
                continue;
            }
            assert_int_equal(site.instance, found), assert_int_equal(site.back, back);
            assert_true(v3_norm(v3_sub(v3_load(site.point), at)) < 1e-4);
            backs += back;
            /* place and barycentrics name the same point; the face is the place's */
            const fct_instance *in = &view.instances[found];
            fct_tree_view t = fct_tree_get(view.models[in->model].tree);
            v3 p[3];
            for (size_t k = 0; k < 3; ++k)
                p[k] = fct_transform_point(
                    in->to_world, v3_load(t.positions + 3 * (size_t)t.triangles[3 * (size_t)site.place + k]));
            v3 y = v3_mad(v3_mad(p[0], site.u, v3_sub(p[1], p[0])), site.v, v3_sub(p[2], p[0]));
            assert_true(v3_norm(v3_sub(y, at)) < 1e-4);
            assert_int_equal(site.face, t.face_ids[site.place]);
        }
        free(s.corners);
        fct_scene_destroy(scene);
    }
    printf("    %d on the line, %d beside it, %d on backs, %d in free space\n", on_line, beside, backs, none);
    assert_true(on_line > 200 && beside > 100 && backs > 50 && none > 300);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(probes_beside_a_rim_know_the_side),
        cmocka_unit_test(noise_on_flat_surfaces_is_smoothed),
        cmocka_unit_test(triangles_without_common_vertices_are_smoothed_alike),
        cmocka_unit_test(light_does_not_pass_walls_above_seams),
        cmocka_unit_test(noise_of_shadow_rays_is_smoothed),
        cmocka_unit_test(hubs_are_smoothed_in_linear_time),
        cmocka_unit_test(borders_are_relative_and_absolute),
        cmocka_unit_test(smaller_errors_get_more_rays),
        cmocka_unit_test(radiosity_is_emission_plus_reflection),
        cmocka_unit_test(lit_sides_are_shown),
        cmocka_unit_test(probes_find_their_surface),
        cmocka_unit_test(sites_equal_brute_force),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
