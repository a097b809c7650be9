/* Whole bakes against closed forms (docs/radiosity.md lists them); every bake must also balance its power. */
#include "support.h"

#include "base/math/vec.h"
#include "facetree/radiosity.h"

static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

typedef struct fixture {
    fct_env env;
    fct_scene *scene;
} fixture;

static void note(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR) fprintf(stderr, "%s\n", text);
}

static void begin(fixture *f) {
    *f = (fixture){.env = fct_env_default()};
    f->env.message = note;
    assert_int_equal(fct_scene_create(&f->env, FCT_BACKEND_OBB, &f->scene), FCT_OK);
}

static uint32_t material(fixture *f, float reflectance, float emission) {
    fct_material m = {.name = "grey"};
    snprintf(m.name, sizeof m.name, "m%g-%g", reflectance, emission);
    for (int c = 0; c < 3; ++c) m.reflectance[c] = reflectance, m.emission[c] = emission;
    uint32_t id;
    assert_int_equal(fct_scene_add_material(f->scene, &m, &id), FCT_OK);
    return id;
}

static void turn_inside_out(fct_mesh *mesh) {
    for (uint32_t i = 0; i < mesh->face_count; ++i) {
        uint32_t *t = mesh->triangles + 3 * (size_t)i, swap = t[1];
        t[1] = t[2], t[2] = swap;
    }
}

static void add(fixture *f, const char *name, fct_mesh *mesh, const float transform[12], uint32_t id,
                const uint32_t *face_materials) {
    assert_int_equal(fct_scene_add_object(f->scene, name, mesh, NULL, transform, id, face_materials), FCT_OK);
    fct_mesh_release(&f->env, mesh);
}

/* A square of side 1 around the origin, facing +z, under a transform. */
static void add_square(fixture *f, const char *name, uint32_t n, const float transform[12], uint32_t id) {
    fct_mesh square = make_grid(&f->env, n);
    for (uint32_t v = 0; v < square.vertex_count; ++v)
        for (int k = 0; k < 2; ++k) square.positions[3 * v + (uint32_t)k] -= .5F;
    add(f, name, &square, transform, id, NULL);
}

static fct_bake *bake(fixture *f, fct_final final) {
    assert_int_equal(fct_scene_commit(f->scene), FCT_OK);
    fct_bake_def def = fct_bake_def_default();
    def.final = final;
    fct_bake *b;
    assert_int_equal(fct_bake_create(&f->env, f->scene, &def, &b), FCT_OK);
    fct_bake_stats s = fct_bake_get_stats(b);
    assert_true(s.converged);
    printf(
        "    %llu elements, %llu links, %llu rays; opened in %.2f s, solved in %.2f s, error about %.2f %%\n",
        (unsigned long long)s.elements, (unsigned long long)s.links, (unsigned long long)s.rays,
        s.seconds_open, s.seconds_solve, 100 * s.error_estimate);
    double lost = fabs(s.power_emitted - s.power_absorbed - s.power_escaped) / s.power_emitted;
    if (lost > .01)
        fail_msg("power: emitted %g, absorbed %g, escaped %g", s.power_emitted, s.power_absorbed,
                 s.power_escaped);
    return b;
}

static void end(fixture *f, fct_bake *b) {
    fct_bake_destroy(b);
    fct_scene_destroy(f->scene);
}

/* Area-weighted mean of channel 1 over an instance's output; *rms (may be NULL): RMS difference to
 * `expected`. */
static double mean_radiosity(fixture *f, fct_bake *b, uint32_t instance, double expected, double *rms) {
    fct_mesh mesh;
    assert_int_equal(fct_bake_instance(b, instance, &mesh), FCT_OK);
    double area = 0, sum = 0, square = 0;
    for (uint32_t i = 0; i < mesh.face_count; ++i) {
        const uint32_t *t = mesh.triangles + 3 * (size_t)i;
        v3 p[3];
        for (int k = 0; k < 3; ++k) p[k] = v3_load(mesh.positions + 3 * (size_t)t[k]);
        double a = .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]))) / 3;
        for (int k = 0; k < 3; ++k) {
            double c = mesh.colors[3 * (size_t)t[k] + 1];
            area += a, sum += a * c, square += a * (c - expected) * (c - expected);
        }
    }
    fct_mesh_release(&f->env, &mesh);
    if (rms) *rms = sqrt(square / area);
    return sum / area;
}

