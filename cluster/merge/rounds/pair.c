/* cluster/merge/rounds/pair.c: finds the pairs of clusters that merge in a round, in two searches.
 *
 * The first search takes pairs that are each other's cheapest partner. The second search takes pairs that are
 * each other's cheapest partner among the clusters without a mate, if the merge costs at most PATIENCE times
 * as much as the best offer of each. It compares rough costs: where costs fall along a chain, each cluster
 * prefers the next one, and exact costs would pair only the last two of the chain.
 */
#include "cluster/merge/rounds/pair.h"

#include "base/key.h"
#include "base/math/simd.h"
#include "cluster/merge/rounds/offer.h"
#include "cluster/merge/rounds/walk.h"

/* The ratio of costs that the second search accepts: in the first rounds, whose clusters are smaller than
 * those of any coarse cut, and later. 1.5 throughout costs 1 % of L2,1 at 1000 clusters of the bunny, 2
 * throughout 3 %. */
enum { EARLY_ROUNDS = 3 };
#define EARLY_PATIENCE 2.0f
#define PATIENCE       1.2f

/* The low bits of a key below an eighth of an octave of cost, which the second search ignores. */
#define ROUGH_BITS ((1u << 20) - 1)

void fct_pair_first(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const fct_rounds *r = user;
    const uint8_t *frozen = r->work->frozen;
    const uint32_t round = r->round, *slots = r->now.slots;
    const float patience = round < EARLY_ROUNDS ? EARLY_PATIENCE : PATIENCE;
    uint32_t *mates = r->mates, *limits = r->limits;
    _Atomic uint64_t *best = r->best, *second = r->second;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint64_t own = fct_offer_load(best, i);
        uint32_t other = fct_offer_other_end(round, i, own);
        float cost = fct_float_of_key((uint32_t)(own >> 32)), more = cost * patience;
        uint32_t limit = fct_float_key(more > cost ? more : cost) | FCT_KEY_SIZE_BITS;
        bool mutual = (other != i) & (fct_offer_load(best, other) == own), done = mutual | (other == i);
        if (frozen && (frozen[slots[i]] || frozen[slots[other]])) mutual = false, done = true;
        mates[i] = mutual ? other : FCT_NONE;
        limits[i] = done ? 0 : limit;
        atomic_store_explicit(&second[i], FCT_NO_OFFER, memory_order_relaxed);
    }
}

static void offer_unpaired(const fct_rounds *r, fct_edge_queue *queue) {
    for (uint32_t q = 0; q < queue->count; ++q) {
        uint32_t i = queue->clusters[q], other = queue->others[q], key = r->now.keys[queue->entries[q]];
        if (key > r->limits[other]) continue;
        fct_offer_edge(r, r->second, i, other, (key & ~ROUGH_BITS) | (key & FCT_KEY_SIZE_BITS));
    }
    queue->count = 0;
}

/* Offers the edges of some clusters to higher ones. */
static inline void offer_lists(const fct_rounds *r, const uint32_t *clusters, uint32_t count,
                               fct_edge_queue *queue) {
    const uint32_t *starts = r->now.starts, *lengths = r->now.lengths, *all_others = r->now.others;
    const uint32_t *keys = r->now.keys, *limits = r->limits;
    for (uint32_t n = 0; n < count; ++n) {
        uint32_t i = clusters[n], start = starts[i], length = lengths[i];
        i8 limit = i8_set(limits[i]);
        for (uint32_t k = 0; k < length; k += 8) {
            i8 others = i8_load(all_others + start + k);
            uint32_t mask =
                fct_higher_ends(i, others, length - k) & i8_no_more(i8_load(keys + start + k), limit);
            fct_enqueue(queue, i, start + k, others, mask);
            if (queue->count >= FCT_QUEUE) offer_unpaired(r, queue);
        }
    }
}

void fct_pair_offer(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const fct_rounds *r = user;
    const uint32_t *limits = r->limits;
    uint32_t open[256], count = 0; /* clusters without a mate */
    fct_edge_queue queue;
    queue.count = 0;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        open[count] = i;
        count += limits[i] > 0;
        if (count < FCT_LENGTH(open)) continue;
        offer_lists(r, open, count, &queue);
        count = 0;
    }
    offer_lists(r, open, count, &queue);
    offer_unpaired(r, &queue);
}

/* The lower cluster of a pair stands for the union. A union's list has at most the entries of both parts,
 * less the two of their common edge. */
void fct_pair_second(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    fct_rounds *r = user;
    const uint32_t round = r->round, *lengths = r->now.lengths;
    const _Atomic uint64_t *second = r->second;
    uint32_t kept = 0, merged = 0, room = FCT_LIST_SLACK, *mates = r->mates;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint64_t own = fct_offer_load(second, i);
        uint32_t other = fct_offer_other_end(round, i, own), mate = mates[i];
        bool mutual = (other != i) & (fct_offer_load(second, other) == own);
        mate = mutual ? other : mate;
        mates[i] = mate;
        bool keeps = mate > i, merges = keeps & (mate != FCT_NONE);
        kept += keeps, merged += merges;
        room += keeps ? lengths[i] : 0;
        room += merges ? lengths[merges ? mate : i] - 2 : 0;
    }
    r->kept[chunk] = kept, r->merged[chunk] = merged, r->room[chunk] = room;
}
