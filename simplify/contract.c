/* simplify/contract.c: the loop that takes the cheapest edge and contracts it.
 *
 * Quadrics only grow, so the cost an edge was queued with is a lower bound: an edge is looked at again when
 * it comes up, and goes back if it has become dearer. Where two edges become one, one of them is dropped.
 * Refused edges return to the queue when a contraction changes their surroundings. A contraction is O(faces
 * around the smaller end) at a hub, a point of more than SIMPLIFY_HUB faces, and O(both rings) elsewhere.
 */
#include "base/parallel.h"
#include "simplify/cost/loss.h"
#include "simplify/cost/placement.h"

/* Cosine of the largest angle by which a face may turn in one contraction. */
#define MIN_TURN_COSINE .1

static void drop_edge(fct_simplifier *s, uint32_t e) {
    s->edges[e].state = EDGE_DEAD;
}

/* Puts an edge aside until something changes around it. */
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
    queue_push(&s->queue, e, s->queue.current);
}

uint32_t fct_simplify_gather(fct_simplifier *s, uint32_t point, uint32_t *ring) {
    uint32_t count = 0, last = FCT_NONE;
    for (uint32_t c = s->first_corners[point]; c != FCT_NONE; c = s->next_corners[c]) {
        if (corner_dead(s, c)) continue;
        if (last == FCT_NONE)
            s->first_corners[point] = c;
        else
            s->next_corners[last] = c;
        last = c;
        ring[count++] = c;
    }
    if (last == FCT_NONE)
        s->first_corners[point] = FCT_NONE;
    else
        s->next_corners[last] = FCT_NONE;
    s->last_corners[point] = last;
    return count;
}

bool fct_simplify_folds_over(const fct_simplifier *s, const uint32_t *ring, uint32_t count, uint32_t other,
                             v3 from, v3 at) {
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t x = s->triangles[corner_next(ring[i])], y = s->triangles[corner_previous(ring[i])];
        if (x == other || y == other) continue;
        v3 px = point_position(s, x), side = v3_sub(point_position(s, y), px);
        v3 before = v3_cross(v3_sub(px, from), side), after = v3_cross(v3_sub(px, at), side);
        double before2 = v3_norm2(before), dot = v3_dot(before, after);
        if (before2 == 0) continue;
        if (!(dot > 0 && dot * dot > MIN_TURN_COSINE * MIN_TURN_COSINE * before2 * v3_norm2(after)))
            return true;
    }
    return false;
}

/* Takes a wedge without faces out of its point's list; what it knows of the position stays with another. */
static void retire_wedge(fct_simplifier *s, uint32_t point, uint32_t wedge) {
    uint32_t keep = FCT_NONE, *link = &s->first_wedges[point];
    for (uint32_t w = *link; w != FCT_NONE; w = s->next_wedges[w])
        if (w != wedge && (keep == FCT_NONE || s->wedge_uses[w] > s->wedge_uses[keep])) keep = w;
    if (keep == FCT_NONE) return;
    while (*link != wedge) link = &s->next_wedges[*link];
    *link = s->next_wedges[wedge];
    const double *q = s->quadrics + (size_t)s->quadric_size * wedge;
    double *to = s->quadrics + (size_t)s->quadric_size * keep;
    fct_elimination e;
    fct_quadric_eliminate(q, s->steering, s->attributes + (size_t)s->channel_count * wedge,
                          1e-12 * quadric_trace(q), &e);
    for (int k = 0; k < POSITION_QUADRIC; ++k) to[k] += e.position[k];
}

static void drop_corner(fct_simplifier *s, uint32_t c) {
    --s->valences[s->triangles[c]];
    if (s->corner_wedges) --s->wedge_uses[corner_wedge(s, c)];
}

