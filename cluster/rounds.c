/* cluster/rounds.c: contraction in rounds: every cluster that is its cheapest neighbour's cheapest neighbour
 * merges with it, all such pairs at once.
 *
 * In: the live lists or edges of an fct_work. Out: its live edges. Live clusters are numbered anew each
 * round, with one list of neighbours each in a flat array, an edge being in the lists of both its ends. A
 * union's list is those of its parts, renumbered, doubles added up; lists are written one after the other, so
 * no sort of edges is needed. The lower end prices an edge and writes the cost into both lists. Ties (costs
 * equal to 18 bits) go to the smaller union, then to a hash of the edge and the round: by number a flat grid
 * would make one merge per chain and round. When a round finds few pairs, or few clusters are left, the
 * greedy loop ends the work: it is bounded on every input, rounds are not. No two threads write the same
 * field and nothing depends on their order: the same bits for every thread count.
 */
#include <string.h>

#include "base/parallel.h"
#include "base/simd.h"
#include "base/sort.h"
#include "cluster/work.h"

enum { GRAIN = 1 << 13, FEW = 4096, LONG = 16 };

#define MERGED 0x80000000u

/* Costs are compared and kept as keys that order like them (fct_float_key). */
#define OPEN    UINT32_MAX  /* to be priced */
#define BLOCKED 0xFF800000u /* infinity: the merge is not allowed */
#define SAME    5           /* low bits of a cost in which equal ones may differ */

/* The live clusters of a round and their lists. Lists longer than LONG are sorted by live number. Arrays of
 * entries may be read, not written, up to SLACK beyond a list. */
typedef struct generation {
    uint32_t count;
    uint32_t *slots, *starts, *lengths; /* of live numbers */
    uint32_t *others;                   /* per entry: the live number at the other end */
    float *shared;
    uint32_t *keys;
} generation;

enum { SLACK = 8, QUEUE = 256 };

typedef struct rounds {
    fct_work *work;
    bool across;
    uint32_t round;
    uint32_t start_height; /* of the tallest cluster before the first round; each adds one at most */
    bool low;              /* every cluster may merge, as far as heights go */
    generation now, next;
    uint32_t *best;                 /* per live cluster: its cheapest neighbour or FCT_NONE */
    uint32_t *renumbered;           /* this round's number to the next's, with MERGED */
    uint32_t *kept, *merged, *room; /* per chunk: counts, then places */
} rounds;

/* --- Pairs --- */

static uint32_t link_hash(uint32_t a, uint32_t b, uint32_t round) {
    uint32_t low = a < b ? a : b, high = a < b ? b : a;
    uint64_t x = ((uint64_t)low << 32 | high) + round * 0x9E3779B97F4A7C15u;
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
    x = (x ^ x >> 27) * 0x94D049BB133111EBu;
    return (uint32_t)(x >> 32);
}

/* What decides between edges of the same cost. */
static uint64_t tie_key(const rounds *r, uint32_t a, uint32_t b) {
    uint32_t faces = r->work->counts[r->now.slots[a]] + r->work->counts[r->now.slots[b]];
    return (uint64_t)(31 - (uint32_t)__builtin_clz(faces)) << 32 | link_hash(a, b, r->round);
}

/* The cheapest of entries whose costs share the key `least`, which one has for certain. */
static uint32_t break_tie(const rounds *r, uint32_t i, uint32_t least) {
    const uint32_t *keys = r->now.keys + r->now.starts[i], *others = r->now.others + r->now.starts[i];
    uint32_t best = FCT_NONE;
    uint64_t best_key = UINT64_MAX;
    for (uint32_t k = 0; k < r->now.lengths[i]; ++k) {
        if (keys[k] >> SAME != least) continue;
        uint64_t key = tie_key(r, i, others[k]);
        if (key < best_key) best = others[k], best_key = key;
    }
    return best;
}

/* Lanes from `from` on are all ones. */
static inline i8 lanes_from(uint32_t from) {
    static const uint32_t lanes[16] = {0,    0,    0,    0,    0,    0,    0,    0,
                                       OPEN, OPEN, OPEN, OPEN, OPEN, OPEN, OPEN, OPEN};
    return i8_load(lanes + 8 - (from < 8 ? from : 8));
}

