/* cluster/rounds.c: contraction in rounds: every cluster that is its cheapest neighbour's cheapest neighbour
 * merges with it, all such pairs at once.
 *
 * In and out: the live edges of an fct_work. Live clusters are numbered anew each round, edges are flat
 * arrays grouped by their lower end; each round regroups them by a counting sort, sorts each group by the
 * other end and adds up doubles. A merged pair prices its edges anew, the rest keep their cost. Ties (costs
 * equal to 18 bits) go to the smaller union, then to a hash of the edge and the round: by number a flat grid
 * would make one merge per chain and round. When a round finds few pairs, or few clusters are left, the
 * greedy loop ends the work: it is bounded on every input, rounds are not. The same bits for every thread
 * count: minima and counts commute, and groups are sorted by all that tells their entries apart.
 */
#include <stdatomic.h>
#include <string.h>

#include "base/parallel.h"
#include "base/sort.h"
#include "cluster/work.h"

enum { GRAIN = 1 << 13, FEW = 4096, SMALL_GROUP = 24 };

/* Ends are live numbers, a < b. */
typedef struct link {
    uint32_t a, b;
    float shared, cost; /* cost: INFINITY where the merge is not allowed, NaN where it must be priced */
} link;

typedef struct rounds {
    fct_work *work;
    bool across;
    uint32_t round;
    uint32_t live_count, next_count; /* clusters in this round and in the next */
    uint32_t *slots, *next_slots;    /* of live numbers */
    uint32_t *mates;                 /* FCT_NONE: stays alone */
    uint32_t *mate_links;            /* of the lower of a pair */
    uint32_t *renumbered;            /* this round's number to the next's */
    _Atomic uint64_t *best;
    _Atomic uint32_t *starts; /* of groups */
    uint32_t link_count, grouped_count;
    link *links, *other;
    uint32_t *kept, *merged; /* per chunk: counts, then places */
} rounds;

static uint32_t scatter_bits(uint32_t x, uint32_t round) {
    x ^= round * 0x9E3779B9u;
    x *= 0x85EBCA6Bu, x ^= x >> 15;
    x *= 0xC2B2AE35u, x ^= x >> 13;
    return x;
}

/* Different for every link of a round, for scatter_bits is a permutation. */
static uint64_t link_key(const rounds *r, uint32_t e) {
    const link *l = &r->links[e];
    uint32_t faces = r->work->counts[r->slots[l->a]] + r->work->counts[r->slots[l->b]];
    uint64_t size = 31 - (uint32_t)__builtin_clz(faces);
    return (uint64_t)(fct_float_key(l->cost) >> 5) << 37 | size << 32 | scatter_bits(e, r->round);
}

static void price(const rounds *r, link *l) {
    fct_work *work = r->work;
    uint32_t a = r->slots[l->a], b = r->slots[l->b];
    bool foreign = !r->across && work->materials && work->materials[a] != work->materials[b];
    l->cost = foreign || !fct_work_allowed(work, a, b) ? INFINITY : fct_work_cost(work, a, b, l->shared);
}

static void price_all(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    for (size_t e = begin; e < end; ++e) price(r, &r->links[e]);
}

static void clear_round(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    for (size_t i = begin; i < end; ++i) {
        atomic_store_explicit(&r->best[i], UINT64_MAX, memory_order_relaxed);
        r->mates[i] = FCT_NONE;
    }
}

static void lower_to(_Atomic uint64_t *best, uint64_t key) {
    uint64_t old = atomic_load_explicit(best, memory_order_relaxed);
    while (key < old && !atomic_compare_exchange_weak_explicit(best, &old, key, memory_order_relaxed,
                                                               memory_order_relaxed))
        continue;
}

static void find_best(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    for (size_t e = begin; e < end; ++e) {
        if (r->links[e].cost == INFINITY) continue;
        uint64_t key = link_key(r, (uint32_t)e);
        lower_to(&r->best[r->links[e].a], key);
        lower_to(&r->best[r->links[e].b], key);
    }
}

static void find_pairs(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    for (size_t e = begin; e < end; ++e) {
        const link *l = &r->links[e];
        const uint8_t *frozen = r->work->frozen;
        if (l->cost == INFINITY || (frozen && (frozen[r->slots[l->a]] || frozen[r->slots[l->b]]))) continue;
        uint64_t key = link_key(r, (uint32_t)e);
        if (atomic_load_explicit(&r->best[l->a], memory_order_relaxed) != key ||
            atomic_load_explicit(&r->best[l->b], memory_order_relaxed) != key)
            continue;
        r->mates[l->a] = l->b;
        r->mates[l->b] = l->a;
        r->mate_links[l->a] = (uint32_t)e;
    }
}

