/* simplify/cost/placement.c: see placement.h. Garland 1999, section 3.5, on quadrics whose attributes are
 * eliminated.
 *
 * The system is solved about the midpoint m of the edge, with the ridge gamma * trace on the diagonal. So the
 * point stays at m in directions that the quadric leaves free. The energy of this ridge,
 * gamma * trace * (|p - a|^2 + |p - b|^2) / 2, also orders contractions without error: short edges go first.
 * This regularisation (course notes COMP 557, "Mesh Simplification") replaces Garland's test for a singular
 * matrix: the result moves smoothly to the midpoint as the faces become coplanar.
 */
#include "simplify/cost/placement.h"

#include "simplify/cost/constraint.h"

/* The smallest ridge of the attributes, relative to trace plus area: it only keeps the pivots above 0. */
#define LEAST_RIDGE 1e-12

/* A weight for the prior that keeps the attributes' matrix regular, relative to the quadric's size. */
static double find_group_ridge(const fct_simplifier *s, const double *q) {
    return fct_max(s->def->regularization, LEAST_RIDGE) * (quadric_trace(q) + q[10]);
}

void fct_place_attributes(const fct_simplifier *s, const fct_groups *groups, uint32_t group,
                          const fct_candidate *candidate, v3 pa, v3 pb, double *attributes) {
    const double *first = fct_groups_end(s, groups, group, 0), *second = fct_groups_end(s, groups, group, 1);
    if (s->def->placement == FCT_PLACE_SUBSET || candidate->locked) {
        memcpy(attributes, candidate->end == 0 ? first : second, s->channel_count * sizeof *attributes);
        return;
    }
    v3 along = v3_sub(pb, pa);
    double length2 = v3_norm2(along);
    double t = length2 > 0 ? v3_dot(v3_sub(candidate->at, pa), along) / length2 : .5;
    t = fct_min(fct_max(t, 0), 1);
    for (uint32_t k = s->steering; k < s->channel_count; ++k)
        attributes[k] = first[k] + t * (second[k] - first[k]);
    if (!s->steering) return;
    double sum[MAX_QUADRIC], prior[SIMPLIFY_MAX_CHANNELS];
    fct_elimination e;
    fct_groups_sum(s, groups, group, sum, prior);
    fct_quadric_eliminate(sum, s->steering, prior, find_group_ridge(s, sum), &e);
    fct_quadric_attributes(&e, s->steering, candidate->at, attributes);
    for (uint32_t k = 0; k < s->steering; ++k)
        attributes[k] = fct_min(fct_max(attributes[k], s->channels[k].lower), s->channels[k].upper);
}

static void try_point(const double *r, v3 at, uint32_t end, fct_candidate *best) {
    double error = quadric_at(r, at);
    if (end == 0 || error < best->error) *best = (fct_candidate){.at = at, .end = end, .error = error};
}

/* The cheapest of both ends and, if `middle`, the midpoint. */
static void place_at_ends(const double *r, v3 a, v3 b, bool middle, fct_candidate *best) {
    try_point(r, a, 0, best);
    try_point(r, b, 1, best);
    if (middle) try_point(r, v3_scale(v3_add(a, b), .5), 2, best);
}

/* The minimum on the segment, by the slope at its midpoint: at = midpoint + t (b - a), t in [-.5, .5]. */
static void place_on_segment(const double *r, v3 a, v3 b, double ridge, fct_candidate *best) {
    v3 along = v3_sub(b, a), middle = v3_scale(v3_add(a, b), .5);
    double curvature = sym3_form(r, along, along) + ridge * v3_norm2(along);
    double t = curvature > 0 ? -v3_dot(along, quadric_gradient(r, middle)) / curvature : 0;
    t = fct_min(fct_max(t, -.5), .5);
    v3 at = t == -.5 ? a : t == .5 ? b : v3_mad(middle, t, along);
    *best = (fct_candidate){.at = at, .end = t == -.5 ? 0 : t == .5 ? 1 : 2, .error = quadric_at(r, at)};
}

/* Step 1 of 3.5 with the regularised matrix; step 2 if the minimiser is too far away. */
static void place_by_policy(const fct_simplifier *s, const double *r, v3 a, v3 b, bool ends_only,
                            fct_candidate *out) {
    fct_placement policy = s->def->placement;
    if (policy == FCT_PLACE_SUBSET || policy == FCT_PLACE_ENDS || ends_only) {
        place_at_ends(r, a, b, policy != FCT_PLACE_SUBSET, out);
        return;
    }
    double ridge = s->def->regularization * quadric_trace(r);
    if (policy == FCT_PLACE_OPTIMAL) {
        v3 middle = v3_scale(v3_add(a, b), .5), delta;
        v3 g = quadric_gradient(r, middle);
        if (quadric_solve(r, ridge, g, &delta) &&
            v3_norm2(delta) <= PLACE_REACH * PLACE_REACH * v3_norm2(v3_sub(b, a))) {
            *out = (fct_candidate){.at = v3_add(middle, delta), .end = 2};
            out->error = quadric_at(r, out->at);
            return;
        }
    }
    place_on_segment(r, a, b, ridge, out);
}