static void expect_radiosity(fixture *f, fct_bake *b, uint32_t instance, double expected, double tolerance) {
    double rms, mean = mean_radiosity(f, b, instance, expected, &rms);
    printf("    instance %u: mean %.6g, expected %.6g, off by %.2f %%, rms %.2f %%\n", instance, mean,
           expected, 100 * (mean / expected - 1), 100 * rms / expected);
    if (fabs(mean - expected) > tolerance * expected) fail_msg("mean %g instead of %g", mean, expected);
    if (rms > 2 * tolerance * expected) fail_msg("rms %g about %g", rms, expected);
}

/* A lamp exactly in the plane of a ceiling, before or behind it in the list of instances: irradiance of the
 * point under the lamp's centre, and the whole power. For a rectangle of half sides a, b at height h the
 * configuration factor of a parallel point under its centre is
 * 4 / (2 pi) (A atan(B / C) / C + B atan(A / D) / D), A = a / h, B = b / h, C^2 = 1 + A^2, D^2 = 1 + B^2. */
static void a_lamp_in_the_ceiling_shines(void **state) {
    (void)state;
    const double a = .5 / 2, c = sqrt(1 + a * a);
    const double factor = 4 / (2 * 3.14159265358979323846) * 2 * a * atan(a / c) / c;
    for (int method = 0; method < 2; ++method)
        for (int order = 0; order < 4; ++order) {
            fixture f;
            begin(&f);
            uint32_t dark = material(&f, 0, 0), lamp = material(&f, 0, 10);
            const float floor[12] = {6, 0, 0, .1f, 0, 6, 0, .2f, 0, 0, 6, 0};
            const float ceiling[12] = {6, 0, 0, .1f, 0, -6, 0, .2f, 0, 0, -6, 2};
            /* The same plane by another transform, whose hits may round otherwise. */
            const float turned[12] = {.6f, -.8f, 0, 0, -.8f, -.6f, 0, 0, 0, 0, -1, 2};
            const float straight[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 2};
            add_square(&f, "floor", 3, floor, dark);
            if (order % 2) add_square(&f, "ceiling", 7, ceiling, dark);
            add_square(&f, "lamp", 2, order / 2 ? turned : straight, lamp);
            if (order % 2 == 0) add_square(&f, "ceiling", 7, ceiling, dark);
            assert_int_equal(fct_scene_commit(f.scene), FCT_OK);
            fct_bake_def def = fct_bake_def_default();
            def.method = method ? FCT_BAKE_REFERENCE : FCT_BAKE_FACE, def.samples = 20000, def.max_edge = 3;
            fct_bake *b;
            assert_int_equal(fct_bake_create(&f.env, f.scene, &def, &b), FCT_OK);
            const float point[3] = {0, 0, 0}, normal[3] = {0, 0, 1};
            fct_probe probe;
            assert_int_equal(fct_bake_probe(b, 1, point, normal, &probe), FCT_OK);
            double found = probe.irradiance[1] / 10;
            printf("    method %d, order %d: %.6g, expected %.6g\n", method, order, found, factor);
            assert_true(fabs(found / factor - 1) < .003);
            for (uint32_t i = 0; i < 3 && method; ++i) mean_radiosity(&f, b, i, 0, NULL);
            fct_bake_stats s = fct_bake_get_stats(b);
            assert_true(fabs(s.power_emitted - 30) < 1e-3);
            assert_true(fabs(s.power_absorbed + s.power_escaped - 30) <
                        (method ? 1.5 : .3)); /* coarse floor */
            end(&f, b);
        }
}

/* Every vertex of a sphere in a furnace is lit, also where --final direct makes its widest groups. */
static void direct_leaves_no_vertex_dark(void **state) {
    (void)state;
    fixture f;
    begin(&f);
    fct_mesh shell = make_sphere(&f.env, 12), ball = make_sphere(&f.env, 8);
    turn_inside_out(&shell);
    const float around[12] = {4, 0, 0, 0, 0, 4, 0, 0, 0, 0, 4, 0};
    add(&f, "shell", &shell, around, material(&f, .5f, 1), NULL);
    add(&f, "ball", &ball, identity, material(&f, .5f, 0), NULL);
    fct_bake *b = bake(&f, FCT_FINAL_DIRECT);
    fct_mesh mesh;
    assert_int_equal(fct_bake_instance(b, 1, &mesh), FCT_OK);
    float least = INFINITY;
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) least = fminf(least, mesh.colors[3 * (size_t)v + 1]);
    printf("    darkest vertex %g\n", (double)least);
    assert_true(least > .5f); /* the closed furnace has 2 everywhere, so the ball 1 */
    fct_mesh_release(&f.env, &mesh);
    end(&f, b);
}

