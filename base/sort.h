/* base/sort.h: stable parallel radix sort of 64-bit keys with 32-bit values. */
#ifndef FCT_BASE_SORT_H
#define FCT_BASE_SORT_H

#include "base/env.h"

/* Sorts count pairs by ascending key. Pairs with equal keys keep their order. O(count) per byte in which the
 * keys differ. Allocates 12 bytes per pair. Errors: MEMORY. */
fct_result fct_sort_pairs(const fct_env *env, uint64_t *keys, uint32_t *values, size_t count);

/* Sorts items by their upper 32 bits. Items with equal upper bits keep their order. Allocates 8 bytes per
 * item. Errors: MEMORY. */
fct_result fct_sort_items(const fct_env *env, uint64_t *items, size_t count);

/* Sorts count pairs by (key, value) in place, without memory and on the calling thread. O(count log count).
 */
void fct_sort_in_place(uint64_t *keys, uint32_t *values, size_t count);

#endif