/* The sides from the face's apex to the two ends of the contracted edge become one edge. */
static void join_twins(fct_simplifier *s, uint32_t side_a, uint32_t side_b) {
    uint32_t ea = edge_root(s->edges, s->side_edges[side_a]);
    uint32_t eb = edge_root(s->edges, s->side_edges[side_b]);
    if (ea == eb) return;
    const fct_edge *a = &s->edges[ea], *b = &s->edges[eb];
    bool queued_a = a->state == EDGE_QUEUED, queued_b = b->state == EDGE_QUEUED;
    bool keep_b = queued_b && (!queued_a || b->bucket > a->bucket);
    uint32_t keep = keep_b ? eb : ea, drop = keep_b ? ea : eb;
    drop_edge(s, drop);
    s->edges[drop].parent = keep;
}

/* Face of corner c at b, which also has a corner at a. */
static void remove_face(fct_simplifier *s, uint32_t c, uint32_t a) {
    uint32_t next = corner_next(c), previous = corner_previous(c);
    if (s->triangles[next] == a)
        join_twins(s, next, previous);
    else
        join_twins(s, next, c);
    uint32_t apex = s->triangles[next] == a ? previous : next;
    uint32_t point = s->triangles[apex];
    for (int k = 0; k < 3; ++k) drop_corner(s, c - c % 3 + (uint32_t)k);
    if (s->corner_wedges && s->wedge_uses[corner_wedge(s, apex)] == 0)
        retire_wedge(s, point, corner_wedge(s, apex));
    s->triangles[c - c % 3] = FCT_NONE;
    --s->live_faces;
}

/* Makes each group one wedge of point a. */
static void merge_wedges(fct_simplifier *s, const fct_groups *g, const fct_candidate *candidate, uint32_t a,
                         v3 first, v3 second) {
    double values[SIMPLIFY_MAX_WEDGES][SIMPLIFY_MAX_CHANNELS];
    for (uint32_t i = 0; i < g->group_count; ++i)
        fct_place_attributes(s, g, i, candidate, first, second, values[i]);
    s->first_wedges[a] = FCT_NONE;
    for (uint32_t i = g->group_count; i-- > 0;) {
        uint32_t keep = FCT_NONE;
        for (uint32_t k = 0; k < g->wedge_count; ++k) {
            uint32_t w = g->wedges[k];
            if (g->group_of[k] != i) continue;
            if (keep == FCT_NONE) {
                keep = w;
                continue;
            }
            double *to = s->quadrics + (size_t)s->quadric_size * keep;
            const double *from = s->quadrics + (size_t)s->quadric_size * w;
            for (uint32_t j = 0; j < s->quadric_size; ++j) to[j] += from[j];
            s->wedge_parents[w] = keep;
            s->wedge_uses[keep] += s->wedge_uses[w];
            uint32_t class_keep = fct_sets_find(s->class_parents, s->wedge_classes[keep]);
            s->class_parents[fct_sets_find(s->class_parents, s->wedge_classes[w])] = class_keep;
        }
        memcpy(s->attributes + (size_t)s->channel_count * keep, values[i], s->channel_count * sizeof(double));
        s->next_wedges[keep] = s->first_wedges[a];
        s->first_wedges[a] = keep;
    }
    for (uint32_t w = s->first_wedges[a], next; w != FCT_NONE; w = next) {
        next = s->next_wedges[w];
        if (s->wedge_uses[w] == 0) retire_wedge(s, a, w);
    }
}

/* Moves what b has to a; ring_b holds b's corners. */
static void contract_into(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_b) {
    uint32_t first = FCT_NONE, last = FCT_NONE;
    for (uint32_t i = 0; i < count_b; ++i) {
        uint32_t c = s->ring_b[i];
        if (s->triangles[corner_next(c)] == a || s->triangles[corner_previous(c)] == a) {
            remove_face(s, c, a);
            continue;
        }
        s->triangles[c] = a;
        if (first == FCT_NONE)
            first = c;
        else
            s->next_corners[last] = c;
        last = c;
        ++s->valences[a];
        --s->valences[b];
    }
    s->first_corners[b] = s->last_corners[b] = FCT_NONE;
    s->point_parents[b] = a;
    if (first == FCT_NONE) return;
    s->next_corners[last] = FCT_NONE;
    if (s->first_corners[a] == FCT_NONE)
        s->first_corners[a] = first;
    else
        s->next_corners[s->last_corners[a]] = first;
    s->last_corners[a] = last;
}