/* A two-sided sheet close between two lamps: each side sees its lamp alone, so that its radiosity is rho
 * times the lamp's emission. */
static void both_sides_are_kept(void **state) {
    (void)state;
    for (int method = 0; method < 2; ++method) {
        fixture f;
        begin(&f);
        fct_material both = {.name = "both", .reflectance = {.5f, .5f, .5f}, .two_sided = true};
        uint32_t id;
        assert_int_equal(fct_scene_add_material(f.scene, &both, &id), FCT_OK);
        const float up[12] = {60, 0, 0, 0, 0, 60, 0, 0, 0, 0, 60, -.1f};
        const float down[12] = {60, 0, 0, 0, 0, -60, 0, 0, 0, 0, -60, .1f};
        add_square(&f, "sheet", 3, identity, id);
        add_square(&f, "below", 1, up, material(&f, 0, 3));
        add_square(&f, "above", 1, down, material(&f, 0, 1));
        assert_int_equal(fct_scene_commit(f.scene), FCT_OK);
        fct_bake_def def = fct_bake_def_default();
        def.method = method ? FCT_BAKE_REFERENCE : FCT_BAKE_FACE, def.samples = 200, def.max_edge = .5;
        fct_bake *b;
        fct_mesh mesh;
        assert_int_equal(fct_bake_create(&f.env, f.scene, &def, &b), FCT_OK);
        assert_int_equal(fct_bake_instance(b, 0, &mesh), FCT_OK);
        assert_true(mesh.face_count >= 36 && mesh.face_count % 2 == 0 && mesh.source_faces);
        for (uint32_t i = 0; i < mesh.face_count; ++i) {
            const uint32_t *t = mesh.triangles + 3 * (size_t)i;
            v3 p[3];
            for (int k = 0; k < 3; ++k) p[k] = v3_load(mesh.positions + 3 * (size_t)t[k]);
            bool lower = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])).z < 0;
            assert_int_equal(lower, i < mesh.face_count / 2); /* the brighter side comes first */
            assert_in_range(mesh.source_faces[i], 0, 17);
            double expected = lower ? 1.5 : .5;
            for (int k = 0; k < 3; ++k)
                assert_true(fabs((double)mesh.colors[3 * (size_t)t[k] + 1] / expected - 1) < .02);
        }
        fct_mesh_release(&f.env, &mesh);
        end(&f, b);
    }
}

static void furnace_is_even(void **state) {
    (void)state;
    if (SANITIZED) skip();
    for (int final = FCT_FINAL_NONE; final <= FCT_FINAL_GATHER; ++final) {
        fixture f;
        begin(&f);
        fct_mesh sphere = make_sphere(&f.env, 24);
        turn_inside_out(&sphere);
        add(&f, "sphere", &sphere, identity, material(&f, .5F, 1), NULL);
        fct_bake *b = bake(&f, (fct_final) final);
        expect_radiosity(&f, b, 0, 2, final == FCT_FINAL_NONE ? .05 : .01);
        end(&f, b);
    }
}

static void furnace_of_a_scanned_head_is_even(void **state) {
    (void)state;
    if (SANITIZED) skip();
    if (!file_exists(FACETREE_DATA "/rocker-arm.obj")) skip();
    fixture f;
    begin(&f);
    fct_mesh mesh;
    assert_int_equal(fct_mesh_load(&f.env, FACETREE_DATA "/rocker-arm.obj", &mesh), FCT_OK);
    turn_inside_out(&mesh);
    add(&f, "arm", &mesh, identity, material(&f, .8F, 1), NULL);
    fct_bake *b = bake(&f, FCT_FINAL_GATHER);
    expect_radiosity(&f, b, 0, 5, .01);
    end(&f, b);
}

/* Every face exists twice in the same place. Rays hit one of the two, and the balance counts the power once.
 */
