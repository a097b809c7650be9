/* Anchors: gathers against closed forms, the search against all anchors, blends against the fields they
 * sample. */
#include "../place.h"
#include "radiosity/output/anchor.h"
#include "radiosity/output/blend.h"
#include "radiosity/surface/tessellate.h"

static const double pi = 3.14159265358979323846;
static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

/* Two half spheres of radius 10 seen from inside, x > 0 stored with 1 and x < 0 with `other`. */
typedef struct sky {
    fct_scene *scene;
    fct_elements set;
    float *stored;
} sky;

static sky make_sky(double other) {
    sky s;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &s.scene), FCT_OK);
    fct_mesh ball = make_sphere(&plain, 40);
    uint32_t ids[2] = {place_material(s.scene, .5, 0, false), place_material(s.scene, .25, 0, false)};
    uint32_t *materials = malloc(ball.face_count * sizeof *materials);
    for (size_t v = 0; v < 3 * (size_t)ball.vertex_count; ++v) ball.positions[v] *= 10;
    for (size_t t = 0; t < ball.face_count; ++t) {
        uint32_t *c = ball.triangles + 3 * t, swap = c[1];
        c[1] = c[2], c[2] = swap;
        float x = 0;
        for (int k = 0; k < 3; ++k) x += ball.positions[3 * (size_t)c[k]];
        materials[t] = ids[x > 0];
    }
    assert_int_equal(fct_scene_add_object(s.scene, "sky", &ball, NULL, NULL, 0, materials), FCT_OK);
    free(materials);
    fct_mesh_release(&plain, &ball);
    assert_int_equal(fct_scene_commit(s.scene), FCT_OK);
    assert_int_equal(fct_elements_create(&plain, s.scene, 1, &s.set), FCT_OK);
    s.stored = calloc(3 * s.set.count, sizeof *s.stored);
    for (size_t i = 0; i < 3 * s.set.count; ++i)
        s.stored[i] = s.set.items[i / 3].reflectance[0] < .3F ? 1 : (float)other;
    return s;
}

static void end_sky(sky *s) {
    free(s->stored);
    fct_elements_release(&s->set);
    fct_scene_destroy(s->scene);
}

static fct_anchor gather(const sky *s, v3 n) {
    fct_anchor a = {.offset = 1e-3F};
    v3_store(a.normal, n);
    const fct_source source = {&s->set, NULL, s->stored, INFINITY, NULL};
    fct_anchor_gather(&source, NULL, 8192, 3, &a);
    return a;
}

