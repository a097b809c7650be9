/* The packed structure against the mesh: scale, leaves, boxes and their padding, kinds of nodes, splits. */
#include "packed.h"

#include "bvh/build/collapse.h"
#include "bvh/build/leaves.h"
#include "bvh/build/slabs.h"

/* The documented padding of axis and oriented boxes: 64 and 256 times u = 2^-24. */
#define U ldexp(1, -24)

static v3 scaled_corner(const fct_bvh *bvh, uint32_t place, uint32_t c) {
    const fct_tree_view *view = &bvh->view;
    return v3_scale(v3_load(view->positions + 3 * (size_t)view->triangles[3 * (size_t)place + c]),
                    bvh->scale);
}

/* Widens the values that each row takes over the vertices of all leaves below `ref`. */
static void span_rows(const fct_bvh *bvh, uint32_t ref, const plain_box *box, double low[3], double high[3]) {
    if (!is_leaf(ref)) {
        for (uint32_t i = 0; i < child_count(bvh, ref); ++i)
            span_rows(bvh, child_of(bvh, ref, i), box, low, high);
        return;
    }
    const fct_leaf *leaf = fct_bvh_leaf(bvh, ref);
    for (uint32_t t = leaf->first; t < leaf->first + leaf->count; ++t)
        for (uint32_t c = 0; c < 3; ++c) {
            v3 p = scaled_corner(bvh, t, c);
            for (int k = 0; k < 3; ++k) {
                double at = v3_dot(box->row[k], p) + box->offset[k];
                low[k] = fmin(low[k], at), high[k] = fmax(high[k], at);
            }
        }
}

typedef struct tally {
    uint32_t axis, oriented, leaves;
} tally;

/* The distance of each box side from the outermost vertex is at least the padding, and hardly more. */
static void check_boxes(const fct_bvh *bvh, uint32_t ref, tally *found) {
    if (is_leaf(ref)) {
        ++found->leaves;
        return;
    }
    *(is_oriented(ref) ? &found->oriented : &found->axis) += 1;
    uint32_t count = child_count(bvh, ref);
    assert_true(count >= 2 && count <= 8);
    for (uint32_t i = 0; i < count; ++i) {
        plain_box box = box_of(bvh, ref, i);
        double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
        uint32_t child = child_of(bvh, ref, i);
        span_rows(bvh, child, &box, low, high);
        double pad = is_oriented(ref) ? 256 * U : 64 * U, slack = is_oriented(ref) ? 40 * U : 4 * U;
        for (int k = 0; k < 3; ++k) {
            double half = 1 / v3_norm(box.row[k]);
            double below = (low[k] + 1) * half, above = (1 - high[k]) * half;
            assert_true(below > pad - slack && below < pad + slack);
            assert_true(above > pad - slack && above < pad + slack);
            v3 next = box.row[(k + 1) % 3];
            assert_true(fabs(v3_dot(box.row[k], next)) < 1e-5 * v3_norm(box.row[k]) * v3_norm(next));
        }
        check_boxes(bvh, child, found);
    }
}

/* Exact: products of differences of floats fit into a long double's 64 bits for such coordinates. */
static bool has_no_area(const fct_bvh *bvh, uint32_t place) {
    v3 a = scaled_corner(bvh, place, 0), b = scaled_corner(bvh, place, 1), c = scaled_corner(bvh, place, 2);
    v3 e = v3_sub(b, a), f = v3_sub(c, a);
    return (long double)e.x * (long double)f.y == (long double)e.y * (long double)f.x &&
           (long double)e.y * (long double)f.z == (long double)e.z * (long double)f.y &&
           (long double)e.z * (long double)f.x == (long double)e.x * (long double)f.z;
}

static uint32_t distinct_vertices(const fct_tree_view *view, uint32_t first, uint32_t count) {
    uint32_t distinct = 0;
    for (uint32_t i = 3 * first; i < 3 * (first + count); ++i) {
        uint32_t j = 3 * first;
        while (view->triangles[j] != view->triangles[i]) ++j;
        distinct += j == i;
    }
    return distinct;
}

static fct_cluster cluster_of(const fct_bvh *bvh, uint32_t node) {
    fct_cluster cluster;
    assert_int_equal(fct_tree_cluster(bvh->tree, node, &cluster), FCT_OK);
    return cluster;
}

