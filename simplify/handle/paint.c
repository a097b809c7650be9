/* simplify/handle/paint.c: weights that the caller paints (Garland 1999, section 7.4.2).
 *
 * Each point of the input keeps its own weight. The weight of a contraction is the largest one of all points
 * of the input that it joins, so it never falls from one contraction to the next, as the quadrics. It
 * multiplies the cost that orders the queue, and neither the position nor the error.
 */
#include "simplify/cost/placement.h"
#include "simplify/handle/history.h"
#include "simplify/handle/wish.h"
#include "simplify/output.h"
#include "simplify/topology/pinch.h"

/* Finds the places in the queue again of the edges whose factor has changed. before: the weights so far, or
 * NULL. */
static void price_edges(fct_simplifier *s, const float *before) {
    for (uint32_t e = 0; e < s->edge_count && s->priced; ++e) {
        fct_edge *edge = &s->edges[e];
        if (edge->state == EDGE_DEAD) continue;
        for (int k = 0; k < 2; ++k) edge->ends[k] = fct_sets_find(s->point_parents, edge->ends[k]);
        uint32_t a = edge->ends[0], b = edge->ends[1];
        double last = before ? fct_max(before[a], before[b]) : 1;
        fct_candidate candidate;
        if (a == b || paint_factor(s, a, b) == last) continue;
        bool placed = fct_place(s, a, b, edge->ends_only, &candidate);
        double key = placed ? candidate.key * paint_factor(s, a, b) : 0;
        edge->bucket = (uint16_t)queue_bucket(key);
    }
}

/* The largest weight of the points that were contracted to each point. */
static void gather_weights(fct_simplifier *s, const float *paint, float *weights) {
    memset(weights, 0, s->point_count * sizeof *weights);
    for (uint32_t p = 0; p < s->point_count; ++p) {
        float *weight = &weights[fct_sets_find(s->point_parents, p)];
        *weight = paint[p] > *weight ? paint[p] : *weight;
    }
}

fct_result fct_paint_points(fct_simplifier *s, const float *paint) {
    float *own = NULL, *weights = NULL, *before = s->weights;
    bool plain = true;
    for (uint32_t p = 0; p < s->point_count && paint; ++p) plain &= paint[p] == 1;
    const fct_array arrays[] = {FCT_ARRAY_IF(!plain, own, s->point_count),
                                FCT_ARRAY_IF(!plain, weights, s->point_count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "weights of points");
    if (result != FCT_OK) return result;
    if (!plain) {
        memcpy(own, paint, s->point_count * sizeof *own);
        gather_weights(s, own, weights);
    }
    fct_release(s->env, s->paint);
    s->paint = own, s->weights = weights;
    price_edges(s, before);
    fct_release(s->env, before);
    return FCT_OK;
}

static fct_result check_weights(const fct_simplifier *s, const float *weights, uint32_t count) {
    for (uint32_t v = 0; v < count; ++v)
        if (!is_paint(weights[v]))
            return fct_fail(s->env, FCT_ERROR_DATA, "the weight of vertex %u is %g, expected 1e-6 to 1e6", v,
                            (double)weights[v]);
    return FCT_OK;
}

/* Vertices at one point: the largest weight counts. */
static fct_result spread_input(const fct_simplifier *s, const float *weights, uint32_t count, float *paint) {
    const fct_sorted *sorted = &s->sorted;
    if (count != sorted_inputs(sorted))
        return fct_fail(s->env, FCT_ERROR_DATA, "%u weights, expected %u, one per vertex of the input", count,
                        sorted_inputs(sorted));
    memset(paint, 0, s->point_count * sizeof *paint);
    for (uint32_t v = 0; v < count; ++v) {
        uint32_t place = sorted->vertex_places[v], p = s->point_of[place], first,
                 end = fct_simplify_find_copies(sorted, place, &first);
        if (p != FCT_NONE && weights[v] > paint[p]) paint[p] = weights[v];
        for (; first < end; ++first) {
            p = s->point_of[count + first];
            if (weights[v] > paint[p]) paint[p] = weights[v];
        }
    }
    return FCT_OK;
}

/* A vertex of the current mesh passes its weight to all vertices that were contracted to it. Those of bodies
 * that are gone keep theirs. */
static fct_result spread_current(fct_simplifier *s, const float *weights, uint32_t count, float *paint) {
    float *found = fct_allocate(s->env, s->point_count, sizeof *found);
    if (!found) return fct_fail_memory(s->env, "weights of points");
    fct_result result = fct_simplify_spread(s, s->sorted.places, weights, count, found);
    for (uint32_t p = 0; p < s->point_count && result == FCT_OK; ++p) {
        float weight = found[fct_sets_find(s->point_parents, p)];
        paint[p] = weight > 0 ? weight : s->paint ? s->paint[p] : 1;
    }
    fct_release(s->env, found);
    return result;
}

fct_result fct_simplifier_paint(fct_simplifier *s, fct_paint_level level, const float *weights,
                                uint32_t count) {
    fct_result result = check_weights(s, weights, count);
    if (result != FCT_OK) return result;
    float *paint = fct_allocate(s->env, s->point_count, sizeof *paint);
    if (!paint) return fct_fail_memory(s->env, "weights of points");
    result = level == FCT_PAINT_INPUT ? spread_input(s, weights, count, paint)
                                      : spread_current(s, weights, count, paint);
    if (result == FCT_OK) result = fct_paint_points(s, paint);
    if (result == FCT_OK && s->history) s->history->broken = true;
    fct_release(s->env, paint);
    return result;
}
