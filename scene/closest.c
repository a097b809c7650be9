/* scene/closest.c: the nearest surface point of the whole scene, in world distance.
 *
 * The search visits the nearest instance box first. An instance has one of two kinds of transform:
 *   1. Rotation, reflection and uniform scale: the model's own query answers.
 *   2. Any other: the point nearest in the model is not the nearest in the world. bvh/near/mapped.h searches
 *      the model in world distance.
 */
#include <math.h>

#include "bvh/near/mapped.h"
#include "scene/scene.h"
#include "scene/transform.h"

enum { STACK = FCT_SCENE_DEPTH * (FCT_SCENE_WIDTH - 1) + 1 };

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

/* Whether a face of an instance replaces the best so far. */
static bool is_better(const search *s, double distance, uint32_t instance) {
    if (!(distance <= s->distance)) return false;
    return distance < s->distance || s->instance == FCT_NONE || instance < s->instance;
}

static void search_mapped(search *s, const fct_scene *scene, uint32_t instance) {
    const fct_instance *placed = scene->instances + instance;
    const fct_scene_model *own = scene->own + placed->model;
    const fct_scene_frame *frame = scene->frames + instance;
    const fct_bvh *bvh = own->points ? own->points : own->bvh;
    const fct_map map = {placed->to_world, frame->to_model, &frame->mapped};
    fct_mapped_near found;
    if (!fct_mapped_search(bvh, &map, s->point, s->distance, &found, NULL)) return;
    if (!is_better(s, found.distance, instance)) return;
    s->distance = found.distance;
    s->instance = instance;
    s->best = (fct_closest){.distance = (float)found.distance,
                            .face = fct_tree_get(own->tree).face_ids[found.place],
                            .place = found.place,
                            .u = (float)found.u,
                            .v = (float)found.v};
    v3_store(s->best.point, found.point);
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
    if (!is_better(s, distance, instance)) return;
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
                search_mapped(&s, scene, i);
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