/* Half a hemisphere that shines gives E = (1 + n.x) / 2; all hits are at distance 10. */
static void gathers_equal_closed_forms(void **state) {
    (void)state;
    sky s = make_sky(0);
    const v3 normals[5] = {{0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {.6, .8, 0}, {-.48, .6, -.64}};
    for (int k = 0; k < 5; ++k) {
        fct_anchor a = gather(&s, normals[k]);
        for (int c = 0; c < 3; ++c) assert_near(a.irradiance[c], .5 * (1 + normals[k].x), .01);
        assert_near(a.reach, 10, .05);
    }
    end_sky(&s);
}

/* dE/dn = 1 / pi times the integral of b d over the hemisphere, across the normal, with grazing directions
 * damped by cos / .15: for a normal z and light from x > 0, along x. The correction of E follows the turn. */
static void gradients_equal_integrals(void **state) {
    (void)state;
    double across = 0;
    enum { N = 20000 };
    for (int i = 0; i < N; ++i) {
        double theta = pi / 2 * (i + .5) / N, c = cos(theta), w = fmin(1, c / .15) * sin(theta) * pi / 2 / N;
        across += w * sin(theta) * 2 / pi; /* integral of cos phi over half a turn: 2 */
    }
    sky s = make_sky(0);
    fct_anchor a = gather(&s, v3_make(0, 0, 1));
    assert_near(a.gradient[1][0], across, .01);
    assert_near(a.gradient[1][1], 0, .01);
    assert_near(a.gradient[1][2], 0, 1e-6);
    /* E for a normal turned by .1 towards the light exceeds that of one turned away. */
    double sine = sin(.1);
    assert_near(a.irradiance[1] + a.gradient[1][0] * sine, .5 * (1 + sine), .015);
    end_sky(&s);
}

static fct_anchors make_anchors(uint32_t count) {
    fct_anchors t = {.count = count, .turn = .3};
    plain = fct_env_default();
    t.items = fct_allocate_zero(&plain, count, sizeof *t.items);
    t.axes = fct_allocate_zero(&plain, count, 1);
    for (uint32_t i = 0; i < count; ++i) {
        fct_anchor *a = &t.items[i];
        for (uint64_t k = 0; k < 3; ++k) a->position[k] = (float)fct_uniform(fct_hash3(i, k, 1));
        v3 n =
            v3_unit(v3_make(fct_uniform(fct_hash3(i, 0, 2)) - .5, fct_uniform(fct_hash3(i, 1, 2)) - .5, .6));
        v3_store(a->normal, n);
        a->reach = 1, a->irradiance[0] = (float)i;
    }
    return t;
}

/* All anchors within 37 degrees (|n - n'|^2 < .4), or all if there is none, by |p - p'|^2 + turn^2 |n -
 * n'|^2. */
static void nearest_equal_brute_force(void **state) {
    (void)state;
    int turned = 0;
    for (uint32_t count = 1; count <= 1000; count = 3 * count + 1) {
        fct_anchors t = make_anchors(count);
        fct_anchors_order(&t);
        for (uint64_t q = 0; q < 60; ++q) {
            float p[3], n[3];
            for (uint64_t k = 0; k < 3; ++k) p[k] = (float)fct_uniform(fct_hash3(q, k, 3));
            v3_store(n, v3_unit(v3_make(fct_uniform(fct_hash3(q, 0, 4)) - .5, 0, q % 10 ? 1 : -.2)));
            fct_nearest found;
            fct_anchors_nearest(&t, p, n, &found);
            double best[FCT_NEAREST_ANCHORS], most = 8;
            int known = 0;
            for (uint32_t i = 0; i < count; ++i)
                if (v3_norm2(v3_sub(v3_load(n), v3_load(t.items[i].normal))) < .4) most = .4;
            turned += most > 4;
            for (uint32_t i = 0; i < count; ++i) {
                v3 d = v3_sub(v3_load(p), v3_load(t.items[i].position)),
                   m = v3_sub(v3_load(n), v3_load(t.items[i].normal));
                double d2 = v3_norm2(d) + .09 * v3_norm2(m);
                if (v3_norm2(m) >= most) continue;
                int at = known < FCT_NEAREST_ANCHORS ? known++ : FCT_NEAREST_ANCHORS;
                if (at == FCT_NEAREST_ANCHORS && d2 >= best[at - 1]) continue;
                if (at == FCT_NEAREST_ANCHORS) --at;
                best[at] = d2;
                for (; at > 0 && best[at - 1] > best[at]; --at) {
                    double swap = best[at];
                    best[at] = best[at - 1], best[at - 1] = swap;
                }
            }
            assert_int_equal(found.count, known);
            for (int i = 0; i < known; ++i) assert_near(found.distances2[i], best[i], 1e-9);
        }
        fct_anchors_release(&plain, &t);
    }
    assert_true(turned > 5);
}

static void set_anchor(fct_anchor *a, v3 p, v3 n, double reach, double e) {
    *a = (fct_anchor){.offset = 1e-3F, .reach = (float)reach};
    v3_store(a->position, p), v3_store(a->normal, n);
    for (int c = 0; c < 3; ++c) a->irradiance[c] = (float)e;
}

static double blend(const fct_anchors *t, const fct_elements *set, v3 p, v3 n, bool flat, uint64_t *rays) {
    float point[3], normal[3];
    double e[3];
    v3_store(point, p), v3_store(normal, n);
    fct_anchors_irradiance(t, set, point, normal, 1e-3F, flat, e, rays);
    assert_near(e[0], e[1], 1e-12), assert_near(e[1], e[2], 1e-12);
    return e[1];
}

/* A field that depends linearly on the normal is reproduced exactly by the gradients, whatever the positions.
 */
static void linear_fields_are_reproduced(void **state) {
    (void)state;
    fct_anchors t = make_anchors(40);
    const v3 g = {.3, -.2, .4};
    for (uint32_t i = 0; i < 40; ++i) {
        fct_anchor *a = &t.items[i];
        a->reach = (float)(.2 + fct_uniform(fct_hash2(9, i)));
        for (int c = 0; c < 3; ++c) {
            a->irradiance[c] = (float)(1 + v3_dot(g, v3_load(a->normal)));
            v3_store(a->gradient[c], g);
        }
    }
    fct_anchors_order(&t);
    uint64_t rays = 0;
    for (uint64_t q = 0; q < 50; ++q) {
        v3 n = v3_unit(v3_make(.3 * fct_uniform(fct_hash2(1, q)), .3 * fct_uniform(fct_hash2(2, q)), 1));
        v3 p =
            v3_make(fct_uniform(fct_hash2(3, q)), fct_uniform(fct_hash2(4, q)), fct_uniform(fct_hash2(5, q)));
        assert_near(blend(&t, NULL, p, n, false, &rays), 1 + v3_dot(g, n), 1e-5);
    }
    assert_int_equal(rays, 0);
    fct_anchors_release(&plain, &t);
}

/* Anchors at two points on opposite sides: the polynomial is constant, so E is the mean with the weights (1 -
 * .98 x / max x)^2 / (x^2 + .2^2), x = |p - p'| / reach + .7 |n - n'|. */
static void weights_fall_with_distance_and_turn(void **state) {
    (void)state;
    const v3 up = {0, 0, 1}, turned = v3_unit(v3_make(.4, 0, 1)), p = {.5, .2, 0};
    fct_anchors t = make_anchors(6);
    for (int k = 0; k < 3; ++k) {
        const double reach = k == 1 ? .4 : .7;
        for (int side = 0; side < 2; ++side) {
            const v3 q = v3_mad(p, side ? 1 : -1, v3_make(.2, .1, 0));
            fct_anchor *a = t.items + 3 * side;
            set_anchor(a, q, up, 1, 1);
            set_anchor(a + 1, q, k == 2 ? turned : up, reach, 2);
            set_anchor(a + 2, q, up, .2, 4);
        }
        fct_anchors_order(&t);
        double x[3] = {sqrt(.05), sqrt(.05) / reach, sqrt(.05) / .2}, sum = 0, weights = 0;
        if (k == 2) x[1] += .7 * v3_norm(v3_sub(turned, up));
        for (int i = 0; i < 3; ++i) {
            double w = pow(1 - .98 * x[i] / x[2], 2) / (x[i] * x[i] + .2 * .2);
            sum += w * (1 << i), weights += w;
        }
        assert_near(blend(&t, NULL, p, up, false, NULL), sum / weights, 2e-3);
    }
    fct_anchors_release(&plain, &t);
}

/* Anchors twice as dense on the left as on the right. A slope costs nothing anywhere inside. The top of
 * a hill is nearly reached, and never exceeded. The same light everywhere stays as it is. */
static void fields_are_reproduced(void **state) {
    (void)state;
    const v3 up = {0, 0, 1};
    fct_anchors t = make_anchors(200);
    for (int field = 0; field < 3; ++field) {
        double highest = 0, sum = 0, truths = 0;
        for (uint32_t i = 0; i < t.count; ++i) {
            const double u = fct_uniform(fct_hash2(7, i)), x = 2 * u * u - 1,
                         y = 2 * fct_uniform(fct_hash2(8, i)) - 1;
            const double e = field == 0 ? .7 : field == 1 ? 20 + x + .5 * y : 20 - x * x - .5 * y * y;
            set_anchor(&t.items[i], v3_make(x, y, 0), up, .5, e);
            highest = fmax(highest, e);
        }
        fct_anchors_order(&t);
        for (uint64_t q = 0; q < 100; ++q) {
            const double x = 1.2 * fct_uniform(fct_hash2(9, q)) - .6,
                         y = 1.2 * fct_uniform(fct_hash2(10, q)) - .6;
            const double e = field == 0 ? .7 : field == 1 ? 20 + x + .5 * y : 20 - x * x - .5 * y * y;
            const double flat = blend(&t, NULL, v3_make(x, y, 0), up, true, NULL);
            const double bent = blend(&t, NULL, v3_make(x, y, 0), up, false, NULL);
            assert_near(flat, e, field == 0 ? 1e-7 : .05);
            assert_near(bent, flat, 1e-6); /* no anchor hides */
            assert_true(flat <= highest * (1 + 1e-6));
            sum += flat, truths += e;
        }
        assert_near(sum, truths, 1); /* of 100 points */
    }
    fct_anchors_release(&plain, &t);
}

/* A single anchor decides alone; its correction stays within .5 to 1.6 of its value. Beyond 37 degrees it
 * counts only if no other is nearer to the normal. */
static void corrections_are_clamped(void **state) {
    (void)state;
    const v3 up = {0, 0, 1}, turned = v3_unit(v3_make(.3, 0, 1));
    fct_anchors t = make_anchors(1);
    set_anchor(&t.items[0], v3_make(0, 0, 0), up, 1, 2);
    assert_near(blend(&t, NULL, v3_make(3, 0, 0), up, false, NULL), 2, 1e-6);
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int c = 0; c < 3; ++c) t.items[0].gradient[c][0] = (float)(100 * sign);
        assert_near(blend(&t, NULL, v3_make(3, 0, 0), turned, false, NULL), sign > 0 ? 3.2 : 1, 1e-5);
        for (int c = 0; c < 3; ++c) t.items[0].gradient[c][0] = (float)(.5 * sign);
        assert_near(blend(&t, NULL, v3_make(3, 0, 0), turned, false, NULL), 2 + .5 * sign * turned.x, 1e-5);
    }
    for (int angle = 30; angle < 100; angle += 10) {
        const v3 n = {0, sin(angle * pi / 180), cos(angle * pi / 180)};
        assert_near(blend(&t, NULL, v3_make(0, 0, 0), n, false, NULL), 2, 1e-6);
        fct_anchors two = make_anchors(2); /* the second one: at n, and brighter */
        set_anchor(&two.items[0], v3_make(.1, 0, 0), up, 1, 2);
        set_anchor(&two.items[1], v3_make(-.1, 0, 0), n, 1, 8);
        fct_anchors_order(&two);
        double e = blend(&two, NULL, v3_make(0, 0, 0), n, false, NULL);
        assert_true(angle < 37 ? e > 2 && e < 8 : fabs(e - 8) < 1e-6);
        fct_anchors_release(&plain, &two);
    }
    fct_anchors_release(&plain, &t);
}

