/* bvh/near/descend.h: the stack of a search that opens the nearest box first. For kernel files. */
#ifndef FCT_BVH_DESCEND_H
#define FCT_BVH_DESCEND_H

#include "base/key.h"
#include "bvh/near/measure.h"

/* A pending child: the bits of its squared distance above its reference. */
static inline float fct_entry_distance2(uint64_t entry) {
    return fct_float_of_bits((uint32_t)(entry >> 32));
}

/* Prefetches 256 bytes: an axis node, or the largest leaf. */
static inline void fct_prefetch_child(const fct_bvh *bvh, uint32_t ref) {
    const char *at = ref & FCT_REF_LEAF ? (const char *)fct_bvh_leaf(bvh, ref) : fct_bvh_node(bvh, ref);
    __builtin_prefetch(at);
    __builtin_prefetch(at + 64);
    __builtin_prefetch(at + 128);
    __builtin_prefetch(at + 192);
}

/* Pushes the children whose bit is set, the nearest on top, and returns the new height.
 *
 * Each lane counts the lanes that are farther away. The count is its place above `height`. So no branch
 * depends on the order of the distances. The lowest bits of the keys are lane numbers, so no two are equal.
 */
static inline uint32_t fct_push_children(const fct_bvh *bvh, uint64_t *stack, uint32_t height, uint32_t met,
                                         const float distance2[8], const uint32_t child[8]) {
    static const uint32_t numbers[8] = {0, 1, 2, 3, 4, 5, 6, 7}, bits[8] = {1, 2, 4, 8, 16, 32, 64, 128};
    i8 lane = i8_load(numbers), bit = i8_load(bits), farther = i8_set(0);
    i8 key = i8_add(i8_without(i8_bits(f8_load(distance2)), i8_set(7)), i8_set(8));
    key = i8_or(i8_and(key, i8_same(i8_and(i8_set(met), bit), bit)), lane);
    for (uint32_t i = 1; i < 8; ++i)
        farther = i8_add(farther, i8_less(key, i8_lookup8(key, i8_add(lane, i8_set(i)))));
    uint32_t below[8], count = 0;
    i8_store(below, farther); /* minus the count */
    for (; met; met &= met - 1, ++count) {
        uint32_t i = (uint32_t)__builtin_ctz(met);
        stack[height - below[i]] = (uint64_t)fct_float_bits(distance2[i]) << 32 | child[i];
        fct_prefetch_child(bvh, child[i]);
    }
    return height + count;
}

#endif
