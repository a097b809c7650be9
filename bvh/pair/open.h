/* bvh/pair/open.h: the stack of a search for contacts, for kernel files. */
#ifndef FCT_BVH_OPEN_H
#define FCT_BVH_OPEN_H

#include "bvh/pair/map.h"

/* Larger models are prefetched. Two statues of a million triangles touch in 4.4 us instead of 5.2. Two scans
 * of 70,000 triangles take 1.06 times as long without prefetching if other work uses the caches in between.
 * If the caches keep what the poses need, they take 1.2 times as long with prefetching. */
#define PREFETCH_BYTES ((size_t)2 << 20)

static size_t count_bytes(const fct_bvh *bvh) {
    return bvh->leaf_bytes + bvh->pair_count * sizeof(fct_pair_node);
}

/* Prefetches a node, or the largest leaf. */
static inline void prefetch_child(const fct_bvh *bvh, uint32_t ref) {
    const char *at =
        ref & FCT_REF_LEAF ? (const char *)fct_bvh_leaf(bvh, ref) : (const char *)&bvh->pairs[ref];
    uint32_t bytes = ref & FCT_REF_LEAF ? 256 : (uint32_t)sizeof(fct_pair_node);
    for (uint32_t i = 0; i < bytes; i += 64) __builtin_prefetch(at + i);
}

static bool is_prefetched(const fct_pair_map *map) {
    return count_bytes(map->a) + count_bytes(map->b) > PREFETCH_BYTES;
}

/* A pair of boxes. */
typedef struct box_pair {
    uint32_t a, b;
} box_pair;

/* A node of `own` whose boxes were tested against box `fixed` of the other model. */
typedef struct opened_node {
    const fct_bvh *own;
    uint32_t number, fixed;
    bool opens_a, prefetches;
} opened_node;

/* Pushes the boxes of the node in the mask `met` with the other box, those that overlap deepest on top.
 * Returns the new height of the stack. */
static inline __attribute__((always_inline)) uint32_t
push_boxes(const opened_node *node, uint32_t met, const float depth[8], box_pair *stack, uint32_t height) {
    const uint32_t *children = node->own->pairs[node->number].child;
    float waiting[8];
    const uint32_t base = height;
    for (; met; met &= met - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(met), child = node->number << 3 | i;
        if (children[i] == FCT_NONE) continue;
        if (node->prefetches) prefetch_child(node->own, children[i]);
        uint32_t at = height++;
        for (; at > base && waiting[at - 1 - base] < depth[i]; --at)
            stack[at] = stack[at - 1], waiting[at - base] = waiting[at - 1 - base];
        stack[at] = node->opens_a ? (box_pair){child, node->fixed} : (box_pair){node->fixed, child};
        waiting[at - base] = depth[i];
    }
    return height;
}

#endif
