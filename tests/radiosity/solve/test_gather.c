/* The stored solution of random scenes against a plain evaluation. The oracle knows the sequence of sample
 * points: it traces the same rays, repeats the splits, solves the equations of the leaves, and sums power and
 * noise. */
#include "../place.h"
#include "../soup.h"
#include "radiosity/solve/transport.h"
#include "radiosity/surface/cover.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

static uint32_t add_colour(fct_scene *scene, uint64_t seed, double emission, bool two_sided) {
    return place_colours(scene, seed, .2, .8, emission, two_sided);
}

/* A floor, a small lamp, a wall whose back is black, a two-sided bumpy ball, which in odd scenes shines and
 * is too large for a lamp, and a blocker whose shadow crosses the floor. */
static fct_scene *make_scene(uint64_t seed) {
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    uint32_t floor = add_colour(scene, seed, 0, false), lamp = add_colour(scene, seed + 10, 9, seed & 2);
    place_sheet(&plain, scene, floor, 3, v3_make(0, 0, 0), v3_make(3, 0, 0), v3_make(0, 3, 0));
    place_sheet(&plain, scene, lamp, 1, v3_make(1, 1, 2.5), v3_make(0, .4, 0), v3_make(.5, 0, 0));
    place_sheet(&plain, scene, floor, 1, v3_make(2.8, 0, .1), v3_make(0, 0, 2), v3_make(0, 3, 0));
    place_sheet(&plain, scene, floor, 1, v3_make(.3, .1, .05), v3_make(0, 0, 1.5), v3_make(0, 2.5, 0));
    fct_mesh ball = make_bumpy(&plain, 5, .2);
    double s = seed & 1 ? .85 : .3;
    const float place[12] = {(float)s, 0, 0, 1.6F, 0, (float)s, 0, 2, 0, 0, (float)-s, 1};
    place_mesh(scene, &ball, add_colour(scene, seed + 20, seed & 1 ? .3 : 0, true), place);
    for (uint64_t k = 0; k < 4; ++k) { /* specks, whose bends are too small to split */
        float tiny = .002F + .002F * (float)fct_uniform(fct_hash2(seed, k));
        const float speck[12] = {tiny, 0, 0, (float)k, 0, tiny, 0, 5, 0, 0, tiny, 1};
        place_mesh(scene, &ball, floor, speck);
    }
    fct_mesh_release(&plain, &ball);
    place_sheet(&plain, scene, floor, 1, v3_make(1.3, .3, 1), v3_make(.6, 0, 0), v3_make(0, .7, .1));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

/* A ray finds the leaf at its nearest hit, on the side that it hits, or black on the back of a one-sided
 * surface. */
static void rays_find_the_leaf_that_they_hit(void **state) {
    (void)state;
    int backs = 0, blacks = 0, misses = 0;
    for (uint64_t seed = 0; seed < 4; ++seed) {
        fct_scene *scene = make_scene(seed);
        soup s = list_triangles(scene);
        fct_elements set;
        assert_int_equal(fct_elements_create(&plain, scene, .5, &set), FCT_OK);
        for (uint32_t id = 0; id < set.count; ++id)
            if (fct_elements_can_split(&set, id)) assert_int_equal(fct_elements_split(&set, id), FCT_OK);
        float *stored = calloc(3 * set.count, sizeof *stored);
        for (uint64_t k = 0; k < 1500; ++k) {
            float o[3], d[3];
            for (uint64_t c = 0; c < 3; ++c) o[c] = (float)(3 * fct_uniform(fct_hash3(seed, k, c)));
            v3_store(d, v3_unit(v3_make(fct_uniform(fct_hash3(seed, k, 4)) - .5,
                                        fct_uniform(fct_hash3(seed, k, 5)) - .5,
                                        fct_uniform(fct_hash3(seed, k, 6)) - .5)));
            fct_found f = fct_transport_look(&set, stored, o, d);
            double distance;
            bool behind;
            uint32_t hit = find_nearest(&s, v3_load(o), v3_load(d), &distance, &behind), instance = 0;
            if (hit == FCT_NONE) {
                assert_true(f.leaf == FCT_NONE && isinf(f.distance) && !f.black && f.radiosity[0] == 0),
                    ++misses;
                continue;
            }
            assert_near(f.distance, distance, 1e-6 + 1e-5 * distance);
            const v3 *c = s.corners + 3 * (size_t)hit;
            v3 n = v3_cross(v3_sub(c[1], c[0]), v3_sub(c[2], c[0])),
               x = v3_mad(v3_load(o), distance, v3_load(d));
            uint32_t count = 0;
            for (; hit >=
                   count + fct_tree_get(set.view.models[set.view.instances[instance].model].tree).face_count;
                 ++instance)
                count += fct_tree_get(set.view.models[set.view.instances[instance].model].tree).face_count;
            const fct_instance *in = &set.view.instances[instance];
            bool back = (v3_dot(n, v3_load(d)) > 0) != in->mirrored;
            if (back && !set.view.materials[in->material].two_sided) {
                assert_true(f.leaf == FCT_NONE && f.black && f.radiosity[1] == 0), ++blacks;
                continue;
            }
            const fct_element *e = &set.items[f.leaf];
            assert_true(f.radiosity == stored + 3 * (size_t)f.leaf && !f.black && e->child_count == 0);
            assert_true(e->instance == instance && e->back == back &&
                        set.ranges[f.leaf].first == hit - count);
            double sum = 0;
            for (int k2 = 0; k2 < 3; ++k2)
                sum +=
                    .5 * v3_norm(v3_cross(
                             v3_sub(v3_load(set.corners + 9 * (size_t)e->triangle + 3 * k2), x),
                             v3_sub(v3_load(set.corners + 9 * (size_t)e->triangle + (3 * k2 + 3) % 9), x)));
            assert_near(sum, e->area, 1e-5);
            backs += back;
        }
        free(stored), free(s.corners);
        fct_elements_release(&set);
        fct_scene_destroy(scene);
    }
    assert_true(backs > 100 && blacks > 100 && misses > 100);
}

/* Direct light at the k-th of four points; `fresh`: 0 for splits, 1 for the solution. */
static void light_point(const fct_elements *set, const fct_lamps *lamps, uint64_t seed, uint32_t id,
                        uint64_t k, uint64_t fresh, double e[3], uint64_t *rays) {
    fct_element_point at, *p = &at;
    fct_element_point_at(set, id, (uint32_t)(4 * k + (fct_hash3(seed, id, k) + fresh) % 4), p);
    const double x[3] = {p->position[0], p->position[1], p->position[2]},
                 n[3] = {p->normal[0], p->normal[1], p->normal[2]};
    fct_lamps_direct(lamps, set->scene, x, n, p->offset, fct_hash3(seed + fresh, id, k), 2 | FCT_LAMPS_FIXED,
                     NULL, NULL, e, rays);
}

/* sum over channels of rho (max E - min E) A, 16 times that where a point is dark and another is not. */
static double measure_spread(const fct_elements *set, const fct_lamps *lamps, uint64_t seed, uint32_t id,
                             uint64_t *rays) {
    double e[4][3], spread = 0, factor = 1;
    for (uint64_t k = 0; k < 4; ++k) light_point(set, lamps, seed, id, k, 0, e[k], rays);
    for (int c = 0; c < 3; ++c) {
        double least = fmin(fmin(e[0][c], e[1][c]), fmin(e[2][c], e[3][c]));
        double most = fmax(fmax(e[0][c], e[1][c]), fmax(e[2][c], e[3][c]));
        spread += set->items[id].reflectance[c] * (most - least) * set->items[id].area;
        if (least == 0 && most > 0) factor = 16;
    }
    return spread * factor;
}

static bool can_split(const fct_elements *set, const fct_element *e) {
    if (e->kind != FCT_ELEMENT_TRIANGLE) return e->kind == FCT_ELEMENT_CLUSTER;
    const float *q = set->corners + 9 * (size_t)e->triangle;
    double longest = 0;
    for (int k = 0; k < 3; ++k)
        longest = fmax(longest, v3_norm(v3_sub(v3_load(q + 3 * k), v3_load(q + (3 * k + 3) % 9))));
    return longest > set->min_edge;
}

/* Repeats the splits: bent leaves first, then up to eight rounds by direct light. Children are numbered in
 * the order of the splits. */
static void follow_splits(const fct_elements *set, const fct_lamps *lamps, size_t old, uint64_t seed,
                          double epsilon, uint64_t *rays, int met[2]) {
    size_t next = old, from = 0;
    for (size_t id = 0; id < next; ++id) {
        const fct_element *e = &set->items[id];
        if ((e->child_count && e->child < next) || e->kind != FCT_ELEMENT_CLUSTER) continue;
        bool bent = v3_norm(e->vector) <= .95 * e->area && e->area >= 2e-6 * set->items[0].area;
        if (bent) assert_true(e->child_count && e->child == next);
        next += bent ? e->child_count : 0, met[0] += bent;
    }
    for (int round = 0; round < 8 && from < next; ++round) {
        size_t count = next;
        for (size_t id = from; id < count; ++id) {
            const fct_element *e = &set->items[id];
            if ((e->child_count && e->child < next) || e->kind == FCT_ELEMENT_VOLUME || e->area == 0)
                continue;
            bool splits = measure_spread(set, lamps, seed, (uint32_t)id, rays) > epsilon && can_split(set, e);
            assert_int_equal(e->child_count && e->child == next, splits);
            next += splits ? e->child_count : 0, met[1] += splits;
        }
        from = count;
    }
    assert_int_equal(next, set->count);
}

enum { NOTHING = -1, BLACK = -2, COVERED = -3 };

/* The leaf that ray k of a leaf finds, NOTHING or BLACK; COVERED: black, from a covered point. */
static int64_t trace_ray(const fct_elements *set, const fct_transport *t, uint64_t seed, uint32_t id,
                         uint32_t k, uint32_t rays, uint64_t *sent) {
    uint64_t own = fct_hash2(seed ^ 0x6761746865720001u, id);
    double plane[2], place[2];
    fct_element_point p;
    float origin[3], direction[3];
    fct_plane_point(k, own, plane),
        fct_plane_point(fct_shuffle_index(k, (uint32_t)own), fct_hash(own), place);
    fct_element_sample(set, id, (k + place[0]) / rays, place[1], fct_uniform(fct_hash2(own, k)), &p);
    v3_store(origin, v3_mad(v3_load(p.position), p.offset, v3_load(p.normal)));
    v3_store(direction, fct_cosine_direction(v3_load(p.normal), plane[0], plane[1]));
    fct_found f = fct_transport_look(set, t->stored, origin, direction);
    if (f.leaf != FCT_NONE) return (int64_t)f.leaf;
    if (!f.black) return NOTHING;
    return fct_point_is_covered(set->scene, p.position, p.normal, p.offset, fct_hash3(own, k, 2), NULL, sent)
               ? COVERED
               : BLACK;
}

static void solutions_solve_the_equations(void **state) {
    (void)state;
    int met[2] = {0, 0}, blacks = 0, misses = 0;
    for (uint64_t seed = 0; seed < 5; ++seed) {
        fct_scene *scene = make_scene(seed);
        fct_elements set;
        fct_lamps *lamps;
        fct_transport t;
        assert_int_equal(fct_elements_create(&plain, scene, .3, &set), FCT_OK);
        assert_int_equal(fct_lamps_create(&plain, scene, &lamps), FCT_OK);
        assert_int_equal(fct_lamps_sampled(lamps, 4), false);
        const double fineness = seed % 2 ? .1 : .07, epsilon = .02;
        const fct_transport_def def = {
            .seed = seed, .epsilon = epsilon, .tolerance = 1e-10, .fineness = fineness};
        size_t old = set.count, count = 0;
        uint64_t sent = 0;
        assert_int_equal(fct_transport_solve(&set, lamps, &def, &t), FCT_OK);
        follow_splits(&set, lamps, old, seed, epsilon, &sent, met);
        uint32_t rays = (uint32_t)(512 * fineness);
        int64_t *hits = malloc(set.count * rays * sizeof *hits);
        double *e = calloc(3 * set.count, sizeof *e), *next = calloc(3 * set.count, sizeof *next),
               *direct = calloc(3 * set.count, sizeof *direct), *open = calloc(set.count, sizeof *open),
               emitted = 0, absorbed = 0, escaped = 0, noise = 0, level = 0;
        for (uint32_t id = 0; id < set.count; ++id) {
            const fct_element *x = &set.items[id];
            if (x->child_count) continue;
            ++count;
            for (uint64_t k = 0; k < 4; ++k) {
                double light[3];
                light_point(&set, lamps, seed, id, k, 1, light, &sent);
                for (int c = 0; c < 3; ++c) direct[3 * (size_t)id + (size_t)c] += light[c] / 4;
            }
            for (uint32_t k = 0; k < rays; ++k)
                open[id] +=
                    (hits[(size_t)id * rays + k] = trace_ray(&set, &t, seed, id, k, rays, &sent)) != COVERED;
            open[id] = open[id] > 0 ? open[id] / rays : 1;
        }
        assert_int_equal(t.rays, sent + count * rays);
        /* Jacobi; gather rays find the emission of emitters that are no lamps. */
        for (int sweep = 0; sweep < 80; ++sweep) {
            for (size_t id = 0; id < set.count; ++id)
                for (size_t c = 0; c < 3 && !set.items[id].child_count; ++c) {
                    double sum = 0;
                    for (uint32_t k = 0; k < rays; ++k) {
                        int64_t h = hits[id * rays + k];
                        if (h < 0) continue;
                        const fct_element *y = &set.items[h];
                        sum += (double)y->reflectance[c] * e[3 * (size_t)h + c] +
                               (fct_lamps_sampled(lamps, y->instance) ? 0 : (double)y->emission[c]);
                    }
                    next[3 * id + c] = (direct[3 * id + c] + sum / rays) / open[id];
                }
            double *swap = e;
            e = next, next = swap;
        }
        double flux[3] = {0, 0, 0}, area = 0;
        for (size_t id = 0; id < set.count; ++id) {
            const fct_element *x = &set.items[id];
            if (x->child_count) continue;
            double halves[2] = {0, 0}, lost = 0, dark = 0;
            for (uint32_t k = 0; k < rays; ++k) {
                int64_t h = hits[id * rays + k];
                lost += h == NOTHING, dark += h == BLACK || (h == COVERED && open[id] >= 1);
                for (size_t c = 0; c < 3 && h >= 0; ++c)
                    halves[k >= (rays + 1) / 2] += 2. / rays * (double)t.stored[3 * (size_t)h + c] / open[id];
            }
            misses += lost > 0, blacks += dark > 0;
            for (size_t c = 0; c < 3; ++c) {
                double expected = e[3 * id + c],
                       b = (double)x->emission[c] + (double)x->reflectance[c] * expected;
                bool lamp = fct_lamps_sampled(lamps, x->instance);
                assert_near(t.direct[3 * id + c], direct[3 * id + c], 1e-12);
                assert_near(x->irradiance[c], expected, 2e-6 * (1 + expected));
                assert_near(x->radiosity[c], b, 2e-6 * (1 + b));
                assert_near(t.stored[3 * id + c], b - (lamp ? (double)x->emission[c] : 0), 2e-6 * (1 + b));
                halves[0] += direct[3 * id + c] / open[id], halves[1] += direct[3 * id + c] / open[id];
                emitted += x->area * x->emission[c];
                absorbed +=
                    x->area * (open[id] * (1 - (double)x->reflectance[c]) * expected + b * dark / rays);
                absorbed += x->area * (1 - open[id]) * (double)x->emission[c]; /* the covered part keeps it */
                escaped += x->area * b * lost / rays;
                flux[c] += x->area * b;
            }
            area += x->area;
            noise += x->area * pow((halves[0] - halves[1]) / 2, 2),
                level += x->area * pow((halves[0] + halves[1]) / 2, 2);
        }
        assert_near(t.emitted, emitted, 1e-5 * emitted);
        assert_near(t.absorbed, absorbed, 1e-5 * absorbed), assert_near(t.escaped, escaped, 1e-5 * escaped);
        assert_near(t.noise, sqrt(noise / level), 1e-5 * t.noise);
        for (int c = 0; c < 3; ++c) assert_near(set.items[0].radiosity[c], flux[c] / area, 1e-5);
        assert_true(t.converged && t.change < 1e-9 && t.sweeps > 10);
        free(hits), free(e), free(next), free(direct), free(open);
        fct_transport_release(&plain, &t);
        fct_elements_release(&set);
        fct_lamps_destroy(lamps);
        fct_scene_destroy(scene);
    }
    printf("    %d leaves split for bends, %d for light, %d see black, %d see nothing\n", met[0], met[1],
           blacks, misses);
    assert_true(met[0] > 10 && met[1] > 100 && blacks > 10 && misses > 100);
}

/* 512 rays per leaf below 4,096 leaves, 128 below 16,384, then 64; times the fineness. */
static void few_leaves_send_more_rays(void **state) {
    (void)state;
    static const struct {
        uint32_t n;
        uint32_t rays;
    } cases[] = {{45, 25}, {46, 6}, {91, 3}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        fct_scene *scene;
        plain = fct_env_default();
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        place_sheet(&plain, scene, place_material(scene, .5, 0, false), cases[i].n, v3_make(0, 0, 0),
                    v3_make(1, 0, 0), v3_make(0, 1, 0));
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_elements set;
        fct_lamps *lamps;
        fct_transport t;
        assert_int_equal(fct_elements_create(&plain, scene, 1, &set), FCT_OK);
        assert_int_equal(fct_lamps_create(&plain, scene, &lamps), FCT_OK);
        for (uint32_t id = 0; id < set.count; ++id)
            if (fct_elements_can_split(&set, id)) assert_int_equal(fct_elements_split(&set, id), FCT_OK);
        const fct_transport_def def = {.epsilon = 1, .tolerance = 1, .fineness = .05};
        assert_int_equal(fct_transport_solve(&set, lamps, &def, &t), FCT_OK);
        assert_int_equal(t.rays, 2 * cases[i].n * cases[i].n * cases[i].rays);
        fct_transport_release(&plain, &t);
        fct_elements_release(&set);
        fct_lamps_destroy(lamps);
        fct_scene_destroy(scene);
    }
}

/* Of two sheets in one place, also if one is turned over or smaller, the power counts each point of their
 * union once. */
static void coincident_sheets_count_once(void **state) {
    (void)state;
    for (int kind = 0; kind < 6; ++kind) {
        fct_scene *scene;
        plain = fct_env_default();
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        uint32_t glow = place_material(scene, .5, 2, false);
        double gap = kind == 2 ? .01 : 0, side = kind == 3 ? .5 : 1;
        v3 u = v3_make(1, 0, 0), v = v3_make(0, 1, 0);
        if (kind > 3) u = v3_make(.6, .3, sqrt(.55)), v = v3_unit(v3_cross(v3_make(.3, .2, kind), u));
        place_sheet(&plain, scene, glow, 4, v3_make(0, 0, 0), u, v);
        place_sheet(&plain, scene, glow, 4, v3_make(0, 0, gap), v3_scale(u, side), v3_scale(v, side));
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_elements set;
        fct_lamps *lamps;
        fct_transport t;
        assert_int_equal(fct_elements_create(&plain, scene, .2, &set), FCT_OK);
        assert_int_equal(fct_lamps_create(&plain, scene, &lamps), FCT_OK);
        for (uint32_t id = 0; id < set.count; ++id)
            if (fct_elements_can_split(&set, id)) assert_int_equal(fct_elements_split(&set, id), FCT_OK);
        const fct_transport_def def = {.epsilon = 100, .tolerance = 1e-6, .fineness = .25};
        assert_int_equal(fct_transport_solve(&set, lamps, &def, &t), FCT_OK);
        assert_near(t.emitted, 3 * 2 * (kind == 2 ? 2 : 1), .05);
        fct_transport_release(&plain, &t);
        fct_elements_release(&set);
        fct_lamps_destroy(lamps);
        fct_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_find_the_leaf_that_they_hit),
        cmocka_unit_test(solutions_solve_the_equations),
        cmocka_unit_test(few_leaves_send_more_rays),
        cmocka_unit_test(coincident_sheets_count_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
