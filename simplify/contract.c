/* simplify/contract.c: see contract.h.
 *
 * 1. Compute the cost of every edge (in parallel). Contract most edges in sweeps over blocks (sweep.c), and
 *    queue the others by their cost.
 * 2. Pop the cheapest edge and compute its cost again. Quadrics only grow, so the queued cost is a lower
 *    bound: an edge whose cost has grown returns to the queue.
 * 3. Refuse edges that fail a check or cost more than max_error. They return when a contraction changes their
 *    surroundings.
 * 4. Contract, and merge edges that became twins.
 * Cost of a contraction: O(corners of both rings); at a hub only O(corners of the smaller ring).
 * Source: Garland 1999, section 3.9, with lazy re-evaluation.
 */
#include "simplify/contract.h"

#include "base/parallel.h"
#include "simplify/collapse.h"
#include "simplify/cost/constraint.h"
#include "simplify/cost/loss.h"
#include "simplify/log.h"
#include "simplify/pairs/join.h"
#include "simplify/pairs/release.h"
#include "simplify/sweep.h"
#include "simplify/topology/link.h"
#include "simplify/topology/remain.h"
#include "simplify/topology/ring.h"

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

/* Whether the contraction leaves good faces and, if the caller asked, keeps the topology. *body: the edge
 * belongs to a body of four faces, and all of them vanish. */
static bool check_contraction(fct_simplifier *s, const fct_move *move, bool *body) {
    *body = s->def->check_foldover && !s->def->keep_topology && fct_simplify_is_tetrahedron(s, move);
    if (!fct_constraint_keeps_locked(s, move->a, move->b, move->count_b, *body)) return false;
    if (*body) return true;
    if (s->def->keep_topology && !fct_simplify_link_holds(s, move->a, move->b, move->count_a, move->count_b))
        return false;
    return fct_simplify_remains_good(s, move);
}

/* Whether the edge may be contracted now. If its cost has grown beyond the current bucket, the edge returns
 * to the queue; if its error exceeds max_error, the edge is refused. */
static bool confirm_cost(fct_simplifier *s, uint32_t e, const uint32_t ends[2],
                         const fct_candidate *candidate) {
    uint32_t bucket = queue_bucket(candidate->key);
    if (bucket > s->queue->current) {
        queue_push(s->queue, e, bucket);
        return false;
    }
    double bound = s->def->max_error / s->extent;
    if (candidate->distance2 > 0 && candidate->distance2 > bound * bound * candidate->area) {
        refuse_edge(s, e, ends, EDGE_OVER_BOUND);
        return false;
    }
    return true;
}

/* Whether all points of a ring belong to the block of this sweep. */
static bool is_in_block(const fct_simplifier *s, const uint32_t *ring, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i)
        if (s->blocks[s->triangles[corner_next(ring[i])]] != s->block ||
            s->blocks[s->triangles[corner_previous(ring[i])]] != s->block)
            return false;
    return true;
}

/* The inner walls that the contraction of an edge closes, between faces at the two ends that stay. */
static bool find_edge_walls(fct_simplifier *s, const fct_move *move, fct_walls *walls) {
    fct_move rest = *move;
    rest.count_a = 0;
    while (rest.count_a < s->remaining_count && s->triangles[s->remaining[rest.count_a].corner] == move->a)
        ++rest.count_a;
    return fct_simplify_find_walls(s, &rest, walls);
}

/* Contracts the edge if the checks and the loss allow it. Gathers both rings, or only that of the smaller end
 * if the larger one is a hub. An edge of two hubs is dropped, and so is one without faces. */
