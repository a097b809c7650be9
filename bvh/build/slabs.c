/* bvh/build/slabs.c: see slabs.h. O(vertices of the leaves) for each set of axes. */
#include "bvh/build/slabs.h"

#include <string.h>

#include "cluster/tree/node.h"

/* An oriented box of a leaf that saves a smaller share of the area is not fitted. */
#define LEAST_SAVED 1e-5

/* With more roots, the search for an enclosing cluster costs more than its box saves. */
enum { MOST_ROOTS = 32 };

double fct_slabs_area(const fct_slabs *s) {
    const double pad = 2 * (double)FCT_ORIENTED_PAD;
    return fct_half_area(s->upper[0] - s->lower[0] + pad, s->upper[1] - s->lower[1] + pad,
                         s->upper[2] - s->lower[2] + pad);
}

static bool holds_places(const fct_tree *tree, uint32_t node, const fct_span *span) {
    const uint32_t begin = fct_node_first(tree, node);
    return begin <= span->first && span->last <= begin + fct_node_faces(tree, node);
}

/* The root whose places include those of the span. FCT_NONE if none does, or if there are more than
 * MOST_ROOTS.
 */
static uint32_t find_enclosing_root(const fct_tree *tree, const fct_span *span) {
    const fct_tree_view *view = &tree->view;
    for (uint32_t r = 0; r < view->root_count && view->root_count <= MOST_ROOTS; ++r)
        if (holds_places(tree, view->roots[r], span)) return view->roots[r];
    return FCT_NONE;
}

/* The smallest cluster below `node` whose places include those of the span, as those of the node do. */
static uint32_t find_smallest(const fct_tree *tree, uint32_t node, const fct_span *span) {
    while (node < tree->view.node_count) {
        const uint32_t left = fct_node_child(tree, node, 0), right = fct_node_child(tree, node, 1);
        if (holds_places(tree, left, span))
            node = left;
        else if (holds_places(tree, right, span))
            node = right;
        else
            break;
    }
    return node;
}

/* Sets the enclosing clusters, from the root down: that of a node lies below that of its parent. */
static void find_enclosing(const fct_tree *tree, const fct_top *top, fct_span *spans) {
    spans[0].enclosing = FCT_NONE;
    for (uint32_t n = 0; n < top->node_count; ++n) {
        const fct_top_node *node = &top->nodes[n];
        fct_span *s = &spans[n];
        if (node->left == FCT_NONE) {
            s->enclosing = s->largest;
            continue;
        }
        if (s->enclosing == FCT_NONE) s->enclosing = find_enclosing_root(tree, s);
        if (s->enclosing != FCT_NONE) s->enclosing = find_smallest(tree, s->enclosing, s);
        spans[node->left].enclosing = spans[node->right].enclosing = s->enclosing;
    }
}

void fct_slabs_clear(fct_slabs *s) {
    for (int k = 0; k < 3; ++k) s->lower[k] = INFINITY, s->upper[k] = -INFINITY;
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

/* The area of the box that the tree stores for a cluster, as fct_slabs_area of a fit to its faces. */
static double cluster_area(const fct_bvh *bvh, uint32_t node) {
    const double pad = 2 * (double)FCT_ORIENTED_PAD;
    fct_cluster room;
    const float *half = fct_node_cluster(bvh->tree, node, &room)->box_half;
    double side[3];
    for (int k = 0; k < 3; ++k) side[k] = 2 * bvh->scale * (double)half[k] + pad;
    return fct_half_area(side[0], side[1], side[2]);
}

fct_result fct_spans_build(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                           fct_span **out) {
    fct_span *spans = *out = fct_allocate(bvh->env, top->node_count, sizeof *spans);
    if (!spans) return fct_fail_memory(bvh->env, "the nodes of a ray structure");
    for (uint32_t n = top->node_count; n-- > 0;) {
        const fct_top_node *node = &top->nodes[n];
        if (node->left == FCT_NONE) {
            const uint32_t number = top->order[node->begin], cluster = leaves->nodes[number];
            const fct_leaf *leaf = fct_bvh_leaf(bvh, leaves->offsets[number]);
            fct_cluster room;
            spans[n] = (fct_span){.first = FCT_NONE,
                                  .largest = cluster,
                                  .area = fct_node_cluster(bvh->tree, cluster, &room)->area};
            for (uint32_t i = 0; i < leaf->count; ++i) {
                const uint32_t place = fct_leaf_place(bvh, leaf, i);
                if (place < spans[n].first) spans[n].first = place;
                if (place + 1 > spans[n].last) spans[n].last = place + 1;
            }
        } else {
            const fct_span *l = &spans[node->left], *r = &spans[node->right];
            spans[n] = r->area > l->area ? *r : *l;
            spans[n].first = l->first < r->first ? l->first : r->first;
            spans[n].last = l->last > r->last ? l->last : r->last;
        }
    }
    find_enclosing(bvh->tree, top, spans);
    return FCT_OK;
}

/* Whether the axes of cluster i are there, and are not those of another one. */
static bool adds_axes(const uint32_t clusters[2], int i) {
    return clusters[i] != FCT_NONE && (i == 0 || clusters[0] != clusters[1]);
}

fct_slabs fct_slabs_fit(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                        const fct_top_node *node, const fct_span *span) {
    fct_slabs best = make_axis_slabs(bvh, node), s;
    double best_area = fct_slabs_area(&best);
    const bool is_leaf = node->left == FCT_NONE;
    if (is_leaf && !bvh->places && cluster_area(bvh, span->largest) > best_area * (1 - LEAST_SAVED))
        return best;
    const uint32_t clusters[2] = {span->largest, span->enclosing};
    for (int i = 0; i < 3; ++i) {
        if (i == 2 ? !leaves->frame_bounds : !adds_axes(clusters, i)) continue;
        if (i == 2)
            memcpy(s.axes, leaves->frame, sizeof s.axes);
        else
            use_cluster_axes(bvh, clusters[i], &s);
        fct_slabs_clear(&s);
        fct_slabs_hold(bvh, leaves->offsets, top->order + node->begin, node->end - node->begin, &s);
        const double area = fct_slabs_area(&s);
        if (area < best_area) best = s, best_area = area;
    }
    return best;
}
