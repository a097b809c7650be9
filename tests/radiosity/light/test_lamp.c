/* Direct light of lamps against closed forms and sums over triangles, with shadows and receivers in odd
 * places. */
#include "../place.h"
#include "radiosity/light/lamp.h"
#include "radiosity/light/lamp_cut.h"
#include "radiosity/light/polygon.h"

typedef struct fixture {
    fct_env env;
    fct_scene *scene;
    fct_lamps *lamps;
} fixture;

static fct_env plain; /* outlives every scene */

static fixture begin(void) {
    plain = fct_env_default();
    fixture f = {.env = plain};
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &f.scene), FCT_OK);
    return f;
}

/* A far square with most of the scene's area, so that no emitter is too large for a lamp. */
static void add_ground(fixture *f) {
    uint32_t grey = place_material(f->scene, .5, 0, false);
    place_sheet(&f->env, f->scene, grey, 1, v3_make(-50, -50, -60), v3_make(100, 0, 0), v3_make(0, 100, 0));
}

static void light_up(fixture *f) {
    assert_int_equal(fct_scene_commit(f->scene), FCT_OK);
    assert_int_equal(fct_lamps_create(&plain, f->scene, &f->lamps), FCT_OK);
}

static void end(fixture *f) {
    fct_lamps_destroy(f->lamps);
    fct_scene_destroy(f->scene);
}

static double open_light(const fixture *f, v3 p, v3 n) {
    double point[3] = {p.x, p.y, p.z}, normal[3] = {n.x, n.y, n.z}, e[3];
    fct_lamps_unoccluded(f->lamps, point, normal, e);
    assert_true(e[0] == e[1] && e[1] == e[2] && isfinite(e[0]) && e[0] >= 0);
    return e[0];
}

static double lit(const fixture *f, v3 p, v3 n, double offset, uint64_t seed, uint64_t *rays) {
    double point[3] = {p.x, p.y, p.z}, normal[3] = {n.x, n.y, n.z}, e[3];
    fct_lamps_direct(f->lamps, f->scene, point, normal, offset, seed, 4, NULL, NULL, e, rays);
    assert_true(isfinite(e[0]) && e[0] >= 0);
    return e[0];
}

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance * fabs(expected)))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

static const v3 up = {0, 0, 1}, down = {0, 0, -1};

/* Mean over a k x k grid of the unit square at height 0, facing up. */
static double square_mean(const fixture *f, int k) {
    double sum = 0;
    for (int i = 0; i < k * k; ++i) sum += open_light(f, v3_make((i % k + .5) / k, (i / k + .5) / k, 0), up);
    return sum / (k * k);
}

static void parallel_squares(void **state) {
    (void)state;
    for (uint32_t n = 1; n <= 16; n *= 16) {
        fixture f = begin();
        add_ground(&f);
        place_sheet(&f.env, f.scene, place_material(f.scene, 0, 1, false), n, v3_make(0, 0, 1),
                    v3_make(0, 1, 0), v3_make(1, 0, 0));
        light_up(&f);
        assert_near(square_mean(&f, 40), .199824896, n == 1 ? 2e-4 : 2e-3);
        end(&f);
    }
}

static void perpendicular_squares(void **state) {
    (void)state;
    fixture f = begin();
    add_ground(&f);
    place_sheet(&f.env, f.scene, place_material(f.scene, 0, 1, false), 1, v3_make(0, 0, 0), v3_make(0, 1, 0),
                v3_make(0, 0, 1));
    light_up(&f);
    assert_near(square_mean(&f, 100), .200043776, 2e-3);
    end(&f);
}

static void equal_disks(void **state) {
    (void)state;
    fixture f = begin();
    add_ground(&f);
    fct_mesh disk = make_disk(&f.env, 256, v3_make(0, 0, 1), 1, false);
    place_mesh(f.scene, &disk, place_material(f.scene, 0, 1, false), NULL);
    fct_mesh_release(&f.env, &disk);
    light_up(&f);
    double sum = 0;
    for (int i = 0; i < 200; ++i) sum += open_light(&f, v3_make(sqrt((i + .5) / 200), 0, 0), up) / 200;
    assert_near(sum, .381966011, 2e-3);
    end(&f);
}