static void count_clusters(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    rounds *r = user;
    uint32_t kept = 0, merged = 0;
    for (size_t i = begin; i < end; ++i) {
        kept += r->mates[i] > i; /* alone, or the lower of a pair */
        merged += r->mates[i] > i && r->mates[i] != FCT_NONE;
    }
    r->kept[chunk] = kept, r->merged[chunk] = merged;
}

static void merge_pairs(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    rounds *r = user;
    uint32_t next = r->kept[chunk], merge = r->work->merge_count + r->merged[chunk];
    for (size_t i = begin; i < end; ++i) {
        uint32_t mate = r->mates[i];
        if (mate <= i) continue;
        r->next_slots[next] = r->slots[i];
        r->renumbered[i] = next;
        if (mate != FCT_NONE) {
            const link *l = &r->links[r->mate_links[i]];
            r->renumbered[mate] = next;
            fct_work_merge_as(r->work, merge++, r->slots[i], r->slots[mate], l->shared, l->cost);
        }
        ++next;
    }
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

/* The link in the next round's numbers; false if it has become a loop. */
static bool renumber(const rounds *r, const link *from, link *to) {
    uint32_t a = r->renumbered[from->a], b = r->renumbered[from->b];
    bool changed = r->mates[from->a] != FCT_NONE || r->mates[from->b] != FCT_NONE;
    *to = (link){a < b ? a : b, a < b ? b : a, from->shared, changed ? NAN : from->cost};
    return a != b;
}

static void count_groups(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    link l;
    for (size_t e = begin; e < end; ++e)
        if (renumber(r, &r->links[e], &l))
            atomic_fetch_add_explicit(&r->starts[l.a], 1, memory_order_relaxed);
}

static void fill_groups(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    rounds *r = user;
    link l;
    for (size_t e = begin; e < end; ++e)
        if (renumber(r, &r->links[e], &l))
            r->other[atomic_fetch_add_explicit(&r->starts[l.a], 1, memory_order_relaxed)] = l;
}

static inline bool before(const link *p, const link *q) {
    return p->b != q->b ? p->b < q->b : p->shared < q->shared;
}

/* By (b, shared): what is left equal is equal throughout. */
static void sort_group(link *group, link *scratch, size_t count) {
    size_t run = count <= SMALL_GROUP ? count : SMALL_GROUP;
    for (size_t from = 0; from < count; from += run) {
        size_t end = from + run < count ? from + run : count;
        for (size_t i = from + 1; i < end; ++i) {
            link l = group[i];
            size_t j = i;
            for (; j > from && before(&l, &group[j - 1]); --j) group[j] = group[j - 1];
            group[j] = l;
        }
    }
    for (; run < count; run *= 2) {
        for (size_t from = 0; from < count; from += 2 * run) {
            size_t middle = from + run < count ? from + run : count;
            size_t end = middle + run < count ? middle + run : count, i = from, j = middle;
            for (size_t k = from; k < end; ++k)
                scratch[k] =
                    j >= end || (i < middle && !before(&group[j], &group[i])) ? group[i++] : group[j++];
        }
        memcpy(group, scratch, count * sizeof *group);
    }
}

/* Sorts the groups of a chunk, joins doubles and packs the chunk's links together at its beginning. */
static void join_doubles(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    rounds *r = user;
    uint32_t first = begin ? r->starts[begin - 1] : 0, from = first, to = first;
    for (size_t i = begin; i < end; ++i) {
        uint32_t last = r->starts[i]; /* filling has moved every start to its group's end */
        if (last - from > 1) sort_group(r->other + from, r->links + from, last - from);
        for (; from < last; ++from) {
            link *l = &r->other[from];
            if (to > first && r->other[to - 1].a == l->a && r->other[to - 1].b == l->b)
                r->other[to - 1].shared += l->shared;
            else
                r->other[to++] = *l;
        }
    }
    r->kept[chunk] = to - first;
    r->merged[chunk] = first;
}

static void price_kept(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)begin, (void)end, (void)thread;
    rounds *r = user;
    uint32_t place = r->kept[chunk], last = r->kept[chunk + 1];
    const link *from = r->other + r->merged[chunk];
    for (; place < last; ++place) {
        link *l = &r->links[place];
        *l = *from++;
        if (l->cost != l->cost) price(r, l);
    }
}

/* Takes the links into the next round. */
static void regroup(rounds *r) {
    const fct_env *env = r->work->env;
    uint32_t count = r->next_count;
    memset((void *)r->starts, 0, ((size_t)count + 1) * sizeof *r->starts);
    fct_parallel_for(env, r->link_count, GRAIN, count_groups, r);
    uint32_t place = 0;
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t size = atomic_load_explicit(&r->starts[i], memory_order_relaxed);
        atomic_store_explicit(&r->starts[i], place, memory_order_relaxed);
        place += size;
    }
    fct_parallel_for(env, r->link_count, GRAIN, fill_groups, r);
    uint32_t *slots = r->slots;
    r->slots = r->next_slots, r->next_slots = slots;
    fct_parallel_for(env, count, GRAIN, join_doubles, r);
    size_t chunks = fct_chunk_count(count, GRAIN);
    r->kept[chunks] = 0;
    r->link_count = counts_to_places(r->kept, chunks + 1);
    fct_parallel_for(env, count, GRAIN, price_kept, r);
}

