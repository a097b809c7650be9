/* cluster/merge/rounds/rounds.c: contraction in rounds, without a global heap.
 *
 * In: the lists or edges of an fct_work. Out: its remaining edges. Each round
 * 1. finds pairs of clusters that are each other's cheapest partner, or nearly so (pair.c),
 * 2. merges them and numbers the clusters that remain (merge.c),
 * 3. writes the lists of neighbours of those clusters (lists.c),
 * 4. prices the edges of unions and offers all edges to their ends (price.c).
 * The greedy loop finishes when few clusters are left or a round finds few pairs, because its work is bounded
 * on every input and that of rounds is not. The result has the same bits for every thread count.
 */
#include "cluster/merge/rounds/rounds.h"

#include <string.h>

#include "base/parallel.h"
#include "cluster/merge/greedy.h"
#include "cluster/merge/rounds/lists.h"
#include "cluster/merge/rounds/merge.h"
#include "cluster/merge/rounds/offer.h"
#include "cluster/merge/rounds/pair.h"
#include "cluster/merge/rounds/price.h"

enum {
    GRAIN = FCT_ROUND_GRAIN,
    SLACK = FCT_LIST_SLACK,
    FEW = 4096,      /* clusters that the greedy loop takes over */
    LEAST_SHARE = 64 /* it also does when a round merges fewer than one cluster in so many */
};

/* Turns counts into the sums of those before; returns the sum of all. */
static uint32_t sum_before(uint32_t *counts, size_t chunks) {
    uint32_t total = 0;
    for (size_t i = 0; i < chunks; ++i) {
        uint32_t count = counts[i];
        counts[i] = total;
        total += count;
    }
    return total;
}

static fct_result allocate_generation(const fct_env *env, uint32_t count, size_t room, fct_generation *out) {
    const size_t entries = room + SLACK;
    const fct_array arrays[] = {FCT_ARRAY(out->slots, count),    FCT_ARRAY(out->starts, count),
                                FCT_ARRAY(out->lengths, count),  FCT_ARRAY(out->others, entries),
                                FCT_ARRAY(out->shared, entries), FCT_ARRAY(out->keys, entries)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "clustering");
    if (result == FCT_OK) memset(out->others + room, 0, SLACK * sizeof *out->others);
    return result;
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

/* The next generation and the scratch memory. No later round needs more than the first. Errors: MEMORY. */
static fct_result allocate_next(fct_rounds *r, uint32_t live, uint32_t room) {
    const fct_env *env = r->work->env;
    uint32_t threads = fct_env_threads(env);
    fct_result result = allocate_generation(env, live, room, &r->next);
    if (result != FCT_OK) return result;
    r->scratch = fct_allocate_zero(env, threads, sizeof *r->scratch);
    if (!r->scratch) return fct_fail_memory(env, "clustering");
    for (uint32_t i = 0; i < threads; ++i)
        if (!(r->scratch[i].places = fct_allocate_zero(env, live, 1)))
            return fct_fail_memory(env, "clustering");
    return FCT_OK;
}

/* Runs one round; *merges: the number of its merges. Errors: MEMORY. */
static fct_result run_round(fct_rounds *r, uint32_t *merges) {
    const fct_env *env = r->work->env;
    size_t count = r->now.count, chunks = fct_chunk_count(count, GRAIN);
    fct_parallel_for(env, count, GRAIN, fct_pair_first, r);
    fct_parallel_for(env, count, GRAIN, fct_pair_offer, r);
    fct_parallel_for(env, count, GRAIN, fct_pair_second, r);
    uint32_t live = sum_before(r->kept, chunks), room = sum_before(r->room, chunks);
    *merges = sum_before(r->merged, chunks);
    r->kept[chunks] = live;
    fct_result result = r->next.slots ? FCT_OK : allocate_next(r, live, room);
    if (result != FCT_OK) return result;
    fct_parallel_for(env, count, GRAIN, fct_merge_pairs, r);
    r->work->merge_count += *merges;
    fct_parallel_for(env, count, GRAIN, fct_join_lists, r);
    fct_generation old = r->now;
    r->now = r->next, r->next = old;
    r->now.count = live;
    ++r->round;
    r->fresh = false;
    r->unbound = !r->work->materials && r->start_height + r->round < FCT_FREE_HEIGHT;
    fct_parallel_for(env, count, GRAIN, fct_price_next, r);
    return FCT_OK;
}

static void number_faces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const fct_rounds *r = user;
    for (uint32_t s = (uint32_t)begin; s < end; ++s) {
        r->now.slots[s] = s;
        atomic_store_explicit(&r->best[s], FCT_NO_OFFER, memory_order_relaxed);
    }
}