static void coincident_faces_share_one_light(void **state) {
    (void)state;
    fixture f;
    begin(&f);
    fct_mesh sphere = make_sphere(&f.env, 10), twice;
    turn_inside_out(&sphere);
    assert_int_equal(fct_mesh_create(&f.env, sphere.vertex_count, 2 * sphere.face_count, 0, &twice), FCT_OK);
    memcpy(twice.positions, sphere.positions, 12 * (size_t)sphere.vertex_count);
    for (int k = 0; k < 2; ++k)
        memcpy(twice.triangles + 3 * (size_t)(k ? sphere.face_count : 0), sphere.triangles,
               12 * (size_t)sphere.face_count);
    fct_mesh_release(&f.env, &sphere);
    add(&f, "twice", &twice, identity, material(&f, .5F, 1), NULL);
    fct_bake *b = bake(&f, FCT_FINAL_GATHER);
    expect_radiosity(&f, b, 0, 2, .01);
    end(&f, b);
}

static void sphere_spreads_its_light_evenly(void **state) {
    (void)state;
    if (SANITIZED) skip();
    fixture f;
    begin(&f);
    fct_mesh sphere = make_sphere(&f.env, 30);
    turn_inside_out(&sphere);
    uint32_t ids[2] = {material(&f, .5F, 0), material(&f, .5F, 1)};
    uint32_t *faces = malloc(sphere.face_count * sizeof *faces);
    double areas[2] = {0, 0};
    for (uint32_t i = 0; i < sphere.face_count; ++i) {
        v3 p[3];
        for (int k = 0; k < 3; ++k)
            p[k] = v3_load(sphere.positions + 3 * sphere.triangles[3 * i + (uint32_t)k]);
        bool lit = p[0].z + p[1].z + p[2].z > 3 * .8;
        faces[i] = ids[lit];
        areas[lit] += v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
    }
    add(&f, "sphere", &sphere, identity, 0, faces);
    free(faces);
    fct_bake *b = bake(&f, FCT_FINAL_GATHER);
    double share = areas[1] / (areas[0] + areas[1]), dark = .5 * share / .5;
    fct_scene_view view = fct_scene_get(f.scene);
    for (uint32_t i = 0; i < view.instance_count; ++i)
        expect_radiosity(&f, b, i, view.instances[i].material == ids[1] ? 1 + dark : dark, .01);
    end(&f, b);
}

static void open_hemisphere_loses_half(void **state) {
    (void)state;
    if (SANITIZED) skip();
    fixture f;
    begin(&f);
    fct_mesh sphere = make_sphere(&f.env, 32), half;
    turn_inside_out(&sphere);
    uint32_t *faces = malloc(sphere.face_count * sizeof *faces), n = 0;
    for (uint32_t i = 0; i < sphere.face_count; ++i) {
        float z = 0;
        for (int k = 0; k < 3; ++k) z += sphere.positions[3 * sphere.triangles[3 * i + (uint32_t)k] + 2];
        if (z > 0) faces[n++] = i;
    }
    assert_int_equal(fct_mesh_extract(&f.env, &sphere, faces, n, &half, NULL), FCT_OK);
    fct_mesh_release(&f.env, &sphere);
    free(faces);
    add(&f, "cap", &half, identity, material(&f, .5F, 1), NULL);
    fct_bake *b = bake(&f, FCT_FINAL_GATHER);
    expect_radiosity(&f, b, 0, 4 / 3., .01);
    end(&f, b);
}

static void concentric_spheres_exchange(void **state) {
    (void)state;
    if (SANITIZED) skip();
    fixture f;
    begin(&f);
    fct_mesh inner = make_sphere(&f.env, 32), outer = make_sphere(&f.env, 32);
    turn_inside_out(&outer);
    const float half[12] = {.5F, 0, 0, 0, 0, .5F, 0, 0, 0, 0, .5F, 0};
    add(&f, "inner", &inner, half, material(&f, .5F, 1), NULL);
    add(&f, "outer", &outer, identity, material(&f, .8F, 0), NULL);
    fct_bake *b = bake(&f, FCT_FINAL_GATHER);
    expect_radiosity(&f, b, 0, 4 / 3., .01);
    expect_radiosity(&f, b, 1, 2 / 3., .01);
    end(&f, b);
}

