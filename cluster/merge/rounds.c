/* cluster/merge/rounds.c: contraction in rounds: every cluster that is its cheapest neighbour's cheapest
 * neighbour merges with it, all such pairs at once; of those left over, pairs whose merge is hardly dearer
 * than what each would like best merge too.
 *
 * In: the live lists or edges of an fct_work. Out: its live edges. The lower end of an edge prices it and
 * lowers the least of both ends to it; a least names its edge, by the exclusive or of the ends, scrambled,
 * which also decides between equal costs (to 18 bits), after the smaller union: by number a flat grid would
 * make one merge per chain and round. When a round finds few pairs, or few clusters are left, the greedy loop
 * ends the work: it is bounded on every input, rounds are not. Nothing depends on the order of threads: the
 * same bits for every thread count.
 */
#include "cluster/merge/rounds.h"

#include <string.h>

#include "base/key.h"
#include "base/math/simd.h"
#include "base/parallel.h"
#include "base/sort.h"

enum { GRAIN = FCT_ROUND_GRAIN, SLACK = FCT_LIST_SLACK, FEW = 4096, QUEUE = 128, EARLY = 3 };

/* How much dearer than a cluster's best a merge may be that is taken because the best is taken: in the first
 * rounds, of clusters that no coarse cut shows, and later. */
#define EARLY_PATIENCE 2.0f
#define PATIENCE       1.2f

#define SIZE_BITS  31u              /* low bits of a key: log2 of the union's faces */
#define ROUGH_BITS ((1u << 20) - 1) /* what is less than an eighth of an octave */

/* --- The least edge of a cluster --- */

static inline uint32_t tie_of(const fct_rounds *r, uint32_t a, uint32_t b) {
    uint32_t x = (a ^ b ^ r->round * 0x85EBCA6Bu) * 0x9E3779B1u;
    return (x ^ x >> 16) * 0x21F0AAADu;
}

static inline i8 ties_of(uint32_t round, i8 a, i8 b) {
    i8 x = i8_mul(i8_xor(i8_xor(a, b), i8_set(round * 0x85EBCA6Bu)), i8_set(0x9E3779B1u));
    return i8_mul(i8_xor(x, i8_shift_right(x, 16)), i8_set(0x21F0AAADu));
}

/* The end other than i of the edge that a least of i names. */
static inline uint32_t other_end(uint32_t round, uint32_t i, uint64_t least) {
    uint32_t x = (uint32_t)least * 0x333C4925u;
    return (x ^ x >> 16) * 0x0E8B2F51u ^ round * 0x85EBCA6Bu ^ i;
}

static inline void lower_to(const fct_rounds *r, _Atomic uint64_t *least, uint64_t value) {
    uint64_t now = atomic_load_explicit(least, memory_order_relaxed);
    if (r->alone) {
        atomic_store_explicit(least, value < now ? value : now, memory_order_relaxed);
        return;
    }
    while (value < now && !atomic_compare_exchange_weak_explicit(least, &now, value, memory_order_relaxed,
                                                                 memory_order_relaxed))
        continue;
}

static inline void offer(const fct_rounds *r, _Atomic uint64_t *least, uint32_t a, uint32_t b, uint32_t key) {
    uint64_t value = (uint64_t)key << 32 | tie_of(r, a, b);
    lower_to(r, &least[a], value);
    lower_to(r, &least[b], value);
}

/* --- Costs --- */

/* Edges met on a walk over lists, so that what is done with them waits neither for the walk's branches nor
 * for memory. */
typedef struct edge_queue {
    uint32_t count;
    uint32_t clusters[QUEUE + SLACK], others[QUEUE + SLACK], entries[QUEUE + SLACK];
} edge_queue;

/* What walks read, in variables of their own: every store of eight numbers might change it where it lies. */
typedef struct generation_view {
    const uint32_t *starts, *lengths, *others, *keys;
} generation_view;

static inline generation_view view(const fct_rounds *r) {
    return (generation_view){r->now.starts, r->now.lengths, r->now.others, r->now.keys};
}

static inline void enqueue(edge_queue *queue, uint32_t i, uint32_t first, i8 others, uint32_t mask) {
    i8 order = i8_chosen(mask);
    i8_store(queue->clusters + queue->count, i8_set(i));
    i8_store(queue->others + queue->count, i8_lookup8(others, order));
    i8_store(queue->entries + queue->count, i8_add(i8_set(first), order));
    queue->count += (uint32_t)__builtin_popcount(mask);
}

