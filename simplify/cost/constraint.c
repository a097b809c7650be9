/* simplify/cost/constraint.c: see constraint.h.
 *
 * 1. The strength of an edge: 1 at open boundaries and at borders between materials or face colours; at
 *    seams, where both sides have different attributes, the squared difference.
 *    Contours that the caller marks have their weight.
 * 2. Each face at a held edge adds a plane to both ends: through the edge, perpendicular to the face,
 *    weighted by the strength and the length of the edge.
 * 3. lines.c finds the straight parts of the held curves.
 * 4. Locks replace the other rules of a point.
 * Faces without area add nothing. Cost: linear in the corners.
 */
#include "simplify/cost/constraint.h"

#include "simplify/cost/groups.h"
#include "simplify/cost/lines.h"

/* Squared difference of two wedges' attributes, at most 1. Each channel is divided by its unit. */
static double squared_gap(const fct_simplifier *s, uint32_t w, uint32_t u) {
    if (w == u) return 0;
    double sum = 0;
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        const fct_channel *channel = &s->channels[i];
        double d =
            s->attributes[(size_t)s->channel_count * w + i] - s->attributes[(size_t)s->channel_count * u + i];
        if (channel->unit > 0) sum += d * d / (channel->unit * channel->unit);
    }
    return sum < 1 ? sum : 1;
}

/* The strength of each edge, in [0, 1]. first_sides: scratch, one per edge. */
static void find_strengths(const fct_simplifier *s, float *strength, uint32_t *first_sides) {
    for (uint32_t e = 0; e < s->edge_count; ++e) strength[e] = s->edge_flags[e] ? 1 : 0;
    if (!s->corner_wedges) return;
    memset(first_sides, 0xff, s->edge_count * sizeof *first_sides);
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; ++c) {
        if (corner_dead(s, c)) continue;
        uint32_t e = s->side_edges[c], d = first_sides[e];
        if (d == FCT_NONE) {
            first_sides[e] = c;
            continue;
        }
        uint32_t here = s->corner_wedges[c], there = s->corner_wedges[corner_next(c)];
        bool same_way = s->triangles[c] == s->triangles[d];
        uint32_t from = s->corner_wedges[d], to = s->corner_wedges[corner_next(d)];
        double gap =
            fct_max(squared_gap(s, here, same_way ? from : to), squared_gap(s, there, same_way ? to : from));
        if (gap > strength[e]) strength[e] = (float)gap;
    }
}

/* Contours of the caller hold like boundaries, times their weight. The rings are those of the input. */
static void add_contours(const fct_simplifier *s, float *strength) {
    for (size_t i = 0; i < s->mark_count; ++i) {
        const fct_mark *mark = &s->marks[i];
        uint32_t a = mark->points[0], b = mark->points[1];
        if (b == FCT_NONE) continue;
        for (uint32_t c = point_at(s, a)->first_corner; c != FCT_NONE; c = s->next_corners[c]) {
            uint32_t next = corner_next(c), previous = corner_previous(c);
            uint32_t side = s->triangles[next] == b ? c : s->triangles[previous] == b ? previous : FCT_NONE;
            if (side == FCT_NONE) continue;
            float *held = &strength[s->side_edges[side]];
            *held = mark->weight > *held ? (float)mark->weight : *held;
        }
    }
}

static bool edge_is_locked(const fct_simplifier *s, uint32_t e) {
    return s->def->lock_border && s->edge_flags[e] & EDGE_BOUNDARY;
}

static bool vertex_is_locked(const fct_simplifier *s, uint32_t v) {
    return s->def->locks && s->def->locks[v] && s->point_of[v] != FCT_NONE;
}

static void number_point(fct_simplifier *s, uint32_t point) {
    if (s->constraint_of[point] == FCT_NONE) s->constraint_of[point] = s->constraint_count++;
}

/* Numbers the points at held edges and those that are locked. */
static void number_held_points(fct_simplifier *s, const float *strength) {
    memset(s->constraint_of, 0xff, s->point_count * sizeof *s->constraint_of);
    for (uint32_t e = 0; e < s->edge_count; ++e)
        for (int k = 0; k < 2 && (strength[e] > 0 || edge_is_locked(s, e)); ++k)
            number_point(s, s->edges[e].ends[k]);
    for (uint32_t v = 0; v < s->mesh->vertex_count; ++v)
        if (vertex_is_locked(s, v)) number_point(s, s->point_of[v]);
}

