/* bvh/build/wide.c: collapses the binary top to nodes of eight children.
 *
 * A node opens its child of largest area until it has eight children or all are leaves. Nodes are numbered
 * depth first, so that a node lies near its first child in memory. The boxes of the children are fitted in
 * parallel: O(F) per level of the tree.
 */
#include "bvh/build/wide.h"

#include "base/parallel.h"

enum { NODE_CHUNK = 16 /* nodes per task */ };

static double top_area(const fct_top_node *n) {
    return fct_half_area((double)n->bounds[3] - (double)n->bounds[0],
                         (double)n->bounds[4] - (double)n->bounds[1],
                         (double)n->bounds[5] - (double)n->bounds[2]);
}

static void open_children(const fct_top_node *nodes, uint32_t from, fct_wide_node *wide) {
    wide->count = 2, wide->top[0] = nodes[from].left, wide->top[1] = nodes[from].right;
    while (wide->count < 8) {
        uint32_t open = FCT_NONE;
        for (uint32_t i = 0; i < wide->count; ++i)
            if (nodes[wide->top[i]].left != FCT_NONE &&
                (open == FCT_NONE || top_area(&nodes[wide->top[i]]) > top_area(&nodes[wide->top[open]])))
                open = i;
        if (open == FCT_NONE) break;
        uint32_t opened = wide->top[open];
        wide->top[open] = nodes[opened].left;
        wide->top[wide->count++] = nodes[opened].right;
    }
}

static void collapse_top(const fct_top *top, fct_wide_list *list) {
    uint32_t stack[3 * (8 * FCT_TOP_DEPTH + 1)], height = 0;
    stack[height++] = 0, stack[height++] = FCT_NONE, stack[height++] = 0;
    while (height) {
        uint32_t slot = stack[--height], parent = stack[--height], from = stack[--height];
        uint32_t number = list->count++;
        fct_wide_node *wide = &list->nodes[number];
        *wide = (fct_wide_node){.parent = parent, .slot = slot};
        open_children(top->nodes, from, wide);
        for (uint32_t i = wide->count; i-- > 0;) {
            if (top->nodes[wide->top[i]].left == FCT_NONE) continue;
            stack[height++] = wide->top[i], stack[height++] = number, stack[height++] = i;
        }
    }
}

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
                fct_slabs_fit(job->bvh, job->leaves, job->top, &job->top->nodes[wide->top[k]]);
    }
}

fct_result fct_wide_build(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                          fct_wide_list *out) {
    const fct_env *env = bvh->env;
    *out = (fct_wide_list){0};
    if (leaves->count == 1) return FCT_OK;
    fct_wide_list list = {.nodes = fct_allocate(env, leaves->count, sizeof *list.nodes)};
    if (list.nodes) {
        collapse_top(top, &list);
        list.boxes = fct_allocate(env, list.count, 8 * sizeof *list.boxes);
    }
    if (!list.boxes) {
        fct_wide_release(env, &list);
        return fct_fail_memory(env, "the nodes of a ray structure");
    }
    box_job job = {.bvh = bvh, .leaves = leaves, .top = top, .list = &list};
    fct_parallel_for(env, list.count, NODE_CHUNK, fit_boxes, &job);
    *out = list;
    return FCT_OK;
}

void fct_wide_release(const fct_env *env, fct_wide_list *list) {
    fct_release(env, list->nodes);
    fct_release(env, list->boxes);
    *list = (fct_wide_list){0};
}