static uint32_t best_of(const rounds *r, uint32_t i) {
    const uint32_t *keys = r->now.keys + r->now.starts[i], length = r->now.lengths[i];
    uint32_t least = OPEN, at = 0, equal = 0;
    for (uint32_t k = 0; k < length; k += 8) {
        i8 lanes = i8_or(i8_shift_right(i8_load(keys + k), SAME), lanes_from(length - k));
        uint32_t low = i8_least(lanes);
        if (low > least) continue;
        uint32_t mask = i8_eq(lanes, i8_set(low)), ties = (uint32_t)__builtin_popcount(mask);
        equal = low < least ? ties : equal + ties;
        if (low < least) at = k + (uint32_t)__builtin_ctz(mask);
        least = low;
    }
    if (least >= BLOCKED >> SAME) return FCT_NONE;
    return equal == 1 ? r->now.others[r->now.starts[i] + at] : break_tie(r, i, least);
}

static void find_best(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    const uint8_t *frozen = r->work->frozen;
    for (uint32_t i = (uint32_t)begin; i < end; ++i)
        r->best[i] = frozen && frozen[r->now.slots[i]] ? FCT_NONE : best_of(r, i);
}

static inline uint32_t mate_of(const rounds *r, uint32_t i) {
    uint32_t best = r->best[i];
    return best != FCT_NONE && r->best[best] == i ? best : FCT_NONE;
}

static void count_clusters(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    rounds *r = user;
    uint32_t kept = 0, merged = 0, room = 0;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint32_t mate = mate_of(r, i);
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
static uint32_t entry_of(const generation *g, uint32_t i, uint32_t other) {
    const uint32_t *others = g->others + g->starts[i];
    uint32_t low = 0, high = g->lengths[i], mask;
    while (high - low > LONG) {
        uint32_t middle = low + (high - low) / 2;
        if (others[middle] <= other)
            low = middle;
        else
            high = middle;
    }
    for (i8 wanted = i8_set(other); (mask = i8_eq(i8_load(others + low), wanted)) == 0;) low += 8;
    return g->starts[i] + low + (uint32_t)__builtin_ctz(mask);
}

static float cost_of_key(uint32_t key) {
    uint32_t bits = key & 0x80000000u ? key & 0x7FFFFFFFu : ~key;
    float cost;
    memcpy(&cost, &bits, sizeof cost);
    return cost;
}

/* Numbers the clusters of the next round and merges. */
static void merge_pairs(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    rounds *r = user;
    uint32_t next = r->kept[chunk], merge = r->work->merge_count + r->merged[chunk], room = r->room[chunk];
    fct_pair pairs[FCT_LANES];
    float costs[FCT_LANES];
    uint32_t count = 0;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint32_t mate = mate_of(r, i);
        if (mate < i) continue;
        r->next.slots[next] = r->now.slots[i];
        r->next.starts[next] = room;
        room += r->now.lengths[i];
        r->renumbered[i] = next;
        if (mate != FCT_NONE) {
            uint32_t entry = entry_of(&r->now, i, mate);
            room += r->now.lengths[mate] - 2;
            r->renumbered[i] = r->renumbered[mate] = next | MERGED;
            pairs[count] = (fct_pair){r->now.slots[i], r->now.slots[mate], r->now.shared[entry]};
            costs[count++] = cost_of_key(r->now.keys[entry]);
            if (count == FCT_LANES) {
                fct_work_merges(r->work, merge, pairs, costs, count);
                merge += count, count = 0;
            }
        }
        ++next;
    }
    if (count) fct_work_merges(r->work, merge, pairs, costs, count);
}

/* --- Lists --- */

/* A list being made, with room for SLACK more. */
typedef struct list {
    uint32_t *others, *keys;
    float *shared;
} list;

static inline bool before(const list *l, size_t p, size_t q) {
    return l->others[p] != l->others[q] ? l->others[p] < l->others[q] : l->shared[p] < l->shared[q];
}

static void swap(const list *l, size_t p, size_t q) {
    uint32_t other = l->others[p], key = l->keys[p];
    float shared = l->shared[p];
    l->others[p] = l->others[q], l->keys[p] = l->keys[q], l->shared[p] = l->shared[q];
    l->others[q] = other, l->keys[q] = key, l->shared[q] = shared;
}

static void sift_down(const list *l, size_t at, size_t count) {
    for (size_t child; (child = 2 * at + 1) < count; at = child) {
        if (child + 1 < count && before(l, child, child + 1)) ++child;
        if (!before(l, at, child)) break;
        swap(l, at, child);
    }
}

