/* tests/radiosity/test_textures.c: bakes of painted surfaces: closed forms, and the reference. */
#include "radiosity/place.h"

#include "facetree/radiosity.h"
#include "mesh/mesh.h"
#include "radiosity/surface/paint.h"
#include "radiosity/surface/tessellate.h"
#include "scene/texture/reflectance.h"

enum { CELLS = 8, CELL = 4 }; /* checks along an image, texels along a check */
#define SIDE (CELLS * CELL)

static const fct_env plain = {.size = sizeof(fct_env)};

static void assert_near(double found, double expected, double tolerance) {
    if (!(fabs(found - expected) <= tolerance)) fail_msg("%g, expected %g", found, expected);
}

static fct_scene *begin(void) {
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    return scene;
}

/* Checks of sRGB 255 and 60; the material's factor makes .8 and .036 of them. */
static uint32_t paint_checks(fct_scene *scene, double emission, bool two_sided, float factor, float repeat) {
    uint8_t pixels[3 * SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; ++i)
        memset(pixels + 3 * i, (i % SIDE / CELL + i / SIDE / CELL) % 2 ? 255 : 60, 3);
    const fct_texture texture = {"checks", SIDE, SIDE, pixels};
    const uint32_t id = place_material(scene, .1, emission, two_sided);
    fct_paint paint = fct_paint_default();
    assert_int_equal(fct_scene_add_texture(scene, &texture, &paint.texture), FCT_OK);
    for (int c = 0; c < 3; ++c) paint.factor[c] = factor;
    paint.transform[0] = paint.transform[4] = repeat;
    assert_int_equal(fct_scene_paint_material(scene, id, &paint), FCT_OK);
    return id;
}

static double dark_of(double factor) {
    return factor * pow((60 / 255. + .055) / 1.055, 2.4);
}

/* Gives a mesh texture coordinates: two of its positions. */
static void add_texcoords(fct_mesh *mesh, int a, int b) {
    mesh->texcoords = fct_allocate(&plain, mesh->face_count, 6 * sizeof *mesh->texcoords);
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c) {
        const float *p = mesh->positions + 3 * (size_t)mesh->triangles[c];
        mesh->texcoords[2 * c] = p[a], mesh->texcoords[2 * c + 1] = p[b];
    }
}

static void place_painted(fct_scene *scene, uint32_t id, uint32_t n, v3 corner, v3 a, v3 b) {
    fct_mesh grid = make_grid(&plain, n);
    const float m[12] = {(float)a.x, (float)b.x, 0, (float)corner.x,
                         (float)a.y, (float)b.y, 0, (float)corner.y,
                         (float)a.z, (float)b.z, 0, (float)corner.z};
    float transform[12];
    const v3 up = v3_cross(a, b);
    memcpy(transform, m, sizeof m);
    transform[2] = (float)up.x, transform[6] = (float)up.y, transform[10] = (float)up.z;
    add_texcoords(&grid, 0, 1);
    assert_int_equal(fct_scene_add_object(scene, "painted", &grid, NULL, transform, id, NULL), FCT_OK);
    fct_mesh_release(&plain, &grid);
}

static fct_bake *start(fct_scene *scene, const fct_bake_def *def) {
    fct_bake *b;
    assert_int_equal(fct_bake_create(&plain, scene, def, &b), FCT_OK);
    return b;
}

static double mean_of(const fct_mesh *m, double *area) {
    double sum = 0;
    *area = 0;
    for (size_t f = 0; f < m->face_count; ++f) {
        v3 p[3];
        for (size_t k = 0; k < 3; ++k) p[k] = v3_load(m->positions + 3 * (size_t)m->triangles[3 * f + k]);
        const double a = .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
        for (size_t k = 0; k < 3; ++k)
            sum += a / 3 * (double)m->colors[3 * (size_t)m->triangles[3 * f + k] + 1];
        *area += a;
    }
    return sum / *area;
}

/* In a sphere every point sees all others alike, so the irradiance is even whatever the paint:
 * E = e / (1 - mean rho). */
