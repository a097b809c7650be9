/* Contraction in rounds against brute force: at the start of each round the costs of all live pairs are
 * computed from the faces of their unions. Then every merge of the round joins
 * - two clusters that are each other's cheapest neighbour, or
 * - two clusters whose cheapest neighbour is taken, at a cost within the patience of both (twice the cheapest
 * in the first three rounds, 1.2 times later), cheapest among such pairs to an eighth of an octave; and no
 * such pair is left out. Merges of a round are in order of their clusters' lowest faces, which is how the
 * test finds the rounds.
 */
#include "meshes.h"
#include "oracle.h"

#include "cluster/merge/rounds/rounds.h"

enum { EARLY_ROUNDS = 3, LEAST_CLUSTERS = 4096 };
static const double early_patience = 2, late_patience = 1.2, octave_part = 1.0 / 8;

typedef struct live {
    uint32_t a, b; /* build ids */
    oracle_price price;
    bool allowed;
} live;

typedef struct game {
    const char *name;
    const fct_mesh *mesh;
    oracle o;
    uint32_t faces;
    const fct_work *work;
    oracle_cluster *measures;
    uint32_t **members, *counts, *heights; /* by build id */
    uint32_t *nodes;                       /* per face: the live cluster that has it */
    live *pairs;
    uint32_t pair_count;
    uint32_t *starts, *ends_of; /* first pair of each id, with an end; numbers of pairs */
    double *best, *rest;        /* per id: lowest cost of its pairs, and of those within patience */
    uint32_t *mates;            /* per id: its partner in this round, or FCT_NONE */
    bool *done, *sure; /* per id: it merges with its cheapest neighbour, up to the slack; for certain */
    uint32_t mutual, patient;
} game;

static int compare_live(const void *p, const void *q) {
    const live *x = p, *y = q;
    if (x->a != y->a) return x->a < y->a ? -1 : 1;
    return x->b < y->b ? -1 : x->b > y->b;
}

static bool may_merge(const game *g, uint32_t a, uint32_t b) {
    const uint32_t *materials = g->mesh->materials;
    uint32_t taller = g->heights[a] > g->heights[b] ? g->heights[a] : g->heights[b];
    return (!materials || materials[g->members[a][0]] == materials[g->members[b][0]]) &&
           oracle_allows(taller, g->counts[a] + g->counts[b], true);
}

/* Lists all pairs of live clusters with a common border, each once, with their costs. */
static void list_pairs(game *g) {
    uint32_t count = 0;
    for (uint32_t l = 0; l < g->o.link_count; ++l) {
        uint32_t a = g->nodes[g->o.links[l].a], b = g->nodes[g->o.links[l].b];
        if (a != b) g->pairs[count++] = (live){.a = a < b ? a : b, .b = a < b ? b : a};
    }
    qsort(g->pairs, count, sizeof *g->pairs, compare_live);
    g->pair_count = 0;
    for (uint32_t i = 0; i < count; ++i)
        if (i == 0 || compare_live(&g->pairs[i], &g->pairs[i - 1])) g->pairs[g->pair_count++] = g->pairs[i];
    for (uint32_t i = 0; i < g->pair_count; ++i) {
        live *p = &g->pairs[i];
        p->allowed = may_merge(g, p->a, p->b);
        p->price = oracle_merge_price(&g->o, &g->measures[p->a], g->members[p->a], g->counts[p->a],
                                      &g->measures[p->b], g->members[p->b], g->counts[p->b]);
    }
}

/* Lists each pair at both ends. */
static void list_ends(game *g) {
    size_t ids = 2 * (size_t)g->faces;
    memset(g->starts, 0, (ids + 2) * sizeof *g->starts);
    for (uint32_t i = 0; i < g->pair_count; ++i)
        ++g->starts[g->pairs[i].a + 2], ++g->starts[g->pairs[i].b + 2];
    for (size_t i = 0; i < ids; ++i) g->starts[i + 2] += g->starts[i + 1];
    for (uint32_t i = 0; i < g->pair_count; ++i) {
        g->ends_of[g->starts[g->pairs[i].a + 1]++] = i;
        g->ends_of[g->starts[g->pairs[i].b + 1]++] = i;
    }
}