static inline bool may_merge(const fct_rounds *r, uint32_t a, uint32_t b) {
    const uint32_t *materials = r->work->materials;
    return (r->across || !materials || materials[a] == materials[b]) && fct_work_allowed(r->work, a, b);
}

/* Keys of costs, unions of so many faces. */
static inline i8 keys_of(const float costs[FCT_LANES], const uint32_t faces[FCT_LANES]) {
    i8 bits = i8_bits(f8_load(costs)), sign = i8_set(0x80000000u);
    i8 order = i8_xor(bits, i8_or(i8_less(bits, i8_set(0)), sign));
    i8 size = i8_add(i8_shift_right(i8_bits(f8_from(i8_load(faces))), 23), i8_set(0u - 127));
    return i8_or(i8_without(order, i8_set(SIZE_BITS)), size);
}

/* pairs has FCT_LANES, of which count are to be priced. */
static void price_eight(const fct_rounds *r, const edge_queue *queue, uint32_t at, const fct_pair *pairs,
                        uint32_t count) {
    _Atomic uint64_t *least = r->least[0];
    uint32_t *keys = r->now.keys, faces[FCT_LANES], new_keys[FCT_LANES], ties[FCT_LANES];
    float costs[FCT_LANES];
    for (uint32_t k = 0; k < FCT_LANES; ++k)
        faces[k] = r->work->records[pairs[k].a].count + r->work->records[pairs[k].b].count;
    fct_work_costs(r->work, pairs, FCT_LANES, costs);
    i8_store(new_keys, keys_of(costs, faces));
    i8_store(ties, ties_of(r->round, i8_load(queue->clusters + at), i8_load(queue->others + at)));
    for (uint32_t k = 0; k < count; ++k) {
        uint64_t value = (uint64_t)new_keys[k] << 32 | ties[k];
        if (new_keys[k] >= FCT_KEY_BLOCKED || (!r->unbound && !may_merge(r, pairs[k].a, pairs[k].b))) {
            keys[queue->entries[at + k]] = FCT_KEY_BLOCKED;
            continue;
        }
        keys[queue->entries[at + k]] = new_keys[k];
        lower_to(r, &least[queue->clusters[at + k]], value);
        lower_to(r, &least[queue->others[at + k]], value);
    }
}

/* Prices all, or all but what is left of eights. */
static void price_queued(const fct_rounds *r, edge_queue *queue, bool all) {
    fct_pair pairs[QUEUE + SLACK];
    uint32_t done = 0, left = all ? 0 : queue->count % FCT_LANES, count = queue->count - left;
    for (uint32_t q = 0; q < count; ++q) {
        uint32_t a = r->now.slots[queue->clusters[q]], b = r->now.slots[queue->others[q]];
        pairs[q] = (fct_pair){a, b, r->now.shared[queue->entries[q]]};
        __builtin_prefetch(&r->work->records[b]);
    }
    for (uint32_t q = count; q % FCT_LANES; ++q) pairs[q] = pairs[0];
    for (; done < count; done += FCT_LANES)
        price_eight(r, queue, done, pairs + done, count - done < FCT_LANES ? count - done : FCT_LANES);
    queue->count = left;
    if (left == 0) return;
    i8_store(queue->clusters, i8_load(queue->clusters + count));
    i8_store(queue->others, i8_load(queue->others + count));
    i8_store(queue->entries, i8_load(queue->entries + count));
}

static void offer_queued(const fct_rounds *r, edge_queue *queue) {
    for (uint32_t q = 0; q < queue->count; ++q)
        offer(r, r->least[0], queue->clusters[q], queue->others[q], r->now.keys[queue->entries[q]]);
    queue->count = 0;
}

/* Lanes of a list from entry k on, to clusters of higher number. */
static inline uint32_t higher_ends(uint32_t i, i8 others, uint32_t left) {
    uint32_t within = left < 8 ? (1u << left) - 1 : 0xFF;
    return within & i8_lt(i8_set(i), others);
}

/* The edges of clusters [begin, end) to those of higher number: prices them where that is open, and offers
 * them to both ends. */