static void a_painted_sphere_is_evenly_lit(void **state) {
    (void)state;
    fct_scene *scene = begin();
    fct_mesh ball = make_sphere(&plain, 24);
    fct_mesh_turn_over(&ball);
    add_texcoords(&ball, 0, 1);
    const uint32_t id = paint_checks(scene, 1, false, .8F, 1.25F);
    assert_int_equal(fct_scene_add_object(scene, "ball", &ball, NULL, NULL, id, NULL), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    float *means;
    assert_int_equal(fct_reflectance_of_nodes(&plain, scene, 0, &means), FCT_OK);
    const double rho = (double)means[0], even = 1 / (1 - rho);
    assert_near(rho, (.8 + dark_of(.8)) / 2, .02);
    fct_release(&plain, means);
    fct_bake_def def = fct_bake_def_default();
    def.max_edge = .1;
    for (int method = 0; method < 2; ++method) {
        def.method = method ? FCT_BAKE_REFERENCE : FCT_BAKE_FACE;
        def.samples = method ? 120 : 0;
        fct_bake *b = start(scene, &def);
        fct_probe probes[60];
        float points[180], normals[180];
        for (size_t k = 0; k < 60; ++k) {
            const v3 d =
                v3_unit(v3_make(fct_uniform(fct_hash(3 * k)) - .5, fct_uniform(fct_hash(3 * k + 1)) - .5,
                                fct_uniform(fct_hash(3 * k + 2)) - .5));
            v3_store(points + 3 * k, v3_scale(d, .999)), v3_store(normals + 3 * k, v3_scale(d, -1));
        }
        assert_int_equal(fct_bake_probe(b, 60, points, normals, probes), FCT_OK);
        double mean = 0;
        for (size_t k = 0; k < 60; ++k) {
            mean += (double)probes[k].irradiance[1] / 60;
            assert_near(probes[k].irradiance[1] / even, 1, method ? .3 : .06);
            /* Probes are not filtered: light, dark, or between two checks. */
            const double found = ((double)probes[k].radiosity[1] - 1) / (double)probes[k].irradiance[1];
            assert_true(found > dark_of(.8) * .99 && found < .801);
        }
        assert_near(mean / even, 1, .02);
        fct_mesh mesh;
        double area;
        assert_int_equal(fct_bake_instance(b, 0, &mesh), FCT_OK);
        assert_near(mean_of(&mesh, &area) / even, 1, .02);
        const fct_bake_stats s = fct_bake_get_stats(b);
        assert_near((s.power_absorbed + s.power_escaped) / s.power_emitted, 1, .01);
        fct_mesh_release(&plain, &mesh);
        fct_bake_destroy(b);
    }
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &ball);
}

/* A floor under a lamp, and a black square on a third side. Fine checks send it what an even floor of their
 * mean reflectance sends. */