/* The new point of an end on a line and one that may leave its place: the minimum on the line, from the
 * edge's midpoint. If it is too far away, or if only ends may be tried, as place_at_ends. */
static void place_on_line(const fct_simplifier *s, const double *r, const fct_joint *joint, v3 a, v3 b,
                          bool ends_only, fct_candidate *out) {
    const fct_line *line = &s->lines[joint->held.line];
    v3 middle = v3_scale(v3_add(a, b), .5), d = line->direction;
    v3 from = v3_mad(line->origin, v3_dot(v3_sub(middle, line->origin), d), d);
    double curvature = sym3_form(r, d, d) + s->def->regularization * quadric_trace(r);
    double t = curvature > 0 ? -v3_dot(d, quadric_gradient(r, from)) / curvature : 0;
    v3 at = v3_mad(from, t, d);
    bool near = v3_norm2(v3_sub(at, middle)) <= PLACE_REACH * PLACE_REACH * v3_norm2(v3_sub(b, a));
    if (s->def->placement == FCT_PLACE_OPTIMAL && !ends_only && near)
        *out = (fct_candidate){.at = at, .end = 2, .error = quadric_at(r, at)};
    else if (!joint->ends[1] || (joint->ends[0] && quadric_at(r, a) <= quadric_at(r, b)))
        *out = (fct_candidate){.at = a, .end = 0, .error = quadric_at(r, a)};
    else
        *out = (fct_candidate){.at = b, .end = 1, .error = quadric_at(r, b)};
}

/* The position that the constraint and then the policy choose. */
static void place_point(const fct_simplifier *s, const double *r, const fct_joint *joint, v3 a, v3 b,
                        bool ends_only, fct_candidate *out) {
    if (joint && joint->held.hold == HOLD_LINE)
        place_on_line(s, r, joint, a, b, ends_only, out);
    else if (joint && joint->held.hold >= HOLD_POINT) {
        v3 at = joint->ends[0] ? a : b;
        *out = (fct_candidate){.at = at, .end = joint->ends[1], .error = quadric_at(r, at)};
    } else
        place_by_policy(s, r, a, b, ends_only, out);
}

/* The value of the point constraints of both ends. */
static double pins_at(const fct_simplifier *s, uint32_t a, uint32_t b, v3 at) {
    return s->pins ? quadric_at(s->pins[a], at) + quadric_at(s->pins[b], at) : 0;
}

/* Subset placement takes the attributes of the chosen end too, so they are part of its cost. pins: the values
 * of the point constraints at both ends. */
static void place_subset(const fct_simplifier *s, const fct_groups *g, double sums[][MAX_QUADRIC],
                         const fct_joint *joint, double weight, const double pins[2], v3 a, v3 b,
                         fct_candidate *out) {
    bool found = false;
    for (uint32_t end = 0; end < 2; ++end) {
        if (joint && !joint->ends[end]) continue;
        double error = pins[end] + (joint ? weight * quadric_at(joint->held.planes, end ? b : a) : 0);
        for (uint32_t i = 0; i < g->group_count; ++i)
            error += fct_quadric_value(sums[i], s->steering, end ? b : a, fct_groups_end(s, g, i, end));
        if (!found || error < out->error)
            *out = (fct_candidate){.at = end ? b : a, .end = end, .error = error};
        found = true;
    }
}

/* r = the quadric of the new point's position: the sum over the groups, attributes eliminated. Also returns
 * the groups and their sums. False if there are too many wedges. */
static bool sum_position_quadric(fct_simplifier *s, uint32_t a, uint32_t b, double *r, fct_groups *g,
                                 double sums[][MAX_QUADRIC]) {
    memset(r, 0, POSITION_QUADRIC * sizeof *r);
    if (!s->steering) {
        if (s->corner_wedges && !fct_groups_fit(s, a, b)) return false;
        for (int k = 0; k < POSITION_QUADRIC; ++k)
            r[k] = point_at(s, a)->quadric[k] + point_at(s, b)->quadric[k];
        return true;
    }
    if (!fct_groups_find(s, a, b, g)) return false;
    for (uint32_t i = 0; i < g->group_count; ++i) {
        double prior[SIMPLIFY_MAX_CHANNELS];
        fct_groups_sum(s, g, i, sums[i], prior);
        fct_elimination e;
        fct_quadric_eliminate(sums[i], s->steering, prior, find_group_ridge(s, sums[i]), &e);
        for (int k = 0; k < POSITION_QUADRIC; ++k) r[k] += e.position[k];
    }
    return true;
}

/* The common case: no attributes that steer, no constraint, the optimal position, no hub. With m the middle
 * of a-b and d the way from it, (A + ridge I) d = -g, so Q(m + d) = Q(m) + g.d - ridge |d|^2. False if step 1
 * of 3.5 fails. */
