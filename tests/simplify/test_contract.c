/* One contraction against a copy of the mesh; order, costs and stops of a run; the queue. */
#include "oracle.h"
#include "simplify/collapse.h"
#include "simplify/contract.h"
#include "simplify/cost/loss.h"
#include "simplify/topology/remain.h"
#include "simplify/topology/ring.h"

static fct_env env;

static void the_queue_pops_within_an_eighth(void **state) {
    (void)state;
    enum { COUNT = 4000 };
    static fct_queue queue;
    fct_edge *edges = calloc(COUNT, sizeof *edges);
    double *costs = calloc(COUNT, sizeof *costs);
    uint64_t seed = 61;
    queue_clear(&queue, edges, QUEUE_BUCKETS - 1);
    assert_true(queue_pop(&queue) == FCT_NONE);
    for (uint32_t i = 0; i < COUNT; ++i) {
        costs[i] = i % 50 == 0 ? 0 : i % 51 == 0 ? -1 : exp(between(&seed, -60, 60));
        queue_push(&queue, i, queue_bucket(costs[i]));
    }
    bool *left = malloc(COUNT);
    memset(left, 1, COUNT);
    for (uint32_t k = 0; k < COUNT; ++k) {
        uint32_t e = queue_pop(&queue);
        assert_true(e < COUNT && left[e]);
        left[e] = false;
        for (uint32_t i = 0; i < COUNT; ++i)
            if (left[i]) assert_true(costs[e] <= 0 || costs[e] < 1.1251 * costs[i]);
    }
    assert_true(queue_pop(&queue) == FCT_NONE);
    free(left);
    free(costs);
    free(edges);
}

/* --- One contraction --- */

static double value_at(const fct_simplifier *s, uint32_t wedge, const double *v) {
    return fct_quadric_value(wedge_quadric(s, wedge), s->steering, (v3){v[0], v[1], v[2]}, v + 3);
}

static uint32_t wedge_of(fct_simplifier *s, uint32_t c) {
    return s->corner_wedges ? corner_wedge(s, c) : s->triangles[c];
}

static uint32_t find_kept(fct_simplifier *s, const fct_groups *groups, uint32_t group) {
    uint32_t i = 0;
    while (groups->group_of[i] != group) ++i;
    return fct_sets_find(s->wedge_parents, groups->wedges[i]);
}

/* 1: two groups share a vertex at one of the ends where both have corners, before the contraction, and at the
 * other too, unless one has no corner there. -1: at an end they have corners, but share none. */
static int compare_groups(const fct_simplifier *old, const fct_groups *groups, uint32_t g, uint32_t other) {
    int result = g == other;
    for (int end = 0; end < 2 && g != other; ++end) {
        bool both = false, share = false;
        for (uint32_t i = 0; i < groups->wedge_count; ++i)
            for (uint32_t k = 0; k < groups->wedge_count; ++k) {
                if (groups->group_of[i] != g || groups->group_of[k] != other) continue;
                if (groups->second[i] != end || groups->second[k] != end) continue;
                both = true;
                share |= old->wedge_classes[groups->wedges[i]] == old->wedge_classes[groups->wedges[k]];
            }
        if (both && !share) return -1;
        result |= share;
    }
    return result;
}

/* Whether a third group keeps two groups that share a vertex apart. */
static bool may_part(const fct_simplifier *old, const fct_groups *groups, uint32_t g, uint32_t other) {
    for (uint32_t third = 0; third < groups->group_count; ++third)
        if (compare_groups(old, groups, g, third) < 0 || compare_groups(old, groups, other, third) < 0)
            return true;
    return false;
}

/* Colours and normals of the class of a wedge: the mean of the best attributes of its groups, by corners. */
static void check_class(fct_simplifier *s, uint32_t point, uint32_t wedge, const fct_simplifier *old,
                        const fct_groups *groups, const fct_candidate *candidate, const v3 ends[2]) {
    double sums[SIMPLIFY_MAX_CHANNELS] = {0}, all = 0;
    for (uint32_t g = 0; g < groups->group_count; ++g) {
        double best[SIMPLIFY_MAX_CHANNELS];
        uint32_t kept = find_kept(s, groups, g), w = s->first_wedges[point];
        while (w != FCT_NONE && w != kept) w = s->next_wedges[w];
        if (w == FCT_NONE || s->wedge_classes[w] != s->wedge_classes[wedge]) continue;
        fct_place_attributes(old, groups, g, candidate, ends[0], ends[1], best);
        all += s->wedge_uses[w];
        for (uint32_t k = 0; k < s->channel_count; ++k) sums[k] += s->wedge_uses[w] * best[k];
    }
    for (uint32_t k = 0; k < s->channel_count; ++k)
        if (s->channels[k].source != CHANNEL_TEXCOORD && s->def->placement != FCT_PLACE_SUBSET)
            assert_close(s->attributes[(size_t)s->channel_count * wedge + k], sums[k] / all, 1e-14);
}

