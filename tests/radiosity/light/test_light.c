/* Direct light of halls with lamps of all kinds against a plain evaluation: the rays of one receiver, with
 * visibility by brute force. */
#include "../place.h"
#include "../soup.h"
#include "cluster/tree/node.h"
#include "radiosity/light/lamp.h"
#include "radiosity/light/lamp_cut.h"
#include "radiosity/light/polygon.h"
#include "scene/transform.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

/* A number in [0, 1). */
static double pick(uint64_t a, uint64_t b, uint64_t c) {
    return fct_uniform(fct_hash3(a, b, c));
}

static const float turned[12] = {0, -2, 0, 1, 2, 0, 0, 2, 0, 0, 2, 3};
static const float mirrored[12] = {-1.5F, 0, 0, 1, 0, 1.5F, 0, 2, 0, 0, 1.5F, 3};
static const float sheared[12] = {1, .5F, 0, 1, 0, 2, 0, 2, .3F, .25F, 1.5F, 3};
static const float sheared_mirrored[12] = {-1, .5F, 0, 1, 0, 2, 0, 2, .3F, .25F, 1.5F, 3};

/* A hall with lamps of all kinds, one of them too large, and walls. */
typedef struct hall {
    fct_scene *scene;
    fct_lamps *lamps;
    soup triangles;
    fct_lamp own[64];
    uint32_t count;
} hall;

static hall make_hall(uint64_t seed) {
    static const float *const transforms[4] = {turned, mirrored, sheared, sheared_mirrored};
    hall h = {.count = 0};
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &h.scene), FCT_OK);
    uint32_t grey = place_material(h.scene, .5, 0, false);
    place_sheet(&plain, h.scene, grey, 1, v3_make(-9, -9, -3), v3_make(18, 0, 0), v3_make(0, 18, 0));
    for (uint64_t k = 0; k < 8; ++k)
        place_sheet(&plain, h.scene, grey, 1,
                    v3_make(8 * pick(seed, k, 0) - 4, 8 * pick(seed, k, 1) - 4, 2 * pick(seed, k, 2) - 1),
                    v3_make(1, 0, pick(seed, k, 3)), v3_make(0, 1, pick(seed, k, 4)));
    fct_mesh ball = make_bumpy(&plain, 4, .2);
    for (uint64_t k = 0; k < 38; ++k) {
        double e = k % 5 ? .05 : 2;
        fct_material m = {.two_sided = k % 4 == 1};
        /* few lamps send the channel seed % 3, so that some receivers send no ray to any of them */
        for (uint64_t c = 0; c < 3; ++c)
            m.emission[c] = c == seed % 3 && k % 9 != 7 ? 0 : (float)(e * pick(seed, k, 5 + c));
        uint32_t id;
        float place[12];
        assert_int_equal(fct_scene_add_material(h.scene, &m, &id), FCT_OK);
        memcpy(place, transforms[k % 4], sizeof place);
        for (size_t i = 0; i < 12; ++i)
            place[i] = i % 4 == 3 ? (float)(10 * pick(seed, k, 20 + i) - 5) : .1F * place[i];
        place[11] = (float)(3 + pick(seed, k, 8));
        if (k % 2)
            place_mesh(h.scene, &ball, id, place);
        else
            place_sheet(&plain, h.scene, id, 1, v3_make(place[3], place[7], place[11]), v3_make(.2, .5, .1),
                        v3_make(.6, .1, 0));
    }
    if (seed % 2) {
        const float even[12] = {4, 0, 0, 0, 0, 4, 0, 0, 0, 0, 4, 9};
        const float bent[12] = {4.5F, 1, 0, 0, 0, 3.5F, 0, 0, 0, 0, 4, 9};
        place_mesh(h.scene, &ball, place_material(h.scene, 0, 1, false), seed % 4 == 1 ? even : bent);
    }
    fct_mesh_release(&plain, &ball);
    assert_int_equal(fct_scene_commit(h.scene), FCT_OK);
    assert_int_equal(fct_lamps_create(&plain, h.scene, &h.lamps), FCT_OK);
    h.triangles = list_triangles(h.scene);
    fct_scene_view view = fct_scene_get(h.scene);
    double total = 0, areas[64];
    v3 vectors[64];
    size_t t = 0;
    for (uint32_t i = 0; i < view.instance_count; ++i) {
        uint32_t faces = fct_tree_get(view.models[view.instances[i].model].tree).face_count;
        areas[i] = 0, vectors[i] = v3_make(0, 0, 0);
        for (uint32_t f = 0; f < faces; ++f, ++t) {
            const v3 *p = h.triangles.corners + 3 * t;
            v3 s = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), .5);
            areas[i] += v3_norm(s), vectors[i] = v3_add(vectors[i], s);
        }
        total += areas[i];
    }
    for (uint32_t i = 0; i < view.instance_count; ++i) {
        const float *e = view.materials[view.instances[i].material].emission;
        bool bent = v3_norm(vectors[i])<.9 * areas[i], sampled = e[0] + e[1] + e[2]> 0 &&
                    !(bent && areas[i] > total / 4);
        assert_int_equal(fct_lamps_sampled(h.lamps, i), sampled);
        if (bent && e[0] + e[1] + e[2] > 0 && !sampled) assert_in_range(100 * areas[i] / total, 26, 48);
        if (sampled) assert_int_equal(fct_lamp_init(&plain, &view, i, &h.own[h.count++]), FCT_OK);
    }
    assert_int_equal(fct_lamps_count(h.lamps), h.count);
    if (seed % 2) assert_false(fct_lamps_sampled(h.lamps, view.instance_count - 1));
    return h;
}

