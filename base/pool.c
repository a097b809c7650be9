/* base/pool.c: see pool.h. An allocation takes the first gap that is large enough. The 64 bytes before it
 * store its size. If a release makes more gaps than the list can hold, the smallest gap stays unused. */
#include "base/pool.h"

#include <stdlib.h>
#include <string.h>

enum { HEADER = 64 };

static void *take_gap(fct_pool *pool, uint32_t gap, size_t bytes) {
    unsigned char *part = pool->block + pool->begins[gap];
    memcpy(part, &bytes, sizeof bytes);
    pool->begins[gap] += bytes;
    if (pool->begins[gap] == pool->ends[gap]) {
        --pool->gap_count;
        for (uint32_t i = gap; i < pool->gap_count; ++i)
            pool->begins[i] = pool->begins[i + 1], pool->ends[i] = pool->ends[i + 1];
    }
    return part + HEADER;
}

static void *pool_allocate(void *user, size_t size) {
    fct_pool *pool = user;
    size_t bytes = ((size + 63) & ~(size_t)63) + HEADER;
    for (uint32_t i = 0; i < pool->gap_count; ++i)
        if (pool->ends[i] - pool->begins[i] >= bytes) return take_gap(pool, i, bytes);
    return fct_allocate(pool->beneath, size, 1);
}

static void drop_smallest_gap(fct_pool *pool) {
    uint32_t smallest = 0;
    for (uint32_t i = 1; i < pool->gap_count; ++i)
        if (pool->ends[i] - pool->begins[i] < pool->ends[smallest] - pool->begins[smallest]) smallest = i;
    --pool->gap_count;
    for (uint32_t i = smallest; i < pool->gap_count; ++i)
        pool->begins[i] = pool->begins[i + 1], pool->ends[i] = pool->ends[i + 1];
}

static void add_gap(fct_pool *pool, size_t begin, size_t end) {
    if (pool->gap_count == FCT_POOL_GAPS) drop_smallest_gap(pool);
    uint32_t at = pool->gap_count;
    for (; at > 0 && pool->begins[at - 1] > begin; --at)
        pool->begins[at] = pool->begins[at - 1], pool->ends[at] = pool->ends[at - 1];
    pool->begins[at] = begin, pool->ends[at] = end;
    ++pool->gap_count;
    uint32_t to = 0;
    for (uint32_t i = 0; i < pool->gap_count; ++i) {
        if (to > 0 && pool->ends[to - 1] == pool->begins[i])
            pool->ends[to - 1] = pool->ends[i];
        else
            pool->begins[to] = pool->begins[i], pool->ends[to++] = pool->ends[i];
    }
    pool->gap_count = to;
}

static void pool_release(void *user, void *memory) {
    fct_pool *pool = user;
    unsigned char *part = memory;
    if (part < pool->block || part >= pool->block + pool->size) {
        fct_release(pool->beneath, memory);
        return;
    }
    size_t bytes, begin = (size_t)(part - pool->block) - HEADER;
    memcpy(&bytes, part - HEADER, sizeof bytes);
    add_gap(pool, begin, begin + bytes);
}

void fct_pool_create(const fct_env *beneath, void *block, size_t size, fct_pool *out) {
    *out = (fct_pool){.env = *beneath, .beneath = beneath, .block = block, .size = size & ~(size_t)63};
    out->env.allocate = pool_allocate, out->env.release = pool_release, out->env.memory_user = out;
    if (out->size) out->gap_count = 1, out->ends[0] = out->size;
}
