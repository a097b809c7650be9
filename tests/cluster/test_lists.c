/* The lists of neighbours after a round against plain sums: every union's list holds each neighbour of its
 * parts once, with the sum of the borders, and keeps the key of an edge that no merge of the round touched.
 */
#include "support.h"

#include "cluster/merge/rounds/lists.h"

enum { MOST = 2000, SLACK = FCT_LIST_SLACK };

/* A graph of live clusters and its mates. */
typedef struct graph {
    uint32_t count, mates[MOST];
    float shared[MOST][MOST / 8]; /* border of i with i + 1 + k; 0: none */
} graph;

static graph g;

static float border_of(uint32_t a, uint32_t b) {
    uint32_t low = a < b ? a : b, high = a < b ? b : a;
    return high - low - 1 < MOST / 8 && low != high ? g.shared[low][high - low - 1] : 0;
}

/* Any key without meaning, the same at both ends. */
static uint32_t key_of(uint32_t a, uint32_t b) {
    return 7919 * (a + b) + a * b;
}

static void allocate_lists(fct_generation *lists, uint32_t count, uint32_t room) {
    *lists = (fct_generation){.count = count,
                              .starts = calloc(count, 4),
                              .lengths = calloc(count, 4),
                              .others = calloc(room, 4),
                              .shared = calloc(room, 4),
                              .keys = calloc(room, 4)};
}

static void free_lists(fct_generation *lists) {
    free(lists->starts), free(lists->lengths), free(lists->others), free(lists->shared), free(lists->keys);
}

static void fill_lists(fct_generation *lists) {
    uint32_t place = 0;
    for (uint32_t i = 0; i < g.count; ++i) {
        lists->starts[i] = place;
        for (uint32_t j = 0; j < g.count; ++j) {
            if (border_of(i, j) == 0) continue;
            lists->others[place] = j, lists->shared[place] = border_of(i, j),
            lists->keys[place++] = key_of(i, j);
        }
        lists->lengths[i] = place - lists->starts[i];
    }
}

/* The border of two clusters of the next round, and whether its key stays. */
static double sum_borders(const fct_rounds *r, uint32_t a, uint32_t b, uint32_t *key) {
    double sum = 0;
    const uint32_t parts[2][2] = {{(uint32_t)r->parents[a], (uint32_t)(r->parents[a] >> 32)},
                                  {(uint32_t)r->parents[b], (uint32_t)(r->parents[b] >> 32)}};
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j)
            if (parts[0][i] != FCT_NONE && parts[1][j] != FCT_NONE)
                sum += (double)border_of(parts[0][i], parts[1][j]);
    bool merged = parts[0][1] != FCT_NONE || parts[1][1] != FCT_NONE;
    *key = merged ? FCT_KEY_OPEN : key_of(parts[0][0], parts[1][0]);
    return sum;
}

/* Returns the length of the longest list. */
static uint32_t check_lists(void) {
    uint32_t entries = 0, live = 0, longest = 0, kept[2] = {0}, *renumbered = calloc(g.count, 4);
    for (uint32_t i = 0; i < g.count; ++i)
        for (uint32_t j = 0; j < g.count; ++j) entries += border_of(i, j) != 0;
    uint64_t *parents = calloc(g.count, 8);
    fct_list_scratch scratch = {.places = calloc(g.count, 1)};
    fct_rounds r = {.parents = parents, .renumbered = renumbered, .kept = kept, .scratch = &scratch};
    allocate_lists(&r.now, g.count, entries + SLACK);
    fill_lists(&r.now);
    uint32_t room = entries + SLACK * (g.count + 1), place = 0;
    allocate_lists(&r.next, g.count, room);
    for (uint32_t i = 0; i < g.count; ++i) {
        uint32_t mate = g.mates[i];
        if (mate < i) continue;
        r.next.starts[live] = place;
        place += r.now.lengths[i] + (mate == FCT_NONE ? 0 : r.now.lengths[mate]) + SLACK;
        renumbered[i] = live | (mate == FCT_NONE ? 0 : FCT_MERGED);
        if (mate != FCT_NONE) renumbered[mate] = renumbered[i];
        parents[live++] = (uint64_t)mate << 32 | i;
    }
    kept[1] = live;
    fct_join_lists(&r, 0, g.count, 0, 0);
    for (uint32_t a = 0; a < live; ++a) {
        uint32_t found = 0, key, start = r.next.starts[a], length = r.next.lengths[a];
        longest = length > longest ? length : longest;
        for (uint32_t b = 0; b < live; ++b) {
            double sum = a == b ? 0 : sum_borders(&r, a, b, &key);
            if (sum == 0) continue;
            uint32_t at = start;
            while (at < start + length && r.next.others[at] != b) ++at;
            assert_true(at < start + length);
            assert_true(fabs((double)r.next.shared[at] - sum) <= 1e-6 * sum);
            assert_int_equal(r.next.keys[at], key);
            ++found;
        }
        assert_int_equal(found, length);
    }
    free(renumbered), free(parents), free(scratch.places);
    free_lists(&r.now), free_lists(&r.next);
    return longest;
}

static uint32_t next_random(uint32_t *seed) {
    return *seed = *seed * 1664525u + 1013904223u;
}

/* `density`: of 256 pairs within reach, how many have a border. */
static void make_graph(uint32_t count, uint32_t reach, uint32_t density, uint32_t seed) {
    memset(&g, 0, sizeof g);
    g.count = count;
    for (uint32_t i = 0; i < count; ++i) {
        g.mates[i] = FCT_NONE;
        for (uint32_t k = 0; k < reach && i + 1 + k < count; ++k)
            if (next_random(&seed) >> 24 < density)
                g.shared[i][k] = 1 + (float)(next_random(&seed) >> 20) / 4096;
    }
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t k = 0; k < reach && g.mates[i] == FCT_NONE; ++k)
            if (g.shared[i][k] > 0 && g.mates[i + 1 + k] == FCT_NONE && next_random(&seed) >> 31)
                g.mates[i] = i + 1 + k, g.mates[i + 1 + k] = i;
}

static void every_length_of_list(void **state) {
    (void)state;
    static const struct {
        uint32_t count, reach, density, least, most; /* the last two: of the longest list */
    } cases[] = {
        {400, 4, 128, 4, 12}, {400, 12, 100, 9, 30}, {600, 90, 128, 60, 200}, {700, 240, 180, 201, 500}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i)
        for (uint32_t seed = 1; seed <= 3; ++seed) {
            make_graph(cases[i].count, cases[i].reach, cases[i].density, seed);
            assert_in_range(check_lists(), cases[i].least, cases[i].most);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_length_of_list)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