/* One receiver. */
typedef struct eye {
    const hall *h;
    v3 origin;
    uint64_t seed, rays;
    double other, slack;     /* of the goal */
    uint32_t doubt, counted; /* rays to lamps outside these slots do not count */
    fct_sight sight;
    double variance; /* of the light */
} eye;

/* Adds the variance of light whose visible fraction has `square` f (1 - f), with one more ray that is half
 * visible. */
static void add_variance(eye *q, double power, double visible, uint32_t sent, double square) {
    const double f = (visible * sent + .5) / (sent + 1);
    q->variance += power * power * square * f * (1 - f);
}

/* Rays for a standard error of 2 % / base * slack of the light from a lamp of this share: .6 sqrt(f (1 -
 * f)) / n^(3/4) with one more ray that is half visible, in steps of 4 up to 64. */
static uint32_t count_rays(const eye *q, uint32_t base, double visible, uint32_t sent, double share) {
    const double f = (visible * sent + .5) / (sent + 1), error = .6 * sqrt(f * (1 - f)) * share;
    uint32_t n = 4;
    while (n < 64 && error / pow(n, .75) > .02 / base * q->slack) n += 4;
    return n;
}

/* known: an earlier call has sent this ray. */
static bool sees(eye *q, const fct_lamp *lamp, uint32_t slot, bool known, v3 y) {
    const double *m = lamp->to_world;
    v3 w = v3_make(m[0] * y.x + m[1] * y.y + m[2] * y.z + m[3], m[4] * y.x + m[5] * y.y + m[6] * y.z + m[7],
                   m[8] * y.x + m[9] * y.y + m[10] * y.z + m[11]);
    const double c[6] = {w.x, w.y, w.z, q->origin.x, q->origin.y, q->origin.z};
    double largest = 0;
    for (int k = 0; k < 6; ++k) largest = fmax(largest, fabs(c[k]));
    v3 d = v3_sub(w, q->origin);
    q->rays += !known && q->counted >> slot & 1;
    bool free =
        is_free(&q->h->triangles, q->origin, v3_mad(q->origin, 1 - 1e-4 - 1e-6 * largest / v3_norm(d), d));
    *(free ? &q->sight.open : &q->sight.blocked) |= 1u << slot;
    return free;
}

