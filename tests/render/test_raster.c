/* Coverage, depth, interpolation, clipping and the PNG of `facetree render`, against geometry in double. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <png.h>

#include "tools/render/picture.h"
#include "tools/render/raster.h"

enum { WIDTH = 61, HEIGHT = 43, SAMPLES = 16, PIXELS = WIDTH * HEIGHT };

static tool test_tool;

/* At the origin, looking along -z, with y up. A square of 1 x 1 at distance 1 is `focal` pixels wide. */
static raster_camera make_camera(void) {
    return (raster_camera){.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}},
                           .focal = 40,
                           .unit = 1,
                           .width = WIDTH,
                           .height = HEIGHT,
                           .samples = SAMPLES};
}

static double uniform(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.;
}

/* A random triangle in front of the camera, perhaps partly outside the picture. */
static void random_triangle(uint64_t *state, float *positions) {
    for (int i = 0; i < 3; ++i) {
        double z = 1 + 3 * uniform(state);
        positions[3 * i] = (float)(z * 2 * (uniform(state) - .5));
        positions[3 * i + 1] = (float)(z * 1.6 * (uniform(state) - .5));
        positions[3 * i + 2] = (float)-z;
    }
}

static void shade_white(void *user, const raster_point *point, float rgb[3]) {
    (void)user;
    (void)point;
    rgb[0] = rgb[1] = rgb[2] = 1;
}

static void shade_face(void *user, const raster_point *point, float rgb[3]) {
    (void)user;
    rgb[0] = (float)point->face + 1, rgb[1] = point->back, rgb[2] = 0;
}

static void draw(const raster_camera *camera, float *positions, uint32_t vertices, uint32_t *triangles,
                 uint32_t faces, raster_shade *shade, void *user, float *image) {
    fct_mesh mesh = {
        .vertex_count = vertices, .face_count = faces, .positions = positions, .triangles = triangles};
    assert_int_equal(raster_draw(&test_tool, camera, &mesh, shade, user, image), TOOL_DONE);
}

static void samples_on_a_shared_side_belong_to_one_face(void **state) {
    (void)state;
    raster_camera camera = make_camera();
    static float one[4 * PIXELS], other[4 * PIXELS], both[4 * PIXELS];
    uint64_t seed = 1;
    int mixed = 0;
    for (int round = 0; round < 300; ++round) {
        float p[12];
        random_triangle(&seed, p);
        random_triangle(&seed, p + 3);
        if (round % 3 == 0) /* corners that fall on samples */
            for (int i = 0; i < 4; ++i) {
                p[3 * i + 2] = -1;
                for (int k = 0; k < 2; ++k)
                    p[3 * i + k] = (float)(floor(p[3 * i + k] * 64) / 64 + 1. / 32) / 40 * 40;
            }
        /* Both triangles lie in one plane, so neither hides the other: a parallelogram. */
        for (int k = 0; k < 3; ++k) p[9 + k] = p[3 + k] + p[6 + k] - p[k];
        if (p[11] > -.5F) continue;
        uint32_t t[6] = {0, 1, 2, 3, 2, 1};
        draw(&camera, p, 4, t, 1, shade_white, NULL, one);
        draw(&camera, p, 4, t + 3, 1, shade_white, NULL, other);
        draw(&camera, p, 4, t, 2, shade_white, NULL, both);
        for (int i = 0; i < PIXELS; ++i) {
            assert_true(one[4 * i + 3] + other[4 * i + 3] == both[4 * i + 3]);
            mixed += one[4 * i + 3] > 0 && other[4 * i + 3] > 0;
        }
    }
    assert_true(mixed > 1000);
}