static void price_range(const fct_rounds *r, uint32_t begin, uint32_t end) {
    const generation_view now = view(r);
    const bool fresh = r->fresh;
    edge_queue open, known;
    open.count = known.count = 0;
    for (uint32_t i = begin; i < end; ++i) {
        uint32_t start = now.starts[i], length = now.lengths[i];
        for (uint32_t k = 0; k < length; k += 8) {
            i8 others = i8_load(now.others + start + k);
            uint32_t higher = higher_ends(i, others, length - k), unpriced = higher;
            if (!fresh) {
                i8 keys = i8_load(now.keys + start + k);
                unpriced &= i8_eq(keys, i8_set(FCT_KEY_OPEN));
                higher &= ~unpriced & i8_no_more(keys, i8_set(FCT_KEY_BLOCKED - 1));
                enqueue(&known, i, start + k, others, higher);
                if (known.count >= QUEUE) offer_queued(r, &known);
            }
            enqueue(&open, i, start + k, others, unpriced);
            if (open.count >= QUEUE) price_queued(r, &open, false);
        }
    }
    offer_queued(r, &known);
    price_queued(r, &open, true);
}

static void price_first(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    price_range(user, (uint32_t)begin, (uint32_t)end);
}

/* What came of a chunk of the round before, whose lists no other chunk's overlap, slack included. */
static void price_edges(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)begin, (void)end, (void)thread;
    const fct_rounds *r = user;
    price_range(r, r->kept[chunk], r->kept[chunk + 1]);
}

/* --- Pairs --- */

/* The other end of a cluster's least edge; itself if it has none. */
static inline uint32_t best_of(uint32_t round, uint32_t i, uint64_t own) {
    uint32_t other = other_end(round, i, own);
    return own == UINT64_MAX ? i : other;
}

static inline uint64_t least_of(const _Atomic uint64_t *least, uint32_t i) {
    return atomic_load_explicit(&least[i], memory_order_relaxed);
}

/* Mates by the least edges of all, and how far those left over may go for another. */
static void find_mates(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const fct_rounds *r = user;
    const uint8_t *frozen = r->work->frozen;
    const uint32_t round = r->round, *slots = r->now.slots;
    const float patience = round < EARLY ? EARLY_PATIENCE : PATIENCE;
    uint32_t *mates = r->mates, *limits = r->limits;
    _Atomic uint64_t *least = r->least[0], *next_least = r->least[1];
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint64_t own = least_of(least, i);
        uint32_t other = best_of(round, i, own);
        float cost = fct_float_of_key((uint32_t)(own >> 32)), more = cost * patience;
        uint32_t limit = fct_float_key(more > cost ? more : cost) | SIZE_BITS;
        bool mutual = (other != i) & (least_of(least, other) == own), done = mutual | (other == i);
        if (frozen && (frozen[slots[i]] || frozen[slots[other]])) mutual = false, done = true;
        mates[i] = mutual ? other : FCT_NONE;
        limits[i] = done ? 0 : limit;
        atomic_store_explicit(&next_least[i], UINT64_MAX, memory_order_relaxed);
    }
}

static void offer_left_over(const fct_rounds *r, edge_queue *queue) {
    for (uint32_t q = 0; q < queue->count; ++q) {
        uint32_t i = queue->clusters[q], other = queue->others[q], key = r->now.keys[queue->entries[q]];
        if (key <= r->limits[other]) offer(r, r->least[1], i, other, (key & ~ROUGH_BITS) | (key & SIZE_BITS));
    }
    queue->count = 0;
}

/* Offers edges between clusters that have no mate, by their rough costs: where costs fall along a way, each
 * would like the next best, and only the last two of it would come together. */
static void offer_rest(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const fct_rounds *r = user;
    const generation_view now = view(r);
    const uint32_t *limits = r->limits;
    edge_queue queue;
    queue.count = 0;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint32_t start = now.starts[i], length = now.lengths[i];
        i8 limit = i8_set(limits[i]);
        for (uint32_t k = 0; k < length; k += 8) {
            i8 others = i8_load(now.others + start + k);
            uint32_t mask =
                higher_ends(i, others, length - k) & i8_no_more(i8_load(now.keys + start + k), limit);
            enqueue(&queue, i, start + k, others, mask);
            if (queue.count >= QUEUE) offer_left_over(r, &queue);
        }
    }
    offer_left_over(r, &queue);
}

