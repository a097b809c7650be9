/* radiosity/output/anchor_tree.c: see anchor_tree.h. */
#include "radiosity/output/anchor_tree.h"

#include "base/math/vec.h"

enum { STACK = 64 };

static int find_longest_axis(const fct_anchors *t, uint32_t begin, uint32_t end) {
    float lower[3], upper[3];
    for (int a = 0; a < 3; ++a) lower[a] = INFINITY, upper[a] = -INFINITY;
    for (uint32_t i = begin; i < end; ++i)
        for (int a = 0; a < 3; ++a) {
            lower[a] = fminf(lower[a], t->items[i].position[a]);
            upper[a] = fmaxf(upper[a], t->items[i].position[a]);
        }
    int axis = 0;
    for (int a = 1; a < 3; ++a)
        if (upper[a] - lower[a] > upper[axis] - lower[axis]) axis = a;
    return axis;
}

/* Moves the item of rank `mid` along the axis to its place, lower ones before it (Hoare's selection). */
static void select_middle(fct_anchors *t, uint32_t begin, uint32_t end, uint32_t mid, int axis) {
    uint32_t low = begin, high = end - 1;
    while (low < high) {
        float pivot = t->items[low + (high - low) / 2].position[axis];
        uint32_t i = low, j = high;
        for (;;) {
            while (t->items[i].position[axis] < pivot) ++i;
            while (t->items[j].position[axis] > pivot) --j;
            if (i >= j) break;
            fct_anchor swap = t->items[i];
            t->items[i] = t->items[j];
            t->items[j] = swap;
            ++i, --j;
        }
        if (mid <= j)
            high = j;
        else
            low = j + 1;
    }
}

void fct_anchors_order(fct_anchors *t) {
    struct range {
        uint32_t begin, end;
    } stack[STACK];
    int top = 0;
    stack[top++] = (struct range){0, t->count};
    while (top > 0) {
        struct range r = stack[--top];
        if (r.end - r.begin < 2) continue;
        int axis = find_longest_axis(t, r.begin, r.end);
        uint32_t mid = r.begin + (r.end - r.begin) / 2;
        select_middle(t, r.begin, r.end, mid, axis);
        t->axes[mid] = (uint8_t)axis;
        stack[top++] = (struct range){r.begin, mid};
        stack[top++] = (struct range){mid + 1, r.end};
    }
}

/* Inserts an anchor if it is nearer than the last one. */
static void insert_anchor(fct_nearest *n, uint32_t id, double d2) {
    if (n->count == FCT_NEAREST_ANCHORS && d2 >= n->distances2[FCT_NEAREST_ANCHORS - 1]) return;
    int i = n->count < FCT_NEAREST_ANCHORS ? n->count++ : FCT_NEAREST_ANCHORS - 1;
    for (; i > 0 && n->distances2[i - 1] > d2; --i)
        n->ids[i] = n->ids[i - 1], n->distances2[i] = n->distances2[i - 1];
    n->ids[i] = id, n->distances2[i] = d2;
}

/* The nearest anchors among those with |n - n'|^2 below most_turn2. */
static void search_anchors(const fct_anchors *t, const float p[3], const float n[3], double most_turn2,
                           fct_nearest *found) {
    struct visit {
        uint32_t begin, end;
        double least2; /* no anchor of the node is nearer */
    } stack[STACK];
    const int last = FCT_NEAREST_ANCHORS - 1;
    int top = 0;
    found->count = 0;
    stack[top++] = (struct visit){0, t->count, 0};
    while (top > 0) {
        struct visit r = stack[--top];
        if (r.begin >= r.end || (found->count > last && r.least2 >= found->distances2[last])) continue;
        uint32_t mid = r.begin + (r.end - r.begin) / 2;
        const fct_anchor *a = &t->items[mid];
        double d2 = 0, turn2 = 0;
        for (int k = 0; k < 3; ++k) {
            double dp = (double)p[k] - a->position[k], dn = (double)n[k] - a->normal[k];
            d2 += dp * dp, turn2 += dn * dn;
        }
        if (turn2 < most_turn2) insert_anchor(found, mid, d2 + t->turn * t->turn * turn2);
        double side = (double)p[t->axes[mid]] - a->position[t->axes[mid]];
        struct visit low = {r.begin, mid, r.least2}, high = {mid + 1, r.end, r.least2};
        if (side < 0)
            high.least2 = fct_max(r.least2, side * side);
        else
            low.least2 = fct_max(r.least2, side * side);
        stack[top++] = side < 0 ? high : low;
        stack[top++] = side < 0 ? low : high;
    }
}

void fct_anchors_nearest(const fct_anchors *t, const float p[3], const float n[3], fct_nearest *found) {
    search_anchors(t, p, n, FCT_MOST_TURN2, found);
    if (found->count == 0) search_anchors(t, p, n, HUGE_VAL, found);
}

void fct_anchors_release(const fct_env *env, fct_anchors *anchors) {
    fct_release(env, anchors->items);
    fct_release(env, anchors->axes);
    *anchors = (fct_anchors){0};
}
