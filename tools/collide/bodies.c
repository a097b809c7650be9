/* tools/collide/bodies.c: see bodies.h. */
#include "tools/collide/bodies.h"

enum { PAIRS_PER_BODY = 16 /* for which there is memory at first */ };

typedef struct body_list {
    fct_scene *scene;
    fct_scene_view view;
    fct_bvh **bvhs;   /* of the models; NULL where no instance has the model */
    fct_body *bodies; /* of the instances */
    fct_body_pair *pairs;
    size_t pair_count;
} body_list;

static int build_bvhs(tool *t, body_list *list) {
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = FCT_BVH_PAIRS;
    list->bvhs = tool_allocate(t, list->view.model_count, sizeof *list->bvhs);
    if (!list->bvhs) return TOOL_MEMORY;
    for (uint32_t m = 0; m < list->view.model_count; ++m) list->bvhs[m] = NULL;
    for (uint32_t i = 0; i < list->view.instance_count; ++i) {
        uint32_t m = list->view.instances[i].model;
        if (list->bvhs[m]) continue;
        int code = tool_result(t, fct_bvh_build(&t->env, list->view.models[m].tree, &def, &list->bvhs[m]));
        if (code != TOOL_DONE) return code;
    }
    return TOOL_DONE;
}

static int place_bodies(tool *t, body_list *list) {
    list->bodies = tool_allocate(t, list->view.instance_count, sizeof *list->bodies);
    if (!list->bodies) return TOOL_MEMORY;
    for (uint32_t i = 0; i < list->view.instance_count; ++i) {
        const fct_instance *instance = list->view.instances + i;
        fct_body *body = list->bodies + i;
        body->bvh = list->bvhs[instance->model];
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) body->pose.rotation[r][c] = (double)instance->to_world[4 * r + c];
            body->pose.translation[r] = (double)instance->to_world[4 * r + 3];
        }
    }
    return TOOL_DONE;
}

/* Asks again if there are more pairs than the memory holds. */
static int find_pairs(tool *t, body_list *list) {
    uint32_t count = list->view.instance_count;
    size_t capacity = (size_t)count * PAIRS_PER_BODY;
    int code = TOOL_DONE;
    for (;;) {
        list->pairs = tool_allocate(t, capacity, sizeof *list->pairs);
        if (!list->pairs) return TOOL_MEMORY;
        code = tool_result(
            t, fct_bodies_touching(&t->env, count, list->bodies, capacity, list->pairs, &list->pair_count));
        if (code != TOOL_DONE || list->pair_count <= capacity) return code;
        capacity = list->pair_count;
        tool_release(t, list->pairs);
    }
}

static void report_bodies(const body_list *list, size_t limit, collide_report *report) {
    for (size_t i = 0; i < list->pair_count && report->found < limit; ++i) {
        const fct_body_pair *pair = list->pairs + i;
        const fct_instance *instances = list->view.instances;
        if (instances[pair->body_a].object != instances[pair->body_b].object)
            collide_report_bodies(report, &list->view, pair);
    }
}

int collide_bodies(tool *t, const char *path, size_t limit, collide_report *report, double *seconds) {
    body_list list = {0};
    int code = tool_result(t, fct_scene_load(&t->env, path, FCT_BACKEND_OBB, &list.scene));
    if (code == TOOL_DONE) {
        list.view = fct_scene_get(list.scene);
        code = build_bvhs(t, &list);
    }
    if (code == TOOL_DONE) code = place_bodies(t, &list);
    double start = tool_seconds();
    if (code == TOOL_DONE) code = find_pairs(t, &list);
    *seconds = tool_seconds() - start;
    if (code == TOOL_DONE) report_bodies(&list, limit, report);
    for (uint32_t m = 0; list.bvhs && m < list.view.model_count; ++m) fct_bvh_destroy(list.bvhs[m]);
    tool_release(t, list.bvhs);
    tool_release(t, list.bodies);
    tool_release(t, list.pairs);
    fct_scene_destroy(list.scene);
    return code;
}
