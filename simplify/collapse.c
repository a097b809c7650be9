/* simplify/collapse.c: see collapse.h. Cost: linear in the corners of the end that vanishes, plus O(wedges^2)
 * with at most 64 wedges. */
#include "simplify/collapse.h"

#include "simplify/classes.h"
#include "simplify/cost/constraint.h"
#include "simplify/log.h"
#include "simplify/pairs/list.h"

/* The ridge of a retired wedge's attributes, relative to the trace: it only keeps the pivots above 0. */
#define RETIRED_RIDGE 1e-12

void fct_simplify_drop_edge(fct_simplifier *s, uint32_t e) {
    s->edges[e].state = EDGE_DEAD;
}

static void add_quadric(double *to, const double *from, uint32_t size) {
    for (uint32_t i = 0; i < size; ++i) to[i] += from[i];
}

/* Removes a wedge without faces from its point's list. Its quadric, with the attributes eliminated, goes to
 * the wedge of the point that most corners use. The last wedge of a point stays. */
static void retire_wedge(fct_simplifier *s, uint32_t point, uint32_t wedge) {
    uint32_t keep = FCT_NONE, *link = &s->first_wedges[point];
    for (uint32_t w = *link; w != FCT_NONE; w = s->next_wedges[w])
        if (w != wedge && (keep == FCT_NONE || s->wedge_uses[w] > s->wedge_uses[keep])) keep = w;
    if (keep == FCT_NONE) return;
    while (*link != wedge) link = &s->next_wedges[*link];
    *link = s->next_wedges[wedge];
    if (!s->steering) return;
    const double *q = wedge_quadric(s, wedge);
    double *to = wedge_quadric(s, keep);
    fct_elimination e;
    fct_quadric_eliminate(q, s->steering, s->attributes + (size_t)s->channel_count * wedge,
                          RETIRED_RIDGE * quadric_trace(q), &e);
    for (int k = 0; k < POSITION_QUADRIC; ++k) to[k] += e.position[k];
}

static void count_corner_out(fct_simplifier *s, uint32_t c) {
    --point_at(s, s->triangles[c])->valence;
    if (s->corner_wedges) --s->wedge_uses[corner_wedge(s, c)];
}

/* Two sides of a removed face become one edge: those from its apex to both ends. Of two queued edges the one
 * with the higher bucket stays: costs only grow, so that bound is tighter. */
static void join_twins(fct_simplifier *s, uint32_t side_a, uint32_t side_b) {
    uint32_t ea = edge_root(s->edges, s->side_edges[side_a]);
    uint32_t eb = edge_root(s->edges, s->side_edges[side_b]);
    if (ea == eb) return;
    const fct_edge *a = &s->edges[ea], *b = &s->edges[eb];
    bool queued_a = a->state == EDGE_QUEUED, queued_b = b->state == EDGE_QUEUED;
    bool keep_b = queued_b && (!queued_a || b->bucket > a->bucket);
    uint32_t keep = keep_b ? eb : ea, drop = keep_b ? ea : eb;
    fct_simplify_drop_edge(s, drop);
    s->edges[drop].parent = keep;
}

/* Removes the face of corner c, which lies at b; the face also has a corner at a. */
static void remove_face(fct_simplifier *s, uint32_t c, uint32_t a) {
    uint32_t next = corner_next(c), previous = corner_previous(c);
    if (s->triangles[next] == a)
        join_twins(s, next, previous);
    else
        join_twins(s, next, c);
    uint32_t apex = s->triangles[next] == a ? previous : next;
    uint32_t point = s->triangles[apex];
    for (int k = 0; k < 3; ++k) count_corner_out(s, c - c % 3 + (uint32_t)k);
    if (s->corner_wedges && s->wedge_uses[corner_wedge(s, apex)] == 0)
        retire_wedge(s, point, corner_wedge(s, apex));
    s->triangles[c - c % 3] = FCT_NONE;
    --s->live_faces;
}

/* Makes each group one wedge of point a, with the summed quadric and the best attributes. first, second: the
 * ends' positions before the contraction. */
