/* cluster/rounds.c: contraction in rounds: every cluster that is its cheapest neighbour's cheapest neighbour
 * merges with it, all such pairs at once; of those left over, pairs whose merge is hardly dearer than what
 * each would like best merge too.
 *
 * In: the live lists or edges of an fct_work. Out: its live edges. The lower end of an edge prices it and
 * lowers the least of both ends to it; a least names its edge, by the exclusive or of the ends, scrambled,
 * which also decides between equal costs (to 18 bits), after the smaller union: by number a flat grid would
 * make one merge per chain and round. When a round finds few pairs, or few clusters are left, the greedy loop
 * ends the work: it is bounded on every input, rounds are not. Nothing depends on the order of threads: the
 * same bits for every thread count.
 */
#include "cluster/rounds.h"

#include <string.h>

#include "base/parallel.h"
#include "base/simd.h"
#include "base/sort.h"

enum { GRAIN = FCT_ROUND_GRAIN, SLACK = FCT_LIST_SLACK, FEW = 4096, QUEUE = 64, EARLY = 3 };

/* How much dearer than a cluster's best a merge may be that is taken because the best is taken: in the first
 * rounds, of clusters that no coarse cut shows, and later. */
#define EARLY_PATIENCE 2.0f
#define PATIENCE       1.2f

#define SIZE_BITS 31u /* low bits of a key: log2 of the union's faces */

/* --- The least edge of a cluster --- */

static inline uint32_t tie_of(const fct_rounds *r, uint32_t a, uint32_t b) {
    uint32_t x = (a ^ b ^ r->round * 0x85EBCA6Bu) * 0x9E3779B1u;
    return (x ^ x >> 16) * 0x21F0AAADu;
}

/* The end other than i of the edge that a least of i names. */
static inline uint32_t other_end(const fct_rounds *r, uint32_t i, uint64_t least) {
    uint32_t x = (uint32_t)least * 0x333C4925u;
    return (x ^ x >> 16) * 0x0E8B2F51u ^ r->round * 0x85EBCA6Bu ^ i;
}

static inline void lower_to(const fct_rounds *r, _Atomic uint64_t *least, uint64_t value) {
    uint64_t now = atomic_load_explicit(least, memory_order_relaxed);
    if (r->alone && value < now) atomic_store_explicit(least, value, memory_order_relaxed);
    if (r->alone) return;
    while (value < now && !atomic_compare_exchange_weak_explicit(least, &now, value, memory_order_relaxed,
                                                                 memory_order_relaxed))
        continue;
}

static inline void offer(const fct_rounds *r, _Atomic uint64_t *least, uint32_t a, uint32_t b, uint32_t key) {
    uint64_t value = (uint64_t)key << 32 | tie_of(r, a, b);
    lower_to(r, &least[a], value);
    lower_to(r, &least[b], value);
}

static float cost_of_key(uint32_t key) {
    uint32_t bits = key & 0x80000000u ? key & 0x7FFFFFFFu : ~key;
    float cost;
    memcpy(&cost, &bits, sizeof cost);
    return cost;
}

/* --- Costs --- */

/* Edges to be priced, so that eight at a time are and their clusters' records are asked for beforehand. */
typedef struct price_queue {
    uint32_t count;
    uint32_t clusters[QUEUE + SLACK], others[QUEUE + SLACK], entries[QUEUE + SLACK];
    fct_pair pairs[QUEUE + SLACK];
} price_queue;

static inline bool may_merge(const fct_rounds *r, uint32_t a, uint32_t b) {
    const uint32_t *materials = r->work->materials;
    return (r->across || !materials || materials[a] == materials[b]) && fct_work_allowed(r->work, a, b);
}

static inline void enqueue(const fct_rounds *r, price_queue *queue, uint32_t i, uint32_t entry) {
    uint32_t other = r->now.others[entry], a = r->now.slots[i], b = r->now.slots[other], at = queue->count;
    queue->clusters[at] = i, queue->others[at] = other, queue->entries[at] = entry;
    queue->pairs[at] = (fct_pair){a, b, r->now.shared[entry]};
    __builtin_prefetch(&r->work->records[b]);
    if (r->unbound || may_merge(r, a, b))
        ++queue->count;
    else
        r->now.keys[entry] = FCT_KEY_BLOCKED;
}