/* The receiver has reflectance .5 and the lamp emits 1, so B / .5 is the form factor from receiver to lamp.
 */
static void expect_form_factor(fixture *f, double expected, double tolerance) {
    fct_bake *b = bake(f, FCT_FINAL_GATHER);
    double mean = mean_radiosity(f, b, 0, 0, NULL) / .5;
    printf("    form factor %.6f, expected %.6f, off by %.2f %%\n", mean, expected,
           100 * (mean / expected - 1));
    if (fabs(mean - expected) > tolerance * expected)
        fail_msg("form factor %g instead of %g", mean, expected);
    end(f, b);
}

static const float above[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 1};

static void parallel_squares(void **state) {
    (void)state;
    fixture f;
    begin(&f);
    add_square(&f, "receiver", 2, identity, material(&f, .5F, 0));
    add_square(&f, "lamp", 2, above, material(&f, 0, 1));
    expect_form_factor(&f, .199824896, .01);
}

static void perpendicular_squares(void **state) {
    (void)state;
    fixture f;
    begin(&f);
    add_square(&f, "receiver", 2, identity, material(&f, .5F, 0));
    /* at x = .5, facing -x */
    const float wall[12] = {0, 0, -1, .5F, 0, 1, 0, 0, 1, 0, 0, .5F};
    add_square(&f, "lamp", 2, wall, material(&f, 0, 1));
    expect_form_factor(&f, .200043776, .01);
}

static void blocked_squares(void **state) {
    (void)state;
    fixture f;
    begin(&f);
    add_square(&f, "receiver", 2, identity, material(&f, .5F, 0));
    add_square(&f, "lamp", 2, above, material(&f, 0, 1));
    const float blocker[12] = {.5F, 0, 0, 0, 0, .5F, 0, 0, 0, 0, .5F, .5F};
    add_square(&f, "blocker", 1, blocker, material(&f, 0, 0));
    expect_form_factor(&f, .099506, .02);
}

/* The blocker's shadow splits elements after the links exist. Without a lamp there are no links at all. */
static void the_bare_solution_lights_elements_newer_than_its_links(void **state) {
    (void)state;
    for (int lit = 0; lit < 2; ++lit) {
        fixture f;
        begin(&f);
        static const float blocker[12] = {.5, 0, 0, 0, 0, .5, 0, 0, 0, 0, .5, .5F};
        add_square(&f, "receiver", 16, identity, material(&f, .5F, 0));
        add_square(&f, "lamp", 1, above, material(&f, 0, (float)lit));
        add_square(&f, "blocker", 1, blocker, material(&f, 0, 0));
        assert_int_equal(fct_scene_commit(f.scene), FCT_OK);
        fct_bake_def def = fct_bake_def_default();
        def.final = FCT_FINAL_NONE, def.error = 1e-3;
        fct_bake *b;
        assert_int_equal(fct_bake_create(&f.env, f.scene, &def, &b), FCT_OK);
        double mean = mean_radiosity(&f, b, 0, 0, NULL);
        if (fabs(mean - lit * .5 * .099506) > .2 * .5 * .099506) fail_msg("mean %g", mean);
        end(&f, b);
    }
}