static void disk_with_blocker(void **state) {
    (void)state;
    for (int blocked = 0; blocked < 2; ++blocked) {
        fixture f = begin();
        add_ground(&f);
        fct_mesh disk = make_disk(&f.env, 256, v3_make(0, 0, 2), 1, false);
        place_mesh(f.scene, &disk, place_material(f.scene, 0, 1, false), NULL);
        fct_mesh_release(&f.env, &disk);
        disk = make_disk(&f.env, 256, v3_make(0, 0, 1), .3, true);
        if (blocked) place_mesh(f.scene, &disk, place_material(f.scene, 0, 0, false), NULL);
        fct_mesh_release(&f.env, &disk);
        light_up(&f);
        assert_near(open_light(&f, v3_make(0, 0, 0), up), .2, 1e-3);
        double sum = 0, square = 0;
        for (uint64_t seed = 0; seed < 400; ++seed) {
            double point[3] = {0, 0, 0}, normal[3] = {0, 0, 1}, light[3], e;
            double fraction =
                fct_lamps_direct(f.lamps, f.scene, point, normal, 1e-5, seed, 16, NULL, NULL, light, NULL);
            e = light[0];
            assert_near(fraction, e / .2, 1e-3);
            sum += e / 400, square += e * e / 400;
        }
        assert_near(sum, blocked ? .117431 : .2, blocked ? .01 : 1e-3);
        /* 64 independent rays would spread by .104; about half as many are sent. */
        assert_true(square - sum * sum < .05 * .05 * sum * sum);
        end(&f);
    }
}

static void blocked_squares(void **state) {
    (void)state;
    fixture f = begin();
    add_ground(&f);
    uint32_t black = place_material(f.scene, 0, 0, false);
    place_sheet(&f.env, f.scene, place_material(f.scene, 0, 1, false), 1, v3_make(0, 0, 1), v3_make(0, 1, 0),
                v3_make(1, 0, 0));
    place_sheet(&f.env, f.scene, black, 1, v3_make(.25, .25, .5), v3_make(.5, 0, 0), v3_make(0, .5, 0));
    light_up(&f);
    double sum = 0;
    int k = 40;
    for (int i = 0; i < k * k; ++i)
        sum += lit(&f, v3_make((i % k + .5) / k, (i / k + .5) / k, 0), up, 1e-5, (uint64_t)i, NULL);
    assert_near(sum / (k * k), .099506, .01);
    end(&f);
}

/* Sum of Lambert's formula over all triangles. */
static double brute_light(const fct_mesh *mesh, bool two_sided, v3 x, v3 n) {
    double sum = 0;
    for (size_t t = 0; t < mesh->face_count; ++t) {
        v3 p[3];
        for (int k = 0; k < 3; ++k)
            p[k] = v3_sub(v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * t + (size_t)k]), x);
        v3 cross = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
        if (v3_dot(cross, p[0]) < 0 || two_sided) sum += fct_triangle_irradiance(p, n);
    }
    return sum;
}

/* Dense lamps at all distances and angles against the sum over their triangles. The error is relative to the
 * light of a receiver that faces the lamp, because grazing receivers get little. */