/* A face and its reverse in one place: the one that shows its front is seen, whichever comes first. */
static void a_front_covers_its_own_back(void **state) {
    (void)state;
    raster_camera camera = make_camera();
    static float image[4 * PIXELS];
    uint64_t seed = 5;
    int seen = 0;
    for (int round = 0; round < 100; ++round) {
        float p[18];
        random_triangle(&seed, p);
        memcpy(p + 9, p, 9 * sizeof *p);
        uint32_t t[6] = {0, 1, 2, 3, 5, 4};
        draw(&camera, p, 6, t, 2, shade_face, NULL, image);
        for (int i = 0; i < PIXELS; ++i) {
            if (image[4 * i + 3] < .99F) continue;
            assert_true(image[4 * i + 1] == 0);
            ++seen;
        }
    }
    assert_true(seen > 1000);
}

static double cross2(const double a[2], const double b[2], const double c[2]) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
}

static void coverage_is_the_area_of_the_triangle(void **state) {
    (void)state;
    raster_camera camera = make_camera();
    static float image[4 * PIXELS];
    uint64_t seed = 2;
    for (int round = 0; round < 200; ++round) {
        double q[3][2];
        float p[9];
        for (int i = 0; i < 3; ++i) {
            q[i][0] = WIDTH * (.05 + .9 * uniform(&seed)), q[i][1] = HEIGHT * (.05 + .9 * uniform(&seed));
            p[3 * i] = (float)((q[i][0] - .5 * WIDTH) / 40),
                  p[3 * i + 1] = (float)((.5 * HEIGHT - q[i][1]) / 40);
            p[3 * i + 2] = -1;
        }
        uint32_t t[3] = {0, 1, 2};
        draw(&camera, p, 3, t, 1, shade_white, NULL, image);
        double sum = 0, area = .5 * fabs(cross2(q[0], q[1], q[2])), rim = 0;
        for (int i = 0; i < 3; ++i) rim += hypot(q[i][0] - q[(i + 1) % 3][0], q[i][1] - q[(i + 1) % 3][1]);
        for (int i = 0; i < PIXELS; ++i) sum += (double)image[4 * i + 3];
        assert_true(fabs(sum - area) < .02 * rim + .1);
    }
}

/* The depth where the ray through the picture's (x, y) hits a triangle, or infinity; w: the weights of the
 * corners. */
static double hit(const float *p, double x, double y, double w[3]) {
    double d[3] = {(x - .5 * WIDTH) / 40, (.5 * HEIGHT - y) / 40, -1}, n[3][3], sum = 0, volume = 0;
    for (int i = 0; i < 3; ++i) {
        const float *a = p + 3 * ((i + 1) % 3), *b = p + 3 * ((i + 2) % 3);
        for (int k = 0; k < 3; ++k)
            n[i][k] = (double)a[(k + 1) % 3] * b[(k + 2) % 3] - (double)a[(k + 2) % 3] * b[(k + 1) % 3];
        w[i] = n[i][0] * d[0] + n[i][1] * d[1] + n[i][2] * d[2];
        sum += w[i];
    }
    for (int k = 0; k < 3; ++k) volume += p[k] * n[0][k];
    for (int i = 0; i < 3; ++i)
        if ((w[i] /= sum) < 0) return INFINITY;
    return volume / sum;
}

static void the_nearest_face_wins_as_a_ray_finds_it(void **state) {
    (void)state;
    enum { FACES = 40 };
    raster_camera camera = make_camera();
    camera.samples = 1;
    static float positions[9 * FACES], image[4 * PIXELS];
    uint32_t triangles[3 * FACES];
    uint64_t seed = 3;
    for (uint32_t i = 0; i < 3 * FACES; ++i) triangles[i] = i;
    for (int i = 0; i < FACES; ++i) random_triangle(&seed, positions + 9 * i);
    draw(&camera, positions, 3 * FACES, triangles, FACES, shade_face, NULL, image);
    int wrong = 0, seen = 0;
    for (int i = 0; i < PIXELS; ++i) {
        double best = INFINITY, w[3], x = i % WIDTH + .5, y = i / WIDTH + .5;
        int face = -1;
        for (int f = 0; f < FACES; ++f) {
            double z = hit(positions + 9 * f, x, y, w);
            if (z < best) best = z, face = f;
        }
        wrong += (int)lrintf(image[4 * i]) != face + 1;
        seen += face >= 0;
    }
    /* Corners are snapped to 1/4096 pixel: a sample within that distance of a side may belong to either face.
     */
    assert_true(wrong <= 2 && seen > PIXELS / 2);
}

