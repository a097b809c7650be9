/* bvh/entry.h: the stack of a traversal that enters the nearest child first. */
#ifndef FCT_BVH_ENTRY_H
#define FCT_BVH_ENTRY_H

#include "base/key.h"
#include "bvh/model.h"

/* A pending child: the bits of its distance, or of the square, above its reference. Distances are not
 * negative, so entries sort by distance. */
static inline uint64_t fct_entry_make(float distance, uint32_t ref) {
    return (uint64_t)fct_float_bits(distance) << 32 | ref;
}
static inline float fct_entry_distance(uint64_t entry) {
    return fct_float_of_bits((uint32_t)(entry >> 32));
}

/* A function that only prefetches has no effect that gcc 12 sees: it deletes the calls that it has not
 * inlined early. */
#define FCT_PREFETCH_INLINE static inline __attribute__((always_inline))

/* Prefetches 256 bytes: an axis node, or the largest leaf. */
FCT_PREFETCH_INLINE void fct_prefetch_child(const fct_bvh *bvh, uint32_t ref) {
    const char *at = ref & FCT_REF_LEAF ? (const char *)fct_bvh_leaf(bvh, ref) : fct_bvh_node(bvh, ref);
    __builtin_prefetch(at);
    __builtin_prefetch(at + 64);
    __builtin_prefetch(at + 128);
    __builtin_prefetch(at + 192);
}

/* Prefetches a node of either kind, or a leaf. */
FCT_PREFETCH_INLINE void fct_prefetch_all(const fct_bvh *bvh, uint32_t ref) {
    fct_prefetch_child(bvh, ref);
    if (ref & FCT_REF_LEAF || !(ref & FCT_REF_ORIENTED)) return;
    const char *at = fct_bvh_node(bvh, ref);
    __builtin_prefetch(at + 256);
    __builtin_prefetch(at + 320);
    __builtin_prefetch(at + 384);
}

#endif