static void dense_lamps(void **state) {
    (void)state;
    const double distances[] = {1.3, 1.6, 2.5, 5, 12, 40};
    for (int shape = 0; shape < 3; ++shape) {
        fixture f = begin();
        add_ground(&f);
        fct_mesh mesh = make_bumpy(&f.env, 40, shape ? .15 : 0);
        place_mesh(f.scene, &mesh, place_material(f.scene, 0, 1, shape == 2), NULL);
        light_up(&f);
        double worst = 0;
        for (int i = 0; i < 120; ++i) {
            double u[4];
            fct_plane_point((uint32_t)i, 5, u), fct_plane_point((uint32_t)i, 77, u + 2);
            v3 away = fct_cosine_direction(i & 1 ? up : down, u[0], u[1]);
            v3 x = v3_scale(away, distances[i % 6]), n = fct_cosine_direction(v3_scale(away, -1), u[2], u[3]);
            double facing = brute_light(&mesh, shape == 2, x, v3_scale(away, -1));
            double error =
                fabs(open_light(&f, x, n) - fmin(1, brute_light(&mesh, shape == 2, x, n))) / facing;
            worst = fmax(worst, error);
        }
        if (worst > .006) fail_msg("shape %d is off by %g", shape, worst);
        fct_mesh_release(&f.env, &mesh);
        end(&f);
    }
}

/* One triangle at distances where the far formula begins. */
static void single_triangle(void **state) {
    (void)state;
    fixture f = begin();
    add_ground(&f);
    fct_mesh mesh = make_grid(&plain, 1);
    mesh.face_count = 1;
    place_mesh(f.scene, &mesh, place_material(f.scene, 0, 1, true), NULL);
    mesh.face_count = 2;
    light_up(&f);
    for (int i = 0; i < 64; ++i) {
        double u[2];
        fct_plane_point((uint32_t)i, 3, u);
        v3 away = fct_cosine_direction(up, .1 + .8 * u[0], .1 + .8 * u[1]), x = v3_scale(away, 3 + .1 * i);
        v3 p[3];
        for (int k = 0; k < 3; ++k) p[k] = v3_sub(v3_load(mesh.positions + 3 * (size_t)mesh.triangles[k]), x);
        v3 n = v3_unit(v3_add(v3_scale(away, -1), v3_make(.3, 0, 0)));
        assert_near(open_light(&f, x, n), fct_triangle_irradiance(p, n), 1e-3);
    }
    fct_mesh_release(&plain, &mesh);
    end(&f);
}

/* A lamp under every kind of transform equals a lamp whose mesh is transformed. */
static void transformed_lamps(void **state) {
    (void)state;
    const float transforms[3][12] = {
        {0, -2, 0, 1, 2, 0, 0, 3, 0, 0, 2, 0},   /* turned and scaled */
        {0, 2, 0, 1, 2, 0, 0, 3, 0, 0, 2, 0},    /* mirrored too */
        {-1, 0, 0, 1, 0, 3, .5F, 3, 0, 0, 2, 0}, /* sheared, mirrored */
    };
    for (int i = 0; i < 3; ++i) {
        fixture f = begin();
        add_ground(&f);
        const float *m = transforms[i];
        fct_mesh mesh = make_sphere(&f.env, 20);
        place_mesh(f.scene, &mesh, place_material(f.scene, 0, 1, false), m);
        light_up(&f);
        for (size_t v = 0; v < mesh.vertex_count; ++v) {
            float *p = mesh.positions + 3 * v, w[3];
            for (int k = 0; k < 3; ++k)
                w[k] = m[4 * k] * p[0] + m[4 * k + 1] * p[1] + m[4 * k + 2] * p[2] + m[4 * k + 3];
            memcpy(p, w, sizeof w);
        }
        for (size_t t = 0; t < mesh.face_count && i > 0; ++t) {
            uint32_t *c = mesh.triangles + 3 * t, swap = c[1];
            c[1] = c[2], c[2] = swap;
        }
        for (int k = 0; k < 20; ++k) {
            v3 x = v3_make(8 * cos(k), 8 * sin(k), k - 10), n = v3_unit(v3_sub(v3_make(1, 3, 0), x));
            double expected = brute_light(&mesh, false, x, n);
            assert_near(open_light(&f, x, n), expected, .01);
            assert_near(lit(&f, x, n, 1e-5, (uint64_t)k, NULL), expected, .05);
        }
        fct_mesh_release(&f.env, &mesh);
        end(&f);
    }
}

