/* The greedy contraction of small meshes, merge for merge and cost for cost, against chapter 8 by brute
 * force.
 *
 * At each step the costs of all live pairs are computed from the faces of their unions; the merge that the
 * library made must be the cheapest, within the slack of oracle.h. Then the tree's nodes must be these merges
 * in order of their costs.
 */
#include "meshes.h"
#include "oracle.h"

#include "cluster/merge/greedy.h"
#include "cluster/merge/join.h"
#include "cluster/merge/mean.h"

/* Stages of the contraction: edges within a material, then all edges, each with the lower height limit first;
 * then separate parts. */
typedef enum stage { WITHIN_MILD, WITHIN_STEEP, ACROSS_MILD, ACROSS_STEEP, JOIN } stage;

typedef struct replay {
    const char *name;
    const fct_mesh *mesh;
    oracle o;
    uint32_t faces, merges;
    const fct_work *work;
    /* by build id: that of a leaf is its face, merge m makes F + m */
    oracle_cluster *measures;
    uint32_t **members, *counts, *heights;
    oracle_price *prices;   /* per pair of ids; cost NaN: not computed yet */
    uint32_t *listed;       /* per pair of ids: 1 + the last step that listed it */
    fct_mean_record *means; /* records of MEAN by build id */
    uint32_t *nodes;        /* per face: the live cluster that has it */
    double *costs, *slacks; /* per merge, by the oracle */
    stage *stages;          /* per merge */
} replay;

static size_t pair_of(const replay *r, uint32_t a, uint32_t b) {
    return a < b ? (size_t)a * 2 * r->faces + b : (size_t)b * 2 * r->faces + a;
}

static oracle_price price_pair(const replay *r, uint32_t a, uint32_t b) {
    oracle_price *price = &r->prices[pair_of(r, a, b)];
    if (isnan(price->cost))
        *price = oracle_merge_price(&r->o, &r->measures[a], r->members[a], r->counts[a], &r->measures[b],
                                    r->members[b], r->counts[b]);
    return *price;
}

static bool may_merge(const replay *r, uint32_t a, uint32_t b, stage at) {
    const uint32_t *materials = r->mesh->materials;
    if (at <= WITHIN_STEEP && (!materials || materials[r->members[a][0]] != materials[r->members[b][0]]))
        return false;
    uint32_t taller = r->heights[a] > r->heights[b] ? r->heights[a] : r->heights[b];
    return oracle_allows(taller, r->counts[a] + r->counts[b], at == WITHIN_MILD || at == ACROSS_MILD);
}

typedef struct choice {
    uint32_t a, b, pairs;
    double cost, limit;  /* limit: upper bound of the cheapest cost */
    uint32_t least_size; /* the smallest log2 of faces among all pairs */
} choice;

static uint32_t size_class(const replay *r, uint32_t a, uint32_t b) {
    return (uint32_t)floor(log2(r->counts[a] + r->counts[b]));
}

/* Finds the cheapest of all live pairs that may merge, and whether `wanted`, the pair of the library, is one.
 */
static choice find_cheapest(const replay *r, uint32_t step, stage at, const uint32_t wanted[2], bool *there) {
    choice best = {.cost = INFINITY, .limit = INFINITY, .least_size = UINT32_MAX};
    *there = false;
    for (uint32_t l = 0; l < r->o.link_count; ++l) {
        uint32_t a = r->nodes[r->o.links[l].a], b = r->nodes[r->o.links[l].b];
        if (a == b || r->listed[pair_of(r, a, b)] == step + 1 + at * r->faces) continue;
        r->listed[pair_of(r, a, b)] = step + 1 + at * r->faces;
        if (!may_merge(r, a, b, at)) continue;
        ++best.pairs;
        oracle_price price = price_pair(r, a, b);
        if ((a == wanted[0] && b == wanted[1]) || (a == wanted[1] && b == wanted[0])) *there = true;
        if (price.cost < best.cost) best.cost = price.cost, best.a = a, best.b = b;
        best.limit = fmin(best.limit, price.cost + price.slack);
        if (size_class(r, a, b) < best.least_size) best.least_size = size_class(r, a, b);
    }
    return best;
}