static void sort_list(const list *l, size_t count) {
    for (size_t i = count / 2; i-- > 0;) sift_down(l, i, count);
    for (size_t i = count; i-- > 1;) {
        swap(l, 0, i);
        sift_down(l, 0, i);
    }
}

/* Adds up neighbouring doubles; a double stands for a merge, so its cost is open. */
static uint32_t join_sorted(const list *l, uint32_t count) {
    uint32_t to = 0;
    for (uint32_t i = 0; i < count; ++i) {
        if (to > 0 && l->others[to - 1] == l->others[i])
            l->shared[to - 1] += l->shared[i];
        else
            l->others[to] = l->others[i], l->keys[to] = l->keys[i], l->shared[to++] = l->shared[i];
    }
    return to;
}

/* Appends the list of live cluster i in the next round's numbers, without what leads to `self`. */
static uint32_t renumber_list(const rounds *r, uint32_t i, uint32_t self, const list *l, uint32_t count) {
    uint32_t own = r->renumbered[i], from = r->now.starts[i], end = from + r->now.lengths[i];
    for (; from < end; ++from) {
        uint32_t number = r->renumbered[r->now.others[from]];
        if ((number & ~MERGED) == self) continue;
        l->others[count] = number & ~MERGED;
        l->shared[count] = r->now.shared[from];
        l->keys[count++] = (number | own) & MERGED ? OPEN : r->now.keys[from];
    }
    return count;
}

/* A list of at most LONG, its other ends in registers. */
typedef struct short_list {
    uint32_t count;
    i8 low, high;
    uint32_t keys[LONG + 1];
    float shared[LONG + 1];
} short_list;

/* The same for a short list, adding up doubles. Without branches but the loop's, for which way they go could
 * not be foretold. */
static inline void renumber_short(const rounds *r, uint32_t i, uint32_t self, bool half, short_list *l) {
    uint32_t own = r->renumbered[i], from = r->now.starts[i], end = from + r->now.lengths[i];
    for (; from < end; ++from) {
        uint32_t number = r->renumbered[r->now.others[from]], other = number & ~MERGED;
        i8 wanted = i8_set(other);
        uint32_t equal = i8_eq(l->low, wanted) | (half ? 0 : i8_eq(l->high, wanted) << 8);
        uint32_t there = equal & ((1u << l->count) - 1), at = (uint32_t)__builtin_ctz(there | 1u << l->count);
        float sum = l->shared[at];
        l->low = i8_insert(l->low, at, wanted);
        if (!half) l->high = i8_insert(l->high, at - 8, wanted);
        l->shared[at] = (there ? sum : 0) + r->now.shared[from];
        l->keys[at] = (number | own) & MERGED ? OPEN : r->now.keys[from];
        l->count += !there && other != self;
    }
}

/* With `half`, of at most 8 entries. */
static inline uint32_t join_short(const rounds *r, uint32_t i, uint32_t mate, uint32_t next, uint32_t place,
                                  bool half) {
    short_list l;
    uint32_t others[LONG];
    l.count = 0, l.low = l.high = i8_set(OPEN);
    renumber_short(r, i, next, half, &l);
    if (mate != FCT_NONE) renumber_short(r, mate, next, half, &l);
    i8_store(others, l.low);
    if (!half) i8_store(others + 8, l.high);
    for (uint32_t k = 0; k < l.count; ++k) {
        r->next.others[place + k] = others[k];
        r->next.shared[place + k] = l.shared[k];
        r->next.keys[place + k] = l.keys[k];
    }
    return l.count;
}

static uint32_t join_few(const rounds *r, uint32_t i, uint32_t mate, uint32_t next, uint32_t place,
                         uint32_t length) {
    return length <= 8 ? join_short(r, i, mate, next, place, true)
                       : join_short(r, i, mate, next, place, false);
}

static uint32_t join_many(const rounds *r, uint32_t i, uint32_t mate, uint32_t next, uint32_t place) {
    list l = {r->next.others + place, r->next.keys + place, r->next.shared + place};
    uint32_t count = renumber_list(r, i, next, &l, 0);
    if (mate != FCT_NONE) count = renumber_list(r, mate, next, &l, count);
    sort_list(&l, count);
    return join_sorted(&l, count);
}

static void join_lists(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint32_t mate = mate_of(r, i), length = r->now.lengths[i];
        if (mate < i) continue;
        uint32_t next = r->renumbered[i] & ~MERGED, place = r->next.starts[next];
        if (mate != FCT_NONE) length += r->now.lengths[mate];
        r->next.lengths[next] =
            length <= LONG ? join_few(r, i, mate, next, place, length) : join_many(r, i, mate, next, place);
    }
}

