/* simplify/attempt.c: see attempt.h. Cost of a contraction: O(corners of both rings); at a hub only
 * O(corners of the smaller ring).
 */
#include "simplify/attempt.h"

#include "simplify/collapse.h"
#include "simplify/cost/constraint.h"
#include "simplify/cost/loss.h"
#include "simplify/pairs/join.h"
#include "simplify/topology/link.h"
#include "simplify/topology/ring.h"

fct_outcome fct_attempt_judge(const fct_simplifier *s, const fct_attempt *attempt) {
    const fct_candidate *candidate = &attempt->candidate;
    if (queue_bucket(candidate->key) > attempt->highest) return OUTCOME_GREW;
    double bound = s->def->max_error / s->extent;
    bool over = candidate->distance2 > 0 && candidate->distance2 > bound * bound * candidate->area;
    return over ? OUTCOME_OVER_BOUND : OUTCOME_CONTRACTED;
}

static void note_error(fct_simplifier *s, const fct_candidate *candidate) {
    if (candidate->distance2 > 0)
        s->max_error2 = fct_max(s->max_error2, candidate->distance2 / candidate->area);
}

/* The end that stays is the larger one. */
static uint32_t find_kept_end(const fct_simplifier *s, const uint32_t ends[2]) {
    return point_at(s, ends[1])->valence > point_at(s, ends[0])->valence;
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

fct_outcome fct_attempt_edge(fct_simplifier *s, const uint32_t ends[2], fct_attempt *attempt) {
    fct_candidate *candidate = &attempt->candidate;
    uint32_t keep = find_kept_end(s, ends), a = ends[keep], b = ends[1 - keep];
    bool hub = point_at(s, a)->valence > SIMPLIFY_HUB, two_hubs = point_at(s, b)->valence > SIMPLIFY_HUB,
         body;
    if (two_hubs || fct_simplify_find_side(s, point_at(s, b)->first_corner, a) == FCT_NONE)
        return OUTCOME_GONE;
    uint32_t count_a = hub ? 0 : fct_simplify_gather(s, a, s->ring_a);
    uint32_t count_b = fct_simplify_gather(s, b, s->ring_b);
    if (s->blocks && (hub || !is_in_block(s, s->ring_a, count_a) || !is_in_block(s, s->ring_b, count_b)))
        return OUTCOME_ELSEWHERE;
    attempt->move = (fct_move){a, b, count_a, count_b, candidate->at};
    if (!check_contraction(s, &attempt->move, &body)) return hub ? OUTCOME_REFUSED : OUTCOME_BAD_PLACE;
    fct_loss loss;
    double cost = body ? fct_loss_measure_body(s, b, count_b, candidate, &loss)
                  : hub || fct_simplify_is_level(s)
                      ? 0
                      : fct_loss_measure(s, a, b, count_a, count_b, candidate, &loss);
    if (cost > 0) {
        candidate->error += cost, candidate->distance2 += cost;
        candidate->key += cost * paint_factor(s, a, b);
        fct_outcome outcome = fct_attempt_judge(s, attempt);
        if (outcome != OUTCOME_CONTRACTED) return outcome;
    }
    fct_walls walls;
    walls.count = 0;
    if (s->next_pairs && !body && !hub && !find_edge_walls(s, &attempt->move, &walls))
        return OUTCOME_BAD_PLACE;
    if (s->blocks && s->live_faces < s->least_faces + 4 + fct_simplify_count_walls(&walls))
        return OUTCOME_ELSEWHERE;
    fct_simplify_collapse(s, ends, candidate, keep, count_b);
    if (body) fct_simplify_remove_faces(s, a);
    if (walls.count > 0) fct_simplify_remove_walls(s, &walls);
    if (cost > 0) fct_loss_add(&loss, point_at(s, a)->quadric);
    if (cost > 0 && s->steering) fct_loss_add(&loss, wedge_quadric(s, s->first_wedges[a]));
    note_error(s, candidate);
    return OUTCOME_CONTRACTED;
}

/* Whether the ends of a pair are still apart, have faces, and are neither hubs nor locked. */
static bool is_pair(const fct_simplifier *s, uint32_t a, uint32_t b) {
    uint32_t most = point_at(s, a)->valence, least = point_at(s, b)->valence;
    return least > 0 && most <= SIMPLIFY_HUB && !point_is_locked(s, a) && !point_is_locked(s, b) &&
           fct_simplify_find_side(s, point_at(s, b)->first_corner, a) == FCT_NONE;
}

fct_outcome fct_attempt_pair(fct_simplifier *s, const uint32_t ends[2], fct_attempt *attempt) {
    uint32_t keep = find_kept_end(s, ends), a = ends[keep], b = ends[1 - keep];
    if (!is_pair(s, a, b)) return OUTCOME_GONE;
    uint32_t count_a = fct_simplify_gather(s, a, s->ring_a), count_b = fct_simplify_gather(s, b, s->ring_b);
    if (s->blocks && (!is_in_block(s, s->ring_a, count_a) || !is_in_block(s, s->ring_b, count_b)))
        return OUTCOME_ELSEWHERE;
    attempt->move = (fct_move){a, b, count_a, count_b, attempt->candidate.at};
    fct_walls walls;
    if (!fct_simplify_joins_well(s, &attempt->move) || !fct_simplify_find_walls(s, &attempt->move, &walls))
        return OUTCOME_BAD_PLACE;
    if (s->blocks && s->live_faces < s->least_faces + fct_simplify_count_walls(&walls))
        return OUTCOME_ELSEWHERE;
    fct_simplify_collapse(s, ends, &attempt->candidate, keep, count_b);
    fct_simplify_join_classes(s, a);
    fct_simplify_remove_walls(s, &walls);
    ++s->pairs_joined;
    note_error(s, &attempt->candidate);
    return OUTCOME_CONTRACTED;
}