/* A wall on a floor: the bright anchor behind it counts only without the test. */
static void walls_hide_anchors(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    uint32_t grey = place_material(scene, .5, 0, false);
    place_sheet(&plain, scene, grey, 1, v3_make(.1, -5, 0), v3_make(0, 10, 0), v3_make(0, 0, 2));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_elements set;
    assert_int_equal(fct_elements_create(&plain, scene, 1, &set), FCT_OK);
    const v3 up = {0, 0, 1};
    fct_anchors t = make_anchors(3);
    set_anchor(&t.items[0], v3_make(.35, 0, 0), up, 1, 10);
    set_anchor(&t.items[1], v3_make(-.3, 0, 0), up, 1, 1);
    set_anchor(&t.items[2], v3_make(-.4, .1, 0), up, 1, 1);
    fct_anchors_order(&t);
    uint64_t rays = 0;
    assert_true(blend(&t, &set, v3_make(0, 0, 0), up, false, &rays) > 2);
    assert_int_equal(rays, 0);
    assert_near(blend(&t, &set, v3_make(0, 0, 0), up, true, &rays), 1, 1e-6);
    assert_true(rays >= 1 && rays <= 3);
    /* If all anchors are alike, no ray is sent. */
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < 3; ++c) t.items[i].irradiance[c] = 1;
    rays = 0;
    blend(&t, &set, v3_make(0, 0, 0), up, true, &rays);
    assert_int_equal(rays, 0);
    /* If all are hidden, the nearest one decides. */
    t.count = 2;
    set_anchor(&t.items[0], v3_make(.3, 0, 0), up, .3, 10);
    set_anchor(&t.items[1], v3_make(.6, 0, 0), up, .6, 2);
    fct_anchors_order(&t);
    assert_near(blend(&t, &set, v3_make(0, 0, 0), up, true, &rays), 10, 1e-6);
    assert_int_equal(rays, 2);
    fct_anchors_release(&plain, &t);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* Every vertex has an anchor with distance / reach + sqrt(1 - n.n') within the tolerance, anchors lie on
 * sample points, and a smaller tolerance makes more of them. The back gathers on the other side. */
static void groups_respect_the_tolerance(void **state) {
    (void)state;
    sky s = make_sky(.5);
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    fct_mesh mesh = make_bumpy(&plain, 20, .2);
    place_mesh(scene, &mesh, place_material(scene, .5, 0, false), NULL);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_surface f;
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, 0), 10, &f), FCT_OK);
    uint32_t last = 0;
    for (int k = 0; k < 3; ++k) {
        const double tolerance = k == 0 ? .9 : .4;
        fct_anchors_def def = {.rays = 16, .tolerance = tolerance, .side = k == 2 ? -1 : 1, .seed = 1};
        fct_anchors t;
        const fct_source source = {&s.set, NULL, s.stored, 20 * sqrt(3) / 8, NULL};
        t = (fct_anchors){0};
        assert_int_equal(fct_anchors_extend(&plain, &source, &f, &def, &t), FCT_OK);
        assert_true(t.rays >= 16 * t.count && t.rays <= 80 * t.count);
        double inverse = 0;
        for (uint32_t i = 0; i < t.count; ++i) inverse += 1 / t.items[i].reach;
        assert_near(t.turn, .7 * t.count / inverse, 1e-6);
        for (uint32_t v = 0; v < f.mesh.vertex_count; ++v) {
            double best = 100;
            v3 p = v3_load(f.sample_points + 3 * (size_t)v),
               n = v3_scale(v3_load(f.normals + 3 * (size_t)v), def.side);
            for (uint32_t i = 0; i < t.count; ++i) {
                const fct_anchor *a = &t.items[i];
                double d = v3_norm(v3_sub(p, v3_load(a->position))) / a->reach;
                best = fmin(best, d + sqrt(fmax(0, 1 - v3_dot(n, v3_load(a->normal)))));
            }
            assert_true(best <= tolerance + 1e-6);
        }
        for (uint32_t i = 0; i < t.count; ++i) {
            /* The sky is 8 to 12 away, beyond the longest reach. */
            assert_near(t.items[i].reach, 20 * sqrt(3) / 8, .05);
            const v3 n = v3_load(t.items[i].normal);
            assert_true(v3_dot(n, v3_load(t.items[i].position)) * def.side > 0);
        }
        if (k == 1) assert_true(t.count > 2 * last && t.count < 2 * f.mesh.vertex_count);
        last = t.count;
        fct_anchors_release(&plain, &t);
    }
    fct_surface_release(&plain, &f);
    fct_mesh_release(&plain, &mesh);
    fct_scene_destroy(scene);
    end_sky(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gathers_equal_closed_forms),
        cmocka_unit_test(gradients_equal_integrals),
        cmocka_unit_test(nearest_equal_brute_force),
        cmocka_unit_test(linear_fields_are_reproduced),
        cmocka_unit_test(weights_fall_with_distance_and_turn),
        cmocka_unit_test(fields_are_reproduced),
        cmocka_unit_test(corrections_are_clamped),
        cmocka_unit_test(walls_hide_anchors),
        cmocka_unit_test(groups_respect_the_tolerance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
