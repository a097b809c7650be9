/* simplify/sweep.c: see sweep.h. Each sweep:
 *
 * 1. Count the queued edges per bucket. Take the cheapest, as many as faces have to go. A contraction takes
 *    two faces and three edges, so about two thirds of these faces go.
 * 2. Cut the points that are left into blocks of equal size, and give each block the edges inside it.
 * 3. Contract in all blocks.
 * Cost of a sweep: linear in points and edges, plus the contractions. Source of the idea: Garland 1999,
 * section 9.2 (many contractions per round).
 */
#include "simplify/sweep.h"

#include "base/parallel.h"
#include "simplify/log.h"
#include "simplify/pairs/release.h"

enum {
    BLOCK_POINTS = 4096,
    LEAST_EDGES = 8192,             /* of a sweep */
    LEAST_SHARE = 32,               /* sweeps go on while they contract this part of their edges */
    MOST_WEDGES = 8 * BLOCK_POINTS, /* a block stops when it has written so many, so that a log has room */
    MOST_WALLS = BLOCK_POINTS,      /* likewise, inner walls that vanish */
};

typedef struct sweep {
    fct_simplifier *s;
    fct_block_body *body;
    uint32_t limit; /* the highest bucket */
    uint32_t block_count;
    uint32_t *edges, edge_count; /* the edges that are not dead yet */
    uint32_t *blocks;            /* per point that is left: its block */
    uint32_t *chosen, *owners;   /* edges of the sweep, and their blocks */
    uint32_t *ordered;           /* the chosen edges, block after block */
    uint32_t *starts;            /* per block: the place of its first edge; then the number of edges */
    fct_simplifier *results;     /* per block: the copy that worked on it */
    fct_log *logs;               /* per block; NULL without a log */
} sweep;

/* Drops dead edges from the list, and returns the highest bucket up to which at most `most` edges are queued;
 * *count is their number. With 0 edges the result has no meaning. */
static uint32_t find_limit(sweep *w, uint32_t most, uint32_t *count) {
    const fct_edge *edges = w->s->edges;
    uint32_t counts[QUEUE_BUCKETS] = {0}, kept = 0;
    for (uint32_t i = 0; i < w->edge_count; ++i) {
        const fct_edge *e = &edges[w->edges[i]];
        if (e->state == EDGE_DEAD) continue;
        w->edges[kept++] = w->edges[i];
        counts[e->bucket] += e->state == EDGE_QUEUED;
    }
    w->edge_count = kept;
    uint32_t sum = 0, bucket = 0;
    while (bucket < QUEUE_BUCKETS && sum + counts[bucket] <= most) sum += counts[bucket++];
    *count = sum;
    return bucket - 1;
}

/* Blocks of equal numbers of points. The first one has `first` points. */
static void cut_blocks(sweep *w, uint32_t first) {
    const fct_simplifier *s = w->s;
    uint32_t block = 0, room = first;
    for (uint32_t p = 0; p < s->point_count; ++p) {
        if (s->point_parents[p] != p) continue;
        if (room-- == 0) ++block, room = BLOCK_POINTS - 1;
        w->blocks[p] = block;
    }
    w->block_count = block + 1;
}

/* A block asks for the blocks of its pairs, also of those that are not chosen. */
static void resolve_pairs(fct_simplifier *s) {
    for (uint32_t e = s->first_pair; e < s->edge_count; ++e)
        for (int k = 0; k < 2; ++k)
            s->edges[e].ends[k] = fct_sets_find(s->point_parents, s->edges[e].ends[k]);
}

/* Lists the queued edges up to the limit by their blocks. Edges between blocks are left out. */
static void choose_edges(sweep *w) {
    fct_simplifier *s = w->s;
    uint32_t count = 0;
    resolve_pairs(s);
    memset(w->starts, 0, ((size_t)w->block_count + 1) * sizeof *w->starts);
    for (uint32_t i = 0; i < w->edge_count; ++i) {
        fct_edge *e = &s->edges[w->edges[i]];
        if (e->state != EDGE_QUEUED || e->bucket > w->limit) continue;
        for (int k = 0; k < 2; ++k) e->ends[k] = fct_sets_find(s->point_parents, e->ends[k]);
        uint32_t block = w->blocks[e->ends[0]];
        if (block != w->blocks[e->ends[1]]) continue;
        w->chosen[count] = w->edges[i], w->owners[count++] = block;
        ++w->starts[block + 1];
    }
    for (uint32_t b = 0; b < w->block_count; ++b) w->starts[b + 1] += w->starts[b];
    for (uint32_t i = 0; i < count; ++i) w->ordered[w->starts[w->owners[i]]++] = w->chosen[i];
    for (uint32_t b = w->block_count; b > 0; --b) w->starts[b] = w->starts[b - 1];
    w->starts[0] = 0;
}