/* The work's lists become the first generation. Errors: MEMORY. */
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

/* The work's edges become the first generation. Errors: MEMORY. */
static fct_result enter_edges(fct_rounds *r) {
    fct_work *work = r->work;
    fct_generation *now = &r->now;
    uint32_t live = 0, count = work->face_count - work->merge_count, place = 0;
    size_t room = 2 * (size_t)work->edge_count;
    if (room > UINT32_MAX) return fct_fail_memory(work->env, "clustering");
    fct_result result = allocate_generation(work->env, count, room, now);
    if (result != FCT_OK) return result;
    for (uint32_t s = 0; s < work->face_count; ++s)
        if (work->nodes[s] != FCT_NONE) {
            if (work->heights[s] > r->start_height) r->start_height = work->heights[s];
            atomic_store_explicit(&r->best[live], FCT_NO_OFFER, memory_order_relaxed);
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

/* The last generation becomes the work's edges. Errors: MEMORY. */
static fct_result leave_edges(fct_rounds *r) {
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

static fct_result run_rounds(fct_rounds *r) {
    fct_work *work = r->work;
    fct_result result = work->lists.neighbors ? enter_lists(r) : enter_edges(r);
    if (result != FCT_OK) return result;
    r->unbound = !work->materials && r->start_height < FCT_FREE_HEIGHT;
    fct_parallel_for(work->env, r->now.count, GRAIN, fct_price_first, r);
    for (uint32_t merges = UINT32_MAX; r->now.count > FEW && merges > r->now.count / LEAST_SHARE;) {
        result = fct_progress(work->env, "clusters", work->merge_count / (double)work->face_count);
        if (result == FCT_OK) result = run_round(r, &merges);
        if (result != FCT_OK) return result;
    }
    return leave_edges(r);
}

static fct_result allocate_rounds(fct_rounds *r, size_t live) {
    size_t chunks = fct_chunk_count(live, GRAIN);
    const fct_array arrays[] = {FCT_ARRAY(r->best, live),       FCT_ARRAY(r->second, live),
                                FCT_ARRAY(r->mates, live),      FCT_ARRAY(r->renumbered, r->work->face_count),
                                FCT_ARRAY(r->kept, chunks + 1), FCT_ARRAY(r->merged, chunks),
                                FCT_ARRAY(r->room, chunks)};
    return fct_allocate_all(r->work->env, arrays, FCT_LENGTH(arrays), "clustering");
}

static void release_rounds(fct_rounds *r) {
    const fct_env *env = r->work->env;
    release_generation(env, &r->now);
    release_generation(env, &r->next);
    for (uint32_t i = 0; r->scratch && i < fct_env_threads(env); ++i) fct_release(env, r->scratch[i].places);
    fct_release(env, r->scratch);
    fct_release(env, r->best);
    fct_release(env, r->second);
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
        work->entry_borders = work->borders = NULL; /* rounds keep borders in float only */
        fct_rounds r = {.work = work, .across = across, .alone = fct_env_threads(env) == 1};
        result = allocate_rounds(&r, live);
        if (result == FCT_OK) result = run_rounds(&r);
        release_rounds(&r);
    }
    return result == FCT_OK ? fct_work_greedy(work, across) : result;
}
