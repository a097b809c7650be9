/* Trees built from file to file in parts, against brute force: every node's sums, plane, cone, box and cost,
 * and the file's fields. Parts are small, so most nodes above a thousand faces are joined from several parts.
 */
#define _GNU_SOURCE
#include "cluster/check_tree.h"
#include "cluster/folder.h"
#include "nodes.h"
#include "parts.h"

#include <unistd.h>

/* --- Costs --- */

/* When a merge is made: along an edge inside a material, along any edge, or by proximity. */
typedef enum phase { WITHIN, ACROSS, LOOSE } phase;

typedef struct audit {
    const char *name;
    const fct_tree *tree;
    fct_tree_view view;
    oracle o;
    oracle_cluster *measures; /* per id */
    phase *phases;            /* per id; 0 for a leaf */
    uint32_t *heights;        /* per id */
} audit;

static const uint32_t *faces_of(const audit *a, uint32_t id, uint32_t *count) {
    bool leaf = id >= a->view.node_count;
    *count = leaf ? 1 : a->tree->nodes[id].count;
    return a->view.face_ids + (leaf ? id - a->view.node_count : a->tree->nodes[id].first);
}

static bool are_linked(const audit *a, uint32_t p, uint32_t q) {
    uint32_t p_count, q_count;
    const uint32_t *p_faces = faces_of(a, p, &p_count), *q_faces = faces_of(a, q, &q_count);
    bool found = false;
    for (uint32_t i = 0; i < p_count; ++i) a->o.inside[p_faces[i]] = 1;
    for (uint32_t i = 0; i < q_count; ++i) a->o.inside[q_faces[i]] = 2;
    for (uint32_t i = 0; i < p_count + q_count; ++i) {
        uint32_t face = i < p_count ? p_faces[i] : q_faces[i - p_count];
        for (uint32_t l = a->o.link_starts[face]; l < a->o.link_starts[face + 1]; ++l)
            found |= a->o.inside[face] + a->o.inside[a->o.links[a->o.links_of[l]].b] == 3;
    }
    for (uint32_t i = 0; i < p_count; ++i) a->o.inside[p_faces[i]] = 0;
    for (uint32_t i = 0; i < q_count; ++i) a->o.inside[q_faces[i]] = 0;
    return found;
}

/* Merges along an edge need a common border and keep the height limit. */
static phase phase_of(const audit *a, uint32_t id) {
    const uint32_t *child = a->tree->nodes[id].child, *materials = a->o.materials;
    uint32_t count, tallest = 0;
    const uint32_t *faces = faces_of(a, id, &count);
    phase last = materials ? WITHIN : ACROSS;
    for (int k = 0; k < 2; ++k) {
        if (a->heights[child[k]] > tallest) tallest = a->heights[child[k]];
        if (a->phases[child[k]] > last) last = a->phases[child[k]];
    }
    if (!are_linked(a, child[0], child[1]) || !oracle_allows(tallest, count, false)) return LOOSE;
    for (uint32_t i = 1; i < count && materials; ++i)
        if (materials[faces[i]] != materials[faces[0]] && last < ACROSS) last = ACROSS;
    return last;
}

static oracle_price price_of(const audit *a, uint32_t p, uint32_t q) {
    uint32_t p_count, q_count;
    const uint32_t *p_faces = faces_of(a, p, &p_count), *q_faces = faces_of(a, q, &q_count);
    return oracle_merge_price(&a->o, &a->measures[p], p_faces, p_count, &a->measures[q], q_faces, q_count);
}

static double cost_of(const audit *a, uint32_t id) {
    return id < a->view.node_count ? (double)a->tree->nodes[id].cost : -INFINITY;
}

/* The cost of a node is the price of its merge, but at least the costs of its children of the same phase, and
 * at least the highest cost of all earlier phases. The price of clusters whose merge waited for the proximity
 * phase although they have a border is not known. */
static void check_cost(const audit *a, uint32_t id, const double highest[3]) {
    const fct_cluster *c = &a->tree->nodes[id];
    phase at = a->phases[id];
    oracle_price price = price_of(a, c->child[0], c->child[1]);
    double least = -INFINITY, found = (double)c->cost;
    for (int p = WITHIN; p < (int)at; ++p) least = fmax(least, highest[p]);
    for (int k = 0; k < 2; ++k) least = fmax(least, cost_of(a, c->child[k]));
    double wanted = fmax(least, price.cost), slack = price.slack + 1e-7 * fabs(wanted) + 1e-15;
    if (a->o.cost == FCT_COST_MEAN) slack += 1e-6 * (1 + fabs(wanted)); /* borders are floats */
    bool known = at < LOOSE || !are_linked(a, c->child[0], c->child[1]);
    if (!(known ? fabs(found - wanted) <= slack : found >= least))
        fail_msg("%s: node %u of %u faces in phase %d costs %.9g, should cost %.9g (price %.9g, slack %.3g)",
                 a->name, id, c->count, (int)at, found, wanted, price.cost, slack);
}

