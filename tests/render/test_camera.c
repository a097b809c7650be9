/* The eye of `facetree render`: as given, and so that a mesh fills the picture. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tools/render/camera.h"

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void assert_frame(const raster_camera *c) {
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) assert_true(fabs(dot(c->axes[i], c->axes[j]) - (i == j)) < 1e-12);
}

static void a_given_eye_is_kept(void **state) {
    (void)state;
    float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    uint32_t triangles[3] = {0, 1, 2};
    drawing d = {
        .mesh = {.vertex_count = 3, .face_count = 1, .positions = positions, .triangles = triangles}};
    drawing_frame frame = {.view = -1, .fov = 35, .up_vector = {0, 1, 0}};
    raster_camera camera = {.width = 400, .height = 300};
    bool outside;
    assert_true(drawing_parse_camera("3,4,12,0,0,0,60", &frame));
    drawing_aim(&d, &frame, &camera, &outside);
    assert_frame(&camera);
    assert_true(outside);
    assert_true(camera.eye[0] == 3 && camera.eye[1] == 4 && camera.eye[2] == 12);
    for (int k = 0; k < 3; ++k) assert_true(fabs(camera.axes[2][k] + (double[]){3, 4, 12}[k] / 13) < 1e-12);
    assert_true(camera.axes[1][1] > 0 && fabs(camera.axes[0][1]) < 1e-12); /* up is up, right is level */
    assert_true(fabs(camera.focal - 150 / tan(3.14159265358979323846 / 6)) < 1e-9);
    /* right x up is backward */
    double right[3] = {camera.axes[0][0], camera.axes[0][1], camera.axes[0][2]};
    assert_true(right[0] > 0);
    assert_true(drawing_parse_camera("0.1,0.1,0,1,1,1", &frame));
    drawing_aim(&d, &frame, &camera, &outside);
    assert_false(outside);
}

static void a_square_fills_the_picture(void **state) {
    (void)state;
    float positions[12] = {2, 3, 5, 4, 3, 5, 4, 5, 5, 2, 5, 5};
    uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    drawing d = {
        .mesh = {.vertex_count = 4, .face_count = 2, .positions = positions, .triangles = triangles}};
    for (int wide = 0; wide < 2; ++wide) {
        drawing_frame frame = {.view = 1, .up = 1, .fov = 40, .up_vector = {0, 1, 0}};
        raster_camera camera = {.width = wide ? 300 : 100, .height = 200};
        bool outside;
        drawing_aim(&d, &frame, &camera, &outside);
        /* Half of the side over the slope of the narrow half of the picture, and 6 % of room. */
        double slope = tan(20 * 3.14159265358979323846 / 180) * (wide ? 1 : .5);
        assert_true(fabs(camera.eye[0] - 3) < 1e-6 && fabs(camera.eye[1] - 4) < 1e-6);
        assert_true(fabs(camera.eye[2] - (5 + 1.06 / slope)) < 1e-5);
    }
}

static void every_view_holds_the_whole_mesh(void **state) {
    (void)state;
    enum { COUNT = 60 };
    float positions[3 * COUNT];
    uint32_t triangles[COUNT];
    uint64_t seed = 1;
    for (int i = 0; i < 3 * COUNT; ++i) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        positions[i] = (float)(seed >> 40) / (float)(1 << 22) * (i % 3 == 0 ? 2.F : i % 3 == 1 ? .5F : 1.F);
    }
    for (uint32_t i = 0; i < COUNT; ++i) triangles[i] = i;
    drawing d = {
        .mesh = {
            .vertex_count = COUNT, .face_count = COUNT / 3, .positions = positions, .triangles = triangles}};
    for (int view = 0; drawing_views[view]; ++view)
        for (int up = 1; up < 3; ++up) {
            drawing_frame frame = {.view = view, .up = up, .fov = 35};
            frame.up_vector[up] = 1;
            raster_camera camera = {.width = 320, .height = 200};
            bool outside;
            drawing_aim(&d, &frame, &camera, &outside);
            assert_frame(&camera);
            double most = 0;
            for (int i = 0; i < COUNT; ++i) {
                double p[3];
                for (int k = 0; k < 3; ++k) p[k] = positions[3 * i + k] - camera.eye[k];
                double z = dot(camera.axes[2], p);
                assert_true(z > 0);
                most = fmax(most, fabs(camera.focal * dot(camera.axes[0], p) / z / 160));
                most = fmax(most, fabs(camera.focal * dot(camera.axes[1], p) / z / 100));
            }
            assert_true(most < 1 && most > .85);
        }
}

static void bad_cameras_are_refused(void **state) {
    (void)state;
    drawing_frame frame = {.fov = 35};
    const char *const bad[] = {"",
                               "1,2,3",
                               "1,2,3,4,5",
                               "1,2,3,4,5,x",
                               "1,2,3,1,2,3",
                               "1,2,3,4,5,6,0",
                               "1,2,3,4,5,6,171",
                               "1,2,3,4,5,6,7,8",
                               "1,2,3,4,5,inf"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) assert_false(drawing_parse_camera(bad[i], &frame));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_given_eye_is_kept),
        cmocka_unit_test(a_square_fills_the_picture),
        cmocka_unit_test(every_view_holds_the_whole_mesh),
        cmocka_unit_test(bad_cameras_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