static void check_point(void *user, const raster_point *point, float rgb[3]) {
    const float *p = user;
    double at[3] = {0, 0, 0}, w[3];
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) at[k] += point->weight[i] * p[3 * i + k];
    /* Project the point that the weights give: its weights and its distances to the sides must be the same.
     */
    double x = .5 * WIDTH - 40 * at[0] / at[2], y = .5 * HEIGHT + 40 * at[1] / at[2];
    hit(p, x, y, w);
    double screen[3][2], here[2] = {x, y};
    for (int i = 0; i < 3; ++i) {
        assert_true(fabs(w[i] - point->weight[i]) < 1e-6);
        screen[i][0] = .5 * WIDTH - 40. * p[3 * i] / p[3 * i + 2];
        screen[i][1] = .5 * HEIGHT + 40. * p[3 * i + 1] / p[3 * i + 2];
    }
    for (int i = 0; i < 3; ++i) {
        const double *a = screen[(i + 1) % 3], *b = screen[(i + 2) % 3];
        double away = fabs(cross2(a, b, here)) / hypot(a[0] - b[0], a[1] - b[1]);
        assert_true(fabs(away - point->side[i]) < 1e-4);
    }
    rgb[0] = rgb[1] = rgb[2] = 1;
}

static void weights_are_right_in_perspective(void **state) {
    (void)state;
    raster_camera camera = make_camera();
    static float image[4 * PIXELS];
    uint32_t t[3] = {0, 1, 2};
    uint64_t seed = 4;
    for (int round = 0; round < 20; ++round) {
        float p[9];
        random_triangle(&seed, p);
        draw(&camera, p, 3, t, 1, check_point, p, image);
    }
}

static void a_floor_through_the_eye_plane_is_clipped_at_the_horizon(void **state) {
    (void)state;
    raster_camera camera = make_camera();
    static float image[4 * PIXELS];
    float p[9] = {-1e5F, -1, 1e5F, 1e5F, -1, 1e5F, 0, -1, -1e6F};
    uint32_t t[3] = {0, 1, 2};
    draw(&camera, p, 3, t, 1, shade_white, NULL, image);
    for (int y = 0; y < HEIGHT; ++y)
        for (int x = 20; x < 40; ++x) {
            float cover = image[4 * (y * WIDTH + x) + 3];
            if (y != HEIGHT / 2) assert_true(cover == (y > HEIGHT / 2 ? 1 : 0));
        }
}

static void back_faces_are_told_and_culled(void **state) {
    (void)state;
    raster_camera camera = make_camera();
    static float image[4 * PIXELS];
    float p[9] = {-1, -1, -2, 1, -1, -2, 0, 1, -2};
    uint32_t front[3] = {0, 1, 2}, back[3] = {0, 2, 1};
    int middle = 4 * (HEIGHT / 2 * WIDTH + WIDTH / 2);
    draw(&camera, p, 3, front, 1, shade_face, NULL, image);
    assert_true(image[middle + 3] == 1 && image[middle + 1] == 0);
    draw(&camera, p, 3, back, 1, shade_face, NULL, image);
    assert_true(image[middle + 3] == 1 && image[middle + 1] == 1);
    camera.cull = true;
    draw(&camera, p, 3, back, 1, shade_face, NULL, image);
    assert_true(image[middle + 3] == 0);
    draw(&camera, p, 3, front, 1, shade_face, NULL, image);
    assert_true(image[middle + 3] == 1);
}

