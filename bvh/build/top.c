/* bvh/build/top.c: a binary tree over the leaves by binned surface-area cost.
 *
 * Clusters make good leaves, but above the leaves a ray visits 1.6 times as many nodes of the cluster tree as
 * of a tree that is split top-down. So this file splits the set of leaves, with 16 bins per axis (Wald 2007).
 * A set whose centres coincide, or that is SPLIT_DEPTH levels deep, is halved by count. This bounds the depth
 * of any input by FCT_TOP_DEPTH: 48 levels of splits and 32 of halving. Each leaf counts 1, whatever it
 * holds. O(n log n), in parallel below nodes of PART_LEAVES leaves.
 */
#include "bvh/build/top.h"

#include <string.h>

#include "base/parallel.h"

enum { BIN_COUNT = 16, SPLIT_DEPTH = 48, PART_LEAVES = 2048 };

typedef struct bin {
    float bounds[6]; /* of a bin that is not empty */
    uint32_t count;
} bin;

static void clear_bounds(float b[6]) {
    for (int k = 0; k < 3; ++k) b[k] = INFINITY, b[3 + k] = -INFINITY;
}

static void join_bounds(float b[6], const float o[6]) {
    for (int k = 0; k < 3; ++k) {
        b[k] = o[k] < b[k] ? o[k] : b[k];
        b[3 + k] = o[3 + k] > b[3 + k] ? o[3 + k] : b[3 + k];
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
    float right[BIN_COUNT], sum = 0, b[6];
    uint32_t count = 0;
    clear_bounds(b);
    for (uint32_t i = BIN_COUNT; i-- > 1;) {
        if (bins[i].count) {
            join_bounds(b, bins[i].bounds);
            count += bins[i].count;
            sum = half_area(b) * (float)count;
        }
        right[i] = sum;
    }
    clear_bounds(b);
    count = 0;
    for (uint32_t i = 0; i + 1 < BIN_COUNT; ++i) {
        if (bins[i].count == 0) continue;
        join_bounds(b, bins[i].bounds);
        count += bins[i].count;
        float cost = half_area(b) * (float)count + right[i + 1];
        if (cost < best->cost) *best = (split){axis, i, cost};
    }
}

/* The bins of an axis: of twice the centres, from `lower` on. An axis on which all centres coincide has the
 * factor 0 and no bins. */
typedef struct binning {
    float lower[3], factor[3];
    bin bins[3][BIN_COUNT];
} binning;

static void fill_bins(const float *bounds, const uint32_t *order, uint32_t count, binning *b) {
    float high[3];
    for (int k = 0; k < 3; ++k) b->lower[k] = INFINITY, high[k] = -INFINITY;
    for (uint32_t i = 0; i < count; ++i) {
        const float *box = bounds + 6 * (size_t)order[i];
        for (int k = 0; k < 3; ++k) {
            float c = double_center(box, k);
            b->lower[k] = c < b->lower[k] ? c : b->lower[k];
            high[k] = c > high[k] ? c : high[k];
        }
    }
    for (int k = 0; k < 3; ++k) {
        /* The factor is a little smaller, so that the highest centre stays in the last bin. */
        float width = high[k] - b->lower[k];
        b->factor[k] = width > 0 ? (float)BIN_COUNT * (1 - 0x1p-20f) / width : 0;
        if (!(b->factor[k] < INFINITY)) b->factor[k] = 0;
        for (int i = 0; i < BIN_COUNT; ++i) b->bins[k][i].count = 0;
    }
    for (uint32_t i = 0; i < count; ++i) {
        const float *box = bounds + 6 * (size_t)order[i];
        for (int k = 0; k < 3; ++k) {
            if (b->factor[k] == 0) continue;
            bin *into = &b->bins[k][find_bin(double_center(box, k), b->lower[k], b->factor[k])];
            if (into->count++)
                join_bounds(into->bounds, box);
            else
                memcpy(into->bounds, box, sizeof into->bounds);
        }
    }
}

/* Reorders the leaves of a node into two parts, neither empty, and returns where the second part begins. */
static uint32_t split_leaves(const float *bounds, uint32_t *order, const fct_top_node *node, uint32_t depth) {
    uint32_t middle = node->begin + (node->end - node->begin) / 2;
    if (node->end - node->begin == 2 || depth >= SPLIT_DEPTH) return middle;
    binning b;
    fill_bins(bounds, order + node->begin, node->end - node->begin, &b);
    split best = {.axis = -1, .cost = INFINITY};
    for (int k = 0; k < 3; ++k)
        if (b.factor[k] != 0) find_best_plane(b.bins[k], k, &best);
    if (best.axis < 0) return middle;
    uint32_t left = node->begin, right = node->end;
    while (left < right) {
        float c = double_center(bounds + 6 * (size_t)order[left], best.axis);
        if (find_bin(c, b.lower[best.axis], b.factor[best.axis]) <= best.last) {
            ++left;
        } else {
            uint32_t moved = order[--right];
            order[right] = order[left];
            order[left] = moved;
        }
    }
    return left > node->begin && left < node->end ? left : middle;
}

/* A node that is still to be split. */
typedef struct pending {
    uint32_t node, depth;
} pending;

/* Sets the bounds of a node. Gives it two children, `next` and next + 1, unless it holds at most
 * `most` leaves: returns whether it did. */
static bool split_node(const float *bounds, fct_top *top, pending at, uint32_t most, uint32_t next) {
    fct_top_node *node = &top->nodes[at.node];
    clear_bounds(node->bounds);
    for (uint32_t i = node->begin; i < node->end; ++i)
        join_bounds(node->bounds, bounds + 6 * (size_t)top->order[i]);
    node->area = half_area(node->bounds);
    if (node->end - node->begin <= most) return false;
    uint32_t middle = split_leaves(bounds, top->order, node, at.depth);
    node->left = next, node->right = next + 1;
    fct_top_node child = {.left = FCT_NONE, .right = FCT_NONE, .begin = node->begin, .end = middle};
    top->nodes[node->left] = child;
    child.begin = middle, child.end = node->end;
    top->nodes[node->right] = child;
    return true;
}

/* Splits the nodes of more than PART_LEAVES leaves, and lists the others below them. Returns the number of
 * the latter. */
static uint32_t split_upper(const float *bounds, fct_top *top, uint32_t most, pending *parts) {
    pending stack[FCT_TOP_DEPTH + 2];
    uint32_t height = 1, count = 0;
    stack[0] = (pending){0, 0};
    while (height) {
        pending at = stack[--height];
        if (top->nodes[at.node].end - top->nodes[at.node].begin <= PART_LEAVES) {
            parts[count++] = at;
            continue;
        }
        split_node(bounds, top, at, most, top->node_count);
        stack[height++] = (pending){top->node_count + 1, at.depth + 1};
        stack[height++] = (pending){top->node_count, at.depth + 1};
        top->node_count += 2;
    }
    return count;
}

typedef struct part_job {
    const float *bounds;
    uint32_t most;
    fct_top *top;
    const pending *parts;
    const uint32_t *first; /* per part: the number of its first new node */
} part_job;

static void split_parts(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const part_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        pending stack[FCT_TOP_DEPTH + 2];
        uint32_t height = 1, next = job->first[i];
        stack[0] = job->parts[i];
        while (height) {
            pending at = stack[--height];
            if (!split_node(job->bounds, job->top, at, job->most, next)) continue;
            stack[height++] = (pending){next + 1, at.depth + 1};
            stack[height++] = (pending){next, at.depth + 1};
            next += 2;
        }
    }
}