/* Marks the faces of each leaf, and compares its packed corners with the mesh. */
static void check_leaves(const fct_bvh *bvh, uint32_t ref, unsigned char *seen) {
    if (!is_leaf(ref)) {
        for (uint32_t i = 0; i < child_count(bvh, ref); ++i) check_leaves(bvh, child_of(bvh, ref, i), seen);
        return;
    }
    const fct_leaf *leaf = fct_bvh_leaf(bvh, ref);
    uint32_t vertices = distinct_vertices(&bvh->view, leaf->first, leaf->count);
    assert_true(leaf->count >= 1 && leaf->count <= 16 && vertices <= 16);
    assert_int_equal(leaf->vertex_octets, vertices > 8 ? 2 : 1);
    for (uint32_t i = 0; i < leaf->count; ++i) {
        v3 p[3];
        fct_leaf_triangle(leaf, i, p);
        assert_int_equal(seen[leaf->first + i]++, 0);
        assert_int_equal(leaf->mask >> i & 1, !has_no_area(bvh, leaf->first + i));
        for (uint32_t c = 0; c < 3; ++c)
            assert_true(v3_norm(v3_sub(p[c], scaled_corner(bvh, leaf->first + i, c))) == 0);
    }
    assert_int_equal(leaf->mask >> leaf->count, 0);
    /* The smallest cluster that holds more than this leaf does not fit one. */
    const fct_tree_view *view = &bvh->view;
    fct_cluster smallest = {.count = UINT32_MAX};
    for (uint32_t n = 0; n < view->node_count; ++n) {
        fct_cluster c = cluster_of(bvh, n);
        bool holds = c.first <= leaf->first && c.first + c.count >= leaf->first + leaf->count;
        if (holds && c.count > leaf->count && c.count < smallest.count) smallest = c;
    }
    if (smallest.count == UINT32_MAX) return;
    assert_true(smallest.count > 16 || distinct_vertices(view, smallest.first, smallest.count) > 16);
}

/* Half the surface of the oriented box in the axes of the leaf's cluster, or of its axis box if that is
 * smaller, with padding. */
static double leaf_area(const fct_bvh *bvh, uint32_t ref, bool oriented) {
    const fct_leaf *leaf = fct_bvh_leaf(bvh, ref);
    const fct_tree_view *view = &bvh->view;
    fct_cluster cluster = cluster_of(bvh, view->node_count + leaf->first);
    fct_box fitted;
    for (uint32_t n = 0; n < view->node_count && leaf->count > 1; ++n) {
        fct_cluster c = cluster_of(bvh, n);
        if (c.first == leaf->first && c.count == leaf->count) cluster = c;
    }
    fct_cluster_box(&cluster, &fitted);
    double best = INFINITY, pad = 2 * (oriented ? 256 * U : 64 * U);
    for (int turned = 0; turned < 1 + oriented; ++turned) {
        plain_box box = {.offset = {0, 0, 0}};
        double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
        for (int k = 0; k < 3; ++k)
            box.row[k] = turned ? v3_load(fitted.axes[k]) : v3_make(k == 0, k == 1, k == 2);
        span_rows(bvh, ref, &box, low, high);
        double x = high[0] - low[0] + pad, y = high[1] - low[1] + pad, z = high[2] - low[2] + pad;
        best = fmin(best, x * y + y * z + z * x);
    }
    return best;
}

/* Half the surface of the axis box of everything below `ref`, with padding. */
static double whole_area(const fct_bvh *bvh, uint32_t ref) {
    plain_box box = {.offset = {0, 0, 0}};
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int k = 0; k < 3; ++k) box.row[k] = v3_make(k == 0, k == 1, k == 2);
    span_rows(bvh, ref, &box, low, high);
    double x = high[0] - low[0] + 128 * U, y = high[1] - low[1] + 128 * U, z = high[2] - low[2] + 128 * U;
    return x * y + y * z + z * x;
}

/* A node is oriented exactly if oriented boxes save area of more than half of its own. Checked where all
 * children are leaves, because their axes are known. */
static void check_kinds(const fct_bvh *bvh, uint32_t ref, uint32_t checked[2]) {
    if (is_leaf(ref)) return;
    double saved = 0, half = .5 * whole_area(bvh, ref);
    bool bottom = true;
    for (uint32_t i = 0; i < child_count(bvh, ref); ++i) {
        uint32_t child = child_of(bvh, ref, i);
        check_kinds(bvh, child, checked);
        if (!is_leaf(child)) {
            bottom = false;
            continue;
        }
        saved += leaf_area(bvh, child, false) - leaf_area(bvh, child, true);
    }
    if (!bottom || fabs(saved - half) < 1e-3 * half) return;
    assert_int_equal(is_oriented(ref), saved > half);
    ++checked[is_oriented(ref)];
}

