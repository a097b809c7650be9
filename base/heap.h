/* base/heap.h: a min-heap of ids below a capacity, ordered by (key, id). The key of an id can change. */
#ifndef FCT_BASE_HEAP_H
#define FCT_BASE_HEAP_H

#include "base/env.h"

typedef struct fct_heap_entry {
    uint64_t key;
    uint32_t id;
} fct_heap_entry;

typedef struct fct_heap {
    fct_heap_entry *entries;
    uint32_t *places; /* id -> its entry; FCT_NONE: the id is not in the heap */
    uint32_t count, capacity;
} fct_heap;

/* An empty heap for ids below capacity. Errors: MEMORY. On failure the heap is all zero. */
fct_result fct_heap_create(const fct_env *env, uint32_t capacity, fct_heap *heap);
/* Accepts a zeroed heap. */
void fct_heap_release(const fct_env *env, fct_heap *heap);

/* Adds an id that is not in the heap, without ordering. Call fct_heap_order before any other function. */
void fct_heap_append(fct_heap *heap, uint32_t id, uint64_t key);
/* Orders the heap after appends. O(count). */
void fct_heap_order(fct_heap *heap);
/* Adds the id, or changes its key. O(log count). */
void fct_heap_set(fct_heap *heap, uint32_t id, uint64_t key);
/* Removes the id if it is in the heap. O(log count). */
void fct_heap_remove(fct_heap *heap, uint32_t id);
/* Removes the least id and returns it. Returns FCT_NONE if the heap is empty. O(log count). */
uint32_t fct_heap_pop(fct_heap *heap);

#endif
