/* cluster/merge/rounds/merge.c: merges the pairs of a round and numbers the clusters of the next.
 *
 * Merges are collected in a queue first, so that their records are prefetched. The number of a merge depends
 * on its pair alone, not on the order of threads.
 */
#include "cluster/merge/rounds/merge.h"

#include "base/key.h"
#include "base/math/simd.h"
#include "cluster/merge/rounds/offer.h"

enum { QUEUE = 128 };

typedef struct merge_queue {
    uint32_t count, merge; /* number of the next merge */
    uint32_t clusters[QUEUE + 1], mates[QUEUE + 1];
} merge_queue;

/* The entry of live cluster i that leads to `other`; there must be one. */
static uint32_t find_entry(const fct_generation *g, uint32_t i, uint32_t other) {
    uint32_t entry = g->starts[i], mask;
    for (i8 wanted = i8_set(other); (mask = i8_eq(i8_load(g->others + entry), wanted)) == 0;) entry += 8;
    return entry + (uint32_t)__builtin_ctz(mask);
}

static void merge_queued(const fct_rounds *r, merge_queue *queue) {
    fct_pair pairs[QUEUE];
    float costs[QUEUE];
    for (uint32_t q = 0; q < queue->count; ++q) {
        uint32_t i = queue->clusters[q], mate = queue->mates[q], entry = find_entry(&r->now, i, mate);
        pairs[q] = (fct_pair){r->now.slots[i], r->now.slots[mate], r->now.shared[entry]};
        costs[q] = fct_float_of_key(r->now.keys[entry] & ~FCT_KEY_SIZE_BITS);
        __builtin_prefetch(&r->work->records[pairs[q].a]);
        __builtin_prefetch(&r->work->records[pairs[q].b]);
    }
    for (uint32_t at = 0; at < queue->count; at += FCT_LANES) {
        uint32_t count = queue->count - at < FCT_LANES ? queue->count - at : FCT_LANES;
        fct_work_merges(r->work, queue->merge, pairs + at, costs + at, count);
        queue->merge += count;
    }
    queue->count = 0;
}

void fct_merge_pairs(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)end, (void)thread;
    fct_rounds *r = user;
    const uint32_t *mates = r->mates, *lengths = r->now.lengths, *slots = r->now.slots;
    uint32_t *next_slots = r->next.slots, *starts = r->next.starts, *renumbered = r->renumbered;
    uint32_t next = r->kept[chunk], last = r->kept[chunk + 1], room = r->room[chunk];
    merge_queue queue = {.merge = r->work->merge_count + r->merged[chunk]};
    for (uint32_t i = (uint32_t)begin; next < last; ++i) {
        uint32_t mate = mates[i];
        bool keeps = mate > i, merges = keeps & (mate != FCT_NONE);
        next_slots[next] = slots[i]; /* overwritten by the next cluster that is kept, unless i is */
        starts[next] = room;
        r->parents[next] = (uint64_t)mate << 32 | i;
        atomic_store_explicit(&r->best[next], FCT_NO_OFFER, memory_order_relaxed);
        room += keeps ? lengths[i] : 0;
        room += merges ? lengths[merges ? mate : i] - 2 : 0;
        if (keeps) renumbered[i] = renumbered[merges ? mate : i] = next | (merges ? FCT_MERGED : 0);
        queue.clusters[queue.count] = i, queue.mates[queue.count] = mate;
        queue.count += merges;
        next += keeps;
        if (queue.count == QUEUE) merge_queued(r, &queue);
    }
    merge_queued(r, &queue);
}