static const live *find_pair(const game *g, uint32_t a, uint32_t b) {
    const live wanted = {.a = a < b ? a : b, .b = a < b ? b : a};
    return bsearch(&wanted, g->pairs, g->pair_count, sizeof *g->pairs, compare_live);
}

/* The library compares costs as floats without their last five bits. */
static double slack_of(const live *p) {
    return p->price.slack + 1e-5 * fabs(p->price.cost);
}

static void lower(double *to, double cost) {
    if (cost < *to) *to = cost;
}

static double limit_of(const game *g, uint32_t id, double patience) {
    return fmax(g->best[id] * patience, g->best[id]);
}

static void find_best(game *g) {
    for (uint32_t i = 0; i < 2 * g->faces; ++i)
        g->best[i] = g->rest[i] = INFINITY, g->done[i] = g->sure[i] = false;
    for (uint32_t i = 0; i < g->pair_count; ++i) {
        const live *p = &g->pairs[i];
        if (p->allowed) lower(&g->best[p->a], p->price.cost), lower(&g->best[p->b], p->price.cost);
    }
}

static bool is_cheapest(const game *g, const live *p, double slack) {
    return p->price.cost <= g->best[p->a] + slack && p->price.cost <= g->best[p->b] + slack;
}

/* Whether all other pairs at both ends certainly cost more than `most`. Pairs that cannot merge do not count.
 */
static bool cost_others_more(const game *g, const live *p, double most, bool only_open) {
    for (int k = 0; k < 2; ++k) {
        uint32_t id = k ? p->b : p->a;
        for (uint32_t i = g->starts[id]; i < g->starts[id + 1]; ++i) {
            const live *q = &g->pairs[g->ends_of[i]];
            if (q == p || !q->allowed || (only_open && (g->sure[q->a] || g->sure[q->b]))) continue;
            if (q->price.cost - slack_of(q) <= most) return false;
        }
    }
    return true;
}

/* Whether the pair is the cheapest at both ends by more than the slack. */
static bool is_certain(const game *g, const live *p) {
    return cost_others_more(g, p, p->price.cost + slack_of(p), false);
}

static void check_cost(const game *g, uint32_t m, uint32_t round, const live *p) {
    double cost = (double)g->work->costs[m];
    if (!(fabs(cost - p->price.cost) <= slack_of(p)))
        fail_msg(
            "%s: round %u, merge %u (%u and %u faces) costs %.9g, should cost %.9g (off by %.3g, slack %.3g)",
            g->name, round, m, g->counts[p->a], g->counts[p->b], cost, p->price.cost, cost - p->price.cost,
            slack_of(p));
}

/* Checks one round: merges [begin, end). */
static void note_mates(game *g, uint32_t round, uint32_t begin, uint32_t end) {
    memset(g->mates, 0xFF, 2 * g->faces * sizeof *g->mates);
    for (uint32_t m = begin; m < end; ++m) {
        uint32_t a = g->work->children[m][0], b = g->work->children[m][1];
        const live *p = find_pair(g, a, b);
        if (!p || !p->allowed)
            fail_msg("%s: round %u, merge %u joins %u and %u, which may not merge", g->name, round, m, a, b);
        check_cost(g, m, round, p);
        g->mates[a] = b, g->mates[b] = a;
        if (is_cheapest(g, p, 2 * slack_of(p))) g->done[a] = g->done[b] = true, ++g->mutual;
        if (is_certain(g, p)) g->sure[a] = g->sure[b] = true;
    }
}

/* The lowest cost of each cluster's pairs with others that are not done, within the patience of both. */
static void find_rest(game *g, double patience) {
    for (uint32_t i = 0; i < g->pair_count; ++i) {
        const live *p = &g->pairs[i];
        double least = fmin(limit_of(g, p->a, patience), limit_of(g, p->b, patience));
        if (!p->allowed || g->done[p->a] || g->done[p->b] || p->price.cost + slack_of(p) > least) continue;
        lower(&g->rest[p->a], p->price.cost), lower(&g->rest[p->b], p->price.cost);
    }
}

