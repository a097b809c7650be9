/* scene/bounds.c: the exact bounds of a scene.
 *
 * The extreme vertex of each instance in a direction of the world is found by branch and bound over the
 * oriented boxes of its tree. An instance whose box cannot widen the bounds is skipped.
 */
#include <math.h>

#include "cluster/tree/node.h"
#include "scene/scene.h"

enum { STACK = 256 }; /* above the depth of every tree, as in rays */

/* The greatest value of a . p + d that a node can have. */
static double bound_node(const fct_tree *tree, uint32_t node, v3 a, double d) {
    fct_cluster room;
    fct_box box;
    fct_cluster_box(fct_node_cluster(tree, node, &room), &box);
    double most = v3_dot(a, v3_load(box.center)) + d;
    for (int k = 0; k < 3; ++k) most += fabs(v3_dot(a, v3_load(box.axes[k]))) * box.half[k];
    return most;
}

/* The greatest value of a . p + d over the vertices of the tree, if above `known`; else `known`. Boxes
 * contain their vertices up to rounding, which `slack` covers. */
static double find_greatest(const fct_tree *tree, v3 a, double d, double slack, double known) {
    const fct_tree_view *view = &tree->view;
    uint32_t stack[STACK];
    for (uint32_t r = 0; r < view->root_count; ++r) {
        int top = 0;
        if (bound_node(tree, view->roots[r], a, d) + slack > known) stack[top++] = view->roots[r];
        while (top > 0) {
            uint32_t node = stack[--top];
            if (fct_node_is_leaf(tree, node)) {
                const uint32_t *t = view->triangles + 3 * (size_t)(node - view->node_count);
                for (int k = 0; k < 3; ++k)
                    known = fmax(known, v3_dot(a, v3_load(view->positions + 3 * (size_t)t[k])) + d);
                continue;
            }
            uint32_t child[2] = {fct_node_child(tree, node, 0), fct_node_child(tree, node, 1)};
            double most[2] = {bound_node(tree, child[0], a, d), bound_node(tree, child[1], a, d)};
            int better = most[1] > most[0];
            if (most[!better] + slack > known) stack[top++] = child[!better];
            if (most[better] + slack > known) stack[top++] = child[better];
        }
    }
    return known;
}

/* Covers the rounding of boxes, and of their corners in the world. */
static double find_slack(const fct_tree *tree, v3 a) {
    double most = 0;
    for (uint32_t r = 0; r < tree->view.root_count; ++r) {
        fct_cluster room;
        const fct_cluster *root = fct_node_cluster(tree, tree->view.roots[r], &room);
        most = fmax(most, v3_norm(v3_load(root->box_half)) + v3_norm(v3_load(root->box_center)));
    }
    return 1e-5 * v3_norm(a) * most;
}

void fct_scene_bounds(const fct_scene *scene, double lower[3], double upper[3]) {
    for (int c = 0; c < 3; ++c) lower[c] = INFINITY, upper[c] = -INFINITY;
    for (uint32_t i = 0; i < scene->instance_count; ++i) {
        const fct_instance *in = scene->instances + i;
        const fct_tree *tree = scene->models[in->model].tree;
        for (int c = 0; c < 3; ++c) {
            const float *row = in->to_world + 4 * (size_t)c;
            v3 a = v3_load(row);
            double slack = find_slack(tree, a);
            upper[c] = find_greatest(tree, a, row[3], slack, upper[c]);
            lower[c] = -find_greatest(tree, v3_scale(a, -1), -(double)row[3], slack, -lower[c]);
        }
    }
}