/* A lamp 0.1 mm below a ceiling, facing down or facing the ceiling. */
static void lamp_close_to_a_wall(void **state) {
    (void)state;
    for (int facing = 0; facing < 2; ++facing) {
        fixture f = begin();
        uint32_t grey = place_material(f.scene, .5, 0, false), glow = place_material(f.scene, 0, 1, false);
        place_sheet(&f.env, f.scene, grey, 1, v3_make(-5, -5, 3), v3_make(0, 10, 0), v3_make(10, 0, 0));
        v3 u = v3_make(1, 0, 0), v = v3_make(0, 1, 0);
        place_sheet(&f.env, f.scene, glow, 4, v3_make(0, 0, 2.9999), facing ? u : v, facing ? v : u);
        place_sheet(&f.env, f.scene, grey, 1, v3_make(-5, -5, 0), v3_make(10, 0, 0), v3_make(0, 10, 0));
        light_up(&f);
        for (int i = 0; i < 200; ++i) {
            v3 x = v3_make(-1 + 3 * fct_uniform(fct_hash2(1, (uint64_t)i)),
                           -1 + 3 * fct_uniform(fct_hash2(2, (uint64_t)i)), 3);
            double e = lit(&f, x, down, 2e-5, (uint64_t)i, NULL);
            bool inside = x.x > .01 && x.x < .99 && x.y > .01 && x.y < .99;
            bool outside = x.x < -.01 || x.x > 1.01 || x.y < -.01 || x.y > 1.01;
            if (!facing) assert_true(e == 0);
            if (facing && inside) assert_near(e, 1, .01);
            if (facing && outside) assert_true(e < 1e-3);
            v3 floor = v3_make(x.x, x.y, 0);
            if (!facing) assert_near(lit(&f, floor, up, 1e-5, 3, NULL), open_light(&f, floor, up), 1e-9);
            if (facing) assert_true(lit(&f, floor, up, 1e-5, 3, NULL) == 0);
        }
        end(&f);
    }
}

/* Receivers on a convex lamp get no light from it, even with smooth normals. */
static void receiver_on_the_lamp(void **state) {
    (void)state;
    fixture f = begin();
    add_ground(&f);
    fct_mesh mesh = make_sphere(&f.env, 12);
    float away[12] = {1, 0, 0, 7, 0, 1, 0, 3, 0, 0, 1, 2};
    place_mesh(f.scene, &mesh, place_material(f.scene, 0, 1, false), away);
    light_up(&f);
    for (size_t v = 0; v < mesh.vertex_count; ++v) {
        v3 n = v3_load(mesh.positions + 3 * v);
        float rounded[3];
        v3_store(rounded, v3_add(n, v3_make(7, 3, 2)));
        assert_true(open_light(&f, v3_load(rounded), n) < 1e-5);
    }
    fct_mesh_release(&f.env, &mesh);
    end(&f);
}

/* A row of coloured minor lamps; a wall hides the brighter half and all blue ones. They share rays, and the
 * mean is the light of the open ones. */
