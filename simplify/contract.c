/* simplify/contract.c: see contract.h.
 *
 * 1. Compute the cost of every edge (in parallel). Contract most edges in sweeps over blocks (sweep.c), and
 *    queue the others by their cost.
 * 2. Pop the cheapest edge and compute its cost again. Quadrics only grow, so the queued cost is a lower
 *    bound: an edge whose cost has grown returns to the queue.
 * 3. Refuse edges that fail a check or cost more than max_error. They return when a contraction changes their
 *    surroundings.
 * 4. Contract (attempt.c), and merge edges that became twins (collapse.c).
 * Source: Garland 1999, section 3.9, with lazy re-evaluation.
 */
#include "simplify/contract.h"

#include "base/parallel.h"
#include "simplify/attempt.h"
#include "simplify/collapse.h"
#include "simplify/faces.h"
#include "simplify/log.h"
#include "simplify/pairs/release.h"
#include "simplify/sweep.h"

enum {
    EDGE_CHUNK = 4096,      /* edges per parallel task */
    PROGRESS_PERIOD = 4096, /* contractions between two calls of the progress hook */
};

/* Keeps an edge out of the queue until a contraction changes its surroundings. */
static void refuse_edge(fct_simplifier *s, uint32_t e, const uint32_t ends[2], uint8_t state) {
    s->edges[e].state = state;
    s->refused[ends[0]] = s->refused[ends[1]] = 1;
}

static void requeue_edge(fct_simplifier *s, uint32_t side) {
    uint32_t e = edge_root(s->edges, s->side_edges[side]);
    fct_edge *edge = &s->edges[e];
    if (edge->state != EDGE_REFUSED && edge->state != EDGE_OVER_BOUND) return;
    edge->state = EDGE_QUEUED;
    edge->ends_only = false;
    queue_push(s->queue, e, s->queue->current);
}

/* Returns the refused pairs of a point to the queue, and drops dead ones from its list. A block leaves pairs
 * with other blocks alone. */
static void requeue_pairs(fct_simplifier *s, uint32_t point) {
    uint32_t *link = &s->first_pairs[point], last = FCT_NONE;
    while (*link != FCT_NONE) {
        uint32_t entry = *link, e = s->first_pair + entry / 2;
        fct_edge *edge = &s->edges[e];
        uint32_t other = edge->ends[1 - entry % 2]; /* in a block: resolved when the sweep began */
        bool own = !s->blocks || s->blocks[other] == s->block;
        if (own && edge->state == EDGE_DEAD) {
            *link = s->next_pairs[entry];
            continue;
        }
        if (own && edge->state == EDGE_REFUSED) {
            edge->state = EDGE_QUEUED;
            edge->ends_only = false;
            queue_push(s->queue, e, s->queue->current);
        }
        last = entry;
        link = &s->next_pairs[entry];
    }
    s->last_pairs[point] = last;
}

/* Returns the refused edges of the faces of a ring to the queue. `refused` marks the points that may have
 * some. */
static void requeue_around(fct_simplifier *s, const uint32_t *ring, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) {
        if (corner_dead(s, ring[i])) continue;
        uint32_t f = ring[i] - ring[i] % 3;
        for (uint32_t k = 0; k < 3; ++k)
            if (s->refused[s->triangles[f + k]] && s->refused[s->triangles[f + (k + 1) % 3]])
                requeue_edge(s, f + k);
        for (uint32_t k = 0; k < 3 && s->next_pairs; ++k)
            if (s->refused[s->triangles[f + k]]) requeue_pairs(s, s->triangles[f + k]);
    }
}

/* Returns what was refused around the point that replaced a and b. */
static void requeue_rings(fct_simplifier *s, const fct_move *move) {
    s->refused[move->a] |= s->refused[move->b];
    if (!s->refused[move->a]) return;
    requeue_around(s, s->ring_a, move->count_a);
    requeue_around(s, s->ring_b, move->count_b);
}

/* Refuses an edge whose best position is not allowed, or tries it again at its ends. */
static void refuse_position(fct_simplifier *s, uint32_t e, const uint32_t ends[2]) {
    fct_edge *edge = &s->edges[e];
    if (edge->ends_only || s->def->placement > FCT_PLACE_SEGMENT)
        refuse_edge(s, e, ends, EDGE_REFUSED);
    else {
        edge->ends_only = true;
        queue_push(s->queue, e, s->queue->current);
    }
}

