/* partition/cut.c: cuts from the roots down, and the cut by distance to the planes.
 *
 * 1. Open the frontier level by level, with tests in parallel, until it is wide.
 * 2. Threads take the subtrees of the frontier. Each works inside the subtree's own range of the output,
 * which no cut of the subtree can outgrow.
 * 3. Gather the kept nodes in order of places. The result does not depend on the threads.
 */
#include "partition/cut.h"

#include <string.h>

#include "base/math/vec.h"
#include "base/parallel.h"
#include "facetree/partition.h"

enum { WIDE = 1 << 10 /* nodes in a wide frontier */, GRAIN = 1 << 12 };

typedef struct cutter {
    const fct_tree *tree;
    fct_cut_test *test;
    void *user;
    uint32_t *nodes;    /* per place: the kept node that begins there, or FCT_NONE */
    uint32_t *frontier; /* untested nodes in order of places */
    uint32_t count;
    bool *kept; /* per node of the frontier */
} cutter;

static void test_frontier(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk;
    cutter *c = user;
    for (size_t i = begin; i < end; ++i)
        c->kept[i] = fct_node_is_leaf(c->tree, c->frontier[i]) || c->test(c->user, c->frontier[i], thread);
}

/* Opens the frontier until it is wide or empty. `next` has room for 2 WIDE nodes. */
static void widen_frontier(const fct_env *env, cutter *c, uint32_t *next) {
    while (c->count > 0 && c->count < WIDE) {
        uint32_t count = 0;
        fct_parallel_for(env, c->count, 1, test_frontier, c);
        for (uint32_t i = 0; i < c->count; ++i) {
            uint32_t node = c->frontier[i];
            if (c->kept[i]) {
                c->nodes[fct_node_first(c->tree, node)] = node;
            } else {
                next[count++] = fct_node_child(c->tree, node, 0);
                next[count++] = fct_node_child(c->tree, node, 1);
            }
        }
        uint32_t *swap = c->frontier;
        c->frontier = next, next = swap, c->count = count;
    }
}

/* Depth first. Kept nodes fill the subtree's range from the front and the stack fills it from the end. They
 * are disjoint clusters, so they never meet. */
static void cut_subtrees(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk;
    cutter *c = user;
    for (size_t i = begin; i < end; ++i) {
        uint32_t root = c->frontier[i], count = fct_node_faces(c->tree, root), top = count, kept = 0;
        uint32_t *range = c->nodes + fct_node_first(c->tree, root);
        range[--top] = root;
        while (top < count) {
            uint32_t node = range[top++];
            if (fct_node_is_leaf(c->tree, node) || c->test(c->user, node, thread)) {
                range[kept++] = node;
            } else {
                range[--top] = fct_node_child(c->tree, node, 1);
                range[--top] = fct_node_child(c->tree, node, 0);
            }
        }
        while (kept < count) range[kept++] = FCT_NONE;
    }
}

fct_result fct_cut_tree(const fct_env *env, const fct_tree *tree, const char *phase, fct_cut_test *test,
                        void *user, uint32_t *nodes, uint32_t *count) {
    const fct_tree_view *view = &tree->view;
    size_t width = view->root_count > 2 * WIDE ? view->root_count : 2 * WIDE;
    uint32_t *frontiers;
    bool *kept;
    const fct_array arrays[] = {FCT_ARRAY(frontiers, 2 * (size_t)width), FCT_ARRAY(kept, width)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "cutting a tree");
    *count = 0;
    if (result == FCT_OK) {
        cutter c = {tree, test, user, nodes, frontiers, view->root_count, kept};
        memcpy(frontiers, view->roots, view->root_count * sizeof *frontiers);
        memset(nodes, 0xFF, view->face_count * sizeof *nodes);
        widen_frontier(env, &c, frontiers + width);
        result = fct_parallel_for_progress(env, phase, c.count, 1, cut_subtrees, &c);
        for (uint32_t p = 0; p < view->face_count; ++p)
            if (nodes[p] != FCT_NONE) nodes[(*count)++] = nodes[p];
    }
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

/* --- By distance --- */

/* An upper bound from the box. Its axes are orthonormal to float rounding only, so a vertex may lie a
 * ten-millionth of the box's size farther than the half extents say. */
static double box_distance(const fct_cluster *c) {
    fct_box box;
    fct_cluster_box(c, &box);
    v3 normal = v3_load(c->plane), center = v3_load(box.center);
    double reach = fabs(v3_dot(normal, center) + (double)c->plane[3]);
    double size = fabs(center.x) + fabs(center.y) + fabs(center.z) + fabs((double)c->plane[3]), halves = 0;
    for (int i = 0; i < 3; ++i) {
        reach += (double)box.half[i] * fabs(v3_dot(normal, v3_load(box.axes[i])));
        halves += (double)box.half[i];
    }
    return reach + 1e-6 * halves + 1e-14 * size;
}

/* The largest distance of a vertex, or the first one above `enough`. */
static double vertex_distance(const fct_tree_view *view, const fct_cluster *c, double enough) {
    v3 normal = v3_load(c->plane);
    double largest = 0, offset = (double)c->plane[3];
    const uint32_t *corners = view->triangles + 3 * (size_t)c->first;
    for (size_t i = 0; i < 3 * (size_t)c->count && !(largest > enough); ++i)
        largest =
            fmax(largest, fabs(v3_dot(normal, v3_load(view->positions + 3 * (size_t)corners[i])) + offset));
    return largest;
}

typedef struct distance_cut {
    const fct_tree *tree;
    double max_distance;
    const uint32_t *nodes;
    double *largest; /* per chunk */
} distance_cut;

static bool is_near_plane(void *user, uint32_t node, uint32_t thread) {
    (void)thread;
    const distance_cut *cut = user;
    fct_cluster room;
    const fct_cluster *c = fct_node_cluster(cut->tree, node, &room);
    return box_distance(c) <= cut->max_distance ||
           vertex_distance(&cut->tree->view, c, cut->max_distance) <= cut->max_distance;
}

static void find_largest(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    distance_cut *cut = user;
    double largest = 0;
    for (size_t i = begin; i < end; ++i) {
        fct_cluster room;
        const fct_cluster *c = fct_node_cluster(cut->tree, cut->nodes[i], &room);
        if (box_distance(c) > largest)
            largest = fmax(largest, vertex_distance(&cut->tree->view, c, INFINITY));
    }
    cut->largest[chunk] = largest;
}

fct_result fct_tree_cut_at_distance(const fct_env *env, const fct_tree *tree, double max_distance,
                                    uint32_t *nodes, uint32_t *count, double *largest) {
    if (!(max_distance >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "expected a distance of at least 0, found %g", max_distance);
    distance_cut cut = {.tree = tree, .max_distance = max_distance, .nodes = nodes};
    fct_result result = fct_tree_check(env, tree);
    if (result == FCT_OK) result = fct_cut_tree(env, tree, "cut", is_near_plane, &cut, nodes, count);
    if (result != FCT_OK || !largest) return result;
    size_t chunks = fct_chunk_count(*count, GRAIN);
    cut.largest = fct_allocate(env, chunks, sizeof *cut.largest);
    if (!cut.largest) return fct_fail_memory(env, "cutting a tree");
    result = fct_parallel_for_progress(env, "distances", *count, GRAIN, find_largest, &cut);
    *largest = 0;
    for (size_t i = 0; i < chunks && result == FCT_OK; ++i) *largest = fmax(*largest, cut.largest[i]);
    fct_release(env, cut.largest);
    return result;
}
