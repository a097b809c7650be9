/* The estimate of the error of shown light, against light that is wrong by a known amount. */
#include "../place.h"
#include "../refining.h"
#include "radiosity/output/check.h"
#include "radiosity/surface/tessellate.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

enum { GRID = 60 };

static void solve_scene(fct_solution *s, const fct_scene *scene) {
    const fct_transport_def t = {.seed = 1, .epsilon = 1, .tolerance = 1e-4, .fineness = 1};
    s->scene = scene, s->longest_reach = 9 * fct_surface_default_edge(scene);
    assert_int_equal(fct_lamps_create(&plain, scene, &s->lamps), FCT_OK);
    assert_int_equal(fct_elements_create(&plain, scene, 1, &s->elements), FCT_OK);
    assert_int_equal(fct_links_create(&plain, &s->links), FCT_OK);
    assert_int_equal(refine_links(&s->elements, &s->links, .5), FCT_OK);
    assert_int_equal(fct_transport_solve(&s->elements, s->lamps, &t, &s->transport), FCT_OK);
    assert_int_equal(fct_guides_create(&s->elements, &s->links, s->transport.stored, &s->guides), FCT_OK);
}

/* A two-sided square of side 1, of reflectance .2, .5, .8, within a sphere that shines evenly: the irradiance
 * is 1 on both sides. */
static void make_furnace(fct_solution *s, fct_scene **scene) {
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, scene), FCT_OK);
    fct_mesh ball = make_sphere(&plain, 12);
    for (size_t t = 0; t < ball.face_count; ++t) {
        uint32_t *c = ball.triangles + 3 * t, swap = c[1];
        c[1] = c[2], c[2] = swap;
    }
    const float wide[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const fct_material paint = {.reflectance = {.2F, .5F, .8F}, .two_sided = true};
    uint32_t id;
    assert_int_equal(fct_scene_add_material(*scene, &paint, &id), FCT_OK);
    place_sheet(&plain, *scene, id, GRID, v3_make(-.5, -.5, .1), v3_make(1, 0, 0), v3_make(0, 1, 0));
    place_mesh(*scene, &ball, place_material(*scene, 0, 1, false), wide);
    fct_mesh_release(&plain, &ball);
    assert_int_equal(fct_scene_commit(*scene), FCT_OK);
    *s = (fct_solution){.env = &plain, .def = fct_bake_def_default(), .fineness = 1};
    solve_scene(s, *scene);
}

static void end_furnace(fct_solution *s, fct_scene *scene) {
    fct_guides_release(&plain, &s->guides);
    fct_transport_release(&plain, &s->transport);
    fct_links_release(&plain, &s->links);
    fct_elements_release(&s->elements);
    fct_lamps_destroy(s->lamps);
    fct_scene_destroy(scene);
}

/* Irradiance 1 + a + b x, with x from 0 to 1 over the square. The mean reflectance is .5 and the mean square
 * of the reflectances .31, so the mean light is .5 and the RMS error sqrt(.31 mean (a + b x)^2) / .5. */
static void errors_are_those_of_the_light(void **state) {
    (void)state;
    static const double cases[4][2] = {{0, 0}, {.1, 0}, {0, .3}, {-.2, .1}};
    fct_solution s;
    fct_scene *scene;
    fct_surface f;
    make_furnace(&s, &scene);
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, 0), 10, &f), FCT_OK);
    const size_t n = f.mesh.vertex_count;
    float *light = malloc(3 * n * sizeof *light);
    uint8_t *covered = calloc(n, 1);
    for (int k = 0; k < 16; ++k) {
        const double a = cases[k % 4][0], b = cases[k % 4][1], from = k < 8 ? 0 : .5;
        fct_check sums = {0};
        uint64_t rays = 0;
        for (size_t v = 0; v < n; ++v) {
            const double x = (double)f.mesh.positions[3 * v] + .5;
            covered[v] = x < from + 1e-6 && k >= 8;
            for (size_t c = 0; c < 3; ++c) light[3 * v + c] = (float)(1 + a + b * x);
        }
        enum { SEEDS = 10 };
        for (s.def.seed = 0; s.def.seed < SEEDS; ++s.def.seed)
            assert_int_equal(fct_check_surface(&s, &f, 0, k & 4, light, covered, &sums, &rays), FCT_OK);
        const double width = 1 - from, mean = a + b * (1 + from) / 2;
        const double square = a * a + a * b * (1 + from) + b * b * (1 + from + from * from) / 3;
        assert_near(sums.area, SEEDS * width, 1e-3);
        assert_near(sums.light, SEEDS * .5 * width, 1e-3);
        assert_near(sums.bias, SEEDS * .5 * mean * width, SEEDS * .01 * fabs(mean) + 1e-3);
        assert_near(fct_check_error(&sums), sqrt(.31 * square) / .5, .02 * sqrt(square) + 1e-4);
        assert_int_equal(rays % 129, 0); /* both gathers, and a test for a cover; no lamp is sampled */
        assert_in_range(rays / 129, 40 * SEEDS, 512 * SEEDS);
    }
    memset(covered, 1, n);
    fct_check none = {0};
    uint64_t rays = 0;
    assert_int_equal(fct_check_surface(&s, &f, 0, false, light, covered, &none, &rays), FCT_OK);
    assert_true(none.area <= 0 && fct_check_error(&none) <= 0 && rays == 0);
    free(light), free(covered);
    fct_surface_release(&plain, &f);
    end_furnace(&s, scene);
}

