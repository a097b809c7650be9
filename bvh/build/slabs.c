/* bvh/build/slabs.c: see slabs.h. O(vertices of the leaves) for each set of axes. */
#include "bvh/build/slabs.h"

#include "cluster/tree/node.h"

/* With more roots, the search for an enclosing cluster costs more than its box saves. */
enum { MOST_ROOTS = 32 };

double fct_slabs_area(const fct_slabs *s) {
    const double pad = 2 * (double)FCT_ORIENTED_PAD;
    return fct_half_area(s->upper[0] - s->lower[0] + pad, s->upper[1] - s->lower[1] + pad,
                         s->upper[2] - s->lower[2] + pad);
}

static bool holds_places(const fct_tree *tree, uint32_t node, uint32_t first, uint32_t last) {
    uint32_t begin = fct_node_first(tree, node);
    return begin <= first && last <= begin + fct_node_faces(tree, node);
}

/* The smallest cluster whose places include [first, last). FCT_NONE if no cluster does, or if the tree has
 * more than MOST_ROOTS roots. */
static uint32_t find_enclosing_cluster(const fct_tree *tree, uint32_t first, uint32_t last) {
    const fct_tree_view *view = &tree->view;
    uint32_t node = FCT_NONE;
    for (uint32_t r = 0; r < view->root_count && view->root_count <= MOST_ROOTS && node == FCT_NONE; ++r) {
        uint32_t root = view->roots[r];
        if (root >= view->node_count) continue;
        if (holds_places(tree, root, first, last)) node = root;
    }
    for (uint32_t next = node; next != FCT_NONE;) {
        node = next, next = FCT_NONE;
        for (int i = 0; i < 2; ++i) {
            uint32_t child = fct_node_child(tree, node, i);
            if (child >= view->node_count) continue;
            if (holds_places(tree, child, first, last)) next = child;
        }
    }
    return node;
}

void fct_slabs_clear(fct_slabs *s) {
    for (int k = 0; k < 3; ++k) s->lower[k] = INFINITY, s->upper[k] = -INFINITY;
}

void fct_slabs_hold(const fct_bvh *bvh, const fct_leaf *leaf, fct_slabs *s) {
    v3 center = v3_load(bvh->center);
    const float *rows = fct_leaf_vertices(leaf);
    uint32_t stride = 8u * leaf->vertex_octets;
    for (uint32_t j = 0; j < stride; ++j) {
        v3 p = v3_make((double)rows[j] - center.x, (double)rows[stride + j] - center.y,
                       (double)rows[2 * stride + j] - center.z);
        for (int k = 0; k < 3; ++k) {
            double at = v3_dot(p, s->axes[k]);
            if (at < s->lower[k]) s->lower[k] = at;
            if (at > s->upper[k]) s->upper[k] = at;
        }
    }
}

/* Fits the slabs to the vertices of `count` leaves. */
static void fit_slabs(const fct_bvh *bvh, const fct_leaf_list *leaves, const uint32_t *order, uint32_t count,
                      fct_slabs *s) {
    fct_slabs_clear(s);
    for (uint32_t i = 0; i < count; ++i) fct_slabs_hold(bvh, fct_bvh_leaf(bvh, leaves->offsets[order[i]]), s);
}

static void use_cluster_axes(const fct_bvh *bvh, uint32_t node, fct_slabs *s) {
    fct_cluster room;
    fct_box box;
    fct_cluster_box(fct_node_cluster(bvh->tree, node, &room), &box);
    for (int k = 0; k < 3; ++k) s->axes[k] = v3_load(box.axes[k]);
}

static fct_slabs make_axis_slabs(const fct_bvh *bvh, const fct_top_node *node) {
    fct_slabs s = {.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (int k = 0; k < 3; ++k) {
        s.lower[k] = (double)node->bounds[k] - (double)bvh->center[k];
        s.upper[k] = (double)node->bounds[3 + k] - (double)bvh->center[k];
    }
    return s;
}

fct_slabs fct_slabs_fit(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                        const fct_top_node *node) {
    uint32_t first = FCT_NONE, last = 0, largest = 0;
    double largest_area = -1;
    for (uint32_t i = node->begin; i < node->end; ++i) {
        uint32_t number = top->order[i];
        const fct_leaf *leaf = fct_bvh_leaf(bvh, leaves->offsets[number]);
        if (leaf->first < first) first = leaf->first;
        if (leaf->first + leaf->count > last) last = leaf->first + leaf->count;
        fct_cluster room;
        uint32_t id = leaves->nodes[number];
        double area = (double)fct_node_cluster(bvh->tree, id, &room)->area;
        if (area > largest_area) largest_area = area, largest = id;
    }
    fct_slabs best = make_axis_slabs(bvh, node);
    double best_area = fct_slabs_area(&best);
    uint32_t candidates[2] = {largest, find_enclosing_cluster(bvh->tree, first, last)};
    for (int i = 0; i < 2; ++i) {
        if (candidates[i] == FCT_NONE || (i == 1 && candidates[1] == candidates[0])) continue;
        fct_slabs s;
        use_cluster_axes(bvh, candidates[i], &s);
        fit_slabs(bvh, leaves, top->order + node->begin, node->end - node->begin, &s);
        double area = fct_slabs_area(&s);
        if (area < best_area) best = s, best_area = area;
    }
    return best;
}