static void every_sample_count_covers_a_full_picture(void **state) {
    (void)state;
    static float image[4 * PIXELS];
    float p[9] = {-20, -20, -2, 20, -20, -2, 0, 40, -2};
    uint32_t t[3] = {0, 1, 2};
    for (uint32_t samples = 1; samples <= RASTER_MAX_SAMPLES; ++samples) {
        raster_camera camera = make_camera();
        camera.samples = samples;
        draw(&camera, p, 3, t, 1, shade_white, NULL, image);
        for (int i = 0; i < PIXELS; ++i) assert_float_equal(image[4 * i + 3], 1, 1e-6);
    }
}

static void scale_does_not_matter(void **state) {
    (void)state;
    static float image[4 * PIXELS], scaled[4 * PIXELS];
    uint32_t t[3] = {0, 1, 2};
    uint64_t seed = 5;
    for (int round = 0; round < 10; ++round) {
        raster_camera camera = make_camera();
        float p[9], q[9];
        random_triangle(&seed, p);
        draw(&camera, p, 3, t, 1, shade_white, NULL, image);
        for (int exponent = -100; exponent <= 100; exponent += 200) {
            for (int i = 0; i < 9; ++i) q[i] = ldexpf(p[i], exponent);
            camera.unit = ldexp(1, exponent);
            draw(&camera, q, 3, t, 1, shade_white, NULL, scaled);
            assert_memory_equal(image, scaled, sizeof image);
        }
    }
}

static void memory_that_runs_out_is_told(void **state) {
    (void)state;
    raster_camera camera = make_camera();
    static float image[4 * PIXELS];
    float p[9] = {-1, -1, -2, 1, -1, -2, 0, 1, 2};
    uint32_t t[3] = {0, 1, 2};
    fct_mesh mesh = {.vertex_count = 3, .face_count = 1, .positions = p, .triangles = t};
    int refused = 0, code = TOOL_MEMORY;
    for (size_t limit = 64; code != TOOL_DONE && limit < (size_t)1 << 24; limit += limit / 2) {
        tool limited = {.name = "test", .quiet = true};
        tool_env_open(&limited, NULL);
        limited.max_memory = limit;
        code = raster_draw(&limited, &camera, &mesh, shade_white, NULL, image);
        refused += code == TOOL_MEMORY;
        assert_true(code == TOOL_DONE || code == TOOL_MEMORY);
        assert_int_equal(limited.memory_now, 0);
    }
    assert_int_equal(code, TOOL_DONE);
    assert_true(refused > 5);
}

static void tone_curves_rise_and_stay_in_range(void **state) {
    (void)state;
    for (int tone = PICTURE_TONE_SOFT; tone <= PICTURE_TONE_CLAMP; ++tone) {
        float last = -1;
        for (float x = 0; x < 50; x += .01F) {
            float rgb[3] = {x, x, x};
            picture_apply_tone((picture_tone)tone, rgb);
            assert_true(rgb[0] >= last && rgb[0] <= 1 && rgb[0] == rgb[2]);
            assert_true(x == 0 || rgb[0] - last < .05F);
            last = rgb[0];
        }
        assert_true(last > .95F);
    }
    float dark[3] = {.1F, .3F, .5F}, red[3] = {4, .4F, .2F};
    picture_apply_tone(PICTURE_TONE_SOFT, dark);
    assert_float_equal(dark[1], .3F, 1e-7);
    picture_apply_tone(PICTURE_TONE_SOFT, red);
    assert_true(red[0] > red[1] && red[1] > red[2]);
}