static void make_union(replay *r, uint32_t m, const uint32_t pair[2]) {
    uint32_t id = r->faces + m, a = pair[0], b = pair[1];
    r->counts[id] = r->counts[a] + r->counts[b];
    r->heights[id] = 1 + (r->heights[a] > r->heights[b] ? r->heights[a] : r->heights[b]);
    r->members[id] = malloc(r->counts[id] * sizeof **r->members);
    memcpy(r->members[id], r->members[a], r->counts[a] * sizeof **r->members);
    memcpy(r->members[id] + r->counts[a], r->members[b], r->counts[b] * sizeof **r->members);
    for (uint32_t i = 0; i < r->counts[id]; ++i) r->nodes[r->members[id][i]] = id;
    r->measures[id] = oracle_measure(&r->o, r->members[id], r->counts[id]);
}

static bool is_live(const replay *r, uint32_t id) {
    return r->members[id] && r->nodes[r->members[id][0]] == id;
}

static double shared_border(const replay *r, uint32_t a, uint32_t b) {
    double length = 0;
    for (uint32_t l = 0; l < r->o.link_count; ++l) {
        uint32_t p = r->nodes[r->o.links[l].a], q = r->nodes[r->o.links[l].b];
        if ((p == a && q == b) || (p == b && q == a)) length += r->o.links[l].length;
    }
    return length;
}

/* The cost in double; the tree and the list of merges hold it as a float. */
static void check_mean(const replay *r, uint32_t m, const uint32_t pair[2], oracle_price price) {
    fct_mean_record *a = &r->means[pair[0]], *b = &r->means[pair[1]];
    double shared = shared_border(r, pair[0], pair[1]), cost = fct_mean_cost(&r->work->metric, a, b, shared);
    if (!(fabs(cost - price.cost) <= price.slack))
        fail_msg("%s: merge %u costs %.17g in double, should cost %.17g (off by %.3g, slack %.3g)", r->name,
                 m, cost, price.cost, cost - price.cost, price.slack);
    r->means[r->faces + m] = *a;
    fct_mean_merge(&r->means[r->faces + m], b, shared);
}

static bool are_neighbors(const replay *r, uint32_t a, uint32_t b) {
    for (uint32_t l = 0; l < r->o.link_count; ++l) {
        uint32_t p = r->nodes[r->o.links[l].a], q = r->nodes[r->o.links[l].b];
        if ((p == a && q == b) || (p == b && q == a)) return true;
    }
    return false;
}

/* Compares one merge of the library with all possible merges. */
static stage check_merge(replay *r, uint32_t m, stage at) {
    uint32_t pair[2] = {r->work->children[m][0], r->work->children[m][1]};
    if (!is_live(r, pair[0]) || !is_live(r, pair[1]) || pair[0] == pair[1])
        fail_msg("%s: merge %u joins %u and %u, which are not both live", r->name, m, pair[0], pair[1]);
    bool there = false;
    choice best = find_cheapest(r, m, at, pair, &there);
    while (best.pairs == 0 && at < JOIN) best = find_cheapest(r, m, ++at, pair, &there);
    oracle_price price = price_pair(r, pair[0], pair[1]);
    if (at < JOIN && !there)
        fail_msg("%s: merge %u joins %u and %u, which may not merge yet", r->name, m, pair[0], pair[1]);
    if (at < JOIN && !(price.cost - price.slack <= best.limit))
        fail_msg(
            "%s: merge %u joins %u and %u (%u and %u faces) at %.17g; %u and %u (%u and %u faces) cost %.17g",
            r->name, m, pair[0], pair[1], r->counts[pair[0]], r->counts[pair[1]], price.cost, best.a, best.b,
            r->counts[best.a], r->counts[best.b], best.cost);
    double cost = (double)r->work->costs[m];
    if (r->o.cost == FCT_COST_MEAN) check_mean(r, m, pair, price);
    if (at == JOIN && are_neighbors(r, pair[0], pair[1]))
        price.cost = cost; /* the border of a grafted merge is unknown */
    if (!(fabs(cost - price.cost) <= price.slack + 1e-7 * fabs(price.cost)))
        fail_msg("%s: merge %u of %u and %u (%u and %u faces) costs %.17g, should cost %.17g (off by %g, "
                 "slack %g)",
                 r->name, m, pair[0], pair[1], r->counts[pair[0]], r->counts[pair[1]], cost, price.cost,
                 cost - price.cost, price.slack);
    bool unweighted = r->o.fit_weight + r->o.direction_weight + r->o.shape_weight == 0;
    if (at < JOIN && unweighted && size_class(r, pair[0], pair[1]) != best.least_size)
        fail_msg("%s: merge %u makes %u faces although a smaller union ties", r->name, m,
                 r->counts[pair[0]] + r->counts[pair[1]]);
    r->costs[m] = price.cost, r->slacks[m] = price.slack, r->stages[m] = at;
    make_union(r, m, pair);
    return at;
}

