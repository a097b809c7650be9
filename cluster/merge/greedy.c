/* cluster/merge/greedy.c: the dissertation's loop: contract the cheapest dual edge until none is left
 * (section 8.2).
 *
 * Each cluster has a singly linked list of its edges. A merge walks the lists of both clusters once, unites
 * edges that now lead to the same neighbour, and prices the edges of the union. An edge whose union would be
 * too tall waits outside the heap until one of its ends changes. So an edge is priced at most once per level
 * of the tree: O(F log^2 F) on every input, whatever the valence.
 *
 * Ties go to the smaller log2 of the union's faces, then to a hash of the edge's index, then to the lower
 * index, because a flat grid would become chains by index alone. Indices are the order of the list of edges,
 * first those that meet the lower cluster. The key of a MEAN cost is the double without its low 20 bits.
 */
#include "cluster/merge/greedy.h"

#include <string.h>

#include "base/heap.h"
#include "base/key.h"
#include "base/parallel.h"
#include "base/sort.h"

/* Low bits of the key of a MEAN cost, which log2 of the faces (5) and the hash (15) take. The cost keeps 32
 * bits of its mantissa, so that costs whose only difference is rounding are a tie. */
#define TIE_BITS ((1ull << 20) - 1)

typedef struct greedy {
    fct_work *work;
    fct_edge *edges;
    float *costs;
    double *mean_costs; /* MEAN only */
    uint32_t (
        *next)[2];   /* per edge and end: the next link of the list of that end; a link is 2 * edge + end */
    uint32_t *heads; /* per slot: first link */
    uint32_t *seen;  /* per slot: the edge of the list being walked that leads to it, or FCT_NONE */
    fct_heap heap;
    bool across;
    uint32_t waiting, batch[FCT_LANES]; /* edges to be priced in one call */
} greedy;

/* Orders as the doubles do; -0 below +0. */
static uint64_t double_key(double value) {
    union {
        double d;
        uint64_t u;
    } bits = {value};
    return bits.u >> 63 ? ~bits.u : bits.u | 1ull << 63;
}

static uint64_t edge_key(const greedy *g, uint32_t e) {
    const fct_edge *edge = &g->edges[e];
    uint32_t faces = g->work->records[edge->a].count + g->work->records[edge->b].count;
    uint64_t size = 31 - (uint32_t)__builtin_clz(faces), hash = (uint32_t)(e * 2654435769u) >> 5;
    uint64_t cost = fct_float_key(g->costs[e]);
    if (g->work->balanced) return (uint64_t)faces << 32 | cost;
    if (g->mean_costs) return (double_key(g->mean_costs[e]) & ~TIE_BITS) | size << 15 | hash >> 12;
    return cost << 32 | size << 27 | hash;
}

static bool must_wait(const greedy *g, const fct_edge *edge) {
    const uint32_t *materials = g->work->materials;
    if (!g->across && materials && materials[edge->a] != materials[edge->b]) return true;
    return !fct_work_allowed(g->work, edge->a, edge->b);
}

static void price_mean(greedy *g, uint32_t e) {
    const fct_mean_record *means = g->work->means;
    g->mean_costs[e] =
        fct_mean_cost(&g->work->metric, &means[g->edges[e].a], &means[g->edges[e].b], g->work->borders[e]);
    g->costs[e] = (float)g->mean_costs[e];
}

static void price_batch(greedy *g) {
    fct_pair pairs[FCT_LANES];
    float costs[FCT_LANES];
    for (uint32_t i = 0; i < g->waiting; ++i) pairs[i] = g->edges[g->batch[i]];
    if (g->mean_costs)
        for (uint32_t i = 0; i < g->waiting; ++i) price_mean(g, g->batch[i]);
    else if (g->waiting)
        fct_work_costs(g->work, pairs, g->waiting, costs);
    for (uint32_t i = 0; i < g->waiting; ++i) {
        if (!g->mean_costs) g->costs[g->batch[i]] = costs[i];
        fct_heap_set(&g->heap, g->batch[i], edge_key(g, g->batch[i]));
    }
    g->waiting = 0;
}

static void price_later(greedy *g, uint32_t e) {
    if (must_wait(g, &g->edges[e])) {
        fct_heap_remove(&g->heap, e);
        return;
    }
    g->batch[g->waiting++] = e;
    if (g->waiting == FCT_LANES) price_batch(g);
}

static void price_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    greedy *g = user;
    for (size_t e = begin; e < end && g->mean_costs; ++e) price_mean(g, (uint32_t)e);
    if (!g->mean_costs) fct_work_costs(g->work, g->edges + begin, (uint32_t)(end - begin), g->costs + begin);
}

static void link_edges(greedy *g) {
    memset(g->heads, 0xFF, (size_t)g->work->face_count * sizeof *g->heads);
    memset(g->seen, 0xFF, (size_t)g->work->face_count * sizeof *g->seen);
    for (uint32_t e = g->work->edge_count; e-- > 0;) {
        uint32_t ends[2] = {g->edges[e].a, g->edges[e].b};
        for (uint32_t i = 0; i < 2; ++i) {
            g->next[e][i] = g->heads[ends[i]];
            g->heads[ends[i]] = 2 * e + i;
        }
    }
}