static bool place_freely(const fct_simplifier *s, const fct_point *a, const fct_point *b,
                         fct_candidate *out) {
    double *r = out->quadric;
    for (int k = 0; k < POSITION_QUADRIC; ++k) r[k] = a->quadric[k] + b->quadric[k];
    v3 middle = v3_scale(v3_add(a->at, b->at), .5), g = quadric_gradient(r, middle), delta;
    double ridge = s->def->regularization * quadric_trace(r), length2 = v3_norm2(v3_sub(b->at, a->at));
    if (!quadric_solve(r, ridge, g, &delta)) return false;
    double reach2 = v3_norm2(delta);
    if (!(reach2 <= PLACE_REACH * PLACE_REACH * length2)) return false;
    double error = v3_dot(middle, g) + r[6] * middle.x + r[7] * middle.y + r[8] * middle.z + r[9] +
                   v3_dot(g, delta) - ridge * reach2;
    out->at = v3_add(middle, delta);
    out->end = 2;
    out->locked = false;
    out->error = error > 0 ? error : 0;
    out->distance2 = out->error;
    out->area = r[10];
    out->key = out->error + ridge * (reach2 + .25 * length2);
    return true;
}

/* The wedges of a group at one end of the edge. */
static uint32_t count_at_end(const fct_groups *g, uint32_t group, uint32_t end) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < g->wedge_count; ++i) count += g->group_of[i] == group && g->second[i] == end;
    return count;
}

bool fct_place(fct_simplifier *s, uint32_t a, uint32_t b, bool ends_only, fct_candidate *out) {
    const fct_point *first = point_at(s, a), *second = point_at(s, b);
    if (!s->steering && s->def->placement == FCT_PLACE_OPTIMAL && !ends_only &&
        (!s->corner_wedges || fct_groups_fit(s, a, b)) && first->valence <= SIMPLIFY_HUB &&
        second->valence <= SIMPLIFY_HUB && !constraint_at(s, a) && !constraint_at(s, b) &&
        !point_is_pinned(s, a) && !point_is_pinned(s, b) && place_freely(s, first, second, out))
        return true;
    double r[POSITION_QUADRIC], sums[SIMPLIFY_MAX_WEDGES][MAX_QUADRIC];
    fct_groups g;
    fct_joint joint;
    v3 pa = first->at, pb = second->at;
    bool larger_b = second->valence > first->valence; /* of two hubs the larger one does not move */
    bool hub_a = !larger_b && first->valence > SIMPLIFY_HUB;
    bool hub_b = larger_b && second->valence > SIMPLIFY_HUB;
    if (!sum_position_quadric(s, a, b, r, &g, sums)) return false;
    bool held = fct_constraint_join(s, a, b, &joint);
    double weight = held ? constraint_weight(s, &joint.held, r[10]) : 0;
    for (int k = 0; k < 10 && held; ++k) r[k] += weight * joint.held.planes[k];
    for (int k = 0; k < 10 && s->pins; ++k) r[k] += s->pins[a][k] + s->pins[b][k];
    if (held && ((hub_a && !joint.ends[0]) || (hub_b && !joint.ends[1]))) return false;
    bool locked = held && joint.held.hold == HOLD_LOCK;
    if (locked && !joint.ends[0] && !joint.ends[1]) return false;
    if (locked && s->corner_wedges && !s->steering && !fct_groups_find(s, a, b, &g)) return false;
    /* Each group keeps one locked wedge: none is joined with another, and no vertex of the other end joins.
     */
    for (uint32_t i = 0; locked && s->corner_wedges && i < g.group_count; ++i)
        if (count_at_end(&g, i, joint.ends[1]) != 1) return false;
    if (hub_a || hub_b)
        *out = (fct_candidate){.at = hub_a ? pa : pb, .end = hub_b, .error = quadric_at(r, hub_a ? pa : pb)};
    else if (s->steering && (locked || s->def->placement == FCT_PLACE_SUBSET)) {
        const double pins[2] = {pins_at(s, a, b, pa), pins_at(s, a, b, pb)};
        place_subset(s, &g, sums, held ? &joint : NULL, weight, pins, pa, pb, out);
    } else
        place_point(s, r, held ? &joint : NULL, pa, pb, ends_only, out);
    if (!(out->error > 0)) out->error = 0;
    out->locked = locked;
    out->distance2 = quadric_at(first->quadric, out->at) + quadric_at(second->quadric, out->at);
    if (weight > 0)
        out->distance2 += weight / s->def->boundary_weight * quadric_at(joint.held.planes, out->at);
    if (!(out->distance2 > 0)) out->distance2 = 0;
    out->area = r[10];
    memcpy(out->quadric, r, sizeof out->quadric);
    double reach2 = v3_norm2(v3_sub(out->at, pa)) + v3_norm2(v3_sub(out->at, pb));
    out->key = out->error + .5 * s->def->regularization * quadric_trace(r) * reach2;
    return true;
}