/* Contracts edge e of the sheet and compares every array with the mesh before. */
static void check_collapse(const fct_mesh *mesh, uint32_t e, bool swap) {
    fct_simplify_def def = fct_simplify_def_default();
    def.boundary_weight = 1, def.color_weight = 1;
    def.placement = e % 3 ? FCT_PLACE_OPTIMAL : FCT_PLACE_SUBSET;
    fct_simplifier *s = open_simplifier(&env, mesh, &def), *old = open_simplifier(&env, mesh, &def);
    uint32_t ends[2] = {s->edges[e].ends[swap], s->edges[e].ends[!swap]}, corners = 3 * mesh->face_count;
    uint32_t keep = point_at(s, ends[1])->valence > point_at(s, ends[0])->valence, a = ends[keep],
             b = ends[!keep];
    fct_candidate candidate;
    assert_true(fct_place(s, ends[0], ends[1], false, &candidate));
    fct_groups groups;
    if (s->corner_wedges) assert_true(fct_groups_find(old, ends[0], ends[1], &groups));
    const v3 places[2] = {point_position(old, ends[0]), point_position(old, ends[1])};
    fct_simplify_drop_edge(s, e);
    uint32_t count_b = fct_simplify_gather(s, b, s->ring_b);
    fct_simplify_collapse(s, ends, &candidate, keep, count_b);

    v3 at = point_position(s, a);
    assert_true(at.x == candidate.at.x && at.y == candidate.at.y && at.z == candidate.at.z);
    assert_int_equal(point_at(s, a)->source,
                     candidate.end < 2 ? point_at(old, ends[candidate.end])->source : FCT_NONE);
    assert_int_equal(s->point_parents[b], a);
    uint32_t live = 0, valences[64] = {0};
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        uint32_t at_a = 0, at_b = 0;
        for (uint32_t k = 0; k < 3; ++k)
            at_a += old->triangles[3 * f + k] == a, at_b += old->triangles[3 * f + k] == b;
        assert_true(corner_dead(s, 3 * f) == (at_a && at_b));
        if (at_a && at_b) continue;
        ++live;
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t p = old->triangles[3 * f + k];
            if (p == b) p = a;
            assert_int_equal(s->triangles[3 * f + k], p);
            ++valences[p];
        }
    }
    assert_int_equal(s->live_faces, live);
    for (uint32_t p = 0; p < s->point_count; ++p) assert_int_equal(point_at(s, p)->valence, valences[p]);
    uint32_t *ring = malloc(corners * sizeof *ring);
    assert_int_equal(fct_simplify_gather(s, a, ring), valences[a]);
    free(ring);
    /* Sides with the same two points have one edge, others have different ones. */
    for (uint32_t c = 0; c < corners; ++c)
        for (uint32_t d = 0; d < c && !corner_dead(s, c); ++d) {
            if (corner_dead(s, d)) continue;
            uint32_t p = s->triangles[c], q = s->triangles[corner_next(c)], x = s->triangles[d],
                     y = s->triangles[corner_next(d)];
            bool same = (p == x && q == y) || (p == y && q == x);
            assert_true(same ==
                        (edge_root(s->edges, s->side_edges[c]) == edge_root(s->edges, s->side_edges[d])));
        }

    /* The quadrics of all wedges together stay the sum, wherever the attributes are the best for the
     * position. */
    uint64_t seed = 71 + e;
    for (int round = 0; round < 3; ++round) {
        double v[3 + SIMPLIFY_MAX_CHANNELS] = {0};
        for (uint32_t i = 0; i < 3 + s->steering; ++i) v[i] = between(&seed, -.5, .5);
        if (!s->corner_wedges) {
            assert_close(value_at(s, a, v), value_at(old, a, v) + value_at(old, b, v), 1e-12);
            continue;
        }
        for (uint32_t g = 0; g < groups.group_count; ++g) {
            double sum = 0;
            uint32_t kept = FCT_NONE, uses = 0;
            for (uint32_t i = 0; i < groups.wedge_count; ++i) {
                if (groups.group_of[i] != g) continue;
                sum += value_at(old, groups.wedges[i], v);
                kept = fct_sets_find(s->wedge_parents, groups.wedges[i]);
            }
            for (uint32_t c = 0; c < corners; ++c) uses += !corner_dead(s, c) && wedge_of(s, c) == kept;
            assert_int_equal(s->wedge_uses[kept], uses);
            bool retired = true;
            for (uint32_t w = s->first_wedges[a]; w != FCT_NONE; w = s->next_wedges[w]) retired &= w != kept;
            double got = value_at(s, kept, v);
            if (uses > 0) assert_false(retired);
            if (groups.group_count == 1) assert_close(got, sum, 1e-12);
            if (got < sum)
                assert_close(got, sum, 1e-12); /* it may also hold the position of a retired wedge */
            double want[SIMPLIFY_MAX_CHANNELS];
            fct_place_attributes(old, &groups, g, &candidate, point_position(old, ends[0]),
                                 point_position(old, ends[1]), want);
            bool alone = true;
            for (uint32_t other = 0; other < groups.group_count; ++other) {
                int relation = compare_groups(old, &groups, g, other);
                bool one = s->wedge_classes[find_kept(s, &groups, g)] ==
                           s->wedge_classes[find_kept(s, &groups, other)];
                if (relation < 0) assert_false(one);
                if (relation > 0 && !may_part(old, &groups, g, other)) assert_true(one);
                alone &= other == g || !one;
            }
            for (uint32_t k = 0; k < s->channel_count; ++k)
                if (alone || s->channels[k].source == CHANNEL_TEXCOORD)
                    assert_close(s->attributes[(size_t)s->channel_count * kept + k], want[k], 1e-15);
            if (uses > 0) check_class(s, a, kept, old, &groups, &candidate, places);
        }
    }
    fct_simplifier_destroy(s);
    fct_simplifier_destroy(old);
}