/* A wall 4 cm thick cuts a room with one floor into a bright and a dark part. */
static void no_light_leaks_under_a_wall(void **state) {
    (void)state;
    if (SANITIZED) skip();
    fixture f;
    begin(&f);
    uint32_t white = material(&f, .7F, 0), light = material(&f, 0, 5);
    fct_mesh room = make_grid(&f.env, 1); /* replaced by a box of six faces */
    fct_mesh_release(&f.env, &room);
    assert_int_equal(fct_mesh_create(&f.env, 8, 12, 0, &room), FCT_OK);
    for (uint32_t v = 0; v < 8; ++v) {
        room.positions[3 * v] = v & 1 ? 4.F : 0;
        room.positions[3 * v + 1] = v & 2 ? 2.F : 0;
        room.positions[3 * v + 2] = v & 4 ? 2.F : 0;
    }
    /* inward winding */
    static const uint32_t faces[36] = {0, 1, 3, 0, 3, 2, 4, 7, 5, 4, 6, 7, 0, 5, 1, 0, 4, 5,
                                       2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 7, 3, 1, 5, 7};
    memcpy(room.triangles, faces, sizeof faces);
    add(&f, "room", &room, identity, white, NULL);
    fct_mesh wall;
    assert_int_equal(fct_mesh_create(&f.env, 8, 12, 0, &wall), FCT_OK);
    for (uint32_t v = 0; v < 8; ++v) {
        wall.positions[3 * v] = v & 1 ? 2.02F : 1.98F;
        wall.positions[3 * v + 1] = v & 2 ? 2.F : 0;
        wall.positions[3 * v + 2] = v & 4 ? 2.F : 0;
    }
    memcpy(wall.triangles, faces, sizeof faces);
    turn_inside_out(&wall);
    add(&f, "wall", &wall, identity, white, NULL);
    const float place[12] = {.4F, 0, 0, 1, 0, -.4F, 0, 1, 0, 0, -.4F, 1.95F};
    add_square(&f, "lamp", 1, place, light);
    fct_bake *b = bake(&f, FCT_FINAL_GATHER);
    fct_mesh lit;
    assert_int_equal(fct_bake_instance(b, 0, &lit), FCT_OK);
    double worst = 0, bright = 0;
    for (uint32_t v = 0; v < lit.vertex_count; ++v) {
        double c = lit.colors[3 * v + 1];
        if (lit.positions[3 * v] > 2.021F)
            worst = fmax(worst, c);
        else
            bright = fmax(bright, c);
    }
    printf("    dark room: at most %g beside %g\n", worst, bright);
    fct_mesh_release(&f.env, &lit);
    if (worst > .005 * bright) fail_msg("%g leaks into the dark room", worst);
    end(&f, b);
}

/* A lamp that nearly touches a wall gives E = e like an infinite plane; no value exceeds that by much. */
static void lamp_near_a_wall_is_stable(void **state) {
    (void)state;
    if (SANITIZED) skip();
    static const float gaps[] = {.0001F, .001F, .01F, .1F, .3F};
    for (size_t i = 0; i < sizeof gaps / sizeof *gaps; ++i) {
        fixture f;
        begin(&f);
        add_square(&f, "wall", 4, identity, material(&f, .5F, 0));
        const float place[12] = {.2F, 0, 0, 0, 0, -.2F, 0, 0, 0, 0, -.2F, gaps[i]};
        add_square(&f, "lamp", 1, place, material(&f, .2F, 1));
        fct_bake *b = bake(&f, FCT_FINAL_GATHER);
        fct_mesh lit;
        assert_int_equal(fct_bake_instance(b, 0, &lit), FCT_OK);
        for (uint32_t v = 0; v < lit.vertex_count; ++v) {
            assert_true(lit.colors[3 * v + 1] >= 0);
            assert_true(lit.colors[3 * v + 1] <= .5 * 1.2);
        }
        fct_probe probe;
        const float point[3] = {0, 0, 0}, normal[3] = {0, 0, 1};
        assert_int_equal(fct_bake_probe(b, 1, point, normal, &probe), FCT_OK);
        double h = gaps[i], a = .1 / sqrt(.01 + h * h), expected = 4 / 3.14159265358979 * a * atan(a);
        printf("    gap %g: E %.4f, direct %.4f\n", h, probe.irradiance[1], expected);
        assert_true(probe.irradiance[1] > .98 * expected);
        assert_true(probe.irradiance[1] < 1.15 * expected + .02);
        fct_mesh_release(&f.env, &lit);
        end(&f, b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_lamp_in_the_ceiling_shines),
        cmocka_unit_test(direct_leaves_no_vertex_dark),
        cmocka_unit_test(both_sides_are_kept),
        cmocka_unit_test(furnace_is_even),
        cmocka_unit_test(the_bare_solution_lights_elements_newer_than_its_links),
        cmocka_unit_test(furnace_of_a_scanned_head_is_even),
        cmocka_unit_test(coincident_faces_share_one_light),
        cmocka_unit_test(sphere_spreads_its_light_evenly),
        cmocka_unit_test(open_hemisphere_loses_half),
        cmocka_unit_test(concentric_spheres_exchange),
        cmocka_unit_test(parallel_squares),
        cmocka_unit_test(perpendicular_squares),
        cmocka_unit_test(blocked_squares),
        cmocka_unit_test(no_light_leaks_under_a_wall),
        cmocka_unit_test(lamp_near_a_wall_is_stable),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
