/* simplify/faces.c: see faces.h.
 *
 *         o-----o               o-----o             A face a-b-c is contracted by two of its edges: first the
 *        / \   / \             /  \   |             cheapest that the checks allow, then the one to the third
 *       o---a-c---o    --->   o----ab-c    --->     corner. Quadrics add up, so the second contraction finds
 *        \ / b \ /             \  /   |             the best position for all three corners. If the checks
 *         o-----o               o-----o             refuse it, the first one stays.
 *
 * 1. Compute the cost of every face (in parallel), and queue the faces by it.
 * 2. Pop the cheapest face and compute its cost again. A face whose cost has grown returns to the queue.
 * 3. Refuse a face if no edge of it can be contracted. It returns when a contraction changes its
 *    surroundings.
 */
#include "simplify/faces.h"

#include "base/parallel.h"
#include "simplify/attempt.h"
#include "simplify/cost/face.h"
#include "simplify/log.h"

enum {
    FACE_CHUNK = 4096,      /* faces per parallel task */
    PROGRESS_PERIOD = 4096, /* faces between two calls of the progress hook */
    /* The second contraction may cost up to twice as much as the bucket of its face, because the cost of a
     * face leaves lost points out (cost/loss.h). */
    MOST_GROWTH = 8,
    /* Of a neighbour with more faces, only those around the new point return to the queue. */
    MOST_RETURNS = 64,
};

typedef struct faces {
    fct_simplifier *s;
    fct_edge *items; /* per face; only next, bucket and state are used */
    /* The second contraction of a face that has begun: the point of the first one (FCT_NONE: there is no such
     * face), the third corner, and the highest bucket. */
    uint32_t kept, third, highest;
} faces;

static bool is_dead(const fct_simplifier *s, size_t f) {
    return s->triangles[3 * f] == FCT_NONE;
}

static void find_first_buckets(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    faces *k = user;
    fct_face_price price;
    for (size_t f = begin; f < end; ++f) {
        bool dead = is_dead(k->s, f);
        bool placed = !dead && fct_price_face(k->s, k->s->triangles + 3 * f, &price);
        k->items[f].bucket = (uint16_t)queue_bucket(placed ? price.key : 0);
        k->items[f].state = dead ? EDGE_DEAD : EDGE_QUEUED;
    }
}

/* Returns the refused faces at a point to the queue, if the point has at most `most` faces. */
static void requeue_point(faces *k, uint32_t point, uint32_t most) {
    fct_simplifier *s = k->s;
    if (point_at(s, point)->valence > most) return;
    for (uint32_t c = point_at(s, point)->first_corner; c != FCT_NONE; c = s->next_corners[c]) {
        fct_edge *item = &k->items[c / 3];
        if (item->state != EDGE_REFUSED || corner_dead(s, c)) continue;
        item->state = EDGE_QUEUED;
        queue_push(s->queue, c / 3, s->queue->current);
    }
}

/* The same at the neighbours of the point that replaced an edge. */
static void requeue_ring(faces *k, const uint32_t *ring, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) {
        if (corner_dead(k->s, ring[i])) continue;
        requeue_point(k, k->s->triangles[corner_next(ring[i])], MOST_RETURNS);
        requeue_point(k, k->s->triangles[corner_previous(ring[i])], MOST_RETURNS);
    }
}

/* Contracts an edge at its best place or, if the checks refuse that, at its ends or its middle. */
static fct_outcome try_edge(faces *k, const uint32_t ends[2], fct_attempt *attempt) {
    fct_simplifier *s = k->s;
    double factor = paint_factor(s, ends[0], ends[1]);
    fct_outcome outcome = OUTCOME_REFUSED;
    for (int ends_only = 0; ends_only < (s->def->placement > FCT_PLACE_SEGMENT ? 1 : 2); ++ends_only) {
        if (!fct_place(s, ends[0], ends[1], ends_only, &attempt->candidate)) return OUTCOME_REFUSED;
        attempt->candidate.key *= factor;
        outcome = fct_attempt_judge(s, attempt);
        if (outcome == OUTCOME_CONTRACTED) outcome = fct_attempt_edge(s, ends, attempt);
        if (outcome != OUTCOME_BAD_PLACE) break;
    }
    if (outcome != OUTCOME_CONTRACTED) return outcome;
    requeue_ring(k, s->ring_a, attempt->move.count_a);
    requeue_ring(k, s->ring_b, attempt->move.count_b);
    requeue_point(k, attempt->move.a, SIMPLIFY_HUB);
    return outcome;
}