/* Contracts, requeues, refuses or drops the edge that the queue gave. True if it was contracted. */
static bool process_edge(fct_simplifier *s, uint32_t e) {
    uint32_t ends[2];
    for (int k = 0; k < 2; ++k) ends[k] = fct_sets_find(s->point_parents, s->edges[e].ends[k]);
    fct_attempt attempt;
    attempt.highest = s->queue->current;
    if (ends[0] == ends[1]) {
        fct_simplify_drop_edge(s, e);
        return false;
    }
    if (!fct_place(s, ends[0], ends[1], s->edges[e].ends_only, &attempt.candidate)) {
        refuse_edge(s, e, ends, EDGE_REFUSED);
        return false;
    }
    attempt.candidate.key *= paint_factor(s, ends[0], ends[1]);
    fct_outcome outcome = fct_attempt_judge(s, &attempt);
    if (outcome == OUTCOME_CONTRACTED)
        outcome =
            e >= s->first_pair ? fct_attempt_pair(s, ends, &attempt) : fct_attempt_edge(s, ends, &attempt);
    switch (outcome) {
    case OUTCOME_CONTRACTED:
        fct_simplify_drop_edge(s, e);
        requeue_rings(s, &attempt.move);
        return true;
    case OUTCOME_GONE:
        fct_simplify_drop_edge(s, e);
        break;
    case OUTCOME_ELSEWHERE:
        break;
    case OUTCOME_BAD_PLACE:
        refuse_position(s, e, ends);
        break;
    case OUTCOME_REFUSED:
        refuse_edge(s, e, ends, EDGE_REFUSED);
        break;
    case OUTCOME_GREW:
        queue_push(s->queue, e, queue_bucket(attempt.candidate.key));
        break;
    case OUTCOME_OVER_BOUND:
        refuse_edge(s, e, ends, EDGE_OVER_BOUND);
        break;
    }
    return false;
}

/* Edges [begin, end): the bucket of their first cost. */
static void find_first_buckets(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    fct_simplifier *s = user;
    for (size_t e = begin; e < end; ++e) {
        fct_candidate candidate;
        const uint32_t *ends = s->edges[e].ends;
        bool placed = fct_place(s, ends[0], ends[1], false, &candidate);
        double key = placed ? candidate.key * paint_factor(s, ends[0], ends[1]) : 0;
        s->edges[e].bucket = (uint16_t)queue_bucket(key);
    }
}

/* The loop of a block in a sweep. It ends while a body of four faces may still vanish. */
static void contract_block(fct_simplifier *s) {
    while (s->live_faces >= s->least_faces + 4 && s->wedge_room >= SIMPLIFY_MAX_WEDGES &&
           s->wall_room >= SIMPLIFY_HUB) {
        uint32_t e = queue_pop(s->queue);
        if (e == FCT_NONE) return;
        if (s->edges[e].state == EDGE_QUEUED) process_edge(s, e);
    }
}

/* Sweeps do not requeue pairs between two blocks. */
static void retry_pairs(fct_simplifier *s) {
    for (uint32_t e = s->first_pair; e < s->edge_count; ++e) {
        if (s->edges[e].state != EDGE_REFUSED) continue;
        s->edges[e].state = EDGE_QUEUED;
        s->edges[e].ends_only = false;
    }
}

static void fill_queue(fct_simplifier *s) {
    fct_simplify_reprice(s);
    queue_clear(s->queue, s->edges, QUEUE_BUCKETS - 1);
    for (uint32_t e = s->edge_count; e-- > 0;)
        if (s->edges[e].state == EDGE_QUEUED) queue_push(s->queue, e, s->edges[e].bucket);
}

fct_result fct_simplify_contract(fct_simplifier *s, fct_stop *stop) {
    uint32_t before = s->live_faces, contractions = 0;
    *stop = FCT_STOP_FACES;
    if (before <= s->def->target_faces) return FCT_OK;
    fct_result result = FCT_OK;
    if (!s->priced)
        result = fct_parallel_for_progress(s->env, "costs", s->edge_count, EDGE_CHUNK, find_first_buckets, s);
    if (result != FCT_OK) return result;
    s->priced = true;
    if (s->def->primitive == FCT_PRIMITIVE_FACE) result = fct_simplify_contract_faces(s);
    if (result != FCT_OK) return result;
    result = fct_simplify_sweep(s, contract_block);
    if (result != FCT_OK) return result;
    retry_pairs(s);
    fill_queue(s);
    while (s->live_faces > s->def->target_faces) {
        uint32_t e = queue_pop(s->queue);
        if (e == FCT_NONE) break;
        if (s->edges[e].state != EDGE_QUEUED) continue;
        if (s->released && s->queue->current > s->released_bucket) {
            fill_queue(s);
            continue;
        }
        if (s->log && (result = fct_log_reserve(s)) != FCT_OK) return result;
        if (!process_edge(s, e) || ++contractions % PROGRESS_PERIOD) continue;
        double goal = (double)before - s->def->target_faces;
        result = fct_progress(s->env, "contract", (before - s->live_faces) / goal);
        if (result != FCT_OK) return result;
    }
    if (s->live_faces <= s->def->target_faces) return FCT_OK;
    *stop = FCT_STOP_EXHAUSTED;
    for (uint32_t e = 0; e < s->edge_count; ++e)
        if (s->edges[e].state == EDGE_OVER_BOUND) *stop = FCT_STOP_ERROR;
    return FCT_OK;
}