/* One bright vertex: the light 1 + 4 w over its faces, where w falls from 1 to 0. A square of 60 x 60 squares
 * has some thousand faces, of which 6 are at an inner vertex; points by area alone seldom meet them. The
 * integral of w over a face is a third of its area, that of w^2 a sixth. */
static void few_bright_faces_are_found(void **state) {
    (void)state;
    fct_solution s;
    fct_scene *scene;
    fct_surface f;
    make_furnace(&s, &scene);
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, 0), 10, &f), FCT_OK);
    const size_t n = f.mesh.vertex_count;
    float *light = malloc(3 * n * sizeof *light);
    uint8_t *covered = calloc(n, 1);
    size_t bright = 0, around = 0;
    double least = 1;
    for (size_t v = 0; v < n; ++v) {
        const double x = (double)f.mesh.positions[3 * v], y = (double)f.mesh.positions[3 * v + 1];
        if (x * x + y * y < least) least = x * x + y * y, bright = v;
    }
    for (size_t c = 0; c < 3 * (size_t)f.mesh.face_count; ++c) around += f.mesh.triangles[c] == bright;
    const double area = (double)around / (double)f.mesh.face_count;
    for (size_t i = 0; i < 3 * n; ++i) light[i] = i / 3 == bright ? 5 : 1;
    for (s.def.seed = 0; s.def.seed < 5; ++s.def.seed) {
        fct_check sums = {0};
        uint64_t rays = 0;
        assert_int_equal(fct_check_surface(&s, &f, 0, false, light, covered, &sums, &rays), FCT_OK);
        assert_near(sums.area, 1, 1e-3), assert_near(sums.light, .5, 1e-3);
        assert_near(sums.bias / (.5 * 4 * area / 3), 1, .2);
        assert_near(fct_check_error(&sums) / (sqrt(.31 * 16 * area / 6) / .5), 1, .1);
        assert_int_equal(sums.points, n / 32 + 1);
    }
    free(light), free(covered);
    fct_surface_release(&plain, &f);
    end_furnace(&s, scene);
}

/* A small mesh has 64 points. A flat black body covers a quarter of it, where no viewer sees that the light
 * is wrong. */
static void covered_points_do_not_count(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    fct_solution s = {.env = &plain, .def = fct_bake_def_default(), .fineness = 1};
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    const uint32_t grey = place_material(scene, .5, 0, false), black = place_material(scene, 0, 0, false);
    const float wide[12] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0};
    fct_mesh ball = make_sphere(&plain, 12);
    for (size_t t = 0; t < ball.face_count; ++t) {
        uint32_t *c = ball.triangles + 3 * t, swap = c[1];
        c[1] = c[2], c[2] = swap;
    }
    place_sheet(&plain, scene, grey, 4, v3_make(-.5, -.5, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
    place_sheet(&plain, scene, black, 1, v3_make(-.5, -.5, .001), v3_make(.5, 0, 0), v3_make(0, .5, 0));
    place_mesh(scene, &ball, place_material(scene, 0, 1, false), wide);
    fct_mesh_release(&plain, &ball);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    solve_scene(&s, scene);
    fct_surface f;
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, 0), 10, &f), FCT_OK);
    const size_t n = f.mesh.vertex_count;
    float *light = malloc(3 * n * sizeof *light);
    uint8_t *covered = calloc(n, 1);
    for (size_t i = 0; i < 3 * n; ++i) light[i] = 1;
    fct_check sums = {0};
    uint64_t rays = 0;
    assert_int_equal(fct_check_surface(&s, &f, 0, false, light, covered, &sums, &rays), FCT_OK);
    assert_in_range(sums.points, 46, 50);
    assert_near(sums.area, .75, .03), assert_near(sums.light, .5 * .75, .02);
    assert_true(fct_check_error(&sums) < .01);
    assert_in_range(rays, 129 * sums.points, 130 * sums.points + 8 * 18);
    free(light), free(covered);
    fct_surface_release(&plain, &f);
    end_furnace(&s, scene);
}

/* Noise of the gathers is no error: a small square in the middle of a sphere, of which one half shines, has
 * the irradiance 1/2 wherever its plane divides both halves, but each gather of few rays finds a little more
 * or less. The light 1/2 is right up to .1 %. */