static void check_patient(game *g, uint32_t round, uint32_t m, double patience) {
    const live *p = find_pair(g, g->work->children[m][0], g->work->children[m][1]);
    if (g->done[p->a]) return;
    ++g->patient;
    double cost = p->price.cost, slack = 2 * slack_of(p);
    for (int k = 0; k < 2; ++k) {
        uint32_t id = k ? p->b : p->a;
        if (cost > limit_of(g, id, patience) + slack)
            fail_msg("%s: round %u, merge %u costs %.9g, more than %g times the cheapest %.9g", g->name,
                     round, m, cost, patience, g->best[id]);
        if (cost > g->rest[id] + octave_part * fabs(g->rest[id]) + slack)
            fail_msg("%s: round %u, merge %u costs %.9g, another left over neighbor %.9g", g->name, round, m,
                     cost, g->rest[id]);
    }
}

/* Whether the pair is the cheapest at both ends, among those within patience, by an eighth of an octave. */
static bool is_certain_rest(const game *g, const live *p, double patience) {
    double slack = slack_of(p), least = fmin(limit_of(g, p->a, patience), limit_of(g, p->b, patience));
    return p->price.cost + slack < least &&
           cost_others_more(g, p, p->price.cost + octave_part * fabs(p->price.cost) + slack, true);
}

/* Every pair that must certainly merge has merged. */
static void check_left_out(const game *g, uint32_t round, double patience) {
    for (uint32_t i = 0; i < g->pair_count; ++i) {
        const live *p = &g->pairs[i];
        if (!p->allowed || g->mates[p->a] == p->b || !is_cheapest(g, p, 0)) continue;
        if (is_certain(g, p))
            fail_msg("%s: round %u leaves out %u and %u, each other's cheapest at %.9g", g->name, round, p->a,
                     p->b, p->price.cost);
    }
    for (uint32_t i = 0; i < g->pair_count; ++i) {
        const live *p = &g->pairs[i];
        if (!p->allowed || g->mates[p->a] != FCT_NONE || g->mates[p->b] != FCT_NONE) continue;
        if (is_certain_rest(g, p, patience))
            fail_msg("%s: round %u leaves out %u and %u, the cheapest that patience allows at %.9g", g->name,
                     round, p->a, p->b, p->price.cost);
    }
}

static void make_union(game *g, uint32_t m) {
    uint32_t id = g->faces + m, a = g->work->children[m][0], b = g->work->children[m][1];
    g->counts[id] = g->counts[a] + g->counts[b];
    g->heights[id] = 1 + (g->heights[a] > g->heights[b] ? g->heights[a] : g->heights[b]);
    g->members[id] = malloc(g->counts[id] * sizeof **g->members);
    memcpy(g->members[id], g->members[a], g->counts[a] * sizeof **g->members);
    memcpy(g->members[id] + g->counts[a], g->members[b], g->counts[b] * sizeof **g->members);
    for (uint32_t i = 0; i < g->counts[id]; ++i) g->nodes[g->members[id][i]] = id;
    g->measures[id] = oracle_measure(&g->o, g->members[id], g->counts[id]);
}

static uint32_t lowest_face(const game *g, uint32_t id) {
    uint32_t lowest = UINT32_MAX;
    for (uint32_t i = 0; i < g->counts[id]; ++i)
        lowest = g->members[id][i] < lowest ? g->members[id][i] : lowest;
    return lowest;
}

/* One past the last merge of the round that begins at `begin`. */
static uint32_t round_end(const game *g, uint32_t begin) {
    uint32_t last = 0, m = begin;
    for (; m < g->work->merge_count; ++m) {
        uint32_t a = g->work->children[m][0], b = g->work->children[m][1];
        if (a >= g->faces + begin || b >= g->faces + begin) break;
        uint32_t low = lowest_face(g, a), other = lowest_face(g, b);
        low = low < other ? low : other;
        if (m > begin && low < last) break;
        last = low;
    }
    return m;
}

static void play(game *g) {
    uint32_t begin = 0, round = 0;
    for (uint32_t merges = UINT32_MAX; g->faces - begin > LEAST_CLUSTERS; ++round) {
        if (merges <= (g->faces - begin) / 64) break;
        const double patience = round < EARLY_ROUNDS ? early_patience : late_patience;
        uint32_t end = round_end(g, begin);
        list_pairs(g);
        list_ends(g);
        find_best(g);
        note_mates(g, round, begin, end);
        find_rest(g, patience);
        for (uint32_t m = begin; m < end; ++m) check_patient(g, round, m, patience);
        check_left_out(g, round, patience);
        for (uint32_t m = begin; m < end; ++m) make_union(g, m);
        merges = end - begin;
        begin = end;
    }
    print_message("%s: %u rounds, %u merges of mutually cheapest clusters, %u by patience\n", g->name, round,
                  g->mutual, g->patient);
    assert_true(round > EARLY_ROUNDS && g->mutual > g->patient && g->patient > 0);
}