static void lock_points(fct_simplifier *s) {
    for (uint32_t e = 0; e < s->edge_count; ++e)
        for (int k = 0; k < 2 && edge_is_locked(s, e); ++k)
            s->constraints[s->constraint_of[s->edges[e].ends[k]]].hold = HOLD_LOCK;
    for (uint32_t v = 0; v < s->mesh->vertex_count; ++v)
        if (vertex_is_locked(s, v)) s->constraints[s->constraint_of[s->point_of[v]]].hold = HOLD_LOCK;
}

/* Adds the planes through the held sides of face f to the points at both ends (3.6). */
static void add_planes(fct_simplifier *s, uint32_t f, const float *strength) {
    v3 p[3];
    for (uint32_t k = 0; k < 3; ++k) p[k] = point_position(s, s->triangles[3 * f + k]);
    v3 normal = v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
    if (!(v3_norm2(normal) > 0)) return;
    for (uint32_t k = 0; k < 3; ++k) {
        uint32_t c = 3 * f + k, next = corner_next(c);
        double held = strength[s->side_edges[c]];
        if (held == 0) continue;
        v3 side = v3_sub(p[(k + 1) % 3], p[k]), across = v3_unit(v3_cross(normal, side));
        double length = v3_norm(side);
        for (int end = 0; end < 2; ++end) {
            double *planes = s->constraints[s->constraint_of[s->triangles[end ? next : c]]].planes;
            quadric_add_plane(planes, across, p[k], held * length);
            planes[10] += length;
        }
    }
}

fct_result fct_simplify_constraints(fct_simplifier *s) {
    bool held = s->def->boundary_weight > 0;
    if (!held && !s->def->locks && !s->def->lock_border) return FCT_OK;
    float *strength = NULL;
    uint32_t *first_sides = NULL;
    const fct_array scratch[] = {FCT_ARRAY(strength, s->edge_count),
                                 FCT_ARRAY_IF(s->corner_wedges, first_sides, s->edge_count)};
    fct_result result = fct_allocate_all(s->env, scratch, FCT_LENGTH(scratch), "constraints");
    if (result != FCT_OK) return result;
    s->constraint_of = fct_allocate(s->env, s->point_count, sizeof *s->constraint_of);
    if (!s->constraint_of) {
        result = fct_fail_memory(s->env, "constraints");
        goto done;
    }
    if (held)
        find_strengths(s, strength, first_sides);
    else
        memset(strength, 0, s->edge_count * sizeof *strength);
    if (held) add_contours(s, strength);
    number_held_points(s, strength);
    s->constraints = fct_allocate_zero(s->env, s->constraint_count, sizeof *s->constraints);
    if (!s->constraints) {
        result = fct_fail_memory(s->env, "constraints");
        goto done;
    }
    for (uint32_t f = 0; f < s->mesh->face_count; ++f)
        if (!corner_dead(s, 3 * f)) add_planes(s, f, strength);
    result = fct_simplify_find_lines(s, strength);
    if (result == FCT_OK) lock_points(s);
done:
    fct_release_all(s->env, scratch, FCT_LENGTH(scratch));
    return result;
}

/* Whether the point lies on the line, apart from the rounding of the input. */
static bool lies_on_line(const fct_simplifier *s, v3 p, uint32_t line) {
    v3 rest = v3_cross(v3_sub(p, s->lines[line].origin), s->lines[line].direction);
    return v3_norm2(rest) <= s->least_height * s->least_height;
}

/* 0. A locked point and another: the first wins. Two locked points: neither end is allowed.
 * 1. A point that stays and one that nothing but planes holds: the first wins.
 * 2. Two points of one line: the line. A point of a line and one that stays on this line: the second.
 * 3. Else both are broken. */