static void contractions_update_every_array(void **state) {
    (void)state;
    const unsigned arrays[] = {0, FCT_MESH_COLORS, ALL_ARRAYS};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i) {
        fct_mesh mesh = make_sheet(&env, arrays[i], 81);
        for (uint32_t e = 0; e < 56; ++e) check_collapse(&mesh, e, e % 2);
        fct_mesh_release(&env, &mesh);
    }
}

/* A wedge that loses its last face leaves its quadric, with the best attributes, to another wedge of its
 * point. */
static void a_retired_wedge_leaves_its_quadric(void **state) {
    (void)state;
    /* Two triangles at point 0; vertices 0 and 3 share it with different colours. Side 1-2 goes. */
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 6, 3, FCT_MESH_COLORS, &mesh), FCT_OK);
    const float p[18] = {0, 0, 0, 1, 0, .1f, 1, 1, 0, 0, 0, 0, 0, 1, .3f, -1, .5f, 0};
    const uint32_t t[9] = {0, 1, 2, 3, 2, 4, 3, 4, 5};
    memcpy(mesh.positions, p, sizeof p);
    memcpy(mesh.triangles, t, sizeof t);
    for (uint32_t i = 0; i < 18; ++i) mesh.colors[i] = i < 3 ? 1 : .1f * (float)(i % 5);
    fct_simplify_def def = fct_simplify_def_default();
    def.color_weight = .5, def.boundary_weight = 1;
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    uint32_t point = s->point_of[0], gone = s->corner_wedges[0], kept = s->corner_wedges[3];
    assert_true(point == s->point_of[3] && gone != kept);
    fct_elimination e;
    double before[POSITION_QUADRIC];
    memcpy(before, wedge_quadric(s, kept), sizeof before);
    fct_quadric_eliminate(wedge_quadric(s, gone), s->steering,
                          s->attributes + (size_t)s->channel_count * gone, 0, &e);
    uint32_t ends[2] = {s->point_of[1], s->point_of[2]};
    uint32_t keep = point_at(s, ends[1])->valence > point_at(s, ends[0])->valence;
    fct_candidate candidate;
    assert_true(fct_place(s, ends[0], ends[1], false, &candidate));
    fct_simplify_collapse(s, ends, &candidate, keep, fct_simplify_gather(s, ends[!keep], s->ring_b));
    assert_int_equal(s->first_wedges[point], kept);
    assert_int_equal(s->next_wedges[kept], FCT_NONE);
    const double *q = wedge_quadric(s, kept);
    for (int k = 0; k < POSITION_QUADRIC; ++k) assert_close(q[k], before[k] + e.position[k], 1e-9);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