static void check_packed(const fct_env *env, fct_mesh mesh, bool must_orient) {
    model m = model_make(env, mesh, FCT_BACKEND_OBB);
    const fct_bvh *bvh = m.bvh;
    tally found = {0};
    uint32_t checked[2] = {0, 0};
    unsigned char *seen = calloc(mesh.face_count, 1);
    double largest = 0;
    fct_bounds b = fct_bvh_bounds(bvh);
    for (int k = 0; k < 3; ++k) {
        double low = INFINITY, high = -INFINITY;
        for (uint32_t i = 0; i < 3 * mesh.face_count; ++i) {
            double x = mesh.positions[3 * (size_t)mesh.triangles[i] + (size_t)k];
            low = fmin(low, x), high = fmax(high, x);
        }
        assert_true(b.lower[k] == low && b.upper[k] == high);
        largest = fmax(largest, bvh->scale * (high - low) / 2);
        assert_true(fabs(bvh->center[k] - bvh->scale * (low + high) / 2) <= 1e-7);
        /* Rays from afar enter here: beyond every padded box, and within their reach. */
        assert_true(bvh->lower[k] < bvh->scale * low - 512 * U && bvh->lower[k] > bvh->scale * low - .02);
        assert_true(bvh->upper[k] > bvh->scale * high + 512 * U && bvh->upper[k] < bvh->scale * high + .02);
    }
    assert_true(largest >= .5 && largest < 1);
    assert_true(frexp(bvh->scale, &(int){0}) == .5);
    check_boxes(bvh, bvh->root, &found);
    check_leaves(bvh, bvh->root, seen);
    check_kinds(bvh, bvh->root, checked);
    for (uint32_t f = 0; f < mesh.face_count; ++f) assert_int_equal(seen[f], 1);
    assert_true(found.leaves > 20 && found.axis + found.oriented > 4);
    assert_true(must_orient ? checked[1] > 10 : checked[0] > 3);
    free(seen);
    model_release(env, &m);
}

static void boxes_hold_their_vertices_with_the_documented_padding(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    check_packed(&env, make_pebble(&env, 16, 4), false);
    check_packed(&env, make_soup(&env, 900, 2), false);
    check_packed(&env, make_grid(&env, 20), false);
    check_packed(&env, make_bars(&env, 30, 6), true);
}

/* ---- The binary top over leaves ---- */

static double area_of(const float *b) {
    double x = (double)b[3] - (double)b[0], y = (double)b[4] - (double)b[1], z = (double)b[5] - (double)b[2];
    return x * y + y * z + z * x;
}

static void join_bounds(float *to, const float *from) {
    for (int k = 0; k < 3; ++k) to[k] = fminf(to[k], from[k]), to[3 + k] = fmaxf(to[3 + k], from[3 + k]);
}

/* Area times count on both sides of every plane between 16 equal bins of each axis: the least. */
static double best_binned_cost(const float *bounds, const uint32_t *order, uint32_t begin, uint32_t end) {
    double best = INFINITY;
    for (int axis = 0; axis < 3; ++axis) {
        double low = INFINITY, high = -INFINITY;
        for (uint32_t i = begin; i < end; ++i) {
            const float *b = bounds + 6 * (size_t)order[i];
            double center = (double)b[axis] + (double)b[3 + axis];
            low = fmin(low, center), high = fmax(high, center);
        }
        for (int plane = 1; plane < 16 && high > low; ++plane) {
            float side[2][6];
            uint32_t count[2] = {0, 0};
            for (uint32_t i = begin; i < end; ++i) {
                const float *b = bounds + 6 * (size_t)order[i];
                int right = ((double)b[axis] + (double)b[3 + axis] - low) / (high - low) * 16 >= plane;
                if (count[right]++)
                    join_bounds(side[right], b);
                else
                    memcpy(side[right], b, sizeof side[right]);
            }
            if (!count[0] || !count[1]) continue;
            best = fmin(best, area_of(side[0]) * count[0] + area_of(side[1]) * count[1]);
        }
    }
    return best;
}