/* Appends the list at `link`, that of slot `from`, to the new list of a, whose last link is *tail. Drops dead
 * edges and those between a and b, and unites edges to the same neighbour. Returns the new tail. */
static uint32_t *keep_links(greedy *g, uint32_t link, uint32_t from, uint32_t a, uint32_t b, uint32_t *tail) {
    while (link != FCT_NONE) {
        uint32_t e = link / 2, end = link & 1, after = g->next[e][end];
        fct_edge *edge = &g->edges[e];
        uint32_t other = end ? edge->a : edge->b;
        if (edge->a == FCT_NONE) {
            link = after;
            continue;
        }
        if (other == a || other == b) {
            fct_heap_remove(&g->heap, e);
            edge->a = FCT_NONE;
        } else if (g->seen[other] != FCT_NONE) {
            g->edges[g->seen[other]].shared += edge->shared;
            if (g->mean_costs) g->work->borders[g->seen[other]] += g->work->borders[e];
            fct_heap_remove(&g->heap, e);
            edge->a = FCT_NONE;
        } else {
            g->seen[other] = e;
            if (from == b) *(end ? &edge->b : &edge->a) = a;
            *tail = link;
            tail = &g->next[e][end];
        }
        link = after;
    }
    return tail;
}

static void contract_edge(greedy *g, uint32_t e) {
    uint32_t a = g->edges[e].a, b = g->edges[e].b;
    double shared = g->mean_costs ? g->work->borders[e] : (double)g->edges[e].shared;
    fct_work_merge(g->work, a, b, shared, g->costs[e]);
    uint32_t first = g->heads[a], second = g->heads[b], *tail = &g->heads[a];
    tail = keep_links(g, first, a, a, b, tail);
    tail = keep_links(g, second, b, a, b, tail);
    *tail = FCT_NONE;
    for (uint32_t link = g->heads[a]; link != FCT_NONE; link = g->next[link / 2][link & 1]) {
        const fct_edge *edge = &g->edges[link / 2];
        g->seen[link & 1 ? edge->a : edge->b] = FCT_NONE;
        price_later(g, link / 2);
    }
    price_batch(g);
}

static fct_result run_greedy(greedy *g) {
    fct_work *work = g->work;
    fct_parallel_for(work->env, work->edge_count, 1 << 13, price_chunk, g);
    for (uint32_t e = 0; e < work->edge_count; ++e)
        if (!must_wait(g, &g->edges[e])) fct_heap_append(&g->heap, e, edge_key(g, e));
    fct_heap_order(&g->heap);
    for (uint32_t step = 0;; ++step) {
        if (step % 8192 == 0) {
            fct_result result =
                fct_progress(work->env, "clusters", work->merge_count / (double)work->face_count);
            if (result != FCT_OK) return result;
        }
        uint32_t e = fct_heap_pop(&g->heap);
        if (e == FCT_NONE) break;
        uint32_t a = g->edges[e].a, b = g->edges[e].b;
        if (work->frozen && (work->frozen[a] || work->frozen[b]))
            work->frozen[a] = work->frozen[b] =
                1; /* the cheapest partner of a frozen cluster waits too, so that it stays cheapest */
        else
            contract_edge(g, e);
    }
    uint32_t kept = 0;
    for (uint32_t e = 0; e < work->edge_count; ++e)
        if (g->edges[e].a != FCT_NONE) {
            if (g->mean_costs) work->borders[kept] = work->borders[e];
            g->edges[kept++] = g->edges[e];
        }
    work->edge_count = kept;
    return FCT_OK;
}

/* MEAN only: makes the borders in double from those of the edges, unless they exist. Errors: MEMORY. */
static fct_result widen_borders(fct_work *work) {
    if (!work->means || work->borders) return FCT_OK;
    work->borders = fct_allocate(work->env, work->edge_count, sizeof *work->borders);
    if (!work->borders) return fct_fail_memory(work->env, "clustering");
    for (uint32_t e = 0; e < work->edge_count; ++e) work->borders[e] = (double)work->edges[e].shared;
    return FCT_OK;
}

fct_result fct_work_greedy(fct_work *work, bool across) {
    const fct_env *env = work->env;
    fct_result result = fct_work_list_edges(work);
    if (result == FCT_OK) result = widen_borders(work);
    if (result != FCT_OK || work->edge_count == 0) return result;
    if (work->edge_count >= UINT32_MAX / 2) return fct_fail_memory(env, "so many dual edges");
    greedy g = {.work = work, .edges = work->edges, .across = across};
    const fct_array arrays[] = {FCT_ARRAY(g.costs, work->edge_count),
                                FCT_ARRAY_IF(work->means, g.mean_costs, work->edge_count),
                                FCT_ARRAY(g.next, work->edge_count), FCT_ARRAY(g.heads, work->face_count),
                                FCT_ARRAY(g.seen, work->face_count)};
    result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "clustering");
    if (result == FCT_OK) result = fct_heap_create(env, work->edge_count, &g.heap);
    if (result == FCT_OK) {
        link_edges(&g);
        result = run_greedy(&g);
    }
    fct_heap_release(env, &g.heap);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}
