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
#include "base/sort.h"
#include "cluster/work.h"

enum { GRAIN = 1 << 12, FEW = 4096, LONG = 32 };

#define MERGED 0x80000000u

/* The live clusters of a round. `face` of an entry is a live number; cost: INFINITY where the merge is not
 * allowed, NaN where it must be priced. Lists longer than LONG are sorted by live number. */
typedef struct generation {
    uint32_t count;
    uint32_t *slots, *starts, *lengths; /* of live numbers */
    fct_neighbor *entries;
} generation;

typedef struct rounds {
    fct_work *work;
    bool across;
    uint32_t round;
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

static void find_best(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    const uint8_t *frozen = r->work->frozen;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        r->best[i] = FCT_NONE;
        if (frozen && frozen[r->now.slots[i]]) continue;
        const fct_neighbor *list = r->now.entries + r->now.starts[i];
        uint32_t best = FCT_NONE, least = UINT32_MAX;
        for (uint32_t k = 0; k < r->now.lengths[i]; ++k) {
            uint32_t cost = fct_float_key(list[k].cost) >> 5, other = list[k].face;
            if (cost > least || list[k].cost == INFINITY) continue;
            if (cost < least || tie_key(r, i, other) < tie_key(r, i, best)) best = other;
            least = cost;
        }
        r->best[i] = best;
    }
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

static const fct_neighbor *entry_of(const generation *g, uint32_t i, uint32_t other) {
    const fct_neighbor *entry = g->entries + g->starts[i];
    while (entry->face != other) ++entry;
    return entry;
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
            const fct_neighbor *link = entry_of(&r->now, i, mate);
            room += r->now.lengths[mate] - 2;
            r->renumbered[i] = r->renumbered[mate] = next | MERGED;
            pairs[count] = (fct_pair){r->now.slots[i], r->now.slots[mate], link->length};
            costs[count++] = link->cost;
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

static inline bool before(const fct_neighbor *p, const fct_neighbor *q) {
    return p->face != q->face ? p->face < q->face : p->length < q->length;
}

static void sift_down(fct_neighbor *list, size_t at, size_t count) {
    fct_neighbor entry = list[at];
    for (size_t child; (child = 2 * at + 1) < count; at = child) {
        if (child + 1 < count && before(&list[child], &list[child + 1])) ++child;
        if (!before(&entry, &list[child])) break;
        list[at] = list[child];
    }
    list[at] = entry;
}

static void sort_list(fct_neighbor *list, size_t count) {
    for (size_t i = count / 2; i-- > 0;) sift_down(list, i, count);
    for (size_t i = count; i-- > 1;) {
        fct_neighbor entry = list[0];
        list[0] = list[i], list[i] = entry;
        sift_down(list, 0, i);
    }
}

/* Adds up neighbouring doubles; a double stands for a merge, so its cost is open. */
static uint32_t join_sorted(fct_neighbor *list, uint32_t count) {
    uint32_t to = 0;
    for (uint32_t i = 0; i < count; ++i) {
        if (to > 0 && list[to - 1].face == list[i].face)
            list[to - 1].length += list[i].length;
        else
            list[to++] = list[i];
    }
    return to;
}

/* Appends the list of live cluster i in the next round's numbers, without what leads to `self`. */
static inline uint32_t renumber_list(const rounds *r, uint32_t i, uint32_t self, bool join,
                                     fct_neighbor *list, uint32_t count) {
    const fct_neighbor *from = r->now.entries + r->now.starts[i], *end = from + r->now.lengths[i];
    for (; from < end; ++from) {
        uint32_t number = r->renumbered[from->face], face = number & ~MERGED, at = count;
        if (face == self) continue;
        if (join)
            for (at = 0; at < count && list[at].face != face;) ++at;
        if (at < count) {
            list[at].length += from->length;
        } else {
            bool open = number & MERGED || r->renumbered[i] & MERGED;
            list[count++] = (fct_neighbor){face, from->length, open ? NAN : from->cost};
        }
    }
    return count;
}

static void join_lists(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint32_t mate = mate_of(r, i), count = 0, length = r->now.lengths[i];
        if (mate < i) continue;
        uint32_t next = r->renumbered[i] & ~MERGED;
        if (mate != FCT_NONE) length += r->now.lengths[mate];
        fct_neighbor *list = r->next.entries + r->next.starts[next];
        bool few = length <= LONG;
        count = renumber_list(r, i, next, few, list, count);
        if (mate != FCT_NONE) count = renumber_list(r, mate, next, few, list, count);
        if (!few) {
            sort_list(list, count);
            count = join_sorted(list, count);
        }
        r->next.lengths[next] = count;
    }
}

/* --- Costs --- */

static fct_neighbor *mirror_of(const generation *g, uint32_t i, uint32_t other) {
    fct_neighbor *list = g->entries + g->starts[i];
    uint32_t low = 0, high = g->lengths[i];
    while (high - low > LONG) {
        uint32_t middle = low + (high - low) / 2;
        if (list[middle].face <= other)
            low = middle;
        else
            high = middle;
    }
    while (list[low].face != other) ++low;
    return &list[low];
}

typedef struct price_batch {
    uint32_t count;
    fct_pair pairs[FCT_LANES];
    fct_neighbor *entries[FCT_LANES], *mirrors[FCT_LANES];
} price_batch;

static void price(const rounds *r, price_batch *batch) {
    float costs[FCT_LANES];
    if (batch->count) fct_work_costs(r->work, batch->pairs, batch->count, costs);
    for (uint32_t i = 0; i < batch->count; ++i) batch->entries[i]->cost = batch->mirrors[i]->cost = costs[i];
    batch->count = 0;
}

static bool may_merge(const rounds *r, uint32_t a, uint32_t b) {
    const uint32_t *materials = r->work->materials;
    return (r->across || !materials || materials[a] == materials[b]) && fct_work_allowed(r->work, a, b);
}

/* Prices the edges of the clusters of a chunk to those of higher number. */
static void price_edges(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    const generation *now = &r->now;
    price_batch batch = {.count = 0};
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        fct_neighbor *entry = now->entries + now->starts[i], *last = entry + now->lengths[i];
        for (; entry < last; ++entry) {
            if (entry->face < i || entry->cost == entry->cost) continue;
            uint32_t a = now->slots[i], b = now->slots[entry->face];
            fct_neighbor *mirror = mirror_of(now, entry->face, i);
            if (!may_merge(r, a, b)) {
                entry->cost = mirror->cost = INFINITY;
                continue;
            }
            batch.pairs[batch.count] = (fct_pair){a, b, entry->length};
            batch.entries[batch.count] = entry, batch.mirrors[batch.count] = mirror;
            if (++batch.count == FCT_LANES) price(r, &batch);
        }
    }
    price(r, &batch);
}