static void many_lamps_share_rays(void **state) {
    (void)state;
    fixture f = begin();
    add_ground(&f);
    uint32_t glow[4], red;
    fct_material strong = {.emission = {36, 0, 0}};
    assert_int_equal(fct_scene_add_material(f.scene, &strong, &red), FCT_OK);
    for (int k = 0; k < 4; ++k) {
        fct_material m = {.emission = {k < 2 ? 1 : 3, k == 1 ? 1 : k == 3 ? 3 : 0, k < 2 ? 0 : .5F}};
        assert_int_equal(fct_scene_add_material(f.scene, &m, glow + k), FCT_OK);
    }
    for (int i = 0; i < 300; ++i)
        place_sheet(&f.env, f.scene, glow[(i & 1) + (i < 150 ? 0 : 2)], 1, v3_make(.02 * (i - 150), -.05, 5),
                    v3_make(0, .1, 0), v3_make(.015, 0, 0));
    place_sheet(&f.env, f.scene, red, 1, v3_make(-1, .1, 5), v3_make(0, .1, 0), v3_make(.015, 0, 0));
    place_sheet(&f.env, f.scene, place_material(f.scene, 0, 0, false), 1, v3_make(.36, -20, 1),
                v3_make(400, 0, 0), v3_make(0, 40, 0));
    light_up(&f);
    assert_int_equal(fct_lamps_count(f.lamps), 301);
    double expected[3] = {0, 0, 0}, sum[3] = {0, 0, 0}, point[3] = {.45, 0, 0}, normal[3] = {0, 0, 1};
    for (int i = 0; i < 150; ++i) {
        double x = .02 * (i - 150) + .0075 - point[0];
        double e = .0015 * 25 / (FCT_PI * (x * x + 25) * (x * x + 25));
        expected[0] += e, expected[1] += i & 1 ? e : 0;
    }
    double x = -1 + .0075 - point[0], r2 = x * x + .15 * .15 + 25;
    expected[0] += 36 * .0015 * 25 / (FCT_PI * r2 * r2);
    uint64_t rays = 0;
    for (uint64_t seed = 0; seed < 300; ++seed) {
        double e[3];
        fct_lamps_direct(f.lamps, f.scene, point, normal, 1e-5, seed, 16, NULL, NULL, e, &rays);
        for (int k = 0; k < 3; ++k) sum[k] += e[k] / 300;
    }
    assert_near(sum[0], expected[0], .02);
    assert_near(sum[1], expected[1], .03);
    assert_true(sum[2] == 0);
    assert_true(rays / 300 < 80);
    end(&f);
}

static void sides_and_large_emitters(void **state) {
    (void)state;
    for (int two = 0; two < 2; ++two) {
        fixture f = begin();
        uint32_t glow = place_material(f.scene, 0, 1, two), dark = place_material(f.scene, .5, 0, false);
        place_sheet(&f.env, f.scene, glow, 2, v3_make(0, 0, 1), v3_make(1, 0, 0), v3_make(0, 1, 0));
        fct_mesh ball = make_sphere(&f.env, 8);
        const float large[12] = {5, 0, 0, 0, 0, 5, 0, 0, 0, 0, 5, 20};
        place_mesh(f.scene, &ball, glow, large);
        fct_mesh_release(&f.env, &ball);
        place_sheet(&f.env, f.scene, dark, 1, v3_make(-5, -5, 0), v3_make(10, 0, 0), v3_make(0, 10, 0));
        light_up(&f);
        assert_true(fct_lamps_sampled(f.lamps, 0));
        assert_false(fct_lamps_sampled(f.lamps, 1));
        assert_false(fct_lamps_sampled(f.lamps, 2));
        assert_false(fct_lamps_sampled(f.lamps, 3));
        double below = open_light(&f, v3_make(.5, .5, 0), up),
               above = open_light(&f, v3_make(.5, .5, 2), down);
        assert_near(above, .2394, .01);
        if (two)
            assert_near(below, above, 1e-6);
        else
            assert_true(below == 0);
        end(&f);
    }
}

static void large_flat_emitters_are_lamps(void **state) {
    (void)state;
    fixture f = begin();
    uint32_t glow = place_material(f.scene, 0, 1, false), dark = place_material(f.scene, .5, 0, false);
    place_sheet(&f.env, f.scene, glow, 1, v3_make(-5, -5, 9), v3_make(0, 10, 0), v3_make(10, 0, 0));
    place_sheet(&f.env, f.scene, dark, 1, v3_make(-5, -5, 0), v3_make(10, 0, 0), v3_make(0, 10, 0));
    light_up(&f);
    assert_true(fct_lamps_sampled(f.lamps, 0));
    assert_false(fct_lamps_sampled(f.lamps, 1));
    end(&f);
}