/* --- Costs --- */

/* Edges to be priced: first all are found, then their costs, so that neither loop waits for the other's
 * branches. */
typedef struct price_queue {
    uint32_t count;
    uint32_t clusters[QUEUE + 8], entries[QUEUE + 8];
} price_queue;

static inline bool may_merge(const rounds *r, uint32_t a, uint32_t b) {
    if (r->low && !r->work->materials) return true;
    const uint32_t *materials = r->work->materials;
    return (r->across || !materials || materials[a] == materials[b]) && fct_work_allowed(r->work, a, b);
}

static void price_queued(const rounds *r, price_queue *queue) {
    const generation *now = &r->now;
    fct_pair pairs[FCT_LANES];
    float costs[FCT_LANES];
    uint32_t entries[FCT_LANES], mirrors[FCT_LANES], count = 0;
    for (uint32_t q = 0; q < queue->count; ++q) {
        uint32_t i = queue->clusters[q], entry = queue->entries[q], other = now->others[entry];
        uint32_t a = now->slots[i], b = now->slots[other], mirror = entry_of(now, other, i);
        pairs[count] = (fct_pair){a, b, now->shared[entry]};
        entries[count] = entry, mirrors[count] = mirror;
        if (may_merge(r, a, b))
            ++count;
        else
            now->keys[entry] = now->keys[mirror] = BLOCKED;
        if (count < FCT_LANES && q + 1 < queue->count) continue;
        if (count) fct_work_costs(r->work, pairs, count, costs);
        for (uint32_t k = 0; k < count; ++k)
            now->keys[entries[k]] = now->keys[mirrors[k]] = fct_float_key(costs[k]);
        count = 0;
    }
    queue->count = 0;
}

/* Prices the edges of the clusters of a chunk to those of higher number, for both lists. */
static void price_edges(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    const generation *now = &r->now;
    price_queue queue = {.count = 0};
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        i8 self = i8_set(i);
        uint32_t start = now->starts[i], length = now->lengths[i];
        for (uint32_t k = 0; k < length; k += 8) {
            uint32_t within = length - k < 8 ? (1u << (length - k)) - 1 : 0xFF;
            uint32_t mask = within & i8_lt(self, i8_load(now->others + start + k));
            for (; mask; mask &= mask - 1) {
                uint32_t entry = start + k + (uint32_t)__builtin_ctz(mask);
                queue.clusters[queue.count] = i, queue.entries[queue.count] = entry;
                queue.count += now->keys[entry] == OPEN; /* others write the keys of the lanes left out */
            }
            if (queue.count >= QUEUE) price_queued(r, &queue);
        }
    }
    price_queued(r, &queue);
}

/* --- Rounds --- */

static bool allocate_generation(const fct_env *env, uint32_t count, size_t room, generation *out) {
    out->slots = fct_allocate(env, count, sizeof *out->slots);
    out->starts = fct_allocate(env, count, sizeof *out->starts);
    out->lengths = fct_allocate(env, count, sizeof *out->lengths);
    out->others = fct_allocate(env, room + SLACK, sizeof *out->others);
    out->shared = fct_allocate(env, room, sizeof *out->shared);
    out->keys = fct_allocate(env, room + SLACK, sizeof *out->keys);
    bool complete = out->slots && out->starts && out->lengths && out->others && out->shared && out->keys;
    if (!complete) return false;
    memset(out->others + room, 0, SLACK * sizeof *out->others);
    memset(out->keys + room, 0, SLACK * sizeof *out->keys);
    return true;
}

static void release_generation(const fct_env *env, generation *g) {
    fct_release(env, g->slots);
    fct_release(env, g->starts);
    fct_release(env, g->lengths);
    fct_release(env, g->others);
    fct_release(env, g->shared);
    fct_release(env, g->keys);
    *g = (generation){0};
}