static void apply(fct_simplifier *s, uint32_t ends[2], const fct_candidate *candidate, uint32_t keep,
                  uint32_t count_b) {
    uint32_t a = ends[keep], b = ends[1 - keep];
    fct_groups g;
    v3 first = point_position(s, ends[0]), second = point_position(s, ends[1]);
    if (s->corner_wedges) fct_groups_find(s, ends[0], ends[1], &g);
    uint32_t source = candidate->end < 2 ? s->sources[ends[candidate->end]] : FCT_NONE;
    contract_into(s, a, b, count_b);
    s->sources[a] = source;
    if (s->corner_wedges)
        merge_wedges(s, &g, candidate, a, first, second);
    else {
        double *to = s->quadrics + (size_t)POSITION_QUADRIC * a;
        const double *from = s->quadrics + (size_t)POSITION_QUADRIC * b;
        for (int k = 0; k < POSITION_QUADRIC; ++k) to[k] += from[k];
    }
    double *at = s->positions + 3 * (size_t)a;
    at[0] = candidate->at.x, at[1] = candidate->at.y, at[2] = candidate->at.z;
}

static double *first_quadric(const fct_simplifier *s, uint32_t point) {
    uint32_t w = s->first_wedges ? s->first_wedges[point] : point;
    return s->quadrics + (size_t)s->quadric_size * w;
}

/* Edges of the faces around a point that were put aside come back; `refused` tells where there may be any. */
static void requeue_around(fct_simplifier *s, const uint32_t *ring, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) {
        if (corner_dead(s, ring[i])) continue;
        uint32_t f = ring[i] - ring[i] % 3;
        for (uint32_t k = 0; k < 3; ++k)
            if (s->refused[s->triangles[f + k]] && s->refused[s->triangles[f + (k + 1) % 3]])
                requeue_edge(s, f + k);
    }
}

/* Whether moving b into a, for good or bad, keeps faces from turning over, and topology where asked. */
static bool allowed(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b, v3 at) {
    if (s->def->keep_topology && !fct_simplify_link_holds(s, a, b, count_a, count_b)) return false;
    return !s->def->check_foldover ||
           !(fct_simplify_folds_over(s, s->ring_a, count_a, b, point_position(s, a), at) ||
             fct_simplify_folds_over(s, s->ring_b, count_b, a, point_position(s, b), at));
}

/* Whether a candidate that costs more than was thought can still be taken now; if not, it is put back. */
static bool still_cheapest(fct_simplifier *s, uint32_t e, const uint32_t ends[2],
                           const fct_candidate *candidate) {
    uint32_t bucket = queue_bucket(candidate->key);
    if (bucket > s->queue.current) {
        queue_push(&s->queue, e, bucket);
        return false;
    }
    double bound = s->def->max_error / s->extent;
    if (candidate->error > 0 && candidate->error > bound * bound * candidate->area) {
        refuse_edge(s, e, ends, EDGE_OVER_BOUND);
        return false;
    }
    return true;
}