/* A fan whose faces have three colours at the middle: one has one face, which vanishes; its quadric goes to
 * the colour of most faces. */
static void the_busiest_wedge_takes_a_quadric(void **state) {
    (void)state;
    enum { FACES = 8 };
    uint64_t seed = 83;
    for (int round = 0; round < 60; ++round) {
        /* vertices 0 to 2 lie in the middle; some order of their faces around it */
        uint32_t counts[3] = {0, 0, 0}, lone = (uint32_t)(3 * uniform(&seed)),
                 few = (lone + 1 + (uint32_t)round % 2) % 3;
        uint32_t alone = 2 + (uint32_t)(4 * uniform(&seed)), most = 3 - lone - few;
        fct_mesh mesh;
        assert_int_equal(fct_mesh_create(&env, 3 + FACES + 1, FACES, FCT_MESH_COLORS, &mesh), FCT_OK);
        for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
            double angle = .6 * (v - 3.);
            float p[3] = {(float)cos(angle), (float)sin(angle), (float)between(&seed, 0, .2)},
                  none[3] = {0, 0, 0};
            memcpy(mesh.positions + 3 * (size_t)v, v < 3 ? none : p, sizeof p);
            for (int k = 0; k < 3; ++k) mesh.colors[3 * v + (uint32_t)k] = (float)uniform(&seed);
        }
        for (uint32_t f = 0, left = 2; f < FACES; ++f) {
            uint32_t middle = f == alone ? lone : left > 0 && f % 3 != 0 ? (--left, few) : most;
            uint32_t t[3] = {middle, 3 + f, 4 + f};
            memcpy(mesh.triangles + 3 * (size_t)f, t, sizeof t);
            ++counts[middle];
        }
        assert_true(counts[lone] == 1 && counts[few] < counts[most]);
        fct_simplify_def def = fct_simplify_def_default();
        def.color_weight = .5, def.boundary_weight = 1;
        fct_simplifier *s = open_simplifier(&env, &mesh, &def);
        uint32_t wedges[3];
        for (uint32_t f = 0; f < FACES; ++f)
            wedges[mesh.triangles[3 * (size_t)f]] = s->corner_wedges[3 * (size_t)f];
        fct_elimination e;
        double before[3][POSITION_QUADRIC];
        for (int k = 0; k < 3; ++k) memcpy(before[k], wedge_quadric(s, wedges[k]), sizeof before[k]);
        fct_quadric_eliminate(wedge_quadric(s, wedges[lone]), s->steering,
                              s->attributes + (size_t)s->channel_count * wedges[lone], 0, &e);
        uint32_t ends[2] = {s->point_of[3 + alone], s->point_of[4 + alone]};
        uint32_t keep = point_at(s, ends[1])->valence > point_at(s, ends[0])->valence;
        fct_candidate candidate;
        assert_true(fct_place(s, ends[0], ends[1], false, &candidate));
        fct_simplify_collapse(s, ends, &candidate, keep, fct_simplify_gather(s, ends[!keep], s->ring_b));
        const double *taken = wedge_quadric(s, wedges[most]), *kept = wedge_quadric(s, wedges[few]);
        for (int k = 0; k < POSITION_QUADRIC; ++k) {
            assert_close(taken[k], before[most][k] + e.position[k], 1e-9);
            assert_true(kept[k] == before[few][k]);
        }
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &mesh);
    }
}

/* --- The first contraction of a run --- */

/* Key and squared relative error of an edge, with its loss; false if it may not be contracted. */
static bool price_edge(fct_simplifier *s, uint32_t e, double *key, double *error2) {
    uint32_t a = s->edges[e].ends[0], b = s->edges[e].ends[1];
    fct_candidate c;
    fct_loss loss;
    if (!fct_place(s, a, b, false, &c)) return false;
    uint32_t count_a = fct_simplify_gather(s, a, s->ring_a), count_b = fct_simplify_gather(s, b, s->ring_b);
    const fct_move move = {a, b, count_a, count_b, c.at};
    if (!fct_simplify_remains_good(s, &move)) return false;
    double lost = fct_simplify_is_level(s) ? 0 : fct_loss_measure(s, a, b, count_a, count_b, &c, &loss);
    *key = c.key + lost, *error2 = (c.distance2 + lost) / c.area;
    return true;
}

