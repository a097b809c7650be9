/* scene/volume.c: the hierarchy over instances.
 *
 * Input: a box per instance. Output: a binary tree of volumes, and the same tree eight wide for rays. A range
 * of boxes is sorted by centre along each axis and split where area times count, summed over both sides, is
 * least. Below level HALVE_LEVEL ranges are halved, so that the depth stays below FCT_SCENE_DEPTH: 2^30
 * instances need 30 more levels. Equal centres are sorted by instance, so the result does not depend on
 * addresses. O(n log^2 n).
 */
#include "scene/volume.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PAD 0x1p-21f /* of the scene's largest extent */
enum { HALVE_LEVEL = 32 };

typedef struct entry {
    float key;
    uint32_t instance;
} entry;

typedef struct range {
    uint32_t node, first, count, level;
} range;

typedef struct builder {
    const fct_bounds *bounds;
    fct_volume *volumes;
    entry *entries, *trial; /* count each */
    float *areas;           /* count */
    uint32_t volume_count;
} builder;

static int compare_entries(const void *a, const void *b) {
    const entry *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    return (x->instance > y->instance) - (x->instance < y->instance);
}

static void grow_bounds(fct_bounds *box, const fct_bounds *by) {
    for (int c = 0; c < 3; ++c) {
        box->lower[c] = by->lower[c] < box->lower[c] ? by->lower[c] : box->lower[c];
        box->upper[c] = by->upper[c] > box->upper[c] ? by->upper[c] : box->upper[c];
    }
}

/* Half of the surface. The scale keeps extents of 1e30 from overflowing. */
static float half_area(const fct_bounds *box, float scale) {
    float x = (box->upper[0] - box->lower[0]) * scale, y = (box->upper[1] - box->lower[1]) * scale,
          z = (box->upper[2] - box->lower[2]) * scale;
    return x * y + y * z + z * x;
}

/* Sorts the range's entries for its best split and returns the size of the left part. */
static uint32_t split_range(builder *b, const range *r, float scale) {
    entry *entries = b->entries + r->first;
    int best_axis = -1;
    uint32_t best_left = r->count / 2;
    double best_cost = INFINITY;
    bool halve = r->level >= HALVE_LEVEL;
    for (int axis = 0; axis < 3; ++axis) {
        for (uint32_t k = 0; k < r->count; ++k) {
            const fct_bounds *box = b->bounds + entries[k].instance;
            b->trial[k] = (entry){.5f * box->lower[axis] + .5f * box->upper[axis], entries[k].instance};
        }
        qsort(b->trial, r->count, sizeof *b->trial, compare_entries);
        fct_bounds box = b->bounds[b->trial[0].instance];
        for (uint32_t k = 0; k + 1 < r->count; ++k) {
            grow_bounds(&box, b->bounds + b->trial[k].instance);
            b->areas[k] = half_area(&box, scale);
        }
        box = b->bounds[b->trial[r->count - 1].instance];
        for (uint32_t k = r->count - 1; k > 0; --k) {
            grow_bounds(&box, b->bounds + b->trial[k].instance);
            double cost = (double)b->areas[k - 1] * k + (double)half_area(&box, scale) * (r->count - k);
            bool allowed = !halve || k == r->count / 2;
            if (allowed && cost < best_cost) best_cost = cost, best_left = k, best_axis = axis;
        }
    }
    if (best_axis >= 0) {
        for (uint32_t k = 0; k < r->count; ++k) {
            const fct_bounds *box = b->bounds + entries[k].instance;
            entries[k].key = .5f * box->lower[best_axis] + .5f * box->upper[best_axis];
        }
        qsort(entries, r->count, sizeof *entries, compare_entries);
    }
    return best_left;
}

static void split_ranges(builder *b, uint32_t count, float scale) {
    range stack[FCT_SCENE_DEPTH + 2];
    int top = 0;
    b->volume_count = 1;
    stack[top++] = (range){0, 0, count, 0};
    while (top > 0) {
        range r = stack[--top];
        fct_volume *volume = b->volumes + r.node;
        const entry *entries = b->entries + r.first;
        *volume = (fct_volume){b->bounds[entries[0].instance], {FCT_NONE, FCT_NONE}, FCT_NONE};
        for (uint32_t k = 1; k < r.count; ++k) grow_bounds(&volume->bounds, b->bounds + entries[k].instance);
        if (r.count == 1) {
            volume->instance = entries[0].instance;
            continue;
        }
        uint32_t left = split_range(b, &r, scale), child = b->volume_count;
        volume->child[0] = child, volume->child[1] = child + 1;
        b->volume_count += 2;
        stack[top++] = (range){child + 1, r.first + left, r.count - left, r.level + 1};
        stack[top++] = (range){child, r.first, left, r.level + 1};
    }
}