static void join_holds(const fct_simplifier *s, const fct_constraint *a, const fct_constraint *b, v3 pa,
                       v3 pb, fct_joint *out) {
    uint8_t ha = a ? a->hold : HOLD_PLANES, hb = b ? b->hold : HOLD_PLANES;
    out->held.hold = HOLD_PLANES, out->held.line = FCT_NONE;
    out->ends[0] = out->ends[1] = true;
    if (ha == HOLD_PLANES && hb == HOLD_PLANES) return;
    if (ha == HOLD_LOCK || hb == HOLD_LOCK) {
        out->held.hold = HOLD_LOCK;
        out->ends[0] = hb != HOLD_LOCK, out->ends[1] = ha != HOLD_LOCK;
        return;
    }
    bool first = hb == HOLD_PLANES || (ha == HOLD_POINT && hb == HOLD_LINE && lies_on_line(s, pa, b->line));
    bool second = ha == HOLD_PLANES || (hb == HOLD_POINT && ha == HOLD_LINE && lies_on_line(s, pb, a->line));
    bool both = ha == HOLD_LINE && hb == HOLD_LINE && a->line == b->line;
    if (!first && !second && !both) return;
    const fct_constraint *from = second ? b : a;
    out->held.hold = from->hold, out->held.line = from->line;
    out->ends[0] = !second, out->ends[1] = !first;
}

bool fct_constraint_join(const fct_simplifier *s, uint32_t a, uint32_t b, fct_joint *out) {
    const fct_constraint *first = constraint_at(s, a), *second = constraint_at(s, b);
    if (!first && !second) return false;
    for (int k = 0; k < POSITION_QUADRIC; ++k)
        out->held.planes[k] = (first ? first->planes[k] : 0) + (second ? second->planes[k] : 0);
    join_holds(s, first, second, point_position(s, a), point_position(s, b), out);
    return true;
}

void fct_constraint_merge(fct_simplifier *s, uint32_t a, uint32_t b) {
    fct_joint joint;
    if (!fct_constraint_join(s, a, b, &joint)) return;
    if (s->constraint_of[a] == FCT_NONE) s->constraint_of[a] = s->constraint_of[b];
    s->constraints[s->constraint_of[a]] = joint.held;
}

/* The corners of `wedge` (all at `point`, without attributes) that the faces between a and b have. */
static uint32_t count_vanishing(fct_simplifier *s, uint32_t a, uint32_t count_b, uint32_t point,
                                uint32_t wedge) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < count_b; ++i) {
        uint32_t f = s->ring_b[i] - s->ring_b[i] % 3;
        const uint32_t *t = s->triangles + f;
        if (t[0] != a && t[1] != a && t[2] != a) continue;
        for (uint32_t k = 0; k < 3; ++k) count += t[k] == point && corner_wedge(s, f + k) == wedge;
    }
    return count;
}

static uint32_t count_uses(const fct_simplifier *s, uint32_t wedge) {
    return s->corner_wedges ? s->wedge_uses[wedge] : point_at(s, wedge)->valence;
}

/* Whether each group of wedges with one of the locked point keeps a face. */
static bool keeps_groups(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_b) {
    fct_groups g = {.wedge_count = 2, .group_count = 1, .wedges = {a, b}, .second = {false, true}};
    if (s->corner_wedges && !fct_groups_find(s, a, b, &g)) return false;
    for (uint32_t group = 0; group < g.group_count; ++group) {
        uint32_t left = 0;
        bool locked = false;
        for (uint32_t i = 0; i < g.wedge_count; ++i) {
            if (g.group_of[i] != group) continue;
            uint32_t point = g.second[i] ? b : a;
            locked |= point_is_locked(s, point);
            left += count_uses(s, g.wedges[i]) - count_vanishing(s, a, count_b, point, g.wedges[i]);
        }
        if (locked && left == 0) return false;
    }
    return true;
}

bool fct_constraint_keeps_locked(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_b, bool body) {
    if (!s->constraint_of) return true;
    for (uint32_t i = 0; i < count_b; ++i) {
        uint32_t f = s->ring_b[i] - s->ring_b[i] % 3;
        const uint32_t *t = s->triangles + f;
        if (!body && t[0] != a && t[1] != a && t[2] != a) continue;
        for (uint32_t k = 0; k < 3; ++k) {
            if (!point_is_locked(s, t[k])) continue;
            if (body) return false;
            if (t[k] == a || t[k] == b) continue;
            uint32_t w = corner_wedge(s, f + k);
            if (count_uses(s, w) == count_vanishing(s, a, count_b, t[k], w)) return false;
        }
    }
    return body || (!point_is_locked(s, a) && !point_is_locked(s, b)) || keeps_groups(s, a, b, count_b);
}