static void price_eight(const fct_rounds *r, const price_queue *queue, uint32_t at, uint32_t count) {
    const uint32_t *counts = r->work->counts;
    const fct_pair *pairs = queue->pairs + at;
    float costs[FCT_LANES];
    fct_work_costs(r->work, pairs, count, costs);
    for (uint32_t k = 0; k < count; ++k) {
        uint32_t faces = counts[pairs[k].a] + counts[pairs[k].b];
        uint32_t key = (fct_float_key(costs[k]) & ~SIZE_BITS) | (31 - (uint32_t)__builtin_clz(faces));
        r->now.keys[queue->entries[at + k]] = key;
        if (key < FCT_KEY_BLOCKED) offer(r, r->least[0], queue->clusters[at + k], queue->others[at + k], key);
    }
}

/* Prices all but what is left of eights. */
static void price_queued(const fct_rounds *r, price_queue *queue) {
    uint32_t done = 0, left = queue->count % FCT_LANES;
    for (; done + FCT_LANES <= queue->count; done += FCT_LANES) price_eight(r, queue, done, FCT_LANES);
    for (uint32_t k = 0; k < left; ++k) {
        queue->clusters[k] = queue->clusters[done + k], queue->others[k] = queue->others[done + k];
        queue->entries[k] = queue->entries[done + k], queue->pairs[k] = queue->pairs[done + k];
    }
    queue->count = left;
}

/* The edges of a chunk's clusters to those of higher number: prices them where that is open, and offers them
 * to both ends. */
static void price_edges(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    fct_rounds *r = user;
    const fct_generation *now = &r->now;
    price_queue queue = {.count = 0};
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        i8 self = i8_set(i);
        uint32_t start = now->starts[i], length = now->lengths[i];
        for (uint32_t k = 0; k < length; k += 8) {
            uint32_t within = length - k < 8 ? (1u << (length - k)) - 1 : 0xFF;
            uint32_t mask = within & i8_lt(self, i8_load(now->others + start + k));
            for (; mask; mask &= mask - 1) {
                uint32_t entry = start + k + (uint32_t)__builtin_ctz(mask), key = now->keys[entry];
                if (r->fresh || key == FCT_KEY_OPEN)
                    enqueue(r, &queue, i, entry);
                else if (key < FCT_KEY_BLOCKED)
                    offer(r, r->least[0], i, now->others[entry], key);
            }
            if (queue.count >= QUEUE) price_queued(r, &queue);
        }
    }
    price_queued(r, &queue);
    if (queue.count) price_eight(r, &queue, 0, queue.count);
}

/* --- Pairs --- */

static inline bool is_frozen(const fct_rounds *r, uint32_t i) {
    return r->work->frozen && r->work->frozen[r->now.slots[i]];
}

/* The mate of i by what its least was, or how far it may go for another. */
static inline void find_mate(const fct_rounds *r, uint32_t i, const _Atomic uint64_t *least, bool first) {
    uint64_t own = atomic_load_explicit(&least[i], memory_order_relaxed);
    if (own == UINT64_MAX) {
        if (first) r->mates[i] = FCT_NONE, r->limits[i] = 0;
        return;
    }
    uint32_t other = other_end(r, i, own);
    bool waits = is_frozen(r, i) || is_frozen(r, other);
    bool mutual = !waits && atomic_load_explicit(&least[other], memory_order_relaxed) == own;
    if (mutual || first) r->mates[i] = mutual ? other : FCT_NONE;
    if (mutual || waits) {
        r->limits[i] = 0;
    } else if (first) {
        float cost = cost_of_key((uint32_t)(own >> 32)),
              more = cost * (r->round < EARLY ? EARLY_PATIENCE : PATIENCE);
        r->limits[i] = fct_float_key(more > cost ? more : cost) | SIZE_BITS;
    }
}

static void find_mates(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    fct_rounds *r = user;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        find_mate(r, i, r->least[0], true);
        atomic_store_explicit(&r->least[1][i], UINT64_MAX, memory_order_relaxed);
    }
}

/* Offers edges between clusters that have no mate. */
static void offer_rest(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    fct_rounds *r = user;
    const fct_generation *now = &r->now;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint32_t limit = r->limits[i], start = now->starts[i];
        if (limit == 0) continue;
        for (uint32_t entry = start; entry < start + now->lengths[i]; ++entry) {
            uint32_t other = now->others[entry];
            if (other < i) continue;
            uint32_t key = now->keys[entry];
            if (key <= limit && key <= r->limits[other]) offer(r, r->least[1], i, other, key);
        }
    }
}