/* Splits nodes until each holds at most `most` leaves. A part of n leaves takes at most 2n - 2 new nodes, so
 * the numbers of all nodes are known before the parts are split. If `most` is above 1, some numbers are
 * unused.
 */
static fct_result split_all(const fct_env *env, const float *bounds, fct_top *top, uint32_t most,
                            uint32_t leaves) {
    pending *parts;
    uint32_t *first;
    const fct_array scratch[] = {FCT_ARRAY(parts, leaves), FCT_ARRAY(first, leaves)};
    fct_result result = fct_allocate_all(env, scratch, FCT_LENGTH(scratch), "the top of a ray structure");
    if (result != FCT_OK) return result;
    const uint32_t count = split_upper(bounds, top, most, parts);
    for (uint32_t i = 0; i < count; ++i) {
        const fct_top_node *node = &top->nodes[parts[i].node];
        first[i] = top->node_count;
        top->node_count += 2 * (node->end - node->begin) - 2;
    }
    part_job job = {bounds, most, top, parts, first};
    fct_parallel_for(env, count, 1, split_parts, &job);
    fct_release_all(env, scratch, FCT_LENGTH(scratch));
    return FCT_OK;
}

/* Sets the bounds along the coordinate axes, where the splits had other axes. Unused nodes are empty. */
static void bound_nodes(const float *bounds, fct_top *top) {
    for (uint32_t n = top->node_count; n-- > 0;) {
        fct_top_node *node = &top->nodes[n];
        clear_bounds(node->bounds);
        if (node->left != FCT_NONE) {
            join_bounds(node->bounds, top->nodes[node->left].bounds);
            join_bounds(node->bounds, top->nodes[node->right].bounds);
            continue;
        }
        for (uint32_t i = node->begin; i < node->end; ++i)
            join_bounds(node->bounds, bounds + 6 * (size_t)top->order[i]);
    }
}

fct_result fct_top_build(const fct_env *env, const fct_leaf_list *leaves, uint32_t most, fct_top *out) {
    *out = (fct_top){0};
    fct_top top = {.node_count = 1};
    const fct_array arrays[] = {FCT_ARRAY(top.nodes, 2 * (size_t)leaves->count),
                                FCT_ARRAY(top.order, leaves->count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the top of a ray structure");
    if (result != FCT_OK) return result;
    for (uint32_t i = 0; i < leaves->count; ++i) top.order[i] = i;
    top.nodes[0] = (fct_top_node){.left = FCT_NONE, .right = FCT_NONE, .begin = 0, .end = leaves->count};
    if (most > 1)
        for (uint32_t n = 1; n < 2 * leaves->count; ++n) top.nodes[n] = (fct_top_node){.left = FCT_NONE};
    const float *bounds = leaves->frame_bounds ? leaves->frame_bounds : leaves->bounds;
    result = split_all(env, bounds, &top, most, leaves->count);
    if (result == FCT_OK && leaves->frame_bounds) bound_nodes(leaves->bounds, &top);
    if (result != FCT_OK)
        fct_top_release(env, &top);
    else
        *out = top;
    return result;
}

void fct_top_release(const fct_env *env, fct_top *top) {
    fct_release(env, top->nodes);
    fct_release(env, top->order);
    *top = (fct_top){0};
}