/* --- The tree --- */

/* The cost of a node is the largest of its subtree, and at least that of every merge of an earlier stage. */
static void raise_costs(const replay *r, float *raised) {
    float floor = -INFINITY, highest = -INFINITY;
    int phase = 0;
    for (uint32_t m = 0; m < r->merges; ++m) {
        int now = r->stages[m] <= WITHIN_STEEP ? 0 : r->stages[m] <= ACROSS_STEEP ? 1 : 2;
        if (now > phase) floor = highest, phase = now;
        raised[m] = fmaxf((float)r->work->costs[m], floor);
        for (int k = 0; k < 2; ++k) {
            uint32_t child = r->work->children[m][k];
            if (child >= r->faces) raised[m] = fmaxf(raised[m], raised[child - r->faces]);
        }
        highest = fmaxf(highest, raised[m]);
    }
}

static void check_node(const replay *r, const fct_tree *tree, uint32_t node, uint32_t m, float cost) {
    fct_tree_view view = fct_tree_get(tree);
    fct_cluster c;
    assert_int_equal(fct_tree_cluster(tree, node, &c), FCT_OK);
    uint32_t id = r->faces + m;
    bool same = c.count == r->counts[id];
    memset(r->o.inside, 0, r->faces);
    for (uint32_t i = 0; i < r->counts[id]; ++i) r->o.inside[r->members[id][i]] = 1;
    for (uint32_t i = 0; same && i < c.count; ++i) same = r->o.inside[view.face_ids[c.first + i]];
    memset(r->o.inside, 0, r->faces);
    if (!same)
        fail_msg(
            "%s: node %u (%u faces, cost %.9g) does not hold the faces of merge %u (%u faces, cost %.9g)",
            r->name, node, c.count, (double)c.cost, m, r->counts[id], (double)cost);
    if (!(c.cost == cost))
        fail_msg("%s: node %u has cost %.9g, merge %u %.9g", r->name, node, (double)c.cost, m, (double)cost);
}

/* Costs are compared by their bits, so -0 comes before 0. */
static bool comes_first(float a, float b) {
    return a != b ? a < b : signbit(a) && !signbit(b);
}

/* Node M - 1 - i is the merge with the i-th lowest cost. Among equal costs the earlier merge comes first. */
static void check_order(const replay *r, const fct_tree *tree) {
    assert_int_equal(fct_tree_get(tree).node_count, r->merges);
    float *raised = malloc(r->merges * sizeof *raised);
    bool *done = calloc(r->merges, sizeof *done);
    raise_costs(r, raised);
    for (uint32_t i = 0; i < r->merges; ++i) {
        uint32_t next = UINT32_MAX;
        for (uint32_t m = 0; m < r->merges; ++m)
            if (!done[m] && (next == UINT32_MAX || comes_first(raised[m], raised[next]))) next = m;
        done[next] = true;
        check_node(r, tree, r->merges - 1 - i, next, raised[next]);
    }
    free(raised), free(done);
}

/* --- One mesh --- */

