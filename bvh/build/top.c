/* bvh/build/top.c: a binary tree over the leaves by binned surface-area cost.
 *
 * Clusters make good leaves, but above the leaves a ray visits 1.6 times as many nodes of the cluster tree as
 * of a tree that is split top-down. So this file splits the set of leaves, with 16 bins per axis (Wald 2007).
 * A set whose centres coincide, or that is SPLIT_DEPTH levels deep, is halved by count. This bounds the depth
 * of any input by FCT_TOP_DEPTH: 48 levels of splits and 32 of halving. Each leaf counts 1, whatever it
 * holds. O(n log n) on one thread, about 1 % of the time of clustering.
 */
#include "bvh/build/top.h"

enum { BIN_COUNT = 16, SPLIT_DEPTH = 48 };

typedef struct bin {
    float bounds[6];
    uint32_t count;
} bin;

static void clear_bounds(float b[6]) {
    for (int k = 0; k < 3; ++k) b[k] = INFINITY, b[3 + k] = -INFINITY;
}

static void join_bounds(float b[6], const float o[6]) {
    for (int k = 0; k < 3; ++k) {
        if (o[k] < b[k]) b[k] = o[k];
        if (o[3 + k] > b[3 + k]) b[3 + k] = o[3 + k];
    }
}

/* Half of the surface. */
static float half_area(const float b[6]) {
    float x = b[3] - b[0], y = b[4] - b[1], z = b[5] - b[2];
    return x * y + y * z + z * x;
}

/* Twice the centre of a box. */
static float double_center(const float *bounds, int axis) {
    return bounds[axis] + bounds[3 + axis];
}

typedef struct split {
    int axis;
    uint32_t last; /* bins [0, last] go left */
    float cost;
} split;

static uint32_t find_bin(float value, float lower, float factor) {
    uint32_t b = (uint32_t)((value - lower) * factor);
    return b < BIN_COUNT ? b : BIN_COUNT - 1;
}

/* Replaces *best by the plane of least cost among the 15 between the bins of one axis, if it costs less. The
 * cost is area times number of leaves, summed over both sides. */
static void find_best_plane(const bin bins[BIN_COUNT], int axis, split *best) {
    float right[BIN_COUNT], b[6];
    uint32_t count = 0;
    clear_bounds(b);
    for (uint32_t i = BIN_COUNT; i-- > 1;) {
        join_bounds(b, bins[i].bounds);
        count += bins[i].count;
        right[i] = count ? half_area(b) * (float)count : 0;
    }
    clear_bounds(b);
    count = 0;
    for (uint32_t i = 0; i + 1 < BIN_COUNT; ++i) {
        join_bounds(b, bins[i].bounds);
        count += bins[i].count;
        if (count == 0) continue;
        float cost = half_area(b) * (float)count + right[i + 1];
        if (cost < best->cost) *best = (split){axis, i, cost};
    }
}

/* Reorders [begin, end) of `order` into two parts, neither empty, and returns where the second part begins.
 */
static uint32_t split_leaves(const float *bounds, uint32_t *order, uint32_t begin, uint32_t end,
                             uint32_t depth) {
    uint32_t middle = begin + (end - begin) / 2;
    if (end - begin == 2 || depth >= SPLIT_DEPTH) return middle;
    float lower[3], factor[3];
    for (int k = 0; k < 3; ++k) {
        float low = INFINITY, high = -INFINITY;
        for (uint32_t i = begin; i < end; ++i) {
            float c = double_center(bounds + 6 * (size_t)order[i], k);
            if (c < low) low = c;
            if (c > high) high = c;
        }
        lower[k] = low;
        /* The factor is a little smaller, so that the highest centre stays in the last bin. */
        factor[k] = high > low ? (float)BIN_COUNT * (1 - 0x1p-20f) / (high - low) : 0;
        if (!(factor[k] < INFINITY)) factor[k] = 0;
    }
    split best = {.axis = -1, .cost = INFINITY};
    for (int k = 0; k < 3; ++k) {
        if (factor[k] == 0) continue;
        bin bins[BIN_COUNT];
        for (int i = 0; i < BIN_COUNT; ++i) clear_bounds(bins[i].bounds), bins[i].count = 0;
        for (uint32_t i = begin; i < end; ++i) {
            const float *b = bounds + 6 * (size_t)order[i];
            bin *into = &bins[find_bin(double_center(b, k), lower[k], factor[k])];
            join_bounds(into->bounds, b);
            ++into->count;
        }
        find_best_plane(bins, k, &best);
    }
    if (best.axis < 0) return middle;
    uint32_t left = begin, right = end;
    while (left < right) {
        const float *b = bounds + 6 * (size_t)order[left];
        if (find_bin(double_center(b, best.axis), lower[best.axis], factor[best.axis]) <= best.last) {
            ++left;
        } else {
            uint32_t moved = order[--right];
            order[right] = order[left];
            order[left] = moved;
        }
    }
    return left > begin && left < end ? left : middle;
}

/* Splits nodes until each holds one leaf. `stack` holds pairs of a node and its depth. */
static void split_nodes(const float *bounds, fct_top *top, uint32_t *stack) {
    uint32_t height = 0;
    stack[height++] = 0, stack[height++] = 0;
    while (height) {
        uint32_t depth = stack[--height], number = stack[--height];
        fct_top_node *node = &top->nodes[number];
        clear_bounds(node->bounds);
        for (uint32_t i = node->begin; i < node->end; ++i)
            join_bounds(node->bounds, bounds + 6 * (size_t)top->order[i]);
        if (node->end - node->begin == 1) continue;
        uint32_t middle = split_leaves(bounds, top->order, node->begin, node->end, depth);
        node->left = top->node_count++;
        node->right = top->node_count++;
        fct_top_node child = {.left = FCT_NONE, .right = FCT_NONE, .begin = node->begin, .end = middle};
        top->nodes[node->left] = child;
        child.begin = middle, child.end = node->end;
        top->nodes[node->right] = child;
        stack[height++] = node->right, stack[height++] = depth + 1;
        stack[height++] = node->left, stack[height++] = depth + 1;
    }
}

fct_result fct_top_build(const fct_env *env, const fct_leaf_list *leaves, fct_top *out) {
    *out = (fct_top){0};
    fct_top top = {.node_count = 1};
    top.nodes = fct_allocate(env, 2 * (size_t)leaves->count, sizeof *top.nodes);
    top.order = fct_allocate(env, leaves->count, sizeof *top.order);
    if (!top.nodes || !top.order) {
        fct_top_release(env, &top);
        return fct_fail_memory(env, "the top of a ray structure");
    }
    for (uint32_t i = 0; i < leaves->count; ++i) top.order[i] = i;
    top.nodes[0] = (fct_top_node){.left = FCT_NONE, .right = FCT_NONE, .begin = 0, .end = leaves->count};
    uint32_t stack[2 * (FCT_TOP_DEPTH + 2)];
    split_nodes(leaves->bounds, &top, stack);
    *out = top;
    return FCT_OK;
}

void fct_top_release(const fct_env *env, fct_top *top) {
    fct_release(env, top->nodes);
    fct_release(env, top->order);
    *top = (fct_top){0};
}