/* Gathers both rings (b's alone where a is a hub) and contracts if that is allowed. */
static bool try_contraction(fct_simplifier *s, uint32_t e, uint32_t ends[2], fct_candidate *candidate) {
    fct_edge *edge = &s->edges[e];
    uint32_t keep = s->valences[ends[1]] > s->valences[ends[0]];
    uint32_t a = ends[keep], b = ends[1 - keep];
    bool hub = s->valences[a] > SIMPLIFY_HUB, two_hubs = s->valences[b] > SIMPLIFY_HUB;
    uint32_t count_a = hub ? 0 : fct_simplify_gather(s, a, s->ring_a);
    uint32_t count_b = fct_simplify_gather(s, b, s->ring_b), shared = 0;
    for (uint32_t i = 0; i < count_b; ++i)
        shared +=
            s->triangles[corner_next(s->ring_b[i])] == a || s->triangles[corner_previous(s->ring_b[i])] == a;
    bool fine = shared > 0 && allowed(s, a, b, count_a, count_b, candidate->at);
    if (!fine) {
        /* An edge without faces is none any more; two hubs are looked at once only, for the time it takes. */
        if (shared == 0 || two_hubs)
            drop_edge(s, e);
        else if (hub || edge->ends_only || s->def->placement > FCT_PLACE_SEGMENT)
            refuse_edge(s, e, ends, EDGE_REFUSED);
        else {
            edge->ends_only = true;
            queue_push(&s->queue, e, s->queue.current);
        }
        return false;
    }
    fct_loss loss;
    double cost = hub ? 0 : fct_simplify_loss(s, a, b, count_a, count_b, candidate, &loss);
    if (cost > 0) {
        candidate->error += cost, candidate->key += cost;
        if (!still_cheapest(s, e, ends, candidate)) return false;
    }
    drop_edge(s, e);
    apply(s, ends, candidate, keep, count_b);
    if (cost > 0) fct_simplify_remember(&loss, first_quadric(s, a));
    s->refused[a] |= s->refused[b];
    if (s->refused[a]) {
        requeue_around(s, s->ring_a, count_a);
        requeue_around(s, s->ring_b, count_b);
    }
    return true;
}

/* Looks at the edge that came up: contracts it, sends it back, refuses or drops it. True when contracted. */
static bool process_edge(fct_simplifier *s, uint32_t e) {
    uint32_t ends[2];
    for (int k = 0; k < 2; ++k) ends[k] = fct_sets_find(s->point_parents, s->edges[e].ends[k]);
    if (ends[0] == ends[1]) {
        drop_edge(s, e);
        return false;
    }
    fct_candidate candidate;
    if (!fct_place(s, ends[0], ends[1], s->edges[e].ends_only, &candidate)) {
        refuse_edge(s, e, ends, EDGE_REFUSED);
        return false;
    }
    if (!still_cheapest(s, e, ends, &candidate)) return false;
    if (!try_contraction(s, e, ends, &candidate)) return false;
    if (candidate.error > 0) s->max_error2 = fmax(s->max_error2, candidate.error / candidate.area);
    return true;
}

static void first_buckets(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    fct_simplifier *s = user;
    for (size_t e = begin; e < end; ++e) {
        fct_candidate candidate;
        bool placed = fct_place(s, s->edges[e].ends[0], s->edges[e].ends[1], false, &candidate);
        s->edges[e].bucket = (uint16_t)(placed ? queue_bucket(candidate.key) : 0);
    }
}

fct_result fct_simplify_contract(fct_simplifier *s, fct_stop *stop) {
    uint32_t before = s->live_faces, contractions = 0;
    *stop = FCT_STOP_FACES;
    if (before <= s->def->target_faces) return FCT_OK;
    fct_result result = fct_parallel_for_progress(s->env, "costs", s->edge_count, 4096, first_buckets, s);
    if (result != FCT_OK) return result;
    queue_clear(&s->queue, s->edges);
    for (uint32_t e = s->edge_count; e-- > 0;) queue_push(&s->queue, e, s->edges[e].bucket);
    while (s->live_faces > s->def->target_faces) {
        uint32_t e = queue_pop(&s->queue);
        if (e == FCT_NONE) break;
        if (s->edges[e].state != EDGE_QUEUED) continue;
        if (!process_edge(s, e) || ++contractions % 4096) continue;
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