static void splits_of_the_top_have_the_least_binned_cost(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    enum { COUNT = 5000 }; /* several parts */
    float bounds[6 * COUNT];
    uint64_t seed = 12;
    for (uint32_t i = 0; i < COUNT; ++i)
        for (int k = 0; k < 3; ++k) {
            double at = random_unit(&seed) * (k + 1), size = .2 * random_unit(&seed) * random_unit(&seed);
            bounds[6 * i + (uint32_t)k] = (float)at, bounds[6 * i + 3 + (uint32_t)k] = (float)(at + size);
        }
    fct_leaf_list leaves = {.count = COUNT, .bounds = bounds};
    fct_top top;
    assert_int_equal(fct_top_build(&env, &leaves, 1, &top), FCT_OK);
    assert_int_equal(top.node_count, 2 * COUNT - 1);
    for (uint32_t n = 0; n < top.node_count; ++n) {
        const fct_top_node *node = top.nodes + n;
        float all[6];
        memcpy(all, bounds + 6 * top.order[node->begin], sizeof all);
        for (uint32_t i = node->begin; i < node->end; ++i) join_bounds(all, bounds + 6 * top.order[i]);
        assert_memory_equal(all, node->bounds, sizeof all);
        if (node->left == FCT_NONE) {
            assert_int_equal(node->end, node->begin + 1);
            continue;
        }
        const fct_top_node *left = top.nodes + node->left, *right = top.nodes + node->right;
        assert_true(left->begin == node->begin && left->end == right->begin && right->end == node->end);
        if (node->end - node->begin == 2) continue;
        double cost = area_of(left->bounds) * (left->end - left->begin) +
                      area_of(right->bounds) * (right->end - right->begin);
        assert_true(cost <= best_binned_cost(bounds, top.order, node->begin, node->end) * (1 + 1e-5));
    }
    fct_top_release(&env, &top);
}

/* A top that is split along other axes has bounds along the coordinate axes, of all leaves of a node. */
static void nodes_hold_all_their_leaves(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    enum { COUNT = 3000 };
    static float bounds[6 * COUNT], turned[6 * COUNT];
    uint64_t seed = 14;
    for (uint32_t i = 0; i < 6 * COUNT; i += 6)
        for (uint32_t k = 0; k < 3; ++k) {
            bounds[i + k] = (float)random_unit(&seed), turned[i + k] = (float)random_unit(&seed);
            bounds[i + 3 + k] = bounds[i + k] + .1f, turned[i + 3 + k] = turned[i + k] + .1f;
        }
    fct_leaf_list leaves = {.count = COUNT, .bounds = bounds, .frame_bounds = turned};
    for (uint32_t most = 1; most <= 4; most += 3) {
        fct_top top;
        uint32_t held = 0;
        assert_int_equal(fct_top_build(&env, &leaves, most, &top), FCT_OK);
        for (uint32_t n = 0; n < top.node_count; ++n) {
            const fct_top_node *node = top.nodes + n;
            if (node->begin == node->end) continue; /* unused */
            float all[6];
            memcpy(all, bounds + 6 * top.order[node->begin], sizeof all);
            for (uint32_t i = node->begin; i < node->end; ++i) join_bounds(all, bounds + 6 * top.order[i]);
            assert_memory_equal(all, node->bounds, sizeof all);
            if (node->left == FCT_NONE) held += node->end - node->begin;
        }
        assert_int_equal(held, COUNT);
        fct_top_release(&env, &top);
    }
}

/* Boxes that share a plane, each a sixteenth as thick as the one before: a split takes one away. Then the
 * same along another axis, where a split takes two. Sets at level 48 are halved. */
static void nested_leaves_do_not_make_a_deep_top(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    enum { HALF = 36, COUNT = 2 * HALF };
    float bounds[6 * COUNT] = {0};
    for (int i = 0; i < COUNT; ++i) {
        float *b = bounds + 6 * i;
        b[1] = i < HALF ? -1 : 0;
        b[3] = ldexpf(1, -4 * (i < HALF ? i : HALF));
        b[4] = i < HALF ? 1 : ldexpf(1, -4 * (i - HALF));
        b[5] = 1;
    }
    fct_leaf_list leaves = {.count = COUNT, .bounds = bounds};
    fct_top top;
    assert_int_equal(fct_top_build(&env, &leaves, 1, &top), FCT_OK);
    uint32_t depth[2 * COUNT] = {0}, deepest = 0;
    for (uint32_t n = 0; n < top.node_count; ++n) {
        if (depth[n] > deepest) deepest = depth[n];
        if (top.nodes[n].left != FCT_NONE)
            depth[top.nodes[n].left] = depth[top.nodes[n].right] = depth[n] + 1;
    }
    assert_in_range(deepest, 49, 53);
    fct_top_release(&env, &top);
}