static void equal_seeds_equal_light(void **state) {
    (void)state;
    fixture f = begin();
    add_ground(&f);
    place_sheet(&f.env, f.scene, place_material(f.scene, 0, 1, false), 3, v3_make(0, 0, 1), v3_make(0, 1, 0),
                v3_make(1, 0, 0));
    place_sheet(&f.env, f.scene, place_material(f.scene, 0, 0, false), 1, v3_make(.3, .3, .5),
                v3_make(1, 0, 0), v3_make(0, 1, 0));
    light_up(&f);
    uint64_t rays = 0, again = 0;
    int different = 0;
    for (uint64_t seed = 0; seed < 20; ++seed) {
        double a = lit(&f, v3_make(.1, .2, 0), up, 1e-5, seed, &rays);
        double b = lit(&f, v3_make(.1, .2, 0), up, 1e-5, seed, &again);
        assert_true(a == b);
        different += a != lit(&f, v3_make(.1, .2, 0), up, 1e-5, seed + 1, NULL);
    }
    assert_true(rays == again && rays >= 80 && different > 10);
    end(&f);
}

/* The mean weight of the points that (u, v) choose is the cut's light, near and far and across the horizon.
 * The estimate is about the light or more. */
static void points_have_the_light_as_mean(void **state) {
    (void)state;
    for (int shape = 0; shape < 3; ++shape) {
        fixture f = begin();
        fct_mesh mesh = shape ? make_bumpy(&f.env, 12, .15) : make_grid(&f.env, 1);
        const float moved[12] = {2, 0, 0, 1, 0, 0, -2, 2, 0, 2, 0, 3};
        place_mesh(f.scene, &mesh, place_material(f.scene, 0, 1, shape == 2), moved);
        assert_int_equal(fct_scene_commit(f.scene), FCT_OK);
        fct_scene_view view = fct_scene_get(f.scene);
        fct_lamp lamp;
        assert_int_equal(fct_lamp_init(&f.env, &view, 0, &lamp), FCT_OK);
        static fct_cut cut;
        for (uint64_t i = 0; i < 30; ++i) {
            v3 away = v3_unit(v3_make(fct_uniform(fct_hash2(1, i)) - .5, fct_uniform(fct_hash2(2, i)) - .5,
                                      fct_uniform(fct_hash2(3, i)) - .5));
            v3 x = v3_mad(v3_make(1, 2, 3), 3 + 5 * (double)(i % 4), away);
            v3 n = v3_unit(v3_sub(v3_scale(v3_make(fct_uniform(fct_hash2(4, i)), 0, .3), .7), away));
            fct_receiver rec =
                fct_lamp_receiver(&lamp, (double[3]){x.x, x.y, x.z}, (double[3]){n.x, n.y, n.z});
            fct_lamp_cut(&lamp, &rec, &cut);
            double mean = 0, square = 0;
            enum { N = 4096 };
            for (uint32_t k = 0; k < N; ++k) {
                double u[2];
                fct_plane_point(k, 11, u);
                fct_lamp_point y = fct_cut_point(&lamp, &rec, &cut, u[0], u[1]);
                mean += y.weight / N, square += y.weight * y.weight / N;
            }
            if (cut.light < 1e-3) continue;
            double error = sqrt(fmax(square - mean * mean, 0) / N);
            if (fabs(mean - cut.light) > .01 * cut.light + 4 * error)
                fail_msg("shape %d, receiver %d: points %g, light %g", shape, (int)i, mean, cut.light);
            /* drawn in proportion to the light, roughly: the spread of one point stays below its mean */
            assert_true(square - mean * mean < mean * mean);
            double estimate = fct_lamp_estimate(&lamp, &rec);
            /* both sides of a two-sided body send light, and the estimate sees its outline */
            assert_true(estimate > (shape == 2 ? .5 : .8) * cut.light && estimate < 4 * cut.light + .02);
        }
        fct_lamp_release(&f.env, &lamp);
        fct_mesh_release(&f.env, &mesh);
        fct_scene_destroy(f.scene);
    }
}

