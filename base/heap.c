/* base/heap.c: see heap.h. Each node has four children, because the heap then has half the levels of a binary
 * heap, and four entries fill a cache line. */
#include "base/heap.h"

#include <string.h>

static inline bool comes_before(fct_heap_entry a, fct_heap_entry b) {
    return a.key != b.key ? a.key < b.key : a.id < b.id;
}

static inline void place_entry(fct_heap *heap, uint32_t place, fct_heap_entry entry) {
    heap->entries[place] = entry;
    heap->places[entry.id] = place;
}

static void sift_entry_up(fct_heap *heap, uint32_t place, fct_heap_entry entry) {
    while (place > 0) {
        uint32_t parent = (place - 1) / 4;
        if (!comes_before(entry, heap->entries[parent])) break;
        place_entry(heap, place, heap->entries[parent]);
        place = parent;
    }
    place_entry(heap, place, entry);
}

static void sift_entry_down(fct_heap *heap, uint32_t place, fct_heap_entry entry) {
    for (;;) {
        uint64_t child = 4 * (uint64_t)place + 1;
        if (child >= heap->count) break;
        uint64_t end = child + 4 < heap->count ? child + 4 : heap->count, least = child;
        for (uint64_t i = child + 1; i < end; ++i)
            if (comes_before(heap->entries[i], heap->entries[least])) least = i;
        if (!comes_before(heap->entries[least], entry)) break;
        place_entry(heap, place, heap->entries[least]);
        place = (uint32_t)least;
    }
    place_entry(heap, place, entry);
}

fct_result fct_heap_create(const fct_env *env, uint32_t capacity, fct_heap *heap) {
    *heap = (fct_heap){.capacity = capacity};
    heap->entries = fct_allocate(env, capacity, sizeof *heap->entries);
    heap->places = fct_allocate(env, capacity, sizeof *heap->places);
    if (!heap->entries || !heap->places) {
        fct_heap_release(env, heap);
        return fct_fail_memory(env, "a heap");
    }
    memset(heap->places, 0xFF, (size_t)capacity * sizeof *heap->places);
    return FCT_OK;
}

void fct_heap_release(const fct_env *env, fct_heap *heap) {
    fct_release(env, heap->entries);
    fct_release(env, heap->places);
    *heap = (fct_heap){0};
}

void fct_heap_append(fct_heap *heap, uint32_t id, uint64_t key) {
    place_entry(heap, heap->count++, (fct_heap_entry){key, id});
}

void fct_heap_order(fct_heap *heap) {
    for (uint32_t i = heap->count / 4 + 1; i-- > 0;)
        if (i < heap->count) sift_entry_down(heap, i, heap->entries[i]);
}

void fct_heap_set(fct_heap *heap, uint32_t id, uint64_t key) {
    fct_heap_entry entry = {key, id};
    uint32_t place = heap->places[id];
    if (place == FCT_NONE)
        sift_entry_up(heap, heap->count++, entry);
    else if (comes_before(entry, heap->entries[place]))
        sift_entry_up(heap, place, entry);
    else
        sift_entry_down(heap, place, entry);
}

void fct_heap_remove(fct_heap *heap, uint32_t id) {
    uint32_t place = heap->places[id];
    if (place == FCT_NONE) return;
    heap->places[id] = FCT_NONE;
    fct_heap_entry last = heap->entries[--heap->count];
    if (place == heap->count) return;
    if (place > 0 && comes_before(last, heap->entries[(place - 1) / 4]))
        sift_entry_up(heap, place, last);
    else
        sift_entry_down(heap, place, last);
}

uint32_t fct_heap_pop(fct_heap *heap) {
    if (heap->count == 0) return FCT_NONE;
    uint32_t id = heap->entries[0].id;
    fct_heap_remove(heap, id);
    return id;
}
