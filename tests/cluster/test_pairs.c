/* The pairs of one round against brute force, for random graphs and costs of either sign: mutually cheapest
 * clusters, the costs that the second search accepts, and the counts that the next round allocates by.
 */
#include "support.h"

#include "base/key.h"
#include "cluster/merge/rounds/offer.h"
#include "cluster/merge/rounds/pair.h"

enum { COUNT = 300, DEGREE = 4, MOST = 2 * COUNT * DEGREE, SLACK = FCT_LIST_SLACK };

typedef struct edge {
    uint32_t a, b, key;
} edge;

/* A graph as pair.c sees it: entry i of the flat arrays belongs to the list of one end. */
typedef struct graph {
    edge edges[COUNT * DEGREE];
    uint32_t edge_count;
    uint32_t starts[COUNT], lengths[COUNT], slots[COUNT], others[MOST + SLACK], keys[MOST + SLACK];
    uint32_t mates[COUNT], limits[COUNT];
    _Atomic uint64_t best[COUNT], second[COUNT];
    uint8_t frozen[COUNT];
} graph;

static graph g;

static double random_in(uint32_t *seed, double low, double high) {
    *seed = *seed * 1664525u + 1013904223u;
    return low + (high - low) * ((*seed >> 8) / 16777216.0);
}

static double cost_of(uint32_t key) {
    return (double)fct_float_of_key(key & ~FCT_KEY_SIZE_BITS);
}

static bool has_edge(uint32_t a, uint32_t b) {
    for (uint32_t e = 0; e < g.edge_count; ++e)
        if ((g.edges[e].a == a && g.edges[e].b == b) || (g.edges[e].a == b && g.edges[e].b == a)) return true;
    return false;
}

/* Costs are uneven, so that no two are equal, unless `ties`: then they are one of three. */
static void make_graph(uint32_t *seed, double low, double high, bool ties) {
    memset(&g, 0, sizeof g);
    for (uint32_t i = 0; i < COUNT; ++i)
        for (uint32_t k = 0; k < DEGREE; ++k) {
            uint32_t j = (uint32_t)random_in(seed, 0, COUNT);
            double cost =
                ties ? low + (high - low) * (int)random_in(seed, 0, 3) / 2 : random_in(seed, low, high);
            if (i == j || has_edge(i, j)) continue;
            uint32_t size = (uint32_t)random_in(seed, 0, 32);
            uint32_t key = (fct_float_key((float)cost) & ~FCT_KEY_SIZE_BITS) | size;
            g.edges[g.edge_count++] = (edge){i < j ? i : j, i < j ? j : i, key};
            ++g.lengths[i], ++g.lengths[j];
        }
    for (uint32_t i = 0, place = 0; i < COUNT; ++i) {
        g.starts[i] = place, place += g.lengths[i];
        g.lengths[i] = 0, g.slots[i] = i;
        g.best[i] = FCT_NO_OFFER;
    }
    for (uint32_t e = 0; e < g.edge_count; ++e)
        for (int k = 0; k < 2; ++k) {
            uint32_t from = k ? g.edges[e].b : g.edges[e].a, to = k ? g.edges[e].a : g.edges[e].b;
            uint32_t entry = g.starts[from] + g.lengths[from]++;
            g.others[entry] = to, g.keys[entry] = k ? 0 : g.edges[e].key; /* valid at the lower end */
        }
}

static const edge *find_cheapest(uint32_t i) {
    const edge *best = NULL;
    for (uint32_t e = 0; e < g.edge_count; ++e)
        if ((g.edges[e].a == i || g.edges[e].b == i) && (!best || g.edges[e].key < best->key))
            best = &g.edges[e];
    return best;
}

/* Runs both searches. Returns the number of merges. */
static uint32_t pair_clusters(fct_rounds *r, uint32_t *room) {
    uint32_t kept[2] = {0}, merged = 0;
    r->kept = kept, r->merged = &merged, r->room = room;
    for (uint32_t e = 0; e < g.edge_count; ++e)
        fct_offer_edge(r, g.best, g.edges[e].a, g.edges[e].b, g.edges[e].key);
    fct_pair_first(r, 0, COUNT, 0, 0);
    uint32_t limits[COUNT], first[COUNT];
    memcpy(limits, g.limits, sizeof limits), memcpy(first, g.mates, sizeof first);
    fct_pair_offer(r, 0, COUNT, 0, 0);
    fct_pair_second(r, 0, COUNT, 0, 0);
    assert_memory_equal(limits, g.limits, sizeof limits);
    for (uint32_t i = 0; i < COUNT; ++i)
        if (first[i] != FCT_NONE) assert_int_equal(first[i], g.mates[i]);
    assert_int_equal(kept[0], COUNT - merged);
    return merged;
}