/* across: after rounds within materials, which must merge nothing, those across them are checked. */
static void check_rounds(const char *name, const fct_mesh *mesh, fct_cluster_cost cost, bool across) {
    fct_env env = fct_env_default();
    fct_tree_def def = fct_tree_def_default();
    fct_work work;
    def.cost = cost, def.fit_weight = cost == FCT_COST_MEAN ? 1e6 : 1e4, def.direction_weight = 1,
    def.shape_weight = 0.002;
    assert_int_equal(fct_work_create(&env, mesh, &def, &work), FCT_OK);
    fct_mesh bare = *mesh;
    if (across) {
        assert_int_equal(fct_work_rounds(&work, false), FCT_OK);
        assert_int_equal(work.merge_count, 0);
        bare.materials = NULL, bare.material_count = 0, mesh = &bare;
    }
    assert_int_equal(fct_work_rounds(&work, !mesh->materials), FCT_OK);
    size_t faces = mesh->face_count;
    game g = {
        .name = name, .mesh = mesh, .o = oracle_create(mesh, &def), .faces = mesh->face_count, .work = &work};
    g.members = calloc(2 * faces, sizeof *g.members);
    g.measures = calloc(2 * faces, sizeof *g.measures);
    g.counts = calloc(2 * faces, sizeof *g.counts);
    g.heights = calloc(2 * faces, sizeof *g.heights);
    g.nodes = calloc(faces, sizeof *g.nodes);
    g.pairs = calloc(3 * faces, sizeof *g.pairs);
    g.starts = calloc(2 * faces + 2, sizeof *g.starts);
    g.ends_of = calloc(6 * faces, sizeof *g.ends_of);
    g.best = calloc(2 * faces, sizeof *g.best);
    g.rest = calloc(2 * faces, sizeof *g.rest);
    g.mates = calloc(2 * faces, sizeof *g.mates);
    g.done = calloc(2 * faces, sizeof *g.done);
    g.sure = calloc(2 * faces, sizeof *g.sure);
    for (uint32_t f = 0; f < faces; ++f) {
        g.members[f] = malloc(sizeof **g.members);
        g.members[f][0] = g.nodes[f] = f, g.counts[f] = 1;
        g.measures[f] = oracle_measure(&g.o, g.members[f], 1);
    }
    play(&g);
    for (uint32_t i = 0; i < 2 * faces; ++i) free(g.members[i]);
    free(g.measures), free(g.members), free(g.counts), free(g.heights), free(g.nodes), free(g.pairs),
        free(g.best), free(g.rest);
    free(g.mates), free(g.done), free(g.sure), free(g.starts), free(g.ends_of);
    oracle_destroy(&g.o);
    fct_work_release(&work);
}

static void increment(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_terrain(&env, 120, 0.25, 1);
    check_rounds("terrain", &mesh, FCT_COST_INCREMENT, false);
    fct_mesh_release(&env, &mesh);
}

static void mean_of_two_materials(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_terrain(&env, 110, 0.2, 2);
    paint_stripes(&env, &mesh, 2, 97);
    check_rounds("two materials", &mesh, FCT_COST_MEAN, false);
    fct_mesh_release(&env, &mesh);
}

static void pages(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_pages(&env, 5, 50, 50);
    check_rounds("pages", &mesh, FCT_COST_INCREMENT, false);
    fct_mesh_release(&env, &mesh);
}

/* No two neighbours share a material, so that the rounds across materials begin with edges. */
static void across_materials(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_terrain(&env, 120, 0.25, 1);
    mesh.materials = fct_allocate(&env, mesh.face_count, sizeof *mesh.materials), mesh.material_count = 2;
    for (uint32_t f = 0; f < mesh.face_count; ++f) mesh.materials[f] = f % 2;
    check_rounds("checkered", &mesh, FCT_COST_INCREMENT, true);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(across_materials), cmocka_unit_test(increment),
                                       cmocka_unit_test(mean_of_two_materials), cmocka_unit_test(pages)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