static void replay_create(replay *r, const char *name, const fct_mesh *mesh, const fct_tree_def *def,
                          const fct_work *work) {
    size_t faces = mesh->face_count, pairs = 4 * faces * faces;
    *r = (replay){.name = name,
                  .mesh = mesh,
                  .o = oracle_create(mesh, def),
                  .faces = mesh->face_count,
                  .merges = work->merge_count,
                  .work = work};
    r->members = calloc(2 * faces, sizeof *r->members);
    r->means = calloc(2 * faces, sizeof *r->means);
    r->measures = calloc(2 * faces, sizeof *r->measures);
    r->counts = calloc(2 * faces, sizeof *r->counts);
    r->heights = calloc(2 * faces, sizeof *r->heights);
    r->prices = malloc(pairs * sizeof *r->prices);
    r->listed = calloc(pairs, sizeof *r->listed);
    r->nodes = calloc(faces, sizeof *r->nodes);
    r->costs = calloc(faces, sizeof *r->costs);
    r->slacks = calloc(faces, sizeof *r->slacks);
    r->stages = calloc(faces, sizeof *r->stages);
    for (size_t i = 0; i < pairs; ++i) r->prices[i].cost = NAN;
    for (uint32_t f = 0; f < faces; ++f) {
        r->members[f] = malloc(sizeof **r->members);
        r->members[f][0] = r->nodes[f] = f;
        r->counts[f] = 1;
        fct_mean_face(&work->metric, mesh->positions, mesh->triangles + 3 * (size_t)f, &r->means[f]);
        r->measures[f] = oracle_measure(&r->o, r->members[f], 1);
    }
}

static void replay_destroy(replay *r) {
    for (uint32_t i = 0; i < 2 * r->faces; ++i) free(r->members[i]);
    free(r->means), free(r->measures), free(r->members), free(r->counts), free(r->heights), free(r->prices),
        free(r->listed), free(r->nodes);
    free(r->costs), free(r->slacks), free(r->stages);
    oracle_destroy(&r->o);
}

/* Contracts as fct_tree_build does. Returns whether height limits left neighbours unmerged; fct_tree_build
 * then starts again by size. */
static bool contract(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def, fct_work *work) {
    assert_int_equal(fct_work_create(env, mesh, def, work), FCT_OK);
    for (int across = !mesh->materials; across < 2; ++across)
        for (int steep = 0; steep < 2; ++steep) {
            work->steep = steep;
            assert_int_equal(fct_work_greedy(work, across), FCT_OK);
        }
    bool stranded = work->edge_count > 0;
    assert_int_equal(fct_work_join(work, mesh), FCT_OK);
    assert_int_equal(work->merge_count, mesh->face_count - 1);
    return stranded;
}

static void check_contraction(const char *name, const fct_mesh *mesh, const fct_tree_def *def) {
    fct_env env = fct_env_default();
    fct_work work;
    bool stranded = contract(&env, mesh, def, &work);
    replay r;
    replay_create(&r, name, mesh, def, &work);
    stage at = mesh->materials ? WITHIN_MILD : ACROSS_MILD;
    for (uint32_t m = 0; m < r.merges; ++m) at = check_merge(&r, m, at);
    /* fit or shape alone may make chains, whose merges the height limits forbid */
    if (stranded) assert_true(def->direction_weight == 0 && def->fit_weight * def->shape_weight == 0);
    fct_tree *tree;
    assert_int_equal(fct_tree_build(&env, mesh, def, NULL, &tree), FCT_OK);
    if (!stranded) check_order(&r, tree);
    fct_tree_destroy(tree);
    replay_destroy(&r);
    fct_work_release(&work);
}

/* --- Meshes and weights --- */

