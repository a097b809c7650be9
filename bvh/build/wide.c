/* bvh/build/wide.c: the nodes of eight children, with the boxes of their children. The boxes are fitted in
 * parallel: O(F) per level of the tree.
 */
#include "bvh/build/wide.h"

#include "base/parallel.h"

enum { NODE_CHUNK = 16 /* nodes per task */ };

typedef struct box_job {
    const fct_bvh *bvh;
    const fct_leaf_list *leaves;
    const fct_top *top;
    fct_wide_list *list;
} box_job;

static void fit_boxes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const box_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        const fct_wide_node *wide = &job->list->nodes[i];
        for (uint32_t k = 0; k < wide->count; ++k)
            job->list->boxes[8 * i + k] =
                fct_slabs_fit(job->bvh, job->leaves, job->top, &job->top->nodes[wide->top[k]],
                              &job->list->spans[wide->top[k]]);
    }
}

fct_result fct_wide_build(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                          fct_wide_list *out) {
    const fct_env *env = bvh->env;
    *out = (fct_wide_list){0};
    fct_wide_list list = {0};
    fct_result result = fct_spans_build(bvh, leaves, top, &list.spans);
    if (result == FCT_OK && leaves->count > 1) {
        list.nodes = fct_allocate(env, leaves->count, sizeof *list.nodes);
        result = list.nodes ? fct_collapse(env, top, list.nodes, &list.count)
                            : fct_fail_memory(env, "the nodes of a ray structure");
    }
    if (result == FCT_OK && list.count > 0) {
        list.boxes = fct_allocate(env, list.count, 8 * sizeof *list.boxes);
        if (!list.boxes) result = fct_fail_memory(env, "the nodes of a ray structure");
    }
    if (result != FCT_OK) {
        fct_wide_release(env, &list);
        return result;
    }
    box_job job = {.bvh = bvh, .leaves = leaves, .top = top, .list = &list};
    fct_parallel_for(env, list.count, NODE_CHUNK, fit_boxes, &job);
    *out = list;
    return FCT_OK;
}

void fct_wide_release(const fct_env *env, fct_wide_list *list) {
    fct_release(env, list->nodes);
    fct_release(env, list->boxes);
    fct_release(env, list->spans);
    *list = (fct_wide_list){0};
}