/* The test computes each span again: from all leaves below the node, and from all clusters of the tree. */
static void spans_name_the_clusters_around_their_leaves(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 24, 4), FCT_BACKEND_OBB);
    const fct_tree_view *view = &m.bvh->view;
    fct_leaf_list leaves;
    fct_top top;
    fct_span *spans;
    char *packed = m.bvh->leaves;
    assert_int_equal(fct_leaves_build(m.bvh, &leaves), FCT_OK);
    assert_int_equal(fct_top_build(&env, &leaves, 1, &top), FCT_OK);
    assert_int_equal(fct_spans_build(m.bvh, &leaves, &top, &spans), FCT_OK);
    for (uint32_t n = 0; n < top.node_count; ++n) {
        uint32_t first = UINT32_MAX, last = 0, fewest = UINT32_MAX;
        float area = 0;
        for (uint32_t i = top.nodes[n].begin; i < top.nodes[n].end; ++i) {
            fct_cluster c = cluster_of(m.bvh, leaves.nodes[top.order[i]]);
            if (c.first < first) first = c.first;
            if (c.first + c.count > last) last = c.first + c.count;
            if (c.area > area) area = c.area;
        }
        for (uint32_t k = 0; k < view->node_count; ++k) {
            fct_cluster c = cluster_of(m.bvh, k);
            if (c.first <= first && c.first + c.count >= last && c.count < fewest) fewest = c.count;
        }
        assert_int_equal(spans[n].first, first);
        assert_int_equal(spans[n].last, last);
        assert_true(spans[n].area == area && cluster_of(m.bvh, spans[n].largest).area == area);
        assert_int_equal(cluster_of(m.bvh, spans[n].enclosing).count, fewest);
    }
    fct_release(&env, spans);
    fct_top_release(&env, &top);
    fct_leaf_list_release(&env, &leaves);
    fct_release(&env, packed);
    model_release(&env, &m);
}

/* ---- The collapse to nodes of eight children ---- */

/* The least cost of node n of the top as at most `places` children, by trying everything: the areas of
 * nodes, not of leaves. */
static double least_cost(const fct_top *top, uint32_t n, uint32_t places) {
    const fct_top_node *node = top->nodes + n;
    double area = area_of(node->bounds);
    if (node->left == FCT_NONE) return 0;
    double best = INFINITY;
    for (uint32_t total = places == 1 ? 8 : places, k = 1; k < total; ++k)
        best = fmin(best, least_cost(top, node->left, k) + least_cost(top, node->right, total - k));
    if (places == 1) return area + best;
    return fmin(best, least_cost(top, n, 1));
}

/* The leaves below node n of the top, in bits. */
static uint64_t leaves_below(const fct_top *top, uint32_t n) {
    uint64_t bits = 0;
    for (uint32_t i = top->nodes[n].begin; i < top->nodes[n].end; ++i) bits |= 1ull << top->order[i];
    return bits;
}

static void the_collapse_has_the_least_cost(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint64_t seed = 3;
    for (uint32_t round = 0; round < 60; ++round) {
        enum { MOST = 13 };
        float bounds[6 * MOST];
        uint32_t count = 2 + round % (MOST - 1);
        for (uint32_t i = 0; i < count; ++i)
            for (uint32_t k = 0; k < 3; ++k) {
                double at = random_unit(&seed), size = random_unit(&seed) * random_unit(&seed);
                bounds[6 * i + k] = (float)at, bounds[6 * i + 3 + k] = (float)(at + size);
            }
        fct_leaf_list leaves = {.count = count, .bounds = bounds};
        fct_top top;
        fct_wide_node nodes[MOST];
        uint32_t wide_count, seen[MOST] = {0};
        assert_int_equal(fct_top_build(&env, &leaves, 1, &top), FCT_OK);
        assert_int_equal(fct_collapse(&env, &top, nodes, &wide_count), FCT_OK);
        double cost = 0;
        for (uint32_t n = 0; n < wide_count; ++n) {
            const fct_wide_node *wide = nodes + n;
            assert_true(wide->count >= 2 && wide->count <= 8);
            assert_true(n == 0 ? wide->parent == FCT_NONE : wide->parent < n);
            uint32_t own = n == 0 ? 0 : nodes[wide->parent].top[wide->slot];
            uint64_t below = 0;
            cost += area_of(top.nodes[own].bounds);
            for (uint32_t i = 0; i < wide->count; ++i) {
                const fct_top_node *child = top.nodes + wide->top[i];
                assert_int_equal(below & leaves_below(&top, wide->top[i]), 0);
                below |= leaves_below(&top, wide->top[i]);
                if (child->left != FCT_NONE) continue;
                ++seen[top.order[child->begin]];
            }
            assert_true(below == leaves_below(&top, own));
        }
        for (uint32_t i = 0; i < count; ++i) assert_int_equal(seen[i], 1);
        assert_true(fabs(cost - least_cost(&top, 0, 1)) < 1e-5 * cost);
        fct_top_release(&env, &top);
    }
}