/* Visible fraction of a lamp that brings `power`; total, scale: of all lamps. */
static double see_lamp(eye *q, const fct_lamp *lamp, const fct_receiver *rec, const fct_cut *cut,
                       uint32_t base, bool fixed, double power, double total, double scale) {
    double all = 0, seen = 0;
    uint32_t sent = 0, goal = !fixed && power > .2 * total ? 2 * base : base;
    const uint32_t slot = (uint32_t)(lamp - q->h->own) % 31,
                   doubted = count_rays(q, base, .5, 1, power / scale);
    const uint32_t known = q->doubt >> slot & 1 ? goal : 0;
    if (q->doubt >> slot & 1 && goal < 32) goal = doubted > 32 ? 32 : doubted > goal ? doubted : goal;
    while (sent < goal) {
        for (; sent < goal; ++sent) {
            double u[2];
            fct_plane_point(sent, fct_hash2(q->seed, lamp->instance), u);
            fct_lamp_point p = fct_cut_point(lamp, rec, cut, u[0], u[1]);
            if (p.weight > 0) all += p.weight, seen += sees(q, lamp, slot, sent < known, p.y) ? p.weight : 0;
        }
        if (fixed && all == 0 && sent < 64) {
            goal += base;
            continue;
        }
        if (fixed || (all > 0 && (seen == 0 || seen == all))) break;
        goal = count_rays(q, base, all > 0 ? seen / all : .5, sent, all > 0 ? power / scale : 1);
    }
    if (seen > 0 && seen < all) add_variance(q, power, seen / all, sent, .36 / pow(sent, 1.5));
    return all > 0 ? seen / all : 0;
}

/* Rays to the minor lamps, spread over the sum of their estimates. */
static bool see_minor_lamps(eye *q, const fct_receiver *recs, const double *shares, const bool *minor,
                            double sum, uint32_t count, bool known, double all[3], double seen[3]) {
    static fct_cut cut;
    uint64_t seed = fct_hash2(q->seed, FCT_NONE);
    double below = 0, next = fct_uniform(fct_hash2(seed, count)) * sum / count;
    uint32_t number = 0;
    bool hit = false, miss = false;
    for (int c = 0; c < 3; ++c) all[c] = seen[c] = 0;
    for (uint32_t i = 0; i < q->h->count; ++i) {
        const fct_lamp *lamp = &q->h->own[i];
        if (!minor[i]) continue;
        fct_lamp_cut(lamp, &recs[i], &cut);
        for (below += shares[i]; next < below; next += sum / count) {
            double u[2];
            fct_plane_point(number++, seed, u);
            fct_lamp_point p = fct_cut_point(lamp, &recs[i], &cut, u[0], u[1]);
            if (p.weight <= 0) continue;
            bool free = sees(q, lamp, 31, known, p.y);
            *(free ? &miss : &hit) = true;
            for (int c = 0; c < 3; ++c) {
                all[c] += p.weight * lamp->emission[c] / shares[i];
                if (free) seen[c] += p.weight * lamp->emission[c] / shares[i];
            }
        }
    }
    return hit && miss;
}