static void noise_of_gathers_cancels(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    fct_solution s = {.env = &plain, .def = fct_bake_def_default(), .fineness = 1};
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    fct_mesh ball = make_sphere(&plain, 12);
    const uint32_t grey = place_material(scene, .5, 0, false), lit = place_material(scene, 0, 1, false),
                   dark = place_material(scene, 0, 0, false);
    uint32_t *paints = malloc(ball.face_count * sizeof *paints);
    for (size_t t = 0; t < ball.face_count; ++t) {
        uint32_t *c = ball.triangles + 3 * t, swap = c[1];
        double z = 0;
        c[1] = c[2], c[2] = swap;
        for (int k = 0; k < 3; ++k) z += (double)ball.positions[3 * (size_t)c[k] + 2];
        paints[t] = z > 0 ? lit : dark;
    }
    place_sheet(&plain, scene, grey, GRID, v3_make(0, -.001, -.001), v3_make(0, .002, 0),
                v3_make(0, 0, .002));
    assert_int_equal(fct_scene_add_object(scene, "ball", &ball, NULL, NULL, 0, paints), FCT_OK);
    free(paints), fct_mesh_release(&plain, &ball);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    solve_scene(&s, scene);
    fct_surface f;
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, 0), 10, &f), FCT_OK);
    const size_t n = f.mesh.vertex_count;
    float *light = malloc(3 * n * sizeof *light);
    uint8_t *covered = calloc(n, 1);
    for (size_t i = 0; i < 3 * n; ++i) light[i] = .5F;
    fct_check sums = {0};
    uint64_t rays = 0;
    double most = 0;
    for (s.def.seed = 0; s.def.seed < 24; ++s.def.seed) {
        fct_check one = {0};
        assert_int_equal(fct_check_surface(&s, &f, 0, false, light, covered, &one, &rays), FCT_OK);
        most = fmax(most, fabs(one.square));
        sums.area += one.area, sums.light += one.light, sums.square += one.square, sums.bias += one.bias;
    }
    printf("    error %.5f, bias %.5f, largest part %.3g\n", fct_check_error(&sums), sums.bias / sums.light,
           most);
    assert_near(sums.light / sums.area, .25, .001);
    assert_near(sums.bias / sums.light, 0, .004);
    assert_near(sums.square * sums.area / (sums.light * sums.light), 0, 2e-4);
    free(light), free(covered);
    fct_surface_release(&plain, &f);
    end_furnace(&s, scene);
}

/* The estimate of a bake is that of its objects, weighted by area, and the floor under a lamp beside a wall
 * has no bias. */
static void bakes_estimate_their_error(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_bake_def def = fct_bake_def_default();
    double sum = 0, square = 0;
    for (uint64_t seed = 1; seed <= 8; ++seed) {
        fct_scene *scene;
        fct_bake *bake;
        fct_mesh mesh;
        def.seed = seed, def.max_edge = .12, def.error = 1e-5;
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        const uint32_t grey = place_material(scene, .5, 0, false);
        place_sheet(&plain, scene, grey, 1, v3_make(0, 0, 0), v3_make(2, 0, 0), v3_make(0, 2, 0));
        place_sheet(&plain, scene, place_material(scene, .5, 0, true), 1, v3_make(1.2, 0, 0),
                    v3_make(0, 2, 0), v3_make(0, 0, .7));
        place_sheet(&plain, scene, place_material(scene, 0, 4, false), 1, v3_make(0, 0, 2), v3_make(0, .5, 0),
                    v3_make(.5, 0, 0));
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
        const double before = fct_bake_get_stats(bake).error_estimate;
        assert_near(fct_bake_get_error(bake, 0).area, 0, 0);
        assert_int_equal(fct_bake_mesh(bake, &mesh, NULL), FCT_OK);
        const fct_bake_stats stats = fct_bake_get_stats(bake);
        const fct_bake_error floor = fct_bake_get_error(bake, 0), wall = fct_bake_get_error(bake, 1);
        assert_near(floor.area, 4, 1e-4), assert_near(wall.area, 2.8, 1e-4);
        /* A single point at the foot of the wall may have an error of half the light. */
        assert_true(stats.check_rays > 0 && stats.error_estimate > 0 && stats.error_estimate < .08);
        assert_true(fabs(stats.error_estimate - before) > 1e-6);
        const double light = floor.light * floor.area + wall.light * wall.area;
        const double part =
            pow(floor.error * floor.light, 2) * floor.area + pow(wall.error * wall.light, 2) * wall.area;
        assert_near(stats.error_estimate, sqrt(part * (floor.area + wall.area)) / light, 1e-3);
        sum += floor.bias, square += floor.error * floor.error;
        fct_mesh_release(&plain, &mesh);
        fct_bake_destroy(bake);
        fct_scene_destroy(scene);
    }
    printf("    floor: error %.4f, bias %.4f\n", sqrt(square / 8), sum / 8);
    assert_near(sum / 8, 0, .01);
    assert_true(sqrt(square / 8) < .03);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(errors_are_those_of_the_light), cmocka_unit_test(few_bright_faces_are_found),
        cmocka_unit_test(covered_points_do_not_count), cmocka_unit_test(noise_of_gathers_cancels),
        cmocka_unit_test(bakes_estimate_their_error)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