static bool try_contraction(fct_simplifier *s, uint32_t e, uint32_t ends[2], fct_candidate *candidate) {
    uint32_t keep = point_at(s, ends[1])->valence > point_at(s, ends[0])->valence;
    uint32_t a = ends[keep], b = ends[1 - keep];
    bool hub = point_at(s, a)->valence > SIMPLIFY_HUB, two_hubs = point_at(s, b)->valence > SIMPLIFY_HUB,
         body;
    if (two_hubs || fct_simplify_find_side(s, point_at(s, b)->first_corner, a) == FCT_NONE) {
        fct_simplify_drop_edge(s, e);
        return false;
    }
    uint32_t count_a = hub ? 0 : fct_simplify_gather(s, a, s->ring_a);
    uint32_t count_b = fct_simplify_gather(s, b, s->ring_b);
    if (s->blocks && (hub || !is_in_block(s, s->ring_a, count_a) || !is_in_block(s, s->ring_b, count_b)))
        return false;
    const fct_move move = {a, b, count_a, count_b, candidate->at};
    if (!check_contraction(s, &move, &body)) {
        if (hub)
            refuse_edge(s, e, ends, EDGE_REFUSED);
        else
            refuse_position(s, e, ends);
        return false;
    }
    fct_loss loss;
    double cost = body ? fct_loss_measure_body(s, b, count_b, candidate, &loss)
                  : hub || fct_simplify_is_level(s)
                      ? 0
                      : fct_loss_measure(s, a, b, count_a, count_b, candidate, &loss);
    if (cost > 0) {
        candidate->error += cost, candidate->distance2 += cost;
        candidate->key += cost * paint_factor(s, a, b);
        if (!confirm_cost(s, e, ends, candidate)) return false;
    }
    fct_walls walls;
    walls.count = 0;
    if (s->next_pairs && !body && !hub && !find_edge_walls(s, &move, &walls)) {
        refuse_position(s, e, ends);
        return false;
    }
    if (s->blocks && s->live_faces < s->least_faces + 4 + fct_simplify_count_walls(&walls)) return false;
    fct_simplify_drop_edge(s, e);
    fct_simplify_collapse(s, ends, candidate, keep, count_b);
    if (body) fct_simplify_remove_faces(s, a);
    if (walls.count > 0) fct_simplify_remove_walls(s, &walls);
    if (cost > 0) fct_loss_add(&loss, point_at(s, a)->quadric);
    if (cost > 0 && s->steering) fct_loss_add(&loss, wedge_quadric(s, s->first_wedges[a]));
    requeue_rings(s, &move);
    return true;
}

/* Whether the ends of a pair are still apart, have faces, and are neither hubs nor locked. */
static bool is_pair(const fct_simplifier *s, uint32_t a, uint32_t b) {
    uint32_t most = point_at(s, a)->valence, least = point_at(s, b)->valence;
    return least > 0 && most <= SIMPLIFY_HUB && !point_is_locked(s, a) && !point_is_locked(s, b) &&
           fct_simplify_find_side(s, point_at(s, b)->first_corner, a) == FCT_NONE;
}

/* Contracts the pair if the checks allow it. */
static bool try_pair(fct_simplifier *s, uint32_t e, uint32_t ends[2], fct_candidate *candidate) {
    uint32_t keep = point_at(s, ends[1])->valence > point_at(s, ends[0])->valence;
    uint32_t a = ends[keep], b = ends[1 - keep];
    if (!is_pair(s, a, b)) {
        fct_simplify_drop_edge(s, e);
        return false;
    }
    uint32_t count_a = fct_simplify_gather(s, a, s->ring_a), count_b = fct_simplify_gather(s, b, s->ring_b);
    if (s->blocks && (!is_in_block(s, s->ring_a, count_a) || !is_in_block(s, s->ring_b, count_b)))
        return false;
    const fct_move move = {a, b, count_a, count_b, candidate->at};
    fct_walls walls;
    if (!fct_simplify_joins_well(s, &move) || !fct_simplify_find_walls(s, &move, &walls)) {
        refuse_position(s, e, ends);
        return false;
    }
    if (s->blocks && s->live_faces < s->least_faces + fct_simplify_count_walls(&walls)) return false;
    fct_simplify_drop_edge(s, e);
    fct_simplify_collapse(s, ends, candidate, keep, count_b);
    fct_simplify_join_classes(s, a);
    fct_simplify_remove_walls(s, &walls);
    ++s->pairs_joined;
    requeue_rings(s, &move);
    return true;
}

/* Contracts, requeues, refuses or drops the edge that the queue gave. True if it was contracted. */
static bool process_edge(fct_simplifier *s, uint32_t e) {
    uint32_t ends[2];
    for (int k = 0; k < 2; ++k) ends[k] = fct_sets_find(s->point_parents, s->edges[e].ends[k]);
    if (ends[0] == ends[1]) {
        fct_simplify_drop_edge(s, e);
        return false;
    }
    fct_candidate candidate;
    if (!fct_place(s, ends[0], ends[1], s->edges[e].ends_only, &candidate)) {
        refuse_edge(s, e, ends, EDGE_REFUSED);
        return false;
    }
    candidate.key *= paint_factor(s, ends[0], ends[1]);
    if (!confirm_cost(s, e, ends, &candidate)) return false;
    if (e >= s->first_pair ? !try_pair(s, e, ends, &candidate) : !try_contraction(s, e, ends, &candidate))
        return false;
    if (candidate.distance2 > 0) s->max_error2 = fct_max(s->max_error2, candidate.distance2 / candidate.area);
    return true;
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