/* Returns the light without blockers, summed over channels. */
static double light_hall(eye *q, const double point[3], const double normal[3], uint32_t base, bool fixed,
                         double e[3]) {
    static fct_cut cut;
    const hall *h = q->h;
    fct_receiver recs[64];
    double shares[64], total = q->other, open = 0, minor_sum = 0, light[3] = {0, 0, 0};
    bool minor[64] = {false};
    e[0] = e[1] = e[2] = q->variance = 0;
    for (uint32_t i = 0; i < h->count; ++i) {
        recs[i] = fct_lamp_receiver(&h->own[i], point, normal);
        total += shares[i] = fct_lamp_estimate(&h->own[i], &recs[i]) * h->own[i].strength;
    }
    double scale = total;
    for (uint32_t i = 0; i < h->count; ++i) {
        const fct_lamp *lamp = &h->own[i];
        if (shares[i] == 0) continue;
        minor[i] = shares[i] <= .025 * total;
        minor_sum += minor[i] ? shares[i] : 0;
        fct_lamp_cut(lamp, &recs[i], &cut);
        double own = fmin(cut.light, 1), seen = 1;
        scale += own * lamp->strength - shares[i], open += own * lamp->strength;
        if (base && !minor[i] && own > 0)
            seen = see_lamp(q, lamp, &recs[i], &cut, base, fixed, own * lamp->strength, total, scale);
        for (int c = 0; c < 3; ++c) *(minor[i] && base ? &light[c] : &e[c]) += own * seen * lamp->emission[c];
    }
    if (light[0] + light[1] + light[2] > 0) {
        double all[3], seen[3];
        /* Enough for an error of 2 % / base * slack of the light if each ray has a standard error of 1/2; 4
         * to 16.
         */
        const uint32_t enough =
            (uint32_t)fmin(fmax(pow(.5 * minor_sum / scale / .02 * base / q->slack, 2), 4), 16);
        const bool doubt = q->doubt >> 31 && base < enough && !fixed;
        bool mixed = see_minor_lamps(q, recs, shares, minor, minor_sum, base, q->doubt >> 31, all, seen);
        uint32_t sent = base;
        if ((mixed || doubt || all[0] + all[1] + all[2] == 0) && base < enough && !fixed)
            see_minor_lamps(q, recs, shares, minor, minor_sum, sent = enough, false, all, seen);
        double grey = all[0] + all[1] + all[2];
        grey = grey > 0 ? (seen[0] + seen[1] + seen[2]) / grey : 1;
        for (int c = 0; c < 3; ++c) e[c] += light[c] * (all[c] > 0 ? seen[c] / all[c] : grey);
        if (grey > 0 && grey < 1) add_variance(q, light[0] + light[1] + light[2], grey, sent, 1. / sent);
    }
    return open;
}

static void halls_are_lit_by_the_rules(void **state) {
    (void)state;
    uint32_t partly = 0, minors = 0, doubts = 0;
    for (uint64_t seed = 0; seed < 6; ++seed) {
        hall h = make_hall(seed);
        for (uint64_t i = 0; i < 60; ++i) {
            static const uint32_t bases[6] = {4, 0, 1, 16, 9, 2};
            const uint32_t base = bases[i % 6];
            v3 n = v3_unit(
                v3_make(pick(seed, i, 40) - .5, pick(seed, i, 41) - .5, i % 4 ? 1 : pick(seed, i, 42) - .5));
            const double point[3] = {8 * pick(seed, i, 43) - 4, 8 * pick(seed, i, 44) - 4,
                                     3 * pick(seed, i, 45) - 2},
                         normal[3] = {n.x, n.y, n.z}, offset = .1 * pick(seed, i, 46);
            bool fixed = base && i / 6 % 2 == 0;
            double e[3], expected[3], open[3], expected_open[3];
            uint64_t rays = 3;
            fct_sight sight;
            eye q = {.h = &h, .seed = i, .rays = 3, .slack = 1, .counted = UINT32_MAX};
            if (i % 4) q.other = .1 * pick(seed, i, 47), q.slack = 1 + 3 * pick(seed, i, 48);
            fct_lamp_goal goal = {.other = q.other, .slack = q.slack};
            q.origin = v3_mad(v3_make(point[0], point[1], point[2]), offset, n);
            double all = light_hall(&q, point, normal, base, fixed, expected);
            double fraction = fct_lamps_direct(h.lamps, h.scene, point, normal, offset, i,
                                               base | (fixed ? FCT_LAMPS_FIXED : 0), i % 4 ? &goal : NULL,
                                               &sight, e, &rays);
            /* Some of the lamps whose rays agree are in doubt: the light is that of a call that knew it. */
            const uint32_t agree = (sight.open | sight.blocked) & ~fct_sight_mixed(sight);
            const uint32_t doubt = i % 5 < 3 && !fixed ? agree & (uint32_t)fct_hash2(seed, i) : 0;
            if (doubt) {
                ++doubts;
                goal.doubt = q.doubt = q.counted = doubt;
                all = light_hall(&q, point, normal, base, fixed, expected);
                fraction = fct_lamps_direct(h.lamps, h.scene, point, normal, offset, i, base, &goal, &sight,
                                            e, &rays);
            }
            assert_int_equal(rays, q.rays);
            assert_int_equal(sight.open, q.sight.open), assert_int_equal(sight.blocked, q.sight.blocked);
            assert_near((double)sight.variance, q.variance, 1e-12 + 1e-5 * q.variance);
            partly += (sight.open & sight.blocked) != 0, minors += (sight.open & sight.blocked) >> 31;
            for (int c = 0; c < 3; ++c) assert_near(e[c], expected[c], 1e-9 + 1e-6 * expected[c]);
            assert_near(fraction, all > 0 ? (e[0] + e[1] + e[2]) / all : 0, 1e-6);
            fct_lamps_unoccluded(h.lamps, point, normal, open);
            q.other = 0;
            light_hall(&q, point, normal, 0, false, expected_open);
            for (int c = 0; c < 3; ++c)
                assert_near(open[c], expected_open[c], 1e-9 + 1e-6 * expected_open[c]);
        }
        for (uint32_t k = 0; k < h.count; ++k) fct_lamp_release(&plain, &h.own[k]);
        free(h.triangles.corners);
        fct_lamps_destroy(h.lamps);
        fct_scene_destroy(h.scene);
    }
    assert_in_range(partly, 20, 340), assert_in_range(minors, 5, 340), assert_in_range(doubts, 40, 340);
}

