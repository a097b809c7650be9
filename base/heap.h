/* base/heap.h: an indexed 4-ary min-heap: items are ids below a capacity, ordered by
 * (key, id). */
#ifndef FCT_BASE_HEAP_H
#define FCT_BASE_HEAP_H

#include "base/env.h"

typedef struct fct_heap_entry {
    uint64_t key;
    uint32_t id;
} fct_heap_entry;

typedef struct fct_heap {
    fct_heap_entry *entries;
    uint32_t *places; /* id -> entry, FCT_NONE when the id is not in the heap */
    uint32_t count, capacity;
} fct_heap;

/* An empty heap for ids below capacity. Errors: MEMORY; the heap is all zero then. */
fct_result fct_heap_create(const fct_env *env, uint32_t capacity, fct_heap *heap);
/* Accepts a zeroed heap. */
void fct_heap_release(const fct_env *env, fct_heap *heap);

/* Puts the id in without keeping order; fct_heap_order must follow before any other call. */
void fct_heap_append(fct_heap *heap, uint32_t id, uint64_t key);
/* Orders what was appended. O(count). */
void fct_heap_order(fct_heap *heap);
/* Adds the id, or changes its key. O(log count). */
void fct_heap_set(fct_heap *heap, uint32_t id, uint64_t key);
/* Nothing happens to an id that is not in the heap. O(log count). */
void fct_heap_remove(fct_heap *heap, uint32_t id);
/* Takes out and returns the least; FCT_NONE from an empty heap. O(log count). */
uint32_t fct_heap_pop(fct_heap *heap);

#endif