/* The first contraction of the face that the queue gave. If none is possible now, the face gets a new place
 * in the queue, or is refused. */
static void begin_face(faces *k, uint32_t f) {
    fct_simplifier *s = k->s;
    fct_edge *item = &k->items[f];
    if (item->state != EDGE_QUEUED || is_dead(s, f)) return;
    uint32_t points[3];
    memcpy(points, s->triangles + 3 * (size_t)f, sizeof points);
    fct_face_price price;
    item->state = EDGE_REFUSED;
    if (!fct_price_face(s, points, &price)) return;
    uint32_t bucket = queue_bucket(price.key), least = QUEUE_BUCKETS;
    if (bucket > s->queue->current) least = bucket;
    for (uint32_t i = 0; i < 3 && bucket <= s->queue->current; ++i) {
        uint32_t side = price.order[i];
        const uint32_t ends[2] = {points[side], points[(side + 1) % 3]};
        fct_attempt attempt = {.highest = s->queue->current};
        fct_outcome outcome = try_edge(k, ends, &attempt);
        if (outcome == OUTCOME_CONTRACTED) {
            item->state = EDGE_DEAD;
            k->kept = attempt.move.a, k->third = points[(side + 2) % 3];
            k->highest = s->queue->current + MOST_GROWTH;
            return;
        }
        uint32_t grown = queue_bucket(attempt.candidate.key);
        if (outcome == OUTCOME_GREW && grown < least) least = grown;
    }
    if (least == QUEUE_BUCKETS) return;
    item->state = EDGE_QUEUED;
    queue_push(s->queue, f, least);
}

static void end_face(faces *k) {
    const uint32_t ends[2] = {k->kept, k->third};
    k->kept = FCT_NONE;
    if (point_at(k->s, ends[0])->valence == 0 || point_at(k->s, ends[1])->valence == 0) return;
    fct_attempt attempt = {.highest = k->highest};
    try_edge(k, ends, &attempt);
}

static fct_result contract_all(faces *k) {
    fct_simplifier *s = k->s;
    uint32_t before = s->live_faces, target = s->def->target_faces, count = 0;
    while (s->live_faces > target) {
        fct_result result = s->log ? fct_log_reserve(s) : FCT_OK;
        if (result != FCT_OK) return result;
        if (k->kept != FCT_NONE) {
            end_face(k);
            continue;
        }
        uint32_t f = queue_pop(s->queue);
        if (f == FCT_NONE) return FCT_OK;
        begin_face(k, f);
        if (++count % PROGRESS_PERIOD) continue;
        result = fct_progress(s->env, "contract faces", (double)(before - s->live_faces) / (before - target));
        if (result != FCT_OK) return result;
    }
    return FCT_OK;
}

/* What refused an edge may have changed. */
static void return_edges(fct_simplifier *s) {
    for (uint32_t e = 0; e < s->edge_count; ++e) {
        fct_edge *edge = &s->edges[e];
        if (edge->state != EDGE_REFUSED && edge->state != EDGE_OVER_BOUND) continue;
        edge->state = EDGE_QUEUED;
        edge->ends_only = false;
    }
}

fct_result fct_simplify_contract_faces(fct_simplifier *s) {
    uint32_t count = s->mesh->face_count, before = s->live_faces;
    faces k = {.s = s, .kept = FCT_NONE};
    k.items = fct_allocate_zero(s->env, count, sizeof *k.items);
    if (!k.items) return fct_fail_memory(s->env, "a queue of faces");
    fct_result result = FCT_OK;
    /* After contractions, the search for the wedge of a corner shortens paths, which threads must not. */
    if (s->live_faces == s->face_count)
        result = fct_parallel_for_progress(s->env, "costs", count, FACE_CHUNK, find_first_buckets, &k);
    else
        find_first_buckets(&k, 0, count, 0, 0);
    if (result == FCT_OK) {
        queue_clear(s->queue, k.items, QUEUE_BUCKETS - 1);
        for (uint32_t f = count; f-- > 0;)
            if (k.items[f].state == EDGE_QUEUED) queue_push(s->queue, f, k.items[f].bucket);
        result = contract_all(&k);
    }
    fct_release(s->env, k.items);
    if (s->live_faces < before) return_edges(s);
    return result;
}
