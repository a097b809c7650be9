/* scene/closest.c: the nearest surface point of the whole scene, in world distance.
 *
 * The search visits the nearest instance box first. An instance has one of two kinds of transform:
 *   1. Rotation, reflection and uniform scale: the model's own query answers.
 *   2. Any other: the point nearest in the model is not the nearest in the world. So the search descends the
 *      cluster tree and measures triangles in the world. It prunes a cluster by frame->shrink times the
 *      distance to its box in the model, which never exceeds the distance in the world. The result is exact;
 *      the search gets slower as the scales differ more.
 */
#include <math.h>

#include "bvh/near/triangle.h"
#include "cluster/tree/node.h"
#include "scene/scene.h"
#include "scene/transform.h"

enum { STACK = FCT_SCENE_DEPTH * (FCT_SCENE_WIDTH - 1) + 1, TREE_STACK = FCT_SCENE_TREE_DEPTH + 2 };

typedef struct pending {
    double bound;
    uint32_t child;
} pending;

typedef struct search {
    v3 point;        /* world */
    double distance; /* of the best so far */
    uint32_t instance;
    fct_closest best;
} search;

/* A lower bound of the distance to the cluster's box. The factors cover the rounding of the box to floats. */
static double bound_box_distance(const fct_cluster *cluster, v3 p) {
    fct_box box;
    fct_cluster_box(cluster, &box);
    v3 d = v3_sub(p, v3_load(box.center));
    double square = 0;
    for (int k = 0; k < 3; ++k) {
        double out = fabs(v3_dot(d, v3_load(box.axes[k]))) * (1 - 1e-6) - box.half[k] * (1 + 1e-6);
        if (out > 0) square += out * out;
    }
    return sqrt(square);
}

static void try_triangle(search *s, const fct_tree_view *view, const float *to_world, uint32_t instance,
                         uint32_t place) {
    v3 corner[3];
    double u, v;
    for (int k = 0; k < 3; ++k)
        corner[k] = fct_transform_point(
            to_world, v3_load(view->positions + 3 * (size_t)view->triangles[3 * (size_t)place + k]));
    v3 nearest = fct_triangle_closest(s->point, corner[0], corner[1], corner[2], &u, &v);
    double distance = v3_norm(v3_sub(nearest, s->point));
    uint32_t face = view->face_ids[place];
    if (!(distance <= s->distance)) return;
    if (distance == s->distance && s->instance != FCT_NONE &&
        (instance > s->instance || (instance == s->instance && face >= s->best.face)))
        return;
    s->distance = distance;
    s->instance = instance;
    s->best = (fct_closest){
        .distance = (float)distance, .face = face, .place = place, .u = (float)u, .v = (float)v};
    v3_store(s->best.point, nearest);
}

static void search_cluster_tree(search *s, const fct_scene *scene, uint32_t instance) {
    const fct_instance *placed = scene->instances + instance;
    const fct_tree *tree = scene->own[placed->model].tree;
    const fct_scene_frame *frame = scene->frames + instance;
    fct_tree_view view = fct_tree_get(tree);
    v3 local = fct_transform_point(placed->to_model, s->point);
    pending stack[TREE_STACK];
    for (uint32_t r = 0; r < view.root_count; ++r) {
        int top = 0;
        stack[top++] = (pending){0, view.roots[r]};
        while (top > 0) {
            pending next = stack[--top];
            if (next.bound > s->distance) continue;
            if (next.child >= view.node_count) {
                try_triangle(s, &view, placed->to_world, instance, next.child - view.node_count);
                continue;
            }
            pending child[2];
            for (int k = 0; k < 2; ++k) {
                fct_cluster room;
                child[k].child = fct_node_child(tree, next.child, k);
                const fct_cluster *cluster = fct_node_cluster(tree, child[k].child, &room);
                child[k].bound = frame->shrink * bound_box_distance(cluster, local);
            }
            int near = child[1].bound < child[0].bound;
            if (child[!near].bound <= s->distance) stack[top++] = child[!near];
            if (child[near].bound <= s->distance) stack[top++] = child[near];
        }
    }
}

static void search_model(search *s, const fct_scene *scene, uint32_t instance) {
    const fct_instance *placed = scene->instances + instance;
    const fct_scene_model *own = scene->own + placed->model;
    fct_closest found;
    float local[3];
    v3_store(local, fct_transform_point(placed->to_model, s->point));
    float limit = (float)(s->distance / placed->uniform_scale * (1 + 1e-5));
    if (!fct_bvh_closest_point(own->points ? own->points : own->bvh, local, limit, &found, NULL)) return;
    v3 nearest = fct_transform_point(placed->to_world, v3_load(found.point));
    double distance = v3_norm(v3_sub(nearest, s->point));
    if (!(distance <= s->distance)) return;
    if (distance == s->distance && s->instance != FCT_NONE && instance > s->instance) return;
    s->distance = distance;
    s->instance = instance;
    s->best = found;
    s->best.distance = (float)distance;
    v3_store(s->best.point, nearest);
}

static double measure_child_distance(const fct_scene_node *node, int k, v3 p) {
    double point[3] = {p.x, p.y, p.z}, square = 0;
    for (int c = 0; c < 3; ++c) {
        double below = node->bounds[2 * c][k] - point[c], above = point[c] - node->bounds[2 * c + 1][k];
        double out = below > above ? below : above;
        if (out > 0) square += out * out;
    }
    return sqrt(square);
}

bool fct_scene_closest_point(const fct_scene *scene, const float point[3], float max_distance,
                             uint32_t *instance, fct_closest *out) {
    search s = {.point = v3_load(point),
                .distance = max_distance,
                .instance = FCT_NONE,
                .best = {.face = FCT_NONE, .distance = max_distance}};
    pending stack[STACK];
    int top = 0;
    bool finite = isfinite(point[0]) && isfinite(point[1]) && isfinite(point[2]);
    if (finite && max_distance >= 0) stack[top++] = (pending){0, 0};
    while (top > 0) {
        pending next = stack[--top];
        if (next.bound > s.distance) continue;
        if (next.child & FCT_SCENE_LEAF) {
            uint32_t i = next.child & ~FCT_SCENE_LEAF;
            if (scene->instances[i].uniform_scale > 0)
                search_model(&s, scene, i);
            else
                search_cluster_tree(&s, scene, i);
            continue;
        }
        const fct_scene_node *node = scene->nodes + next.child;
        int base = top;
        for (int k = 0; k < FCT_SCENE_WIDTH && node->child[k] != FCT_NONE; ++k) {
            double bound = measure_child_distance(node, k, s.point);
            if (bound > s.distance) continue;
            int place = top++;
            while (place > base && stack[place - 1].bound < bound) stack[place] = stack[place - 1], --place;
            stack[place] = (pending){bound, node->child[k]};
        }
    }
    *instance = s.instance;
    *out = s.best;
    return s.instance != FCT_NONE;
}