/* Grids above each other in the unit cube. */
static fct_mesh make_layers(const fct_env *env, uint32_t layers) {
    fct_mesh grid = make_grid(env, 8), mesh;
    const uint32_t vertices = (uint32_t)grid.vertex_count, faces = (uint32_t)grid.face_count;
    assert_int_equal(fct_mesh_create(env, layers * vertices, layers * faces, 0, &mesh), FCT_OK);
    for (uint32_t l = 0; l < layers; ++l) {
        float *p = mesh.positions + 3 * (size_t)l * vertices;
        memcpy(p, grid.positions, 3 * (size_t)vertices * sizeof *p);
        for (uint32_t v = 0; v < vertices; ++v) p[3 * v + 2] = (float)l / (float)(layers - 1);
        for (uint32_t k = 0; k < 3 * faces; ++k)
            mesh.triangles[3 * (size_t)l * faces + k] = grid.triangles[k] + l * vertices;
    }
    fct_mesh_release(env, &grid);
    return mesh;
}

static uint32_t largest_leaf(const fct_bvh *bvh) {
    uint32_t most = 0;
    for (size_t at = 0; at < bvh->leaf_bytes;) {
        const fct_leaf *leaf = (const fct_leaf *)(const void *)(bvh->leaves + at);
        if (leaf->count > most) most = leaf->count;
        at += fct_leaf_bytes(leaf->count, leaf->vertex_octets);
    }
    return most;
}

/* A line through the cube meets a layer with a probability of 1/3: about 7 leaves of 20 layers and 27 of 80,
 * and a little more, because clusters are not squares. */
static void leaves_of_a_dense_model_are_small(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model few = model_make(&env, make_layers(&env, 20), FCT_BACKEND_OBB),
          many = model_make(&env, make_layers(&env, 80), FCT_BACKEND_OBB);
    assert_true(largest_leaf(few.bvh) > 8 && largest_leaf(many.bvh) > 4 && largest_leaf(many.bvh) <= 8);
    assert_true(!few.bvh->places && many.bvh->places);
    model_release(&env, &few);
    model_release(&env, &many);
}

/* Asks each query for each face, at a point where no other face is. */
static void expect_every_face(const fct_bvh *bvh, const fct_mesh *mesh, v3 shift) {
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        v3 p[3];
        float at[3];
        uint32_t found = FCT_NONE;
        fct_hit hit;
        fct_closest closest[2];
        face_corners(mesh, f, p);
        v3 middle = v3_add(v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1. / 3), shift);
        v3_store(at, middle);
        fct_ray ray = make_ray(v3_add(middle, v3_make(0, 0, 1e-3)), v3_make(0, 0, -1), 0, INFINITY);
        assert_true(fct_bvh_closest_hit(bvh, &ray, &hit, NULL) && hit.face == f);
        assert_int_equal(bvh->view.face_ids[hit.place], f);
        assert_true(fct_bvh_closest_point(bvh, at, INFINITY, closest, NULL) && closest->face == f);
        assert_int_equal(bvh->view.face_ids[closest->place], f);
        assert_true(closest->distance < 1e-6f);
        assert_true(fct_bvh_nearest(bvh, at, 2, INFINITY, closest, NULL) == 2 && closest->face == f);
        assert_int_equal(bvh->view.face_ids[closest->place], f);
        assert_int_equal(fct_bvh_faces_in_ball(bvh, at, 1e-4f, 1, &found, NULL), 1);
        assert_int_equal(found, f);
    }
}