/* A cluster without a mate accepts what costs at most `patience` times its cheapest offer; for a negative
 * offer, at most the offer itself. */
static void check_limit(uint32_t i, double patience) {
    const edge *best = find_cheapest(i);
    double most = best ? fmax(cost_of(best->key), patience * cost_of(best->key)) : 0;
    for (uint32_t e = 0; e < g.edge_count && best; ++e) {
        double cost = cost_of(g.edges[e].key);
        if (fabs(cost - most) < 1e-5 * fabs(most) && g.edges[e].key != best->key) continue;
        if ((g.edges[e].key <= g.limits[i]) != (cost <= most))
            fail_msg("cluster %u, whose best offer is %.9g, %s a cost of %.9g", i, cost_of(best->key),
                     cost <= most ? "refuses" : "accepts", cost);
    }
}

/* No two clusters stay that are each other's cheapest, or that would both accept the edge between them while
 * nothing else is left for them. */
static void check_mates(bool ties) {
    for (uint32_t i = 0; i < COUNT; ++i) {
        const edge *own = find_cheapest(i);
        if (g.mates[i] != FCT_NONE) {
            assert_int_equal(g.mates[g.mates[i]], i);
            assert_true(has_edge(i, g.mates[i]));
            assert_true(!g.frozen[i] && !g.frozen[g.mates[i]]);
        } else if (own && !ties && !g.frozen[own->a] && !g.frozen[own->b]) {
            uint32_t other = own->a == i ? own->b : own->a;
            assert_true(find_cheapest(other) != own);
        }
    }
    for (uint32_t e = 0; e < g.edge_count; ++e) {
        uint32_t a = g.edges[e].a, b = g.edges[e].b, rivals = 0;
        if (g.mates[a] != FCT_NONE || g.mates[b] != FCT_NONE) continue;
        if (g.edges[e].key > g.limits[a] || g.edges[e].key > g.limits[b]) continue;
        for (uint32_t k = 0; k < g.edge_count; ++k) {
            const edge *other = &g.edges[k];
            bool touches = other->a == a || other->b == a || other->a == b || other->b == b;
            rivals +=
                k != e && touches && other->key <= g.limits[other->a] && other->key <= g.limits[other->b];
        }
        assert_true(rivals > 0);
    }
}

static void check_graph(uint32_t round, bool frozen, bool ties, uint32_t *merges) {
    static fct_work work;
    static const double patience[2] = {1.2, 2}; /* from the fourth round on; in the first three */
    uint32_t room = 0, expected = SLACK;
    work.frozen = frozen ? g.frozen : NULL;
    fct_rounds r = {.work = &work,
                    .alone = true,
                    .round = round,
                    .best = g.best,
                    .second = g.second,
                    .mates = g.mates,
                    .limits = g.limits,
                    .now = {.count = COUNT,
                            .slots = g.slots,
                            .starts = g.starts,
                            .lengths = g.lengths,
                            .others = g.others,
                            .keys = g.keys}};
    *merges += pair_clusters(&r, &room);
    check_mates(ties);
    for (uint32_t i = 0; i < COUNT; ++i) {
        uint32_t mate = g.mates[i];
        if (mate == FCT_NONE) expected += g.lengths[i];
        if (mate != FCT_NONE && mate > i) expected += g.lengths[i] + g.lengths[mate] - 2;
        const edge *own = find_cheapest(i);
        if (g.limits[i] > 0) {
            assert_true(own && !(frozen && (g.frozen[own->a] || g.frozen[own->b])));
            check_limit(i, patience[round < 3]);
        } else if (!ties && own && mate == FCT_NONE) {
            assert_true(frozen && (g.frozen[own->a] || g.frozen[own->b]));
        }
    }
    assert_int_equal(room, expected);
}

static void pairs_are_mutual_and_patient(void **state) {
    (void)state;
    static const double ranges[4][2] = {{1, 4}, {-4, -1}, {-2, 3}, {1e-6, 1e-5}};
    uint32_t seed = 1, merges = 0;
    for (uint32_t round = 0; round < 6; ++round)
        for (int range = 0; range < 4; ++range)
            for (int kind = 0; kind < 3; ++kind) { /* plain, frozen clusters, ties */
                make_graph(&seed, ranges[range][0], ranges[range][1], kind == 2);
                for (uint32_t i = 0; i < COUNT && kind == 1; ++i) g.frozen[i] = random_in(&seed, 0, 5) < 1;
                check_graph(round, kind == 1, kind == 2, &merges);
            }
    assert_true(merges > 6 * 12 * COUNT / 10);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(pairs_are_mutual_and_patient)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