/* The mates of the rest, and what the next round will have. Of a pair the lower speaks for both. */
static void count_clusters(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    fct_rounds *r = user;
    const uint32_t round = r->round, *lengths = r->now.lengths;
    const _Atomic uint64_t *least = r->least[1];
    uint32_t kept = 0, merged = 0, room = SLACK, *mates = r->mates;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint64_t own = least_of(least, i);
        uint32_t other = best_of(round, i, own), mate = mates[i];
        bool mutual = (other != i) & (least_of(least, other) == own);
        mate = mutual ? other : mate;
        mates[i] = mate;
        bool keeps = mate > i, merges = keeps & (mate != FCT_NONE);
        kept += keeps, merged += merges;
        room += keeps ? lengths[i] : 0;
        room += merges ? lengths[merges ? mate : i] - 2 : 0;
    }
    r->kept[chunk] = kept, r->merged[chunk] = merged, r->room[chunk] = room;
}

static uint32_t counts_to_places(uint32_t *counts, size_t chunks) {
    uint32_t total = 0;
    for (size_t i = 0; i < chunks; ++i) {
        uint32_t count = counts[i];
        counts[i] = total;
        total += count;
    }
    return total;
}

/* The entry of live cluster i that leads to `other`, which is there. */
static uint32_t entry_of(const fct_generation *g, uint32_t i, uint32_t other) {
    uint32_t entry = g->starts[i], mask;
    for (i8 wanted = i8_set(other); (mask = i8_eq(i8_load(g->others + entry), wanted)) == 0;) entry += 8;
    return entry + (uint32_t)__builtin_ctz(mask);
}

/* Merges to be made, so that their records are asked for beforehand. */
typedef struct merge_queue {
    uint32_t count, place;
    uint32_t clusters[QUEUE + 1], mates[QUEUE + 1];
} merge_queue;

static void merge_queued(const fct_rounds *r, merge_queue *queue) {
    fct_pair pairs[QUEUE];
    float costs[QUEUE];
    for (uint32_t q = 0; q < queue->count; ++q) {
        uint32_t i = queue->clusters[q], mate = queue->mates[q], entry = entry_of(&r->now, i, mate);
        pairs[q] = (fct_pair){r->now.slots[i], r->now.slots[mate], r->now.shared[entry]};
        costs[q] = fct_float_of_key(r->now.keys[entry] & ~SIZE_BITS);
        __builtin_prefetch(&r->work->records[pairs[q].a]);
        __builtin_prefetch(&r->work->records[pairs[q].b]);
    }
    for (uint32_t at = 0; at < queue->count; at += FCT_LANES) {
        uint32_t count = queue->count - at < FCT_LANES ? queue->count - at : FCT_LANES;
        fct_work_merges(r->work, queue->place, pairs + at, costs + at, count);
        queue->place += count;
    }
    queue->count = 0;
}