fct_result fct_scene_build_volumes(const fct_env *env, uint32_t count, const fct_bounds *bounds,
                                   fct_volume *volumes) {
    builder b = {.bounds = bounds, .volumes = volumes};
    b.entries = fct_allocate(env, count, sizeof *b.entries);
    b.trial = fct_allocate(env, count, sizeof *b.trial);
    b.areas = fct_allocate(env, count, sizeof *b.areas);
    fct_result result = FCT_OK;
    if (b.entries && b.trial && b.areas) {
        fct_bounds whole = bounds[0];
        float size = FLT_MIN;
        for (uint32_t i = 0; i < count; ++i) {
            b.entries[i] = (entry){0, i};
            grow_bounds(&whole, bounds + i);
        }
        for (int c = 0; c < 3; ++c) size = fmaxf(size, whole.upper[c] - whole.lower[c]);
        split_ranges(&b, count, 1 / size);
    } else {
        result = fct_fail_memory(env, "the volumes of a scene");
    }
    fct_release(env, b.entries);
    fct_release(env, b.trial);
    fct_release(env, b.areas);
    return result;
}

/* Lists the children of a wide node: opens the largest volume until there are eight, or only instances.
 * Returns their number. */
static uint32_t collect_children(const fct_volume *volumes, uint32_t root, uint32_t slots[FCT_SCENE_WIDTH]) {
    uint32_t count = 1;
    slots[0] = root;
    while (count < FCT_SCENE_WIDTH) {
        uint32_t open = FCT_NONE;
        double largest = -1;
        for (uint32_t k = 0; k < count; ++k) {
            const fct_volume *volume = volumes + slots[k];
            double size[3];
            for (int c = 0; c < 3; ++c) size[c] = (double)volume->bounds.upper[c] - volume->bounds.lower[c];
            double area = size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
            if (volume->instance == FCT_NONE && area > largest) largest = area, open = k;
        }
        if (open == FCT_NONE) break;
        const fct_volume *volume = volumes + slots[open];
        slots[open] = volume->child[0];
        slots[count++] = volume->child[1];
    }
    return count;
}

/* Sets a child and its box. The box is wider by `pad`, because a ray in the plane of a box's side does not
 * enter the bare box. Without a volume, the bounds are such that no ray hits them. */
static void set_child(fct_scene_node *node, uint32_t slot, const fct_volume *volume, float pad,
                      uint32_t child) {
    node->child[slot] = child;
    for (int c = 0; c < 3; ++c) {
        node->bounds[2 * c][slot] = volume ? nextafterf(volume->bounds.lower[c] - pad, -INFINITY) : INFINITY;
        node->bounds[2 * c + 1][slot] =
            volume ? nextafterf(volume->bounds.upper[c] + pad, INFINITY) : -INFINITY;
    }
}

fct_result fct_scene_build_nodes(const fct_env *env, uint32_t count, const fct_volume *volumes,
                                 fct_scene_node **out) {
    /* Each wide node replaces at least one inner volume, except the root over a single instance. */
    fct_scene_node *nodes = fct_allocate(env, count, sizeof *nodes);
    uint32_t *origins = fct_allocate(env, count, sizeof *origins); /* wide node -> the volume it replaces */
    *out = NULL;
    if (!nodes || !origins) {
        fct_release(env, nodes);
        fct_release(env, origins);
        return fct_fail_memory(env, "the volumes of a scene");
    }
    uint32_t node_count = 1;
    float pad = 0;
    for (int c = 0; c < 3; ++c) {
        double size = (double)volumes[0].bounds.upper[c] - (double)volumes[0].bounds.lower[c];
        pad = fmaxf(pad, (float)(PAD * size));
    }
    origins[0] = 0;
    for (uint32_t n = 0; n < node_count; ++n) {
        uint32_t slots[FCT_SCENE_WIDTH], used = collect_children(volumes, origins[n], slots);
        for (uint32_t k = 0; k < FCT_SCENE_WIDTH; ++k) {
            if (k >= used) {
                set_child(nodes + n, k, NULL, 0, FCT_NONE);
                continue;
            }
            const fct_volume *volume = volumes + slots[k];
            uint32_t child = volume->instance != FCT_NONE ? FCT_SCENE_LEAF | volume->instance : node_count;
            set_child(nodes + n, k, volume, pad, child);
            if (volume->instance == FCT_NONE) origins[node_count++] = slots[k];
        }
    }
    fct_release(env, origins);
    *out = nodes;
    return FCT_OK;
}