static void a_picture_is_read_back_as_it_was(void **state) {
    (void)state;
    enum { W = 5, H = 3 };
    const char *path = "test_raster.png";
    float image[4 * W * H];
    for (int i = 0; i < W * H; ++i)
        for (int k = 0; k < 4; ++k) image[4 * i + k] = k == 3 ? 1 : (float)((i + k) % 4) / 3;
    image[3] = 0, image[0] = image[1] = image[2] = 0;
    for (int transparent = 0; transparent < 2; ++transparent) {
        picture_background background = {{0, 1, 0}, {0, 1, 0}, transparent};
        assert_int_equal(picture_save(&test_tool, path, W, H, image, &background), TOOL_DONE);
        png_image png = {.version = PNG_IMAGE_VERSION};
        assert_true(png_image_begin_read_from_file(&png, path));
        assert_int_equal(png.width, W);
        assert_int_equal(png.height, H);
        png.format = PNG_FORMAT_RGBA;
        unsigned char bytes[4 * W * H];
        assert_true(png_image_finish_read(&png, NULL, bytes, 0, NULL));
        assert_int_equal(bytes[1], transparent ? 0 : 255);
        assert_int_equal(bytes[3], transparent ? 0 : 255);
        /* sRGB of 0, 1/3, 2/3, 1 */
        static const unsigned char expected[4] = {0, 156, 213, 255};
        for (int i = 1; i < W * H; ++i)
            for (int k = 0; k < 3; ++k) assert_int_equal(bytes[4 * i + k], expected[(i + k) % 4]);
    }
    remove(path);
}

/* Behind nothing, row y of H shows the mix of top and bottom at (y + 1/2) / H. */
static void the_background_runs_from_top_to_bottom(void **state) {
    (void)state;
    enum { W = 2, H = 4 };
    const char *path = "test_background.png";
    float image[4 * W * H] = {0};
    const picture_background background = {{.1F, .9F, 0}, {.5F, .3F, 1}, false};
    assert_int_equal(picture_save(&test_tool, path, W, H, image, &background), TOOL_DONE);
    png_image png = {.version = PNG_IMAGE_VERSION};
    assert_true(png_image_begin_read_from_file(&png, path));
    png.format = PNG_FORMAT_RGB;
    unsigned char bytes[3 * W * H];
    assert_true(png_image_finish_read(&png, NULL, bytes, 0, NULL));
    for (int i = 0; i < W * H; ++i)
        for (int k = 0; k < 3; ++k) {
            double down = (i / W + .5) / H;
            double x = (1 - down) * (double)background.top[k] + down * (double)background.bottom[k];
            double srgb = x <= .0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - .055;
            assert_true(fabs(bytes[3 * i + k] - 255 * srgb) < 1);
        }
    remove(path);
}

static void backgrounds_are_parsed(void **state) {
    (void)state;
    picture_background b;
    assert_true(picture_parse_background("none", &b) && b.transparent);
    assert_true(picture_parse_background("#ff8000", &b) && !b.transparent);
    assert_float_equal(b.top[0], 1, 1e-6);
    assert_float_equal(b.top[1], .2158605, 1e-5);
    assert_float_equal(b.bottom[2], 0, 1e-6);
    const char *const bad[] = {"", "#", "#12345", "#1234567", "red", "#12g456", "123456"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) assert_false(picture_parse_background(bad[i], &b));
}

int main(void) {
    test_tool = (tool){.name = "test", .quiet = true};
    tool_env_open(&test_tool, NULL);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_on_a_shared_side_belong_to_one_face),
        cmocka_unit_test(a_front_covers_its_own_back),
        cmocka_unit_test(coverage_is_the_area_of_the_triangle),
        cmocka_unit_test(the_nearest_face_wins_as_a_ray_finds_it),
        cmocka_unit_test(weights_are_right_in_perspective),
        cmocka_unit_test(a_floor_through_the_eye_plane_is_clipped_at_the_horizon),
        cmocka_unit_test(back_faces_are_told_and_culled),
        cmocka_unit_test(every_sample_count_covers_a_full_picture),
        cmocka_unit_test(scale_does_not_matter),
        cmocka_unit_test(memory_that_runs_out_is_told),
        cmocka_unit_test(tone_curves_rise_and_stay_in_range),
        cmocka_unit_test(a_picture_is_read_back_as_it_was),
        cmocka_unit_test(the_background_runs_from_top_to_bottom),
        cmocka_unit_test(backgrounds_are_parsed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
