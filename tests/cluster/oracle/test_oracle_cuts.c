/* Cuts of a tree by count, by cost and by distance, against partitions from its merges, one after another. */
#include "meshes.h"
#include "oracle.h"

#include "cluster/tree/tree.h"
#include "facetree/partition.h"

/* The partition into `count` clusters by doing all merges except the last ones. labels: per place, the node
 * of the last merge. */
static void apply_merges(const fct_tree *tree, uint32_t count, uint32_t *labels) {
    const fct_tree_view *view = &tree->view;
    for (uint32_t p = 0; p < view->face_count; ++p) labels[p] = view->node_count + p;
    for (uint32_t id = view->node_count, left = view->face_count; left > count; --left) {
        const fct_cluster *c = &tree->nodes[--id];
        for (uint32_t p = c->first; p < c->first + c->count; ++p) labels[p] = id;
    }
}

static void check_partition(const char *name, const fct_tree *tree, uint32_t wanted, const uint32_t *labels,
                            const uint32_t *nodes, uint32_t count) {
    const fct_tree_view *view = &tree->view;
    uint32_t place = 0;
    for (uint32_t i = 0; i < count; ++i) {
        bool leaf = nodes[i] >= view->node_count;
        uint32_t first = leaf ? nodes[i] - view->node_count : tree->nodes[nodes[i]].first;
        uint32_t faces = leaf ? 1 : tree->nodes[nodes[i]].count;
        if (first != place)
            fail_msg("%s: of %u clusters, node %u begins at %u, not at %u", name, wanted, nodes[i], first,
                     place);
        for (uint32_t p = first; p < first + faces; ++p)
            if (labels[p] != nodes[i])
                fail_msg("%s: of %u clusters, place %u is in node %u, should be in %u", name, wanted, p,
                         nodes[i], labels[p]);
        place += faces;
    }
    if (place != view->face_count)
        fail_msg("%s: of %u clusters, the nodes hold %u faces", name, wanted, place);
}

static void check_counts(const char *name, const fct_tree *tree) {
    fct_env env = fct_env_default();
    fct_tree_view view = fct_tree_get(tree);
    uint32_t *labels = malloc(view.face_count * sizeof *labels),
             *nodes = malloc(view.face_count * sizeof *nodes), written;
    for (uint32_t count = 0; count <= view.face_count + 1; ++count) {
        uint32_t wanted = count < view.root_count   ? view.root_count
                          : count > view.face_count ? view.face_count
                                                    : count;
        assert_int_equal(fct_tree_partition(&env, tree, count, nodes, &written), FCT_OK);
        if (written != wanted) fail_msg("%s: %u clusters instead of %u", name, written, wanted);
        apply_merges(tree, wanted, labels);
        check_partition(name, tree, wanted, labels, nodes, written);
    }
    free(labels), free(nodes);
}

static void check_costs(const char *name, const fct_tree *tree) {
    fct_tree_view view = fct_tree_get(tree);
    for (uint32_t i = 0; i < view.node_count; ++i)
        for (int side = -1; side <= 1; ++side) {
            float cost = tree->nodes[i].cost;
            double limit = (double)(side < 0   ? nextafterf(cost, -INFINITY)
                                    : side > 0 ? nextafterf(cost, INFINITY)
                                               : cost);
            uint32_t count = view.face_count;
            for (uint32_t k = 0; k < view.node_count; ++k) count -= (double)tree->nodes[k].cost <= limit;
            uint32_t found = fct_tree_count_at_cost(tree, limit);
            if (found != count)
                fail_msg("%s: %u clusters at a cost of %.9g, should be %u", name, found, limit, count);
        }
}

/* The largest distance of a node's vertices from its plane. */
static double measure_node(const fct_tree *tree, uint32_t node) {
    fct_tree_view view = fct_tree_get(tree);
    fct_cluster c;
    assert_int_equal(fct_tree_cluster(tree, node, &c), FCT_OK);
    double largest = 0;
    for (size_t i = 3 * (size_t)c.first; i < 3 * ((size_t)c.first + c.count); ++i) {
        const float *p = view.positions + 3 * (size_t)view.triangles[i];
        double distance = (double)c.plane[3];
        for (int k = 0; k < 3; ++k) distance += (double)c.plane[k] * (double)p[k];
        largest = fmax(largest, fabs(distance));
    }
    return largest;
}

/* The topmost nodes within the distance, in the order of places. distances: per node; leaves always pass. */
static uint32_t cut_below(const fct_tree *tree, uint32_t node, const double *distances, double limit,
                          uint32_t *nodes, uint32_t count) {
    if (node >= tree->view.node_count || distances[node] <= limit) {
        nodes[count] = node;
        return count + 1;
    }
    for (int k = 0; k < 2; ++k)
        count = cut_below(tree, tree->nodes[node].child[k], distances, limit, nodes, count);
    return count;
}

