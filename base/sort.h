/* base/sort.h: stable parallel radix sort of 64-bit keys with 32-bit values. */
#ifndef FCT_BASE_SORT_H
#define FCT_BASE_SORT_H

#include "base/env.h"

/* Sorts count pairs by ascending key, equal keys in the order given; the same for every thread count.
 * O(count) for each byte in which the keys differ. Takes 12 bytes a pair while it runs. Errors: MEMORY. */
fct_result fct_sort_pairs(const fct_env *env, uint64_t *keys, uint32_t *values, size_t count);

/* Sorts items by their upper 32 bits, equal ones in the order given. As fct_sort_pairs, 8 bytes an item. */
fct_result fct_sort_items(const fct_env *env, uint64_t *items, size_t count);

/* The order of floats as unsigned integers: a < b in value is key(a) < key(b); -0 sorts below +0. */
static inline uint32_t fct_float_key(float value) {
    union {
        float f;
        uint32_t u;
    } bits = {value};
    return bits.u & 0x80000000u ? ~bits.u : bits.u | 0x80000000u;
}

#endif