/* The mates of the rest, and what the next round will have. */
static void count_clusters(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    fct_rounds *r = user;
    uint32_t kept = 0, merged = 0, room = SLACK;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        if (r->mates[i] == FCT_NONE) find_mate(r, i, r->least[1], false);
        uint32_t mate = r->mates[i];
        if (mate < i) continue; /* the lower of a pair speaks for both */
        ++kept;
        room += r->now.lengths[i];
        if (mate == FCT_NONE) continue;
        ++merged;
        room += r->now.lengths[mate] - 2;
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
    fct_pair pairs[QUEUE];
    float costs[QUEUE];
} merge_queue;

static void merge_queued(const fct_rounds *r, merge_queue *queue) {
    for (uint32_t at = 0; at < queue->count; at += FCT_LANES) {
        uint32_t count = queue->count - at < FCT_LANES ? queue->count - at : FCT_LANES;
        fct_work_merges(r->work, queue->place, queue->pairs + at, queue->costs + at, count);
        queue->place += count;
    }
    queue->count = 0;
}

static inline void enqueue_merge(const fct_rounds *r, merge_queue *queue, uint32_t i, uint32_t mate) {
    uint32_t entry = entry_of(&r->now, i, mate), a = r->now.slots[i], b = r->now.slots[mate];
    __builtin_prefetch(&r->work->records[a]);
    __builtin_prefetch(&r->work->records[b]);
    queue->pairs[queue->count] = (fct_pair){a, b, r->now.shared[entry]};
    queue->costs[queue->count++] = cost_of_key(r->now.keys[entry] & ~SIZE_BITS);
    if (queue->count == QUEUE) merge_queued(r, queue);
}

/* Numbers the clusters of the next round and merges. */
static void merge_pairs(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    fct_rounds *r = user;
    uint32_t next = r->kept[chunk], room = r->room[chunk];
    merge_queue queue = {.place = r->work->merge_count + r->merged[chunk]};
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint32_t mate = r->mates[i];
        if (mate < i) continue;
        r->next.slots[next] = r->now.slots[i];
        r->next.starts[next] = room;
        room += r->now.lengths[i];
        r->renumbered[i] = next;
        atomic_store_explicit(&r->least[0][next], UINT64_MAX, memory_order_relaxed);
        if (mate != FCT_NONE) {
            room += r->now.lengths[mate] - 2;
            r->renumbered[i] = r->renumbered[mate] = next | FCT_MERGED;
            enqueue_merge(r, &queue, i, mate);
        }
        ++next;
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
    fct_parallel_for(env, live, GRAIN, price_edges, r);
    return FCT_OK;
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
    for (uint32_t s = 0; s < work->face_count; ++s) r->now.slots[s] = s;
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
            now->others[entry] = b, now->shared[entry] = edge->shared, now->keys[entry] = FCT_KEY_OPEN;
        }
    fct_release(work->env, work->edges);
    work->edges = NULL, work->edge_count = 0;
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
    for (uint32_t i = 0; i < r->now.count; ++i) {
        uint32_t height = work->heights[r->now.slots[i]];
        if (height > r->start_height) r->start_height = height;
    }
    r->unbound = !work->materials && r->start_height < FCT_FREE_HEIGHT;
    for (uint32_t i = 0; i < r->now.count; ++i)
        atomic_store_explicit(&r->least[0][i], UINT64_MAX, memory_order_relaxed);
    fct_parallel_for(work->env, r->now.count, GRAIN, price_edges, r);
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
    r->mates = fct_allocate(env, live, sizeof *r->mates);
    r->limits = r->renumbered = fct_allocate(env, r->work->face_count, sizeof *r->renumbered);
    r->kept = fct_allocate(env, chunks, sizeof *r->kept);
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
        fct_rounds r = {.work = work, .across = across, .alone = fct_env_threads(env) == 1};
        result = allocate_rounds(&r, live) ? run(&r) : fct_fail_memory(env, "clustering");
        release_rounds(&r);
    }
    return result == FCT_OK ? fct_work_greedy(work, across) : result;
}