static void merge_wedges(fct_simplifier *s, const fct_groups *g, const fct_candidate *candidate, uint32_t a,
                         v3 first, v3 second) {
    double values[SIMPLIFY_MAX_WEDGES][SIMPLIFY_MAX_CHANNELS];
    uint32_t classes[SIMPLIFY_MAX_WEDGES];
    s->wedge_room -= g->group_count;
    for (uint32_t i = 0; i < g->group_count; ++i)
        fct_place_attributes(s, g, i, candidate, first, second, values[i]);
    fct_classes_find(s, g, classes);
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
            if (s->steering) add_quadric(wedge_quadric(s, keep), wedge_quadric(s, w), s->quadric_size);
            s->wedge_parents[w] = keep;
            s->wedge_uses[keep] += s->wedge_uses[w];
        }
        s->wedge_classes[keep] = classes[i];
        memcpy(s->attributes + (size_t)s->channel_count * keep, values[i], s->channel_count * sizeof(double));
        s->next_wedges[keep] = s->first_wedges[a];
        s->first_wedges[a] = keep;
    }
    for (uint32_t w = s->first_wedges[a], next; w != FCT_NONE; w = next) {
        next = s->next_wedges[w];
        if (s->wedge_uses[w] == 0) retire_wedge(s, a, w);
    }
    fct_classes_unify(s, a);
}

/* Removes the faces between a and b and moves the other corners of b to a. ring_b holds the corners of b. */
static void move_corners(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_b) {
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
        ++point_at(s, a)->valence;
        --point_at(s, b)->valence;
    }
    point_at(s, b)->first_corner = point_at(s, b)->last_corner = FCT_NONE;
    s->point_parents[b] = a;
    if (first == FCT_NONE) return;
    s->next_corners[last] = FCT_NONE;
    if (point_at(s, a)->first_corner == FCT_NONE)
        point_at(s, a)->first_corner = first;
    else
        s->next_corners[point_at(s, a)->last_corner] = first;
    point_at(s, a)->last_corner = last;
}

void fct_simplify_remove_face(fct_simplifier *s, uint32_t f) {
    for (uint32_t c = 3 * f; c < 3 * f + 3; ++c) {
        count_corner_out(s, c);
        if (s->corner_wedges && s->wedge_uses[corner_wedge(s, c)] == 0)
            retire_wedge(s, s->triangles[c], corner_wedge(s, c));
    }
    s->triangles[3 * f] = FCT_NONE;
    --s->live_faces;
}

void fct_simplify_remove_faces(fct_simplifier *s, uint32_t point) {
    if (s->log) s->log->records[s->log->count - 1].body = true;
    for (uint32_t c = point_at(s, point)->first_corner; c != FCT_NONE; c = s->next_corners[c]) {
        if (corner_dead(s, c)) continue;
        for (uint32_t k = 0; k < 3; ++k) count_corner_out(s, c - c % 3 + k);
        s->triangles[c - c % 3] = FCT_NONE;
        --s->live_faces;
    }
}

void fct_simplify_collapse(fct_simplifier *s, const uint32_t ends[2], const fct_candidate *candidate,
                           uint32_t keep, uint32_t count_b) {
    uint32_t a = ends[keep], b = ends[1 - keep];
    fct_groups g;
    v3 first = point_position(s, ends[0]), second = point_position(s, ends[1]);
    if (s->corner_wedges) fct_groups_find(s, ends[0], ends[1], &g);
    if (s->log) fct_log_begin(s, a, b, count_b);
    uint32_t source = candidate->end < 2 ? point_at(s, ends[candidate->end])->source : FCT_NONE;
    move_corners(s, a, b, count_b);
    point_at(s, a)->source = source;
    if (s->corner_wedges) merge_wedges(s, &g, candidate, a, first, second);
    add_quadric(point_at(s, a)->quadric, point_at(s, b)->quadric, POSITION_QUADRIC);
    fct_constraint_merge(s, a, b);
    if (s->pins) add_quadric(s->pins[a], s->pins[b], POSITION_QUADRIC);
    if (s->weights && s->weights[b] > s->weights[a]) s->weights[a] = s->weights[b];
    if (s->next_pairs) fct_simplify_join_pairs(s, a, b);
    point_at(s, a)->at = candidate->at;
    if (s->log) fct_log_end(s, fct_candidate_error(candidate));
}