/* The mean visible fraction does not depend on the number of rays. FCT_LAMPS_FIXED sends exactly that number.
 */
static void fractions_are_unbiased(void **state) {
    (void)state;
    fixture f = begin();
    add_ground(&f);
    place_sheet(&f.env, f.scene, place_material(f.scene, 0, 1, false), 1, v3_make(-.5, -.5, 4),
                v3_make(0, 1, 0), v3_make(1, 0, 0));
    /* hides x < -.2, which is .3 of the lamp */
    place_sheet(&f.env, f.scene, place_material(f.scene, 0, 0, false), 1, v3_make(-10.1, -5, 2),
                v3_make(10, 0, 0), v3_make(0, 10, 0));
    light_up(&f);
    for (uint32_t base = 2; base <= 16; base *= 2) {
        double sum = 0, point[3] = {0, 0, 0}, normal[3] = {0, 0, 1};
        uint64_t rays = 0;
        enum { N = 600 };
        for (uint64_t seed = 0; seed < N; ++seed) {
            double e[3];
            sum += fct_lamps_direct(f.lamps, f.scene, point, normal, 1e-5, seed, base | FCT_LAMPS_FIXED, NULL,
                                    NULL, e, &rays) /
                   N;
        }
        assert_int_equal(rays, N * base);
        assert_near(sum, .7, .02);
    }
    end(&f);
}

/* Points of a lamp below the horizon have no weight. Two such points must not lose the light of the rest:
 * here a fifth of the lamp is above the horizon of a receiver that sees it on edge. */
static void points_below_the_horizon_lose_no_light(void **state) {
    (void)state;
    fixture f = begin();
    add_ground(&f);
    place_sheet(&f.env, f.scene, place_material(f.scene, 0, 1, false), 1, v3_make(1, -.5, -.8),
                v3_make(0, 0, 1), v3_make(0, 1, 0));
    light_up(&f);
    const double point[3] = {0, 0, 0}, normal[3] = {0, 0, 1};
    const double open = open_light(&f, v3_make(0, 0, 0), up);
    assert_true(open > 0);
    for (uint32_t base = 1; base <= 4; base *= 2)
        for (uint64_t seed = 0; seed < 200; ++seed) {
            double e[3];
            fct_lamps_direct(f.lamps, f.scene, point, normal, 1e-5, seed, base | FCT_LAMPS_FIXED, NULL, NULL,
                             e, NULL);
            assert_near(e[0], open, 1e-9);
        }
    end(&f);
}

/* Each allocation in turn fails; nothing leaks. */
static void memory_runs_out(void **state) {
    (void)state;
    fixture f = begin();
    add_ground(&f);
    fct_mesh mesh = make_sphere(&f.env, 6);
    float squeezed[12] = {1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 3, 0};
    uint32_t glow = place_material(f.scene, 0, 1, false);
    place_mesh(f.scene, &mesh, glow, NULL);
    place_mesh(f.scene, &mesh, glow, squeezed);
    fct_mesh_release(&f.env, &mesh);
    assert_int_equal(fct_scene_commit(f.scene), FCT_OK);
    fct_result result = FCT_ERROR_MEMORY;
    long n = 1;
    for (; result != FCT_OK; ++n) {
        recorder r = {.fail_at = n};
        fct_env env = recorder_env(&r);
        fct_lamps *lamps;
        result = fct_lamps_create(&env, f.scene, &lamps);
        assert_true(result == FCT_OK || (result == FCT_ERROR_MEMORY && !lamps && r.messages));
        fct_lamps_destroy(lamps);
        assert_int_equal(r.alive, 0);
    }
    assert_true(n > 8);
    fct_scene_destroy(f.scene);
}