/* Between a lamp and a wall just behind it nothing blocks; a sheet before the lamp by more than 1e-4 of the
 * way does. */
static void rays_end_before_the_lamp(void **state) {
    (void)state;
    for (int k = 0; k < 4; ++k) {
        static const double heights[4] = {1 + 1e-3, 1 - 5e-5, 1 - 4e-4, .5};
        fct_scene *scene;
        fct_lamps *lamps;
        plain = fct_env_default();
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        uint32_t grey = place_material(scene, .5, 0, false);
        place_sheet(&plain, scene, place_material(scene, 0, 1, false), 1, v3_make(-.05, -.05, 1),
                    v3_make(0, .1, 0), v3_make(.1, 0, 0));
        place_sheet(&plain, scene, grey, 1, v3_make(-5, -5, heights[k]), v3_make(10, 0, 0),
                    v3_make(0, 10, 0));
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        assert_int_equal(fct_lamps_create(&plain, scene, &lamps), FCT_OK);
        const double point[3] = {0, 0, 0}, normal[3] = {0, 0, 1};
        double e[3], fraction = fct_lamps_direct(lamps, scene, point, normal, 0, 1, 4, NULL, NULL, e, NULL);
        assert_near(fraction, k < 2 ? 1 : 0, 0);
        fct_lamps_destroy(lamps);
        fct_scene_destroy(scene);
    }
}

/* The mean of single rays is the light of many rays, per channel, over receivers in all halls. */
static void single_rays_are_unbiased(void **state) {
    (void)state;
    double one[3] = {0, 0, 0}, many[3] = {0, 0, 0};
    for (uint64_t seed = 0; seed < 3; ++seed) {
        hall h = make_hall(seed);
        for (uint64_t i = 0; i < 20; ++i) {
            const double point[3] = {8 * pick(seed, i, 43) - 4, 8 * pick(seed, i, 44) - 4,
                                     3 * pick(seed, i, 45) - 2},
                         normal[3] = {0, 0, 1};
            uint64_t rays = 0;
            double e[3];
            fct_lamps_direct(h.lamps, h.scene, point, normal, .01, i, 256 | FCT_LAMPS_FIXED, NULL, NULL, e,
                             NULL);
            for (int c = 0; c < 3; ++c) many[c] += e[c];
            for (uint64_t k = 0; k < 400; ++k) {
                fct_lamps_sample(h.lamps, h.scene, point, normal, .01, fct_hash2(i, k), e, &rays);
                for (int c = 0; c < 3; ++c) one[c] += e[c] / 400;
            }
            assert_in_range(rays, 200, 400);
        }
        for (uint32_t k = 0; k < h.count; ++k) fct_lamp_release(&plain, &h.own[k]);
        free(h.triangles.corners);
        fct_lamps_destroy(h.lamps);
        fct_scene_destroy(h.scene);
    }
    for (int c = 0; c < 3; ++c) assert_near(one[c], many[c], .03 * many[c]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(halls_are_lit_by_the_rules),
        cmocka_unit_test(rays_end_before_the_lamp),
        cmocka_unit_test(single_rays_are_unbiased),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