/* Numbers the clusters of the next round and merges. */
static void merge_pairs(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)end, (void)thread;
    fct_rounds *r = user;
    const uint32_t *mates = r->mates, *lengths = r->now.lengths, *slots = r->now.slots;
    uint32_t *next_slots = r->next.slots, *starts = r->next.starts, *renumbered = r->renumbered;
    uint32_t next = r->kept[chunk], last = r->kept[chunk + 1], room = r->room[chunk];
    merge_queue queue = {.place = r->work->merge_count + r->merged[chunk]};
    for (uint32_t i = (uint32_t)begin; next < last; ++i) {
        uint32_t mate = mates[i];
        bool keeps = mate > i, merges = keeps & (mate != FCT_NONE);
        next_slots[next] = slots[i];
        starts[next] = room;
        r->parents[next] = (uint64_t)mate << 32 | i;
        atomic_store_explicit(&r->least[0][next], UINT64_MAX, memory_order_relaxed);
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

/* --- Rounds --- */

static bool allocate_generation(const fct_env *env, uint32_t count, size_t room, fct_generation *out) {
    out->slots = fct_allocate(env, count, sizeof *out->slots);
    out->starts = fct_allocate(env, count, sizeof *out->starts);
    out->lengths = fct_allocate(env, count, sizeof *out->lengths);
    out->others = fct_allocate(env, room + SLACK, sizeof *out->others);
    out->shared = fct_allocate(env, room + SLACK, sizeof *out->shared);
    out->keys = fct_allocate(env, room + SLACK, sizeof *out->keys);
    bool complete = out->slots && out->starts && out->lengths && out->others && out->shared && out->keys;
    if (complete) memset(out->others + room, 0, SLACK * sizeof *out->others);
    return complete;
}

static void release_generation(const fct_env *env, fct_generation *g) {
    fct_release(env, g->slots);
    fct_release(env, g->starts);
    fct_release(env, g->lengths);
    fct_release(env, g->others);
    fct_release(env, g->shared);
    fct_release(env, g->keys);
    *g = (fct_generation){0};
}

/* What the lists of the next round are written to and joined in. The first round's need is the largest that
 * comes. */
static bool allocate_next(fct_rounds *r, uint32_t live, uint32_t room) {
    const fct_env *env = r->work->env;
    uint32_t threads = fct_env_threads(env);
    if (!allocate_generation(env, live, room, &r->next)) return false;
    r->scratch = fct_allocate_zero(env, threads, sizeof *r->scratch);
    for (uint32_t i = 0; r->scratch && i < threads; ++i)
        if (!(r->scratch[i].places = fct_allocate_zero(env, live, 1))) return false;
    return r->scratch;
}

/* Pairs up, merges, takes the lists into the next round and prices; *merges: how many. Errors: MEMORY. */
static fct_result one_round(fct_rounds *r, uint32_t *merges) {
    const fct_env *env = r->work->env;
    size_t count = r->now.count, chunks = fct_chunk_count(count, GRAIN);
    fct_parallel_for(env, count, GRAIN, find_mates, r);
    fct_parallel_for(env, count, GRAIN, offer_rest, r);
    fct_parallel_for(env, count, GRAIN, count_clusters, r);
    uint32_t live = counts_to_places(r->kept, chunks), room = counts_to_places(r->room, chunks);
    *merges = counts_to_places(r->merged, chunks);
    r->kept[chunks] = live;
    if (!r->next.slots && !allocate_next(r, live, room)) return fct_fail_memory(env, "clustering");
    fct_parallel_for(env, count, GRAIN, merge_pairs, r);
    r->work->merge_count += *merges;
    fct_parallel_for(env, count, GRAIN, fct_rounds_join_lists, r);
    fct_generation old = r->now;
    r->now = r->next, r->next = old;
    r->now.count = live;
    ++r->round;
    r->fresh = false;
    r->unbound = !r->work->materials && r->start_height + r->round < FCT_FREE_HEIGHT;
    fct_parallel_for(env, count, GRAIN, price_edges, r);
    return FCT_OK;
}

static void number_faces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const fct_rounds *r = user;
    for (uint32_t s = (uint32_t)begin; s < end; ++s) {
        r->now.slots[s] = s;
        atomic_store_explicit(&r->least[0][s], UINT64_MAX, memory_order_relaxed);
    }
}

/* The work's lists become the first generation. */
static fct_result enter_lists(fct_rounds *r) {
    fct_work *work = r->work;
    size_t count = work->lists.entry_count;
    r->now = (fct_generation){.count = work->face_count,
                              .slots = fct_allocate(work->env, work->face_count, sizeof *r->now.slots),
                              .starts = work->lists.starts,
                              .lengths = work->lists.counts,
                              .others = work->lists.neighbors,
                              .shared = work->lists.lengths,
                              .keys = fct_allocate(work->env, count + SLACK, sizeof *r->now.keys)};
    work->lists = (fct_lists){0};
    if (!r->now.slots || !r->now.keys) return fct_fail_memory(work->env, "clustering");
    fct_parallel_for(work->env, work->face_count, GRAIN, number_faces, r);
    r->fresh = true;
    return FCT_OK;
}

/* Lists out of the work's edges. */
static fct_result enter_edges(fct_rounds *r) {
    fct_work *work = r->work;
    fct_generation *now = &r->now;
    uint32_t live = 0, count = work->face_count - work->merge_count, place = 0;
    size_t room = 2 * (size_t)work->edge_count;
    if (room > UINT32_MAX || !allocate_generation(work->env, count, room, now))
        return fct_fail_memory(work->env, "clustering");
    for (uint32_t s = 0; s < work->face_count; ++s)
        if (work->nodes[s] != FCT_NONE) {
            if (work->heights[s] > r->start_height) r->start_height = work->heights[s];
            atomic_store_explicit(&r->least[0][live], UINT64_MAX, memory_order_relaxed);
            r->renumbered[s] = live;
            now->slots[live++] = s;
        }
    now->count = live;
    memset(now->lengths, 0, (size_t)live * sizeof *now->lengths);
    for (uint32_t e = 0; e < work->edge_count; ++e) {
        ++now->lengths[r->renumbered[work->edges[e].a]];
        ++now->lengths[r->renumbered[work->edges[e].b]];
    }
    for (uint32_t i = 0; i < live; ++i) {
        now->starts[i] = place;
        place += now->lengths[i];
        now->lengths[i] = 0;
    }
    for (uint32_t e = 0; e < work->edge_count; ++e)
        for (int k = 0; k < 2; ++k) {
            const fct_edge *edge = &work->edges[e];
            uint32_t a = r->renumbered[k ? edge->b : edge->a], b = r->renumbered[k ? edge->a : edge->b];
            uint32_t entry = now->starts[a] + now->lengths[a]++;
            now->others[entry] = b, now->shared[entry] = edge->shared;
        }
    fct_release(work->env, work->edges);
    work->edges = NULL, work->edge_count = 0;
    r->fresh = true;
    return FCT_OK;
}

