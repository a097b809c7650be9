/* Stored solution: direct light, gathered light, power and noise against closed forms. */
#include "../place.h"
#include "radiosity/solve/transport.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance * fabs(expected)))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

typedef struct fixture {
    fct_scene *scene;
    fct_elements set;
    fct_lamps *lamps;
    fct_transport transport;
} fixture;

static fixture begin(void) {
    fixture f = {0};
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &f.scene), FCT_OK);
    return f;
}

static void solve(fixture *f, uint64_t seed, double epsilon, double min_edge) {
    const fct_transport_def def = {.seed = seed, .epsilon = epsilon, .tolerance = 1e-6, .fineness = 1};
    if (!f->lamps) {
        assert_int_equal(fct_scene_commit(f->scene), FCT_OK);
        assert_int_equal(fct_lamps_create(&plain, f->scene, &f->lamps), FCT_OK);
    }
    assert_int_equal(fct_elements_create(&plain, f->scene, min_edge, &f->set), FCT_OK);
    assert_int_equal(fct_transport_solve(&f->set, f->lamps, &def, &f->transport), FCT_OK);
    assert_true(f->transport.converged);
}

static void clear(fixture *f) {
    fct_transport_release(&plain, &f->transport);
    fct_elements_release(&f->set);
}

static void end(fixture *f) {
    clear(f);
    fct_lamps_destroy(f->lamps);
    fct_scene_destroy(f->scene);
}

/* A floor of reflectance .5 under a lamp of the same size that reflects .2: F = .199824896 both ways.
 *   b1 = .5 F b2, b2 = 1 + .2 F b1; absorbed .5 F b2 + .8 F b1; escaped (1 - F) (b1 + b2). */