static audit open_audit(const char *name, const fct_tree *tree, const fct_mesh *mesh) {
    audit a = {.name = name, .tree = tree, .view = fct_tree_get(tree)};
    uint32_t nodes = a.view.node_count, all = nodes + a.view.face_count;
    a.o = oracle_create(mesh, &a.view.def);
    a.measures = malloc(all * sizeof *a.measures);
    a.phases = calloc(all, sizeof *a.phases), a.heights = calloc(all, sizeof *a.heights);
    for (uint32_t id = 0; id < all; ++id) {
        uint32_t count;
        const uint32_t *faces = faces_of(&a, id, &count);
        a.measures[id] = oracle_measure(&a.o, faces, count);
    }
    for (uint32_t id = nodes; id-- > 0;) {
        const uint32_t *child = tree->nodes[id].child;
        a.phases[id] = phase_of(&a, id);
        a.heights[id] =
            1 + (a.heights[child[0]] > a.heights[child[1]] ? a.heights[child[0]] : a.heights[child[1]]);
    }
    return a;
}

static void close_audit(audit *a) {
    oracle_destroy(&a->o);
    free(a->measures), free(a->phases), free(a->heights);
}

static void check_costs(const audit *a) {
    double highest[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t id = 0; id < a->view.node_count; ++id)
        highest[a->phases[id]] = fmax(highest[a->phases[id]], cost_of(a, id));
    for (uint32_t id = a->view.node_count; id-- > 0;) check_cost(a, id, highest);
}

/* The share of merges for which one of the two clusters had a cheaper neighbour, when the merges are made
 * again in the order of the ids. */
static double share_of_hasty_merges(const audit *a) {
    uint32_t nodes = a->view.node_count, hasty = 0, *at = malloc(4 * (size_t)a->view.face_count);
    for (uint32_t p = 0; p < a->view.face_count; ++p) at[a->view.face_ids[p]] = nodes + p;
    for (uint32_t id = nodes; id-- > 0;) {
        const uint32_t *child = a->tree->nodes[id].child;
        oracle_price made = price_of(a, child[0], child[1]);
        bool worse = false;
        for (uint32_t l = 0; l < a->o.link_count && !worse; ++l) {
            uint32_t p = at[a->o.links[l].a], q = at[a->o.links[l].b];
            if (p == q || (p != child[0] && p != child[1] && q != child[0] && q != child[1])) continue;
            if ((p == child[0] && q == child[1]) || (p == child[1] && q == child[0])) continue;
            oracle_price other = price_of(a, p, q);
            worse = other.cost + other.slack < made.cost - made.slack;
        }
        hasty += worse;
        uint32_t count;
        const uint32_t *faces = faces_of(a, id, &count);
        for (uint32_t i = 0; i < count; ++i) at[faces[i]] = id;
    }
    free(at);
    return (double)hasty / nodes;
}

/* --- The file --- */

static fct_tree *build(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def,
                       const fct_large_def *large, fct_large_stats *stats) {
    fct_tree *tree;
    assert_int_equal(fct_mesh_save(env, mesh_path, mesh, NULL), FCT_OK);
    assert_int_equal(fct_tree_build_file(env, mesh_path, tree_path, def, large, stats), FCT_OK);
    assert_int_equal(fct_tree_open(env, tree_path, &tree), FCT_OK);
    assert_int_equal(fct_tree_verify(env, tree), FCT_OK);
    fct_tree_view view = fct_tree_get(tree);
    check_mesh(&view, mesh);
    check_links(tree);
    assert_true(stats->depth == view.depth && stats->mean_depth == view.mean_depth);
    return tree;
}

static fct_large_def parts_of(uint32_t faces) {
    fct_large_def large = fct_large_def_default();
    large.part_faces = faces;
    return large;
}

/* A box of more than a thousand faces is no larger than those with the axes of its children and of the world.
 */