static double light_beside_floor(bool painted, double rho, uint32_t *vertices) {
    fct_scene *scene = begin();
    const uint32_t lamp = place_material(scene, 0, 4, false), wall = place_material(scene, .5, 0, false);
    const uint32_t floor =
        painted ? paint_checks(scene, 0, false, .8F, 3) : place_material(scene, rho, 0, false);
    place_painted(scene, floor, 1, v3_make(0, 0, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
    place_sheet(&plain, scene, lamp, 1, v3_make(.3, .7, 1), v3_make(.4, 0, 0), v3_make(0, -.4, 0));
    place_sheet(&plain, scene, wall, 1, v3_make(0, 0, 1.1), v3_make(0, 0, -1), v3_make(0, 1, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_bake_def def = fct_bake_def_default();
    def.indirect_only = true;
    fct_bake *b = start(scene, &def);
    fct_mesh mesh;
    double area;
    assert_int_equal(fct_bake_instance(b, 2, &mesh), FCT_OK);
    const double mean = mean_of(&mesh, &area);
    fct_mesh_release(&plain, &mesh);
    assert_int_equal(fct_bake_instance(b, 0, &mesh), FCT_OK);
    *vertices = mesh.vertex_count;
    fct_mesh_release(&plain, &mesh);
    fct_bake_destroy(b);
    fct_scene_destroy(scene);
    return mean;
}

static void fine_checks_reflect_their_mean(void **state) {
    (void)state;
    uint32_t counts[2];
    const double rho = (.8 + dark_of(.8)) / 2, even = light_beside_floor(false, rho, &counts[0]),
                 checks = light_beside_floor(true, rho, &counts[1]);
    printf("    even %.5f, checks %.5f; %u and %u vertices\n", even, checks, counts[0], counts[1]);
    assert_near(checks / even, 1, .02);
    assert_true(counts[1] < 1.3 * counts[0]); /* no edge is split because of the checks */
}

/* RMS difference at points of the floor and two walls, over the mean of the reference. */
static void compare_points(fct_bake *b, fct_bake *truth) {
    enum { POINTS = 240 };
    float points[3 * POINTS], normals[3 * POINTS];
    fct_probe found[POINTS], expected[POINTS];
    double square = 0, mean = 0;
    for (size_t k = 0; k < POINTS; ++k) {
        const double s = 2 * fct_uniform(fct_hash(2 * k)), t = 2 * fct_uniform(fct_hash(2 * k + 1));
        v3_store(points + 3 * k, k % 3 == 0   ? v3_make(s, t, 0)
                                 : k % 3 == 1 ? v3_make(0, s, t)
                                              : v3_make(s, 0, t));
        v3_store(normals + 3 * k, v3_make(k % 3 == 1, k % 3 == 2, k % 3 == 0));
    }
    assert_int_equal(fct_bake_probe(b, POINTS, points, normals, found), FCT_OK);
    assert_int_equal(fct_bake_probe(truth, POINTS, points, normals, expected), FCT_OK);
    for (size_t k = 0; k < POINTS; ++k) {
        const double x = (double)expected[k].radiosity[1];
        square += pow((double)found[k].radiosity[1] - x, 2) / POINTS, mean += x / POINTS;
    }
    printf("    points: RMS %.2f %%\n", 100 * sqrt(square) / mean);
    assert_true(sqrt(square) < .015 * mean);
}

/* Checks as wide as a quarter of a wall, and fine ones. */
static void a_painted_room_agrees_with_the_reference(void **state) {
    (void)state;
    fct_scene *scene = begin();
    const uint32_t lamp = place_material(scene, 0, 8, false), white = place_material(scene, .6, 0, false);
    const uint32_t coarse = paint_checks(scene, 0, false, .8F, .5F),
                   fine = paint_checks(scene, 0, false, .6F, 4);
    place_painted(scene, coarse, 3, v3_make(0, 0, 0), v3_make(2, 0, 0), v3_make(0, 2, 0));      /* floor */
    place_painted(scene, fine, 1, v3_make(0, 0, 2), v3_make(0, 2, 0), v3_make(2, 0, 0));        /* ceiling */
    place_painted(scene, coarse, 1, v3_make(0, 0, 0), v3_make(0, 2, 0), v3_make(0, 0, 2));      /* x = 0 */
    place_painted(scene, fine, 2, v3_make(2, 0, 0), v3_make(0, 0, 2), v3_make(0, 2, 0));        /* x = 2 */
    place_sheet(&plain, scene, white, 1, v3_make(0, 0, 0), v3_make(0, 0, 2), v3_make(2, 0, 0)); /* y = 0 */
    place_sheet(&plain, scene, white, 1, v3_make(0, 2, 0), v3_make(2, 0, 0), v3_make(0, 0, 2)); /* y = 2 */
    place_sheet(&plain, scene, lamp, 1, v3_make(.7, .7, 1.9), v3_make(0, .6, 0), v3_make(.6, 0, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_bake_def def = fct_bake_def_default();
    def.max_edge = .08;
    fct_bake *b = start(scene, &def);
    def.method = FCT_BAKE_REFERENCE, def.samples = 48;
    fct_bake *truth = start(scene, &def);
    double power = 0, other = 0;
    for (uint32_t i = 0; i < 6; ++i) {
        fct_mesh found, expected;
        double area, sum;
        assert_int_equal(fct_bake_instance(b, i, &found), FCT_OK);
        assert_int_equal(fct_bake_instance(truth, i, &expected), FCT_OK);
        sum = mean_of(&expected, &area);
        power += area * sum;
        const double mine = mean_of(&found, &area);
        other += area * mine;
        printf("    instance %u: %.4f, reference %.4f, %.2f %%\n", i, mine, sum, 100 * (mine / sum - 1));
        assert_near(mine / sum, 1, .03);
        fct_mesh_release(&plain, &found), fct_mesh_release(&plain, &expected);
    }
    printf("    power %.4f, reference %.4f\n", other, power);
    assert_near(other / power, 1, .015);
    fct_bake_destroy(truth);
    def.samples = 8192;
    truth = start(scene, &def);
    compare_points(b, truth);
    fct_bake_destroy(b), fct_bake_destroy(truth);
    fct_scene_destroy(scene);
}

/* Where checks are finer than the surface, its vertices take their mean. */
static void vertices_are_filtered(void **state) {
    (void)state;
    fct_scene *scene = begin();
    const uint32_t lamp = place_material(scene, .3, 4, false), floor = paint_checks(scene, 0, false, .8F, 4);
    place_painted(scene, floor, 1, v3_make(0, 0, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
    place_sheet(&plain, scene, lamp, 1, v3_make(0, 0, 30), v3_make(1, 0, 0), v3_make(0, 1, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    const double mean = (.8 + dark_of(.8)) / 2, edges[2] = {.25, 1. / 200};
    for (int k = 0; k < 2; ++k) {
        fct_surface f;
        double least = 1, most = 0;
        assert_int_equal(fct_surface_build(&plain, SHADE(scene, 0), edges[k], &f), FCT_OK);
        for (size_t v = 0; v < f.mesh.vertex_count; ++v) {
            float rho[3];
            fct_surface_reflectance(scene, 0, &f, v, rho);
            least = fmin(least, (double)rho[1]), most = fmax(most, (double)rho[1]);
        }
        if (k == 0 && (least < .9 * mean || most > 1.1 * mean))
            fail_msg("%g to %g, mean %g", least, most, mean);
        if (k == 1) assert_true(least < 1.1 * dark_of(.8) && most > .79);
        fct_surface_release(&plain, &f);
    }
    float rho[3];
    fct_surface f;
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, 1), 1, &f), FCT_OK);
    fct_surface_reflectance(scene, 1, &f, 0, rho);
    assert_true(rho[0] == .3F);
    fct_surface_release(&plain, &f);
    fct_scene_destroy(scene);
}

static void threads_do_not_change_bytes(void **state) {
    (void)state;
    fct_mesh meshes[2];
    for (uint32_t k = 0; k < 2; ++k) {
        fct_env env = fct_env_default();
        env.thread_count = 1 + 2 * k;
        fct_scene *scene = begin();
        const uint32_t lamp = place_material(scene, 0, 4, false),
                       floor = paint_checks(scene, 0, true, .8F, 3);
        place_painted(scene, floor, 2, v3_make(0, 0, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
        place_sheet(&plain, scene, lamp, 1, v3_make(.3, .7, 1), v3_make(.4, 0, 0), v3_make(0, -.4, 0));
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        const fct_bake_def def = fct_bake_def_default();
        fct_bake *b;
        assert_int_equal(fct_bake_create(&env, scene, &def, &b), FCT_OK);
        assert_int_equal(fct_bake_mesh(b, &meshes[k], NULL), FCT_OK);
        fct_bake_destroy(b);
        fct_scene_destroy(scene);
    }
    assert_int_equal(meshes[0].vertex_count, meshes[1].vertex_count);
    assert_memory_equal(meshes[0].colors, meshes[1].colors, 12 * (size_t)meshes[0].vertex_count);
    fct_mesh_release(&plain, &meshes[0]), fct_mesh_release(&plain, &meshes[1]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_painted_sphere_is_evenly_lit),
        cmocka_unit_test(fine_checks_reflect_their_mean),
        cmocka_unit_test(vertices_are_filtered),
        cmocka_unit_test(a_painted_room_agrees_with_the_reference),
        cmocka_unit_test(threads_do_not_change_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