static void run_blocks(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk;
    sweep *w = user;
    for (size_t b = begin; b < end; ++b) {
        fct_simplifier *s = &w->results[b];
        *s = *w->s;
        use_scratch(s, w->s->scratches + thread);
        s->blocks = w->blocks, s->block = (uint32_t)b;
        s->wedge_room = MOST_WEDGES;
        s->wall_room = MOST_WALLS;
        if (w->logs) s->log = &w->logs[b];
        queue_clear(s->queue, s->edges, w->limit);
        for (uint32_t i = w->starts[b + 1]; i-- > w->starts[b];)
            queue_push(s->queue, w->ordered[i], s->edges[w->ordered[i]].bucket);
        uint32_t own = w->starts[b + 1] - w->starts[b];
        double share = own > 0 ? (double)own / w->starts[w->block_count] : 0;
        s->least_faces = s->live_faces - (uint32_t)(share * (s->live_faces - s->def->target_faces));
        w->body(s);
    }
}

/* Runs one sweep, with blocks that begin at another point than those of the sweep before. *contracted: the
 * number of pairs, and of edges if each took two faces. */
static fct_result run_sweep(sweep *w, uint32_t number, uint32_t *contracted) {
    fct_simplifier *s = w->s;
    cut_blocks(w, number % 2 ? BLOCK_POINTS / 2 : BLOCK_POINTS);
    choose_edges(w);
    w->results = fct_allocate(s->env, w->block_count, sizeof *w->results);
    if (!w->results) return fct_fail_memory(s->env, "blocks of points");
    fct_result result = fct_log_split(s, w->block_count, BLOCK_POINTS + (s->next_pairs ? MOST_WALLS : 0),
                                      MOST_WEDGES, &w->logs);
    if (result != FCT_OK) goto done;
    fct_parallel_for(s->env, w->block_count, 1, run_blocks, w);
    uint32_t before = s->live_faces, joined = s->pairs_joined, side_epoch = s->side_epoch,
             link_epoch = s->link_epoch;
    for (uint32_t b = 0; b < w->block_count; ++b) {
        const fct_simplifier *r = &w->results[b];
        s->live_faces -= before - r->live_faces;
        s->max_error2 = fct_max(s->max_error2, r->max_error2);
        s->pairs_joined += r->pairs_joined - joined;
        if (r->released && (!s->released || r->released_bucket > s->released_bucket))
            s->released_bucket = r->released_bucket;
        s->released |= r->released;
        if (r->side_epoch > side_epoch) side_epoch = r->side_epoch;
        if (r->link_epoch > link_epoch) link_epoch = r->link_epoch;
    }
    s->side_epoch = side_epoch, s->link_epoch = link_epoch;
    *contracted = (before - s->live_faces) / 2 + s->pairs_joined - joined;
    result = fct_log_join(s, w->logs, w->block_count);
done:
    fct_release(s->env, w->results);
    return result;
}

static fct_result run_sweeps(sweep *w) {
    fct_simplifier *s = w->s;
    uint32_t before = s->live_faces, target = s->def->target_faces;
    for (uint32_t e = 0; e < s->edge_count; ++e) w->edges[e] = e;
    w->edge_count = s->edge_count;
    for (uint32_t number = 0;; ++number) {
        uint32_t count, contracted = 0;
        if (s->live_faces < target + LEAST_EDGES) return FCT_OK;
        fct_simplify_reprice(s);
        w->limit = find_limit(w, s->live_faces - target, &count);
        if (count < LEAST_EDGES) return FCT_OK;
        fct_result result = run_sweep(w, number, &contracted);
        if (result == FCT_OK)
            result = fct_progress(s->env, "contract", (double)(before - s->live_faces) / (before - target));
        if (result != FCT_OK || contracted < count / LEAST_SHARE) return result;
    }
}

fct_result fct_simplify_sweep(fct_simplifier *s, fct_block_body *body) {
    sweep w = {.s = s, .body = body};
    size_t most = s->edge_count;
    const fct_array arrays[] = {
        FCT_ARRAY(w.edges, most),   FCT_ARRAY(w.blocks, s->point_count),
        FCT_ARRAY(w.chosen, most),  FCT_ARRAY(w.owners, most),
        FCT_ARRAY(w.ordered, most), FCT_ARRAY(w.starts, s->point_count / BLOCK_POINTS + 3)};
    if (s->live_faces < s->def->target_faces + LEAST_EDGES) return FCT_OK;
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "the blocks of a sweep");
    if (result != FCT_OK) return result;
    result = run_sweeps(&w);
    fct_release_all(s->env, arrays, FCT_LENGTH(arrays));
    return result;
}
