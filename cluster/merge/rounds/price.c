/* cluster/merge/rounds/price.c: prices the edges of a round whose key is open, and offers all edges.
 *
 * Only the lower end of an edge prices it. Both ends then hold the least offer of all their edges. Costs are
 * computed for eight edges at a time.
 */
#include "cluster/merge/rounds/price.h"

#include "base/math/simd.h"
#include "cluster/merge/rounds/offer.h"
#include "cluster/merge/rounds/walk.h"

/* The arrays that walks read, as local variables: the compiler assumes that a vector store may change the
 * members of *r. */
typedef struct generation_view {
    const uint32_t *starts, *lengths, *others, *keys;
} generation_view;

static inline i8 scramble_eight(uint32_t round, i8 a, i8 b) {
    i8 x = i8_mul(i8_xor(i8_xor(a, b), i8_set(round * FCT_SCRAMBLE_ROUND)), i8_set(FCT_SCRAMBLE_FIRST));
    return i8_mul(i8_xor(x, i8_shift_right(x, 16)), i8_set(FCT_SCRAMBLE_SECOND));
}

static inline bool may_merge(const fct_rounds *r, uint32_t a, uint32_t b) {
    const uint32_t *materials = r->work->materials;
    return (r->across || !materials || materials[a] == materials[b]) && fct_work_allowed(r->work, a, b);
}

/* The keys of eight costs; faces: of the unions. */
static inline i8 keys_of(const float costs[FCT_LANES], const uint32_t faces[FCT_LANES]) {
    i8 bits = i8_bits(f8_load(costs)), sign = i8_set(0x80000000u);
    i8 order = i8_xor(bits, i8_or(i8_less(bits, i8_set(0)), sign));
    i8 size = i8_add(i8_shift_right(i8_bits(f8_from(i8_load(faces))), 23), i8_set(0u - 127)); /* exponent */
    return i8_or(i8_without(order, i8_set(FCT_KEY_SIZE_BITS)), size);
}

/* Offers queue entries `at` and on at the costs of the first `count` of the FCT_LANES pairs. */
static void offer_eight(const fct_rounds *r, const fct_edge_queue *queue, uint32_t at, const fct_pair *pairs,
                        const float *costs, uint32_t count) {
    uint32_t *keys = r->now.keys, faces[FCT_LANES], new_keys[FCT_LANES], ties[FCT_LANES];
    for (uint32_t k = 0; k < FCT_LANES; ++k)
        faces[k] = r->work->records[pairs[k].a].count + r->work->records[pairs[k].b].count;
    i8_store(new_keys, keys_of(costs, faces));
    i8_store(ties, scramble_eight(r->round, i8_load(queue->clusters + at), i8_load(queue->others + at)));
    for (uint32_t k = 0; k < count; ++k) {
        uint64_t offer = (uint64_t)new_keys[k] << 32 | ties[k];
        if (new_keys[k] >= FCT_KEY_BLOCKED || (!r->unbound && !may_merge(r, pairs[k].a, pairs[k].b))) {
            keys[queue->entries[at + k]] = FCT_KEY_BLOCKED;
            continue;
        }
        keys[queue->entries[at + k]] = new_keys[k];
        fct_offer_lower(r, &r->best[queue->clusters[at + k]], offer);
        fct_offer_lower(r, &r->best[queue->others[at + k]], offer);
    }
}

/* Prices and removes the queued edges; those beyond the last whole eight stay unless `all`. */
static void price_queued(const fct_rounds *r, fct_edge_queue *queue, bool all) {
    fct_pair pairs[FCT_QUEUE + FCT_LIST_SLACK];
    float costs[FCT_QUEUE + FCT_LIST_SLACK];
    uint32_t left = all ? 0 : queue->count % FCT_LANES, count = queue->count - left, filled = count;
    for (uint32_t q = 0; q < count; ++q) {
        uint32_t a = r->now.slots[queue->clusters[q]], b = r->now.slots[queue->others[q]];
        pairs[q] = (fct_pair){a, b, r->now.shared[queue->entries[q]]};
        __builtin_prefetch(&r->work->records[b]);
    }
    while (filled % FCT_LANES) pairs[filled++] = pairs[0];
    fct_work_costs(r->work, pairs, filled, costs);
    for (uint32_t done = 0; done < count; done += FCT_LANES)
        offer_eight(r, queue, done, pairs + done, costs + done,
                    count - done < FCT_LANES ? count - done : FCT_LANES);
    queue->count = left;
    if (left == 0) return;
    i8_store(queue->clusters, i8_load(queue->clusters + count));
    i8_store(queue->others, i8_load(queue->others + count));
    i8_store(queue->entries, i8_load(queue->entries + count));
}

static void offer_queued(const fct_rounds *r, fct_edge_queue *queue) {
    for (uint32_t q = 0; q < queue->count; ++q)
        fct_offer_edge(r, r->best, queue->clusters[q], queue->others[q], r->now.keys[queue->entries[q]]);
    queue->count = 0;
}

/* Prices the open edges of clusters [begin, end) to higher ones, and offers all that are allowed. */
static void price_range(const fct_rounds *r, uint32_t begin, uint32_t end) {
    const generation_view now = {r->now.starts, r->now.lengths, r->now.others, r->now.keys};
    const bool fresh = r->fresh;
    fct_edge_queue open, known;
    open.count = known.count = 0;
    for (uint32_t i = begin; i < end; ++i) {
        uint32_t start = now.starts[i], length = now.lengths[i];
        for (uint32_t k = 0; k < length; k += 8) {
            i8 others = i8_load(now.others + start + k);
            uint32_t higher = fct_higher_ends(i, others, length - k), unpriced = higher;
            if (!fresh) {
                i8 keys = i8_load(now.keys + start + k);
                unpriced &= i8_eq(keys, i8_set(FCT_KEY_OPEN));
                higher &= ~unpriced & i8_no_more(keys, i8_set(FCT_KEY_BLOCKED - 1));
                fct_enqueue(&known, i, start + k, others, higher);
                if (known.count >= FCT_QUEUE) offer_queued(r, &known);
            }
            fct_enqueue(&open, i, start + k, others, unpriced);
            if (open.count >= FCT_QUEUE) price_queued(r, &open, false);
        }
    }
    offer_queued(r, &known);
    price_queued(r, &open, true);
}

void fct_price_first(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    price_range(user, (uint32_t)begin, (uint32_t)end);
}

void fct_price_next(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)begin, (void)end, (void)thread;
    const fct_rounds *r = user;
    price_range(r, r->kept[chunk], r->kept[chunk + 1]);
}