static fct_result leave(fct_rounds *r) {
    fct_work *work = r->work;
    const fct_generation *now = &r->now;
    uint32_t count = 0, place = 0;
    for (uint32_t i = 0; i < now->count; ++i)
        for (uint32_t k = 0; k < now->lengths[i]; ++k) count += now->others[now->starts[i] + k] > i;
    work->edges = fct_allocate(work->env, count, sizeof *work->edges);
    if (!work->edges) return fct_fail_memory(work->env, "clustering");
    for (uint32_t i = 0; i < now->count; ++i)
        for (uint32_t entry = now->starts[i]; entry < now->starts[i] + now->lengths[i]; ++entry) {
            uint32_t other = now->others[entry];
            if (other > i)
                work->edges[place++] = (fct_edge){now->slots[i], now->slots[other], now->shared[entry]};
        }
    work->edge_count = count;
    return FCT_OK;
}

static fct_result run(fct_rounds *r) {
    fct_work *work = r->work;
    fct_result result = work->lists.neighbors ? enter_lists(r) : enter_edges(r);
    if (result != FCT_OK) return result;
    r->unbound = !work->materials && r->start_height < FCT_FREE_HEIGHT;
    fct_parallel_for(work->env, r->now.count, GRAIN, price_first, r);
    for (uint32_t merges = UINT32_MAX; r->now.count > FEW && merges > r->now.count / 64;) {
        result = fct_progress(work->env, "clusters", work->merge_count / (double)work->face_count);
        if (result == FCT_OK) result = one_round(r, &merges);
        if (result != FCT_OK) return result;
    }
    return leave(r);
}

static bool allocate_rounds(fct_rounds *r, size_t live) {
    const fct_env *env = r->work->env;
    size_t chunks = fct_chunk_count(live, GRAIN);
    for (int k = 0; k < 2; ++k) r->least[k] = fct_allocate(env, live, sizeof *r->least[k]);
    r->parents = (uint64_t *)(void *)r->least[1];
    r->mates = fct_allocate(env, live, sizeof *r->mates);
    r->limits = r->renumbered = fct_allocate(env, r->work->face_count, sizeof *r->renumbered);
    r->kept = fct_allocate(env, chunks + 1, sizeof *r->kept);
    r->merged = fct_allocate(env, chunks, sizeof *r->merged);
    r->room = fct_allocate(env, chunks, sizeof *r->room);
    return r->least[0] && r->least[1] && r->mates && r->renumbered && r->kept && r->merged && r->room;
}

static void release_rounds(fct_rounds *r) {
    const fct_env *env = r->work->env;
    release_generation(env, &r->now);
    release_generation(env, &r->next);
    for (uint32_t i = 0; r->scratch && i < fct_env_threads(env); ++i) fct_release(env, r->scratch[i].places);
    fct_release(env, r->scratch);
    for (int k = 0; k < 2; ++k) fct_release(env, r->least[k]);
    fct_release(env, r->mates);
    fct_release(env, r->renumbered);
    fct_release(env, r->kept);
    fct_release(env, r->merged);
    fct_release(env, r->room);
}

fct_result fct_work_rounds(fct_work *work, bool across) {
    const fct_env *env = work->env;
    fct_result result = FCT_OK;
    size_t live = work->face_count - work->merge_count;
    if (live > FEW && (work->lists.neighbors || work->edge_count > 0)) {
        fct_release(env, work->entry_borders);
        fct_release(env, work->borders);
        work->entry_borders = work->borders = NULL; /* the lists have borders in float alone */
        fct_rounds r = {.work = work, .across = across, .alone = fct_env_threads(env) == 1};
        result = allocate_rounds(&r, live) ? run(&r) : fct_fail_memory(env, "clustering");
        release_rounds(&r);
    }
    return result == FCT_OK ? fct_work_greedy(work, across) : result;
}