/* Merges of this round. */
static uint32_t one_round(rounds *r) {
    fct_work *work = r->work;
    const fct_env *env = work->env;
    size_t chunks = fct_chunk_count(r->live_count, GRAIN);
    fct_parallel_for(env, r->live_count, GRAIN, clear_round, r);
    fct_parallel_for(env, r->link_count, GRAIN, find_best, r);
    fct_parallel_for(env, r->link_count, GRAIN, find_pairs, r);
    fct_parallel_for(env, r->live_count, GRAIN, count_clusters, r);
    r->next_count = counts_to_places(r->kept, chunks);
    uint32_t merges = counts_to_places(r->merged, chunks);
    fct_parallel_for(env, r->live_count, GRAIN, merge_pairs, r);
    work->merge_count += merges;
    regroup(r);
    r->live_count = r->next_count;
    ++r->round;
    return merges;
}

/* Live numbers, and links out of the work's edges. */
static void enter(rounds *r) {
    fct_work *work = r->work;
    for (uint32_t s = 0; s < work->face_count; ++s)
        if (work->nodes[s] != FCT_NONE) {
            r->renumbered[s] = r->live_count;
            r->slots[r->live_count++] = s;
        }
    for (uint32_t e = 0; e < work->edge_count; ++e) {
        uint32_t a = r->renumbered[work->edges[e].a], b = r->renumbered[work->edges[e].b];
        r->links[e] = (link){a < b ? a : b, a < b ? b : a, work->edges[e].shared, NAN};
    }
    r->link_count = work->edge_count;
}

static fct_result run(rounds *r) {
    fct_work *work = r->work;
    enter(r);
    fct_parallel_for(work->env, r->link_count, GRAIN, price_all, r);
    for (uint32_t merges = UINT32_MAX; r->live_count > FEW && merges > r->live_count / 64;) {
        fct_result result = fct_progress(work->env, "clusters", work->merge_count / (double)work->face_count);
        if (result != FCT_OK) return result;
        merges = one_round(r);
    }
    for (uint32_t e = 0; e < r->link_count; ++e)
        work->edges[e] = (fct_edge){r->slots[r->links[e].a], r->slots[r->links[e].b], r->links[e].shared};
    work->edge_count = r->link_count;
    return FCT_OK;
}

static bool allocate_rounds(const fct_env *env, rounds *r) {
    size_t faces = r->work->face_count, edges = r->work->edge_count, chunks = fct_chunk_count(faces, GRAIN);
    r->slots = fct_allocate(env, faces, sizeof *r->slots);
    r->next_slots = fct_allocate(env, faces, sizeof *r->next_slots);
    r->mates = fct_allocate(env, faces, sizeof *r->mates);
    r->mate_links = fct_allocate(env, faces, sizeof *r->mate_links);
    r->renumbered = fct_allocate(env, faces, sizeof *r->renumbered);
    r->best = fct_allocate(env, faces, sizeof *r->best);
    r->starts = fct_allocate(env, faces + 1, sizeof *r->starts);
    r->links = fct_allocate(env, edges, sizeof *r->links);
    r->other = fct_allocate(env, edges, sizeof *r->other);
    r->kept = fct_allocate(env, chunks + 1, sizeof *r->kept);
    r->merged = fct_allocate(env, chunks + 1, sizeof *r->merged);
    return r->slots && r->next_slots && r->mates && r->mate_links && r->renumbered && r->best && r->starts &&
           r->links && r->other && r->kept && r->merged;
}

fct_result fct_work_rounds(fct_work *work, bool across) {
    const fct_env *env = work->env;
    fct_result result = FCT_OK;
    if (work->face_count - work->merge_count > FEW && work->edge_count > 0) {
        rounds r = {.work = work, .across = across};
        result = allocate_rounds(env, &r) ? run(&r) : fct_fail_memory(env, "clustering");
        fct_release(env, r.slots);
        fct_release(env, r.next_slots);
        fct_release(env, r.mates);
        fct_release(env, r.mate_links);
        fct_release(env, r.renumbered);
        fct_release(env, (void *)r.best);
        fct_release(env, (void *)r.starts);
        fct_release(env, r.links);
        fct_release(env, r.other);
        fct_release(env, r.kept);
        fct_release(env, r.merged);
    }
    return result == FCT_OK ? fct_work_greedy(work, across) : result;
}