/* The leaves are not in order of place. */
static void a_dense_model_answers_with_every_face(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_layers(&env, 80), FCT_BACKEND_OBB);
    const uint32_t face_count = m.mesh.face_count;
    uint32_t *seen = fct_allocate_zero(&env, face_count, sizeof *seen);
    for (uint32_t i = 0; i < face_count; ++i) ++seen[m.bvh->places[i]];
    for (uint32_t i = 0; i < face_count; ++i) assert_int_equal(seen[i], 1);
    fct_release(&env, seen);
    expect_every_face(m.bvh, &m.mesh, v3_make(0, 0, 0));
    float *moved = fct_allocate(&env, m.mesh.vertex_count, 3 * sizeof *moved);
    for (size_t i = 0; i < 3 * (size_t)m.mesh.vertex_count; ++i)
        moved[i] = m.mesh.positions[i] + (i % 3 == 0 ? .25f : 0);
    fct_bvh *bvh;
    assert_int_equal(fct_bvh_refit(&env, m.bvh, moved, &bvh, NULL), FCT_OK);
    expect_every_face(bvh, &m.mesh, v3_make(.25, 0, 0));
    fct_bvh_destroy(bvh);
    fct_release(&env, moved);
    model_release(&env, &m);
}

/* ---- Diagonal strips ---- */

enum { STRIPS = 600, PIECES = 12 };

/* Narrow strips that run along axes[0], at random places. */
static fct_mesh make_strips(const fct_env *env, const v3 axes[3]) {
    fct_mesh mesh;
    uint64_t seed = 9;
    assert_int_equal(fct_mesh_create(env, STRIPS * 2 * (PIECES + 1), STRIPS * 2 * PIECES, 0, &mesh), FCT_OK);
    uint32_t *t = mesh.triangles;
    for (uint32_t i = 0; i < STRIPS; ++i) {
        const double from[3] = {.3 * random_unit(&seed), random_unit(&seed), random_unit(&seed)};
        const uint32_t base = i * 2 * (PIECES + 1);
        for (uint32_t v = 0; v < 2 * (PIECES + 1); ++v) {
            const v3 p = {from[0] + (double)(v / 2) / PIECES, from[1] + .004 * (v % 2), from[2]};
            v3_store(mesh.positions + 3 * (size_t)(base + v),
                     v3_add(v3_scale(axes[0], p.x), v3_add(v3_scale(axes[1], p.y), v3_scale(axes[2], p.z))));
        }
        for (uint32_t v = base; v < base + 2 * PIECES; v += 2, t += 6) {
            t[0] = v, t[1] = v + 1, t[2] = v + 3;
            t[3] = v, t[4] = v + 3, t[5] = v + 2;
        }
    }
    return mesh;
}

static uint64_t count_nodes(const fct_env *env, const v3 axes[3]) {
    model m = model_make(env, make_strips(env, axes), FCT_BACKEND_OBB);
    fct_visits visits = {0};
    uint64_t seed = 4;
    for (int i = 0; i < 1000; ++i) {
        v3 ends[2];
        for (int k = 0; k < 2; ++k) {
            const double x = 1.3 * random_unit(&seed), y = random_unit(&seed), z = random_unit(&seed);
            ends[k] = v3_add(v3_scale(axes[0], x), v3_add(v3_scale(axes[1], y), v3_scale(axes[2], z)));
        }
        fct_ray ray = make_ray(ends[0], v3_sub(ends[1], ends[0]), 0, INFINITY);
        fct_hit hit;
        fct_bvh_closest_hit(m.bvh, &ray, &hit, &visits);
    }
    model_release(env, &m);
    return visits.nodes;
}