static fixture begin_plates(void) {
    fixture f = begin();
    uint32_t floor = place_material(f.scene, .5, 0, false), glow = place_material(f.scene, .2, 1, false);
    place_sheet(&plain, f.scene, floor, 8, v3_make(0, 0, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
    place_sheet(&plain, f.scene, glow, 8, v3_make(0, 0, 1), v3_make(0, 1, 0), v3_make(1, 0, 0));
    return f;
}

static const double F = .199824896;

static void plates_balance(void **state) {
    (void)state;
    fixture f = begin_plates();
    solve(&f, 1, 1e-3, .01);
    double b1 = .5 * F / (1 - .1 * F * F), b2 = 1 / (1 - .1 * F * F);
    assert_near(f.transport.emitted, 3, 1e-5);
    assert_near(f.transport.absorbed, 3 * (.5 * F * b2 + .8 * F * b1), .01);
    assert_near(f.transport.escaped, 3 * (1 - F) * (b1 + b2), .01);
    double direct = 0, reflected = 0, stored = 0, lamp_stored = 0, lamp = 0;
    for (size_t id = f.set.view.volume_count; id < f.set.count; ++id) {
        const fct_element *e = &f.set.items[id];
        if (e->child_count) continue;
        if (e->instance == 0) {
            direct += e->area * f.transport.direct[3 * id + 1];
            reflected += e->area * e->radiosity[1], stored += e->area * f.transport.stored[3 * id + 1];
        } else {
            lamp_stored += e->area * f.transport.stored[3 * id + 1], lamp += e->area * e->radiosity[1];
        }
    }
    assert_near(direct, F, .01);
    assert_near(reflected, b1, .01), assert_near(stored, b1, .01);
    /* Shadow rays bring the emission: gather rays find the reflected part alone. */
    assert_near(lamp, b2, .01), assert_near(lamp_stored, .2 * F * b1, .05);
    assert_near(f.set.items[0].radiosity[1], (b1 + b2) / 2, .01);
    end(&f);
}

/* Inside a sphere every form factor is A_j / A: b = e + rho ebar / (1 - rho), and a furnace is exact. */
static void spheres_are_even(void **state) {
    (void)state;
    for (int whole = 0; whole < 2; ++whole) {
        fixture f = begin();
        fct_mesh mesh = make_sphere(&plain, 12);
        uint32_t ids[2] = {place_material(f.scene, .5, whole, false), place_material(f.scene, .5, 1, false)};
        uint32_t *materials = malloc(mesh.face_count * sizeof *materials);
        double lit = 0, all = 0;
        for (size_t t = 0; t < mesh.face_count; ++t) {
            uint32_t *c = mesh.triangles + 3 * t, swap = c[1];
            c[1] = c[2], c[2] = swap;
            v3 p[3];
            for (size_t k = 0; k < 3; ++k) p[k] = v3_load(mesh.positions + 3 * (size_t)c[k]);
            double area = v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
            bool upper = p[0].z + p[1].z + p[2].z > 0;
            materials[t] = ids[upper];
            all += area, lit += upper || whole ? area : 0;
        }
        assert_int_equal(fct_scene_add_object(f.scene, "ball", &mesh, NULL, NULL, 0, materials), FCT_OK);
        free(materials);
        fct_mesh_release(&plain, &mesh);
        solve(&f, 1, 1, .05);
        double dark = .5 * (lit / all) / .5, worst = 0, mean[2] = {0, 0}, area[2] = {0, 0};
        for (size_t id = f.set.view.volume_count; id < f.set.count; ++id) {
            const fct_element *e = &f.set.items[id];
            if (e->child_count) continue;
            double expected = e->emission[1] + dark;
            worst = fmax(worst, fabs(e->radiosity[1] / expected - 1));
            mean[e->emission[1] > 0] += e->area * (e->radiosity[1] - e->emission[1]),
                area[e->emission[1] > 0] += e->area;
            /* bent leaves are split to nearly flat ones */
            assert_true(v3_norm(e->vector) > .94 * e->area || e->area < 1e-5 * all);
        }
        assert_true(worst < (whole ? 1e-5 : .1));
        assert_near(mean[1] / area[1], dark, whole ? 1e-5 : .02);
        assert_near(f.transport.emitted, f.transport.absorbed + f.transport.escaped, .01);
        assert_true(whole ? f.transport.noise < 1e-6 : f.transport.noise > 1e-4);
        end(&f);
    }
}

/* A square of side 1 inside a black sphere that shines evenly. A flat black body covers a corner of it. With
 * `coincident` the square's own plane holds another such body; with `lamp`, the square is under a small lamp.
 */
static fixture cover_square(double wide_x, double wide_y, bool coincident, bool lamp) {
    fixture f = begin();
    const uint32_t grey = place_material(f.scene, .5, 0, false), black = place_material(f.scene, 0, 0, false);
    const float wide[12] = {.9F, 0, 0, 0, 0, .9F, 0, 0, 0, 0, .9F, 0};
    const float small[12] = {.02F, 0, 0, .2F, 0, .02F, 0, .2F, 0, 0, .02F, .4F};
    const v3 x = v3_make(wide_x, 0, 0), y = v3_make(0, wide_y, 0);
    place_sheet(&plain, f.scene, grey, 1, v3_make(-.5, -.5, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
    place_sheet(&plain, f.scene, black, 1, v3_make(-.5, -.5, 4e-4), x, y);
    if (coincident) place_sheet(&plain, f.scene, black, 1, v3_make(-.5, -.5, 0), y, x);
    fct_mesh mesh = make_sphere(&plain, 12);
    if (lamp) place_mesh(f.scene, &mesh, place_material(f.scene, 0, 400, false), small);
    for (size_t t = 0; t < mesh.face_count; ++t) {
        uint32_t *c = mesh.triangles + 3 * t, swap = c[1];
        c[1] = c[2], c[2] = swap;
    }
    place_mesh(f.scene, &mesh, place_material(f.scene, 0, 1, false), wide);
    fct_mesh_release(&plain, &mesh);
    solve(&f, 1, 1e9, 10);
    assert_int_equal(f.set.items[f.set.roots[0]].child_count, 0);
    return f;
}

/* The square is one leaf, of which a quarter is covered. Its light is that of the other three quarters: 1
 * from the sphere, and the direct light, of which the covered quarter has none. */
static void covered_parts_do_not_darken(void **state) {
    (void)state;
    for (int turn = 0; turn < 4; ++turn) {
        const bool lamp = turn & 2;
        fixture f = cover_square(.5, .5, turn & 1, lamp);
        const uint32_t id = f.set.roots[0];
        const fct_element *e = &f.set.items[id];
        const double direct = f.transport.direct[3 * (size_t)id];
        assert_true(lamp ? direct > .1 : direct <= 0);
        assert_near(e->irradiance[0], 1 + direct / .75, .015);
        assert_near(f.transport.stored[3 * (size_t)id], .5 * (1 + direct / .75), .015);
        if (!lamp) assert_near(f.transport.emitted, f.transport.absorbed + f.transport.escaped, .004);
        end(&f);
    }
}

/* A fiftieth of the square is open: it counts as an eighth, and the balance holds. */
static void a_small_open_rest_is_not_exaggerated(void **state) {
    (void)state;
    fixture f = cover_square(.98, 1, false, false);
    assert_in_range(1000 * f.set.items[f.set.roots[0]].irradiance[0], 80, 260); /* 160 */
    assert_near(f.transport.emitted, f.transport.absorbed + f.transport.escaped, .004);
    end(&f);
}

/* The noise is the standard error of a leaf's irradiance: it agrees with the spread over seeds. The halves of
 * a stratified sequence are a little worse than its whole, so it may be too large, at most by a half. In the
 * second case a small ball adds direct light of 1 everywhere, without noise. */
static void noise_is_the_standard_error(void **state) {
    (void)state;
    enum { SEEDS = 24, MOST = 4096 };
    static double sums[MOST], squares[MOST];
    for (int ball = 0; ball < 2; ++ball) {
        memset(sums, 0, sizeof sums), memset(squares, 0, sizeof squares);
        fixture f = begin();
        fct_mesh mesh = make_sphere(&plain, 6);
        const float small[12] = {.1F, 0, 0, 0, 0, .1F, 0, 0, 0, 0, .1F, 0};
        if (ball) place_mesh(f.scene, &mesh, place_material(f.scene, 0, 100, false), small);
        for (size_t t = 0; t < mesh.face_count; ++t) {
            uint32_t *c = mesh.triangles + 3 * t, swap = c[1];
            c[1] = c[2], c[2] = swap;
        }
        uint32_t ids[2] = {place_material(f.scene, .1, 0, false), place_material(f.scene, .1, 1, false)};
        uint32_t *materials = malloc(mesh.face_count * sizeof *materials);
        for (size_t t = 0; t < mesh.face_count; ++t) materials[t] = ids[t % 2];
        assert_int_equal(fct_scene_add_object(f.scene, "ball", &mesh, NULL, NULL, 0, materials), FCT_OK);
        free(materials);
        fct_mesh_release(&plain, &mesh);
        double noise2 = 0, spread2 = 0, level2 = 0;
        for (uint64_t seed = 0; seed < SEEDS; ++seed) {
            solve(&f, seed, 1e3, 10);
            assert_true(f.set.count < MOST);
            noise2 += f.transport.noise * f.transport.noise / SEEDS;
            for (size_t id = 0; id < f.set.count; ++id) {
                double e = f.set.items[id].child_count ? 0 : f.set.items[id].irradiance[1];
                sums[id] += e, squares[id] += e * e;
            }
            if (seed + 1 < SEEDS) clear(&f);
        }
        for (size_t id = 0; id < f.set.count; ++id) {
            double mean = sums[id] / SEEDS;
            spread2 += f.set.items[id].area * (squares[id] - SEEDS * mean * mean) / (SEEDS - 1);
            level2 += f.set.items[id].area * mean * mean * (f.set.items[id].child_count == 0);
        }
        double ratio = sqrt(noise2 / (spread2 / level2));
        printf("    noise is %.3f of the spread over seeds\n", ratio);
        if (!(ratio > (ball ? .7 : .97) && ratio < 1.5))
            fail_msg("noise is %g of the spread over seeds", ratio);
        end(&f);
    }
}

/* A shadow border splits only the leaves that it crosses, down to min_edge. */
static void borders_split_leaves(void **state) {
    (void)state;
    fixture f = begin();
    uint32_t grey = place_material(f.scene, .5, 0, false), glow = place_material(f.scene, 0, 1, false);
    place_sheet(&plain, f.scene, grey, 1, v3_make(0, 0, 0), v3_make(8, 0, 0), v3_make(0, 8, 0));
    place_sheet(&plain, f.scene, glow, 1, v3_make(4, 4, 40), v3_make(0, .2, 0), v3_make(.2, 0, 0));
    place_sheet(&plain, f.scene, grey, 1, v3_make(4.7, -10, 1), v3_make(20, 0, 0), v3_make(0, 30, 0));
    solve(&f, 1, 2e-5, .3);
    double near = 0, nears = 0, far = 0, fars = 0;
    for (size_t id = f.set.view.volume_count; id < f.set.count; ++id) {
        const fct_element *e = &f.set.items[id];
        if (e->child_count || e->instance != 0) continue;
        double away = fabs(e->center.x - 4.7);
        if (away < .3) near += e->area, ++nears;
        if (away > 2) far += e->area, ++fars;
    }
    if (!(near / nears < .1 && far / fars > .4))
        fail_msg("areas %g near the border, %g far off", near / nears, far / fars);
    end(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plates_balance),
        cmocka_unit_test(spheres_are_even),
        cmocka_unit_test(covered_parts_do_not_darken),
        cmocka_unit_test(a_small_open_rest_is_not_exaggerated),
        cmocka_unit_test(noise_is_the_standard_error),
        cmocka_unit_test(borders_split_leaves),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
