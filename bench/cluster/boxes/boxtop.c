/* bench/cluster/boxes/boxtop.c: our clusters below a new top.
 *
 * A tree for rays alone keeps the clusters of a cut and everything below them. The tree above the cut is
 * split from the top by the surface area heuristic: sort the clusters along each axis of the node's surface
 * and try every cut between two. Ids below count - 1 are the nodes above the cut, in our tree and in the new
 * one.
 */
#include <stdlib.h>

#include "bench/cluster/bench.h"
#include "bench/cluster/boxes/boxtree.h"

typedef struct item {
    uint32_t node, first, count; /* number of its box; its faces in the tree's order */
    v3 center;
    double key;
} item;

typedef struct extent {
    v3 low, high;
    uint32_t faces;
} extent;

static const extent nothing = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0};
static const v3 world[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

static double reach(const fct_box *box, v3 axis) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += fabs(v3_dot(axis, v3_load(box->axes[k]))) * (double)box->half[k];
    return sum;
}

static void include(extent *e, const fct_box *box, const v3 axes[3], uint32_t faces) {
    v3 c = v3_load(box->center), r = {reach(box, axes[0]), reach(box, axes[1]), reach(box, axes[2])};
    c = (v3){v3_dot(axes[0], c), v3_dot(axes[1], c), v3_dot(axes[2], c)};
    e->low = (v3){fmin(e->low.x, c.x - r.x), fmin(e->low.y, c.y - r.y), fmin(e->low.z, c.z - r.z)};
    e->high = (v3){fmax(e->high.x, c.x + r.x), fmax(e->high.y, c.y + r.y), fmax(e->high.z, c.z + r.z)};
    e->faces += faces;
}

static double weight(const extent *e) {
    v3 d = v3_sub(e->high, e->low);
    return e->faces * (d.x * d.y + d.y * d.z + d.z * d.x);
}

static int compare(const void *x, const void *y) {
    const item *a = x, *b = y;
    if (a->key != b->key) return a->key < b->key ? -1 : 1;
    return a->node < b->node ? -1 : a->node > b->node;
}

static void sort_along(item *items, uint32_t count, v3 axis) {
    for (uint32_t i = 0; i < count; ++i) items[i].key = v3_dot(axis, items[i].center);
    qsort(items, count, sizeof *items, compare);
}

/* Sorts the items along the best axis. Returns the number of items of the first child. */
static uint32_t split(const box_tree *tree, item *items, uint32_t count, const v3 axes[3], double *before) {
    double best = INFINITY;
    uint32_t left = 1;
    int axis = 0;
    for (int k = 0; k < 3; ++k) {
        sort_along(items, count, axes[k]);
        extent e = nothing;
        for (uint32_t i = 0; i < count; ++i) {
            before[i] = e.faces ? weight(&e) : 0;
            include(&e, &tree->boxes[items[i].node], axes, items[i].count);
        }
        e = nothing;
        for (uint32_t i = count - 1; i > 0; --i) {
            include(&e, &tree->boxes[items[i].node], axes, items[i].count);
            double cost = before[i] + weight(&e);
            if (cost < best) best = cost, left = i, axis = k;
        }
    }
    sort_along(items, count, axes[axis]);
    return left;
}

static uint32_t take_cut(const fct_tree *clusters, const box_tree *tree, uint32_t count, item *items) {
    uint32_t found = 0;
    for (uint32_t i = 0; i < count - 1; ++i) {
        fct_cluster own, children[2];
        bench_check(fct_tree_cluster(clusters, i, &own), "a cluster");
        bench_check(fct_tree_children(clusters, i, children), "a cluster");
        for (int c = 0; c < 2; ++c) {
            if (own.child[c] < count - 1) continue;
            items[found] =
                (item){.node = tree->child[i][c], .first = children[c].first, .count = children[c].count};
            items[found].center = v3_load(tree->boxes[items[found].node].center);
            ++found;
        }
    }
    return found;
}

static uint32_t gather(const fct_tree_view *view, const item *items, uint32_t count, uint32_t *faces) {
    uint32_t found = 0;
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t k = 0; k < items[i].count; ++k) faces[found++] = view->face_ids[items[i].first + k];
    return found;
}

void box_tree_regroup(const fct_mesh *mesh, const fct_tree *tree, uint32_t count, box_tree *out) {
    fct_tree_view view = fct_tree_get(tree);
    box_tree_take(mesh, tree, out);
    if (count > mesh->face_count) count = mesh->face_count;
    if (count < 2) return;
    typedef struct task {
        uint32_t first, count, node;
    } task;
    item *items = bench_allocate(count, sizeof *items);
    task *stack = bench_allocate(count, sizeof *stack);
    uint32_t *faces = bench_allocate(mesh->face_count, sizeof *faces);
    double *before = bench_allocate(count, sizeof *before);
    uint32_t top = 0, made = 1;
    count = take_cut(tree, out, count, items);
    stack[top++] = (task){0, count, out->root = 0};
    while (top > 0) {
        task t = stack[--top];
        uint32_t number = gather(&view, items + t.first, t.count, faces);
        v3 axes[3];
        box_axes(mesh, faces, number, axes);
        fct_box own = box_fit(mesh, faces, number, axes), aligned = box_fit(mesh, faces, number, world);
        out->boxes[t.node] = box_surface(&aligned) < box_surface(&own) ? aligned : own;
        uint32_t left = split(out, items + t.first, t.count, axes, before);
        task halves[2] = {{t.first, left, 0}, {t.first + left, t.count - left, 0}};
        for (int c = 0; c < 2; ++c) {
            bool single = halves[c].count == 1;
            halves[c].node = single ? items[halves[c].first].node : made++;
            out->child[t.node][c] = halves[c].node;
            if (!single) stack[top++] = halves[c];
        }
    }
    free(items);
    free(stack);
    free(faces);
    free(before);
}
