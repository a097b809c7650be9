/* bvh/build/slabs.c: see slabs.h. O(vertices of the leaves) for each set of axes. */
#include "bvh/build/slabs.h"

#include <string.h>

#include "cluster/tree/node.h"

/* An oriented box of a leaf that saves a smaller share of the area is not fitted. */
#define LEAST_SAVED 1e-5

/* The shortest over the longest half extent of a bulky leaf. */
#define BULKY .5f

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

static void use_cluster_axes(const fct_bvh *bvh, uint32_t node, v3 axes[3]) {
    fct_cluster room;
    fct_box box;
    fct_cluster_box(fct_node_cluster(bvh->tree, node, &room), &box);
    for (int k = 0; k < 3; ++k) axes[k] = v3_load(box.axes[k]);
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

/* Whether the tree's box of a cluster is about as thick as long. */
static bool is_bulky(const fct_bvh *bvh, uint32_t node) {
    fct_cluster room;
    const float *half = fct_node_cluster(bvh->tree, node, &room)->box_half;
    const float least = fminf(half[0], fminf(half[1], half[2])),
                most = fmaxf(half[0], fmaxf(half[1], half[2]));
    return least > BULKY * most;
}

bool fct_slabs_face_axes(const fct_leaf *leaf, v3 axes[3]) {
    double area = 0;
    for (uint32_t i = 0; i < leaf->count; ++i) {
        v3 p[3];
        fct_leaf_triangle(leaf, i, p);
        const v3 sides[3] = {v3_sub(p[1], p[0]), v3_sub(p[2], p[1]), v3_sub(p[0], p[2])};
        const v3 normal = v3_cross(sides[0], sides[1]);
        if (!(v3_norm(normal) > area)) continue;
        area = v3_norm(normal);
        int shortest = v3_norm2(sides[1]) < v3_norm2(sides[0]);
        if (v3_norm2(sides[2]) < v3_norm2(sides[shortest])) shortest = 2;
        axes[0] = v3_unit(sides[shortest]);
        axes[1] = v3_unit(v3_cross(normal, axes[0]));
        axes[2] = v3_cross(axes[0], axes[1]);
    }
    return area > 0;
}

/* The axes that compete with those of the coordinates. Returns their number. */
static uint32_t list_axes(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                          const fct_top_node *node, const fct_span *span, v3 axes[4][3]) {
    uint32_t count = 1;
    use_cluster_axes(bvh, span->largest, axes[0]);
    if (span->enclosing != FCT_NONE && span->enclosing != span->largest)
        use_cluster_axes(bvh, span->enclosing, axes[count++]);
    if (leaves->frame_bounds) memcpy(axes[count++], leaves->frame, sizeof axes[0]);
    if (node->left == FCT_NONE && is_bulky(bvh, span->largest))
        count +=
            fct_slabs_face_axes(fct_bvh_leaf(bvh, leaves->offsets[top->order[node->begin]]), axes[count]);
    return count;
}

fct_slabs fct_slabs_fit(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                        const fct_top_node *node, const fct_span *span) {
    fct_slabs best = make_axis_slabs(bvh, node), s;
    double best_area = fct_slabs_area(&best);
    if (node->left == FCT_NONE && !bvh->places && !is_bulky(bvh, span->largest) &&
        cluster_area(bvh, span->largest) > best_area * (1 - LEAST_SAVED))
        return best;
    v3 axes[4][3];
    const uint32_t count = list_axes(bvh, leaves, top, node, span, axes);
    for (uint32_t i = 0; i < count; ++i) {
        memcpy(s.axes, axes[i], sizeof s.axes);
        fct_slabs_clear(&s);
        fct_slabs_hold(bvh, leaves->offsets, top->order + node->begin, node->end - node->begin, &s);
        const double area = fct_slabs_area(&s);
        if (area >= 0 && area < best_area) best = s, best_area = area; /* not if axes are no numbers */
    }
    return best;
}