static void check_frames(const char *name, const fct_tree *tree) {
    static const double world[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    fct_tree_view view = fct_tree_get(tree);
    for (uint32_t id = 0; id < view.node_count; ++id) {
        node n = {
            .name = name, .id = id, .view = &view, .record = tree->nodes[id], .count = tree->nodes[id].count};
        if (n.count <= BLOCK) continue;
        load_corners(&n);
        fct_box box;
        fct_cluster_box(&n.record, &box);
        double least = area_along(&n, world);
        for (int k = 0; k < 3; ++k) {
            double axes[3][3];
            if (k < 2 && n.record.child[k] >= view.node_count) continue;
            if (k < 2)
                fct_cluster_box(&tree->nodes[n.record.child[k]], &box);
            else
                fct_cluster_box(&n.record, &box);
            for (int i = 0; i < 9; ++i) axes[i / 3][i % 3] = (double)box.axes[i / 3][i % 3];
            double area = area_along(&n, (const double(*)[3])axes);
            if (k < 2)
                least = fmin(least, area);
            else if (area > 1.00001 * least)
                expect(&n, "area of the box", area, least, 0);
        }
        free(n.corners);
    }
}

static void nodes_and_costs(void **state) {
    (void)state;
    fct_env env = single();
    excesses all = {0};
    for (int which = 0; which < PART_MESHES; ++which) {
        const char *name;
        fct_mesh mesh = make_part_mesh(&env, which, &name);
        fct_tree_def def = def_of(part_options[which]);
        fct_large_def large = parts_of(mesh.face_count / (which % 2 ? 30 : 6));
        fct_large_stats stats;
        fct_tree *tree = build(&env, &mesh, &def, &large, &stats);
        check_nodes(name, tree, 1e-3, &all);
        check_frames(name, tree);
        audit a = open_audit(name, tree, &mesh);
        check_costs(&a);
        close_audit(&a);
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
    check_excess("eight angles, all vertices", &all.exact, 1.00001, 1.000001);
    check_excess("eight angles, 64 vertices", &all.sampled, 1.35, 1.013);
    check_excess("any angle", &all.fine, 5, 1.03);
    check_excess("large clusters' eight angles", &all.own, 1.05, 0.96);
}

/* Merges inside a part wait for the other parts, so that almost none is made too early. */
static void few_merges_are_hasty(void **state) {
    (void)state;
    fct_env env = single();
    for (int which = 0; which < 3; ++which) {
        const char *name;
        fct_mesh mesh = make_part_mesh(&env, which, &name);
        fct_tree_def def = def_of(1);
        fct_large_stats stats;
        fct_large_def large = parts_of(mesh.face_count / 6);
        fct_tree *tree = build(&env, &mesh, &def, &large, &stats);
        audit a = open_audit(name, tree, &mesh);
        double share = share_of_hasty_merges(&a);
        if (share > 0.006) fail_msg("%s: %g of the merges are hasty", name, share);
        assert_true(stats.top_count < 0.75 * mesh.face_count); /* but the insides of parts do not wait */
        close_audit(&a);
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
}

/* --- Little memory --- */

/* An allocator that knows the bytes in use and the most so far. */
typedef struct meter {
    size_t now, most;
} meter;

static void *meter_allocate(void *user, size_t size) {
    meter *m = user;
    char *memory = aligned_alloc(64, size + 64);
    if (!memory) return NULL;
    memcpy(memory, &size, sizeof size);
    m->now += size;
    if (m->now > m->most) m->most = m->now;
    return memory + 64;
}

static void meter_release(void *user, void *memory) {
    meter *m = user;
    size_t size;
    memcpy(&size, (char *)memory - 64, sizeof size);
    m->now -= size;
    free((char *)memory - 64);
}

/* With the least memory, parts join clusters by proximity. The tree is still right, and as low as any. */
static void least_memory(void **state) {
    (void)state;
    excesses all = {0};
    for (int which = 1; which < PART_MESHES; which += 2) {
        meter m = {0};
        fct_env env = single();
        const char *name;
        fct_mesh mesh = make_part_mesh(&env, which, &name);
        fct_tree_def def = def_of(part_options[which]);
        fct_large_def large = parts_of(mesh.face_count / 20);
        fct_large_stats stats;
        large.max_memory = fct_tree_build_need(mesh.face_count, mesh.vertex_count, &def).in_parts;
        env.allocate = meter_allocate, env.release = meter_release, env.memory_user = &m;
        fct_tree *tree = build(&env, &mesh, &def, &large, &stats);
        /* tops take 640 bytes, and half of 7/8 of the memory less 12 MiB; each part may have 16 more
         */
        assert_true(stats.top_count <=
                    (large.max_memory / 8 * 7 - (12 << 20)) / 1280 + 16 * stats.part_count);
        check_nodes(name, tree, 1e-3, &all);
        check_frames(name, tree);
        fct_tree_destroy(tree);
        assert_true(m.now == 0 && m.most <= large.max_memory);
        env.allocate = NULL, env.release = NULL;
        fct_mesh_release(&env, &mesh);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(nodes_and_costs),
                                       cmocka_unit_test(few_merges_are_hasty),
                                       cmocka_unit_test(least_memory)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