static void the_first_contraction_is_the_cheapest(void **state) {
    (void)state;
    for (uint64_t round = 0; round < 40; ++round) {
        fct_mesh mesh = make_sheet(&env, round % 2 ? FCT_MESH_COLORS : 0, 90 + round);
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = mesh.face_count - 1, def.boundary_weight = 1;
        fct_simplifier *s = open_simplifier(&env, &mesh, &def), *old = open_simplifier(&env, &mesh, &def);
        fct_stop stop;
        assert_int_equal(fct_simplify_contract(s, &stop), FCT_OK);
        assert_int_equal(stop, FCT_STOP_FACES);
        double least = INFINITY, key = NAN, error2 = NAN;
        uint32_t contracted = 0;
        for (uint32_t e = 0; e < old->edge_count; ++e) {
            double own, own_error2;
            bool done = s->point_parents[old->edges[e].ends[0]] == old->edges[e].ends[1] ||
                        s->point_parents[old->edges[e].ends[1]] == old->edges[e].ends[0];
            bool possible = price_edge(old, e, &own, &own_error2);
            if (possible) least = fmin(least, own);
            if (done && possible) key = own, error2 = own_error2;
            contracted += done;
        }
        assert_int_equal(contracted, 1);
        assert_true(key <= 1.1251 * least);
        assert_ratio(s->max_error2, error2, 1e-9);
        fct_simplifier_destroy(s);
        fct_simplifier_destroy(old);
        fct_mesh_release(&env, &mesh);
    }
}

/* The quadric of each remaining point is the sum over the points that were contracted to it, plus planes for
 * losses. On a round surface losses are small. */
static void quadrics_of_remaining_points_are_sums(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 20);
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 400, def.boundary_weight = 0;
    fct_simplifier *s = open_simplifier(&env, &sphere, &def), *old = open_simplifier(&env, &sphere, &def);
    fct_stop stop;
    assert_int_equal(fct_simplify_contract(s, &stop), FCT_OK);
    uint64_t seed = 77;
    double largest = 0;
    for (uint32_t p = 0; p < s->point_count; ++p) {
        if (s->point_parents[p] != p || point_at(s, p)->valence == 0) continue;
        v3 at = point_position(s, p), probe = random_vector(&seed);
        double sum = 0, area = 0, here = 0;
        for (uint32_t q = 0; q < s->point_count; ++q) {
            if (fct_sets_find(s->point_parents, q) != p) continue;
            const double *part = wedge_quadric(old, q);
            sum += quadric_at(part, probe), here += quadric_at(part, at), area += part[10];
        }
        const double *all = wedge_quadric(s, p);
        assert_ratio(quadric_at(all, probe), sum, .1);
        assert_true(quadric_at(all, probe) >= sum * (1 - 1e-9));
        assert_ratio(all[10], area, 1e-9);
        largest = fmax(largest, here / area);
    }
    assert_true(s->max_error2 >= .99 * largest && s->max_error2 < 2 * largest);
    fct_simplifier_destroy(s);
    fct_simplifier_destroy(old);
    fct_mesh_release(&env, &sphere);
}

/* A flat pyramid over a square. Any contraction of its top costs the same. */
static void max_error_is_compared_with_the_root_mean_square(void **state) {
    (void)state;
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 5, 4, 0, &mesh), FCT_OK);
    const float p[15] = {0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 2, 2, .1f};
    const uint32_t t[12] = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4};
    memcpy(mesh.positions, p, sizeof p);
    memcpy(mesh.triangles, t, sizeof t);
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 2;
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &mesh, &def, &stats);
    double cost = stats.max_cost;
    assert_true(cost > .02 && cost < .1);
    fct_mesh_release(&env, &out);
    for (int over = 0; over < 2; ++over) {
        def.max_error = cost * (over ? .99 : 1.01);
        out = simplified(&env, &mesh, &def, &stats);
        assert_int_equal(stats.stopped_because, over ? FCT_STOP_ERROR : FCT_STOP_FACES);
        assert_int_equal(out.face_count, over ? 4 : 2);
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_queue_pops_within_an_eighth),
        cmocka_unit_test(contractions_update_every_array),
        cmocka_unit_test(a_retired_wedge_leaves_its_quadric),
        cmocka_unit_test(the_busiest_wedge_takes_a_quadric),
        cmocka_unit_test(the_first_contraction_is_the_cheapest),
        cmocka_unit_test(quadrics_of_remaining_points_are_sums),
        cmocka_unit_test(max_error_is_compared_with_the_root_mean_square),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