/* Pairs up, merges and takes the lists into the next round; *merges: how many. Errors: MEMORY. */
static fct_result one_round(rounds *r, uint32_t *merges) {
    const fct_env *env = r->work->env;
    size_t count = r->now.count, chunks = fct_chunk_count(count, GRAIN);
    fct_parallel_for(env, count, GRAIN, find_best, r);
    fct_parallel_for(env, count, GRAIN, count_clusters, r);
    uint32_t live = counts_to_places(r->kept, chunks), room = counts_to_places(r->room, chunks);
    *merges = counts_to_places(r->merged, chunks);
    /* The first round's need is the largest that comes. */
    if (!r->next.slots && !allocate_generation(env, live, room, &r->next))
        return fct_fail_memory(env, "clustering");
    fct_parallel_for(env, count, GRAIN, merge_pairs, r);
    r->work->merge_count += *merges;
    fct_parallel_for(env, count, GRAIN, join_lists, r);
    generation old = r->now;
    r->now = r->next, r->next = old;
    r->now.count = live;
    ++r->round;
    r->low = r->start_height + r->round < FCT_FREE_HEIGHT;
    fct_parallel_for(env, live, GRAIN, price_edges, r);
    return FCT_OK;
}

/* The work's lists become the first generation. */
static fct_result enter_lists(rounds *r) {
    fct_work *work = r->work;
    size_t count = work->lists.entry_count;
    r->now = (generation){.count = work->face_count,
                          .slots = fct_allocate(work->env, work->face_count, sizeof *r->now.slots),
                          .starts = work->lists.starts,
                          .lengths = work->lists.counts,
                          .others = work->lists.neighbors,
                          .shared = work->lists.lengths,
                          .keys = fct_allocate(work->env, count + SLACK, sizeof *r->now.keys)};
    work->lists = (fct_lists){0};
    if (!r->now.slots || !r->now.keys) return fct_fail_memory(work->env, "clustering");
    for (uint32_t s = 0; s < work->face_count; ++s) r->now.slots[s] = s;
    memset(r->now.keys, 0xFF, (count + SLACK) * sizeof *r->now.keys);
    return FCT_OK;
}

/* Lists out of the work's edges. */
static fct_result enter_edges(rounds *r) {
    fct_work *work = r->work;
    generation *now = &r->now;
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
            now->others[entry] = b, now->shared[entry] = edge->shared, now->keys[entry] = OPEN;
        }
    for (uint32_t i = 0; i < live; ++i) {
        list l = {now->others + now->starts[i], now->keys + now->starts[i], now->shared + now->starts[i]};
        if (now->lengths[i] > LONG) sort_list(&l, now->lengths[i]);
    }
    fct_release(work->env, work->edges);
    work->edges = NULL, work->edge_count = 0;
    return FCT_OK;
}

static fct_result leave(rounds *r) {
    fct_work *work = r->work;
    const generation *now = &r->now;
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

static fct_result run(rounds *r) {
    fct_work *work = r->work;
    fct_result result = work->lists.neighbors ? enter_lists(r) : enter_edges(r);
    if (result != FCT_OK) return result;
    for (uint32_t i = 0; i < r->now.count; ++i) {
        uint32_t height = work->heights[r->now.slots[i]];
        if (height > r->start_height) r->start_height = height;
    }
    r->low = r->start_height < FCT_FREE_HEIGHT;
    fct_parallel_for(work->env, r->now.count, GRAIN, price_edges, r);
    for (uint32_t merges = UINT32_MAX; r->now.count > FEW && merges > r->now.count / 64;) {
        result = fct_progress(work->env, "clusters", work->merge_count / (double)work->face_count);
        if (result == FCT_OK) result = one_round(r, &merges);
        if (result != FCT_OK) return result;
    }
    return leave(r);
}

fct_result fct_work_rounds(fct_work *work, bool across) {
    const fct_env *env = work->env;
    fct_result result = FCT_OK;
    size_t live = work->face_count - work->merge_count, chunks = fct_chunk_count(live, GRAIN);
    if (live > FEW && (work->lists.neighbors || work->edge_count > 0)) {
        rounds r = {.work = work, .across = across};
        r.best = fct_allocate(env, live, sizeof *r.best);
        r.renumbered = fct_allocate(env, work->face_count, sizeof *r.renumbered);
        r.kept = fct_allocate(env, chunks, sizeof *r.kept);
        r.merged = fct_allocate(env, chunks, sizeof *r.merged);
        r.room = fct_allocate(env, chunks, sizeof *r.room);
        bool complete = r.best && r.renumbered && r.kept && r.merged && r.room;
        result = complete ? run(&r) : fct_fail_memory(env, "clustering");
        release_generation(env, &r.now);
        release_generation(env, &r.next);
        fct_release(env, r.best);
        fct_release(env, r.renumbered);
        fct_release(env, r.kept);
        fct_release(env, r.merged);
        fct_release(env, r.room);
    }
    return result == FCT_OK ? fct_work_greedy(work, across) : result;
}