static void check_distances(const char *name, const fct_tree *tree) {
    fct_env env = fct_env_default();
    fct_tree_view view = fct_tree_get(tree);
    uint32_t faces = view.face_count, all = view.node_count + faces, count;
    double *distances = malloc(all * sizeof *distances), largest;
    uint32_t *nodes = malloc(faces * sizeof *nodes), *wanted = malloc(faces * sizeof *wanted);
    for (uint32_t i = 0; i < all; ++i) distances[i] = measure_node(tree, i);
    for (uint32_t i = 0; i < view.node_count; i += 1 + view.node_count / 60)
        for (int side = -1; side <= 1; side += 2) { /* slightly below and above the distance of a node */
            double limit = distances[i] * (1 + 1e-6 * side) + (side > 0 ? 1e-12 : 0), most = 0;
            uint32_t number = 0;
            for (uint32_t r = 0; r < view.root_count; ++r)
                number = cut_below(tree, view.roots[r], distances, limit, wanted, number);
            for (uint32_t k = 0; k < number; ++k) most = fmax(most, distances[wanted[k]]);
            assert_int_equal(fct_tree_cut_at_distance(&env, tree, limit, nodes, &count, &largest), FCT_OK);
            if (count != number)
                fail_msg("%s: %u clusters within %.9g, should be %u", name, count, limit, number);
            for (uint32_t k = 0; k < number; ++k)
                if (nodes[k] != wanted[k])
                    fail_msg("%s: within %.9g, cluster %u is node %u, should be %u", name, limit, k, nodes[k],
                             wanted[k]);
            if (!(fabs(largest - most) <= 1e-12 + 1e-9 * most))
                fail_msg("%s: the largest distance is %.9g, should be %.9g", name, largest, most);
        }
    free(distances), free(nodes), free(wanted);
}

/* The number of clusters of a tree with limits of roots and cost. */
static uint32_t count_roots(const fct_mesh *mesh, uint32_t roots, double max_cost) {
    fct_env env = fct_env_default();
    fct_tree *whole;
    assert_int_equal(fct_tree_build(&env, mesh, NULL, NULL, &whole), FCT_OK);
    fct_tree_view view = fct_tree_get(whole);
    uint32_t count = view.face_count;
    for (uint32_t id = view.node_count; id-- > 0 && count > roots; --count) {
        fct_cluster c;
        assert_int_equal(fct_tree_cluster(whole, id, &c), FCT_OK);
        if ((double)c.cost > max_cost) break;
    }
    fct_tree_destroy(whole);
    return count;
}

/* All checks for a small mesh; only distances for a large one. */
static void check_mesh_cuts(const char *name, const fct_mesh *mesh, uint32_t roots, double max_cost) {
    fct_env env = fct_env_default();
    fct_tree *tree;
    fct_tree_def def = fct_tree_def_default();
    def.root_count = roots, def.max_cost = max_cost;
    assert_int_equal(fct_tree_build(&env, mesh, &def, NULL, &tree), FCT_OK);
    assert_int_equal(fct_tree_get(tree).root_count, count_roots(mesh, roots, max_cost));
    if (mesh->face_count < 1000) {
        check_counts(name, tree);
        check_costs(name, tree);
    }
    check_distances(name, tree);
    fct_tree_destroy(tree);
}

/* A tree may stop at any cost. */
static void check_stops(const fct_mesh *mesh) {
    fct_env env = fct_env_default();
    for (double cost = 1e-6; cost < 1; cost *= 1.5) {
        fct_tree *tree;
        fct_tree_def def = fct_tree_def_default();
        def.max_cost = cost;
        assert_int_equal(fct_tree_build(&env, mesh, &def, NULL, &tree), FCT_OK);
        assert_int_equal(fct_tree_get(tree).root_count, count_roots(mesh, 1, cost));
        fct_tree_destroy(tree);
    }
}

static void cuts(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh meshes[] = {make_terrain(&env, 13, 0.3, 1),
                         make_bent_strip(&env, 50),
                         make_pages(&env, 5, 4, 4),
                         make_grid(&env, 6),
                         make_copies(&env, make_terrain(&env, 5, 0.2, 4), 4),
                         make_box(&env, 1, 1, 1),
                         make_tetrahedron(&env),
                         make_terrain(&env, 30, 0.3, 2)};
    const char *names[] = {"terrain", "bent strip", "pages",       "grid",
                           "parts",   "cube",       "tetrahedron", "large terrain"};
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; ++i) {
        check_mesh_cuts(names[i], &meshes[i], 1, INFINITY);
        check_mesh_cuts(names[i], &meshes[i], 3, INFINITY);
        check_mesh_cuts(names[i], &meshes[i], 1, 1e-3);
        fct_mesh_release(&env, &meshes[i]);
    }
    fct_mesh terrain = make_terrain(&env, 13, 0.3, 1);
    check_stops(&terrain);
    fct_mesh_release(&env, &terrain);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(cuts)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