static fct_mesh make_mesh(const fct_env *env, int which, const char **name) {
    fct_mesh mesh;
    switch (which) {
    case 0:
        return *name = "tetrahedron", make_tetrahedron(env);
    case 1:
        return *name = "box", make_box(env, 1, 1.7, 0.6);
    case 2:
        return *name = "terrain", make_terrain(env, 11, 0.25, 1);
    case 3:
        return *name = "flat terrain", make_terrain(env, 8, 0.01, 2);
    case 4:
        return *name = "bent strip", make_bent_strip(env, 40);
    case 5:
        mesh = make_terrain(env, 9, 0.2, 3);
        paint_stripes(env, &mesh, 2, 7);
        return *name = "two materials", mesh;
    case 6:
        return *name = "pages", make_pages(env, 4, 4, 3);
    case 7:
        return *name = "degenerate faces", make_degenerate(env, 5);
    case 8:
        return *name = "parts", make_copies(env, make_terrain(env, 4, 0.2, 4), 4);
    case 9:
        mesh = make_sphere(env, 6);
        roughen(&mesh, 0.1);
        return *name = "rough sphere", mesh;
    case 10:
        return *name = "points", make_points(env);
    default:
        return *name = "grid", make_grid(env, 8);
    }
}
enum { MESHES = 12 };

/* Each term alone, so that no other term hides it, and all together. */
static const double weights[][3] = {{1e4, 1, 0.002}, {1e4, 0, 0},     {0, 1, 0},
                                    {0, 0, 1},       {1e3, 2.5, 0.1}, {0, 0, 0}};

static void check_all(fct_cluster_cost cost, fct_fit_measure measure) {
    fct_env env = fct_env_default();
    for (int which = 0; which < MESHES; ++which) {
        const char *name;
        fct_mesh mesh = make_mesh(&env, which, &name);
        for (size_t w = 0; w < sizeof weights / sizeof *weights; ++w) {
            char text[128];
            fct_tree_def def = fct_tree_def_default();
            def.method = FCT_CLUSTER_GREEDY, def.cost = cost, def.fit_measure = measure;
            def.weld = false; /* the oracle goes by vertices */
            def.fit_weight = weights[w][0] * (cost == FCT_COST_MEAN ? 100 : 1);
            def.direction_weight = weights[w][1], def.shape_weight = weights[w][2];
            snprintf(text, sizeof text, "%s, weights %g %g %g", name, def.fit_weight, def.direction_weight,
                     def.shape_weight);
            check_contraction(text, &mesh, &def);
        }
        fct_mesh_release(&env, &mesh);
    }
}

static void mean_by_points(void **state) {
    (void)state;
    check_all(FCT_COST_MEAN, FCT_FIT_POINTS);
}
static void mean_by_area(void **state) {
    (void)state;
    check_all(FCT_COST_MEAN, FCT_FIT_AREA);
}
static void increment_by_area(void **state) {
    (void)state;
    check_all(FCT_COST_INCREMENT, FCT_FIT_AREA);
}
static void increment_by_points(void **state) {
    (void)state;
    check_all(FCT_COST_INCREMENT, FCT_FIT_POINTS);
}

/* Negative weights select these defaults, and the tree reports them. */
static void default_weights(void **state) {
    (void)state;
    static const double expected[2][3] = {
        [FCT_COST_INCREMENT] = {1e4, 1, 0.002}, [FCT_COST_MEAN] = {1e6, 1, 1}};
    fct_env env = fct_env_default();
    fct_mesh mesh = make_terrain(&env, 6, 0.2, 1);
    for (int cost = 0; cost < 2; ++cost) {
        fct_tree_def def = fct_tree_def_default();
        def.cost = (fct_cluster_cost)cost, def.method = FCT_CLUSTER_GREEDY;
        fct_tree *tree;
        assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_OK);
        def = fct_tree_get(tree).def;
        const double found[3] = {def.fit_weight, def.direction_weight, def.shape_weight};
        for (int i = 0; i < 3; ++i)
            if (fabs(found[i] - expected[cost][i]) > 1e-7 * expected[cost][i])
                fail_msg("weight %d of cost %d is %.9g, should be %.9g", i, cost, found[i],
                         expected[cost][i]);
        check_contraction("default weights", &mesh, &def);
        fct_tree_destroy(tree);
    }
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(default_weights), cmocka_unit_test(mean_by_points),
                                       cmocka_unit_test(mean_by_area), cmocka_unit_test(increment_by_area),
                                       cmocka_unit_test(increment_by_points)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