/* Measured: 1.04 times the nodes; 2.8 times if the top is split along the coordinate axes. */
static void diagonal_strips_cost_as_much_as_straight_ones(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    const v3 straight[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    v3 diagonal[3] = {v3_unit(v3_make(1, 1.1, .9))};
    v3_frame(diagonal[0], &diagonal[1], &diagonal[2]);
    const uint64_t least = count_nodes(&env, straight), found = count_nodes(&env, diagonal);
    assert_true((double)found < 1.3 * (double)least);
}

/* ---- Cubes ---- */

static v3 turn_point(const v3 axes[3], v3 p) {
    return v3_add(v3_scale(axes[0], p.x), v3_add(v3_scale(axes[1], p.y), v3_scale(axes[2], p.z)));
}

enum { ROW = 8, SQUARES = 12 };

/* Cubes at the points of a grid, turned as a whole, and each by itself if `tumbled`. Beside them stand
 * larger tilted squares. */
static fct_mesh make_cubes(const fct_env *env, const v3 axes[3], bool tumbled) {
    static const uint32_t sides[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    const uint32_t cubes = ROW * ROW * ROW;
    fct_mesh mesh;
    uint64_t seed = 6;
    assert_int_equal(fct_mesh_create(env, 8 * cubes + 4 * SQUARES, 12 * cubes + 2 * SQUARES, 0, &mesh),
                     FCT_OK);
    for (uint32_t c = 0; c < cubes; ++c) {
        const v3 at = {c % ROW, c / ROW % ROW, c / ROW / ROW};
        v3 own[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        if (tumbled) {
            own[0] = random_direction(&seed);
            own[1] = v3_unit(v3_cross(own[0], random_direction(&seed)));
            own[2] = v3_cross(own[0], own[1]);
        }
        for (uint32_t v = 0; v < 8; ++v) {
            const v3 corner = v3_make(v & 1 ? .25 : -.25, v & 2 ? .25 : -.25, v & 4 ? .25 : -.25);
            v3_store(mesh.positions + 3 * (8 * c + v), turn_point(axes, v3_add(at, turn_point(own, corner))));
        }
        for (uint32_t t = 0; t < 36; ++t) mesh.triangles[36 * c + t] = 8 * c + sides[t / 3][t % 3];
    }
    for (uint32_t v = 0; v < 4 * SQUARES; ++v) {
        const double x = -1 - .1 * (v / 4), s = v & 1, t = v >> 1 & 1;
        const v3 p = {x - 2 * s - t, 3 * s, 2 * s + 3 * t};
        v3_store(mesh.positions + 3 * (8 * cubes + v), turn_point(axes, p));
    }
    for (uint32_t t = 0; t < 6 * SQUARES; ++t)
        mesh.triangles[36 * cubes + t] = 8 * cubes + 4 * (t / 6) + sides[t % 6 / 3][t % 3];
    return mesh;
}

static fct_visits visit_cubes(const fct_env *env, const v3 axes[3], bool tumbled) {
    model m = model_make(env, make_cubes(env, axes, tumbled), FCT_BACKEND_OBB);
    fct_visits visits = {0};
    uint64_t seed = 4;
    for (int i = 0; i < 2000; ++i) {
        v3 ends[2];
        fct_hit hit;
        for (int k = 0; k < 2; ++k) {
            const double x = ROW * random_unit(&seed), y = ROW * random_unit(&seed),
                         z = ROW * random_unit(&seed);
            ends[k] = turn_point(axes, v3_make(x, y, z));
        }
        const fct_ray ray = make_ray(ends[0], v3_sub(ends[1], ends[0]), 0, INFINITY);
        fct_bvh_closest_hit(m.bvh, &ray, &hit, &visits);
    }
    model_release(env, &m);
    return visits;
}

/* The boxes of the tree are of no help: a cube has no principal axes. Its faces show them. Measured, turned:
 * .99 times the nodes and 1.10 times the triangles; 1.80 and 2.00 with the frames of the squares alone.
 * Tumbled: 1.25 times the triangles; 2.29 if leaves are not fitted along faces. */
static void turned_cubes_cost_as_much_as_straight_ones(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    const v3 straight[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    v3 turned[3] = {v3_unit(v3_make(1, 1.1, .6))};
    v3_frame(turned[0], &turned[1], &turned[2]);
    const fct_visits least = visit_cubes(&env, straight, false), found = visit_cubes(&env, turned, false),
                     tumbled = visit_cubes(&env, straight, true);
    assert_true((double)found.nodes < 1.1 * (double)least.nodes);
    assert_true((double)found.triangles < 1.2 * (double)least.triangles);
    assert_true((double)tumbled.triangles < 1.4 * (double)least.triangles);
}

/* A model on a line has no surface to compare. */
static void leaves_of_a_line_are_large(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 16);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * (size_t)v;
        p[0] += .37f * p[1], p[1] = .3f, p[2] = .7f;
    }
    model line = model_make(&env, mesh, FCT_BACKEND_OBB);
    assert_true(largest_leaf(line.bvh) > 6);
    model_release(&env, &line);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boxes_hold_their_vertices_with_the_documented_padding),
        cmocka_unit_test(splits_of_the_top_have_the_least_binned_cost),
        cmocka_unit_test(nodes_hold_all_their_leaves),
        cmocka_unit_test(nested_leaves_do_not_make_a_deep_top),
        cmocka_unit_test(spans_name_the_clusters_around_their_leaves),
        cmocka_unit_test(the_collapse_has_the_least_cost),
        cmocka_unit_test(leaves_of_a_dense_model_are_small),
        cmocka_unit_test(leaves_of_a_line_are_large),
        cmocka_unit_test(a_dense_model_answers_with_every_face),
        cmocka_unit_test(diagonal_strips_cost_as_much_as_straight_ones),
        cmocka_unit_test(turned_cubes_cost_as_much_as_straight_ones),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