/* --- Rounds --- */

static bool allocate_generation(const fct_env *env, uint32_t count, uint32_t room, generation *out) {
    out->slots = fct_allocate(env, count, sizeof *out->slots);
    out->starts = fct_allocate(env, count, sizeof *out->starts);
    out->lengths = fct_allocate(env, count, sizeof *out->lengths);
    out->entries = fct_allocate(env, room, sizeof *out->entries);
    return out->slots && out->starts && out->lengths && out->entries;
}

static void release_generation(const fct_env *env, generation *g) {
    fct_release(env, g->slots);
    fct_release(env, g->starts);
    fct_release(env, g->lengths);
    fct_release(env, g->entries);
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
    fct_parallel_for(env, live, GRAIN, price_edges, r);
    return FCT_OK;
}

/* The work's lists become the first generation. */
static fct_result enter_lists(rounds *r) {
    fct_work *work = r->work;
    r->now = (generation){.count = work->face_count,
                          .slots = fct_allocate(work->env, work->face_count, sizeof *r->now.slots),
                          .starts = work->lists.starts,
                          .lengths = work->lists.counts,
                          .entries = work->lists.entries};
    work->lists = (fct_lists){0};
    if (!r->now.slots) return fct_fail_memory(work->env, "clustering");
    for (uint32_t s = 0; s < work->face_count; ++s) r->now.slots[s] = s;
    return FCT_OK;
}

/* Lists out of the work's edges. */
static fct_result enter_edges(rounds *r) {
    fct_work *work = r->work;
    uint32_t live = 0, count = work->face_count - work->merge_count, place = 0;
    if (work->edge_count > UINT32_MAX / 2 ||
        !allocate_generation(work->env, count, 2 * work->edge_count, &r->now))
        return fct_fail_memory(work->env, "clustering");
    for (uint32_t s = 0; s < work->face_count; ++s)
        if (work->nodes[s] != FCT_NONE) {
            r->renumbered[s] = live;
            r->now.slots[live++] = s;
        }
    r->now.count = live;
    memset(r->now.lengths, 0, (size_t)live * sizeof *r->now.lengths);
    for (uint32_t e = 0; e < work->edge_count; ++e) {
        ++r->now.lengths[r->renumbered[work->edges[e].a]];
        ++r->now.lengths[r->renumbered[work->edges[e].b]];
    }
    for (uint32_t i = 0; i < live; ++i) {
        r->now.starts[i] = place;
        place += r->now.lengths[i];
        r->now.lengths[i] = 0;
    }
    for (uint32_t e = 0; e < work->edge_count; ++e) {
        const fct_edge *edge = &work->edges[e];
        uint32_t a = r->renumbered[edge->a], b = r->renumbered[edge->b];
        r->now.entries[r->now.starts[a] + r->now.lengths[a]++] = (fct_neighbor){b, edge->shared, NAN};
        r->now.entries[r->now.starts[b] + r->now.lengths[b]++] = (fct_neighbor){a, edge->shared, NAN};
    }
    for (uint32_t i = 0; i < live; ++i)
        if (r->now.lengths[i] > LONG) sort_list(r->now.entries + r->now.starts[i], r->now.lengths[i]);
    fct_release(work->env, work->edges);
    work->edges = NULL, work->edge_count = 0;
    return FCT_OK;
}

static fct_result leave(rounds *r) {
    fct_work *work = r->work;
    const generation *now = &r->now;
    uint32_t count = 0, place = 0;
    for (uint32_t i = 0; i < now->count; ++i)
        for (uint32_t k = 0; k < now->lengths[i]; ++k) count += now->entries[now->starts[i] + k].face > i;
    work->edges = fct_allocate(work->env, count, sizeof *work->edges);
    if (!work->edges) return fct_fail_memory(work->env, "clustering");
    for (uint32_t i = 0; i < now->count; ++i)
        for (uint32_t k = 0; k < now->lengths[i]; ++k) {
            const fct_neighbor *n = &now->entries[now->starts[i] + k];
            if (n->face > i) work->edges[place++] = (fct_edge){now->slots[i], now->slots[n->face], n->length};
        }
    work->edge_count = count;
    return FCT_OK;
}

static fct_result run(rounds *r) {
    fct_work *work = r->work;
    fct_result result = work->lists.entries ? enter_lists(r) : enter_edges(r);
    if (result != FCT_OK) return result;
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
    if (live > FEW && (work->lists.entries || work->edge_count > 0)) {
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