/* Center, area and mean squared distance of lamps with any number of roots, against sums over their faces. */
static void measures_are_those_of_all_roots(void **state) {
    (void)state;
    for (uint32_t roots = 1; roots <= 64; roots *= 4) {
        fixture f = begin();
        fct_mesh mesh = make_sphere(&plain, 12);
        fct_tree_def def = fct_tree_def_default();
        fct_tree *tree;
        fct_lamp lamp;
        def.root_count = roots;
        for (uint32_t v = 0; v < mesh.vertex_count; ++v) /* an egg */
            mesh.positions[3 * (size_t)v + 2] *= 2 + .5f * mesh.positions[3 * (size_t)v];
        assert_int_equal(fct_tree_build(&plain, &mesh, &def, NULL, &tree), FCT_OK);
        uint32_t light = place_material(f.scene, 0, 1, false);
        assert_int_equal(fct_scene_add_object(f.scene, "egg", NULL, tree, NULL, light, NULL), FCT_OK);
        add_ground(&f);
        assert_int_equal(fct_scene_commit(f.scene), FCT_OK);
        fct_scene_view view = fct_scene_get(f.scene);
        assert_int_equal(fct_lamp_init(&plain, &view, 0, &lamp), FCT_OK);
        assert_int_equal(fct_tree_get(lamp.tree).root_count, roots);
        double area = 0, squares = 0, farthest = 0;
        v3 center = {0, 0, 0};
        for (int pass = 0; pass < 2; ++pass)
            for (uint32_t face = 0; face < mesh.face_count; ++face) {
                v3 p[3];
                for (size_t k = 0; k < 3; ++k)
                    p[k] = v3_load(mesh.positions + 3 * (size_t)mesh.triangles[3 * (size_t)face + k]);
                v3 g = v3_scale(v3_add(p[0], v3_add(p[1], p[2])), 1. / 3);
                double own = .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
                if (pass == 0) {
                    area += own, center = v3_mad(center, own, g);
                    continue;
                }
                v3 middle = v3_scale(center, 1 / area);
                squares += own / area * v3_norm2(v3_sub(g, middle));
                for (int k = 0; k < 3; ++k) {
                    squares += own / area / 12 * v3_norm2(v3_sub(p[k], g));
                    farthest = fmax(farthest, v3_norm(v3_sub(p[k], middle)));
                }
            }
        assert_near(lamp.area, area, 1e-6);
        assert_true(v3_norm(v3_sub(lamp.center, v3_scale(center, 1 / area))) < 1e-5);
        assert_true(lamp.radius > farthest * (1 - 1e-6) && lamp.radius < 2 * farthest);
        assert_true(lamp.rms2 > .8 * squares && lamp.rms2 < 1.5 * squares);
        fct_lamp_release(&plain, &lamp);
        fct_mesh_release(&plain, &mesh);
        fct_scene_destroy(f.scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(measures_are_those_of_all_roots),
        cmocka_unit_test(parallel_squares),
        cmocka_unit_test(perpendicular_squares),
        cmocka_unit_test(equal_disks),
        cmocka_unit_test(disk_with_blocker),
        cmocka_unit_test(blocked_squares),
        cmocka_unit_test(dense_lamps),
        cmocka_unit_test(transformed_lamps),
        cmocka_unit_test(lamp_close_to_a_wall),
        cmocka_unit_test(receiver_on_the_lamp),
        cmocka_unit_test(many_lamps_share_rays),
        cmocka_unit_test(sides_and_large_emitters),
        cmocka_unit_test(large_flat_emitters_are_lamps),
        cmocka_unit_test(equal_seeds_equal_light),
        cmocka_unit_test(single_triangle),
        cmocka_unit_test(points_have_the_light_as_mean),
        cmocka_unit_test(fractions_are_unbiased),
        cmocka_unit_test(points_below_the_horizon_lose_no_light),
        cmocka_unit_test(memory_runs_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
