/* simplify/cost/placement.c: see placement.h. Garland 1999, section 3.5, over quadrics whose attributes have
 * been eliminated (quadric.h), so that one 3 x 3 system serves any number of attributes and wedges.
 *
 * The system is solved about the edge's midpoint m with gamma times the trace on the diagonal: in directions
 * that the quadric leaves free the point stays at m. The energy gamma trace (|p - a|^2 + |p - b|^2) / 2 also
 * orders contractions that cost nothing, short edges first.
 */
#include "simplify/cost/placement.h"

/* The farthest a minimiser may lie from the edge's midpoint, in edge lengths. */
#define MAX_REACH 2.0

static uint32_t find_wedge(const fct_groups *g, uint32_t wedge) {
    for (uint32_t i = 0; i < g->wedge_count; ++i)
        if (g->wedges[i] == wedge) return i;
    return FCT_NONE;
}

static bool list_wedges(fct_simplifier *s, uint32_t point, bool second, fct_groups *g) {
    for (uint32_t w = s->first_wedges[point]; w != FCT_NONE; w = s->next_wedges[w]) {
        if (g->wedge_count == SIMPLIFY_MAX_WEDGES) return false;
        g->group_of[g->wedge_count] = g->wedge_count;
        g->second[g->wedge_count] = second;
        g->wedges[g->wedge_count++] = w;
    }
    return true;
}

static void join_groups(fct_groups *g, uint32_t i, uint32_t j) {
    uint32_t low = g->group_of[i], high = g->group_of[j];
    if (low == high) return;
    if (low > high) {
        uint32_t swap = low;
        low = high, high = swap;
    }
    for (uint32_t k = 0; k < g->wedge_count; ++k)
        if (g->group_of[k] == high) g->group_of[k] = low;
}

bool fct_groups_find(fct_simplifier *s, uint32_t a, uint32_t b, fct_groups *g) {
    g->wedge_count = 0;
    if (!list_wedges(s, a, false, g) || !list_wedges(s, b, true, g)) return false;
    if (g->wedge_count == 2) {
        g->group_of[0] = g->group_of[1] = 0;
        g->group_count = 1;
        return true;
    }
    uint32_t from = s->valences[a] <= s->valences[b] ? a : b, to = from == a ? b : a;
    for (uint32_t c = s->first_corners[from]; c != FCT_NONE; c = s->next_corners[c]) {
        if (corner_dead(s, c)) continue;
        uint32_t other = s->triangles[corner_next(c)] == to ? corner_next(c) : corner_previous(c);
        if (s->triangles[other] == to)
            join_groups(g, find_wedge(g, corner_wedge(s, c)), find_wedge(g, corner_wedge(s, other)));
    }
    /* Number the groups 0, 1, ... by their lowest member. */
    uint32_t numbers[SIMPLIFY_MAX_WEDGES];
    g->group_count = 0;
    for (uint32_t i = 0; i < g->wedge_count; ++i) {
        if (g->group_of[i] == i) numbers[i] = g->group_count++;
        g->group_of[i] = numbers[g->group_of[i]];
    }
    return true;
}

/* The sum of a group's quadrics, and as prior the mean of its attributes. */
static void sum_group(const fct_simplifier *s, const fct_groups *g, uint32_t group, double *sum,
                      double *prior) {
    uint32_t members = 0;
    memset(sum, 0, s->quadric_size * sizeof *sum);
    memset(prior, 0, s->channel_count * sizeof *prior);
    for (uint32_t i = 0; i < g->wedge_count; ++i) {
        if (g->group_of[i] != group) continue;
        ++members;
        const double *q = s->quadrics + (size_t)s->quadric_size * g->wedges[i];
        const double *a = s->attributes + (size_t)s->channel_count * g->wedges[i];
        for (uint32_t k = 0; k < s->quadric_size; ++k) sum[k] += q[k];
        for (uint32_t k = 0; k < s->channel_count; ++k) prior[k] += a[k];
    }
    for (uint32_t k = 0; k < s->channel_count; ++k) prior[k] /= members;
}

static double group_ridge(const fct_simplifier *s, const double *q) {
    return fmax(s->def->regularization, 1e-12) * (quadric_trace(q) + q[10]);
}

/* The attributes of the first member of a group at the given end, else of its first member. */
static const double *end_attributes(const fct_simplifier *s, const fct_groups *g, uint32_t group,
                                    uint32_t end) {
    uint32_t chosen = FCT_NONE;
    for (uint32_t i = 0; i < g->wedge_count; ++i)
        if (g->group_of[i] == group &&
            (chosen == FCT_NONE || (g->second[i] == end && g->second[chosen] != end)))
            chosen = i;
    return s->attributes + (size_t)s->channel_count * g->wedges[chosen];
}

void fct_place_attributes(const fct_simplifier *s, const fct_groups *groups, uint32_t group,
                          const fct_candidate *candidate, v3 pa, v3 pb, double *attributes) {
    const double *first = end_attributes(s, groups, group, 0), *second = end_attributes(s, groups, group, 1);
    if (s->def->placement == FCT_PLACE_SUBSET) {
        memcpy(attributes, candidate->end == 0 ? first : second, s->channel_count * sizeof *attributes);
        return;
    }
    v3 along = v3_sub(pb, pa);
    double length2 = v3_norm2(along);
    double t = length2 > 0 ? v3_dot(v3_sub(candidate->at, pa), along) / length2 : .5;
    t = fmin(fmax(t, 0), 1);
    for (uint32_t k = s->steering; k < s->channel_count; ++k)
        attributes[k] = first[k] + t * (second[k] - first[k]);
    if (!s->steering) return;
    double sum[MAX_QUADRIC], prior[SIMPLIFY_MAX_CHANNELS];
    fct_elimination e;
    sum_group(s, groups, group, sum, prior);
    fct_quadric_eliminate(sum, s->steering, prior, group_ridge(s, sum), &e);
    fct_quadric_attributes(&e, s->steering, candidate->at, attributes);
    for (uint32_t k = 0; k < s->steering; ++k)
        attributes[k] = fmin(fmax(attributes[k], s->channels[k].lower), s->channels[k].upper);
}

/* delta = -(A + ridge I)^-1 g by A = L D L^T; false when a pivot is not positive. */
static bool solve(const double *r, double ridge, v3 g, v3 *delta) {
    double d0 = r[0] + ridge;
    if (!(d0 > 0)) return false;
    double l1 = r[1] / d0, l2 = r[2] / d0;
    double d1 = r[3] + ridge - l1 * r[1], k = r[4] - l1 * r[2];
    if (!(d1 > 0)) return false;
    double l3 = k / d1, d2 = r[5] + ridge - l2 * r[2] - l3 * k;
    if (!(d2 > 0)) return false;
    double y = g.y - l1 * g.x, z = (g.z - l2 * g.x - l3 * y) / d2;
    y = y / d1 - l3 * z;
    *delta = (v3){-(g.x / d0 - l1 * y - l2 * z), -y, -z};
    return true;
}

static void try_point(const double *r, v3 at, uint32_t end, fct_candidate *best) {
    double error = quadric_at(r, at);
    if (end == 0 || error < best->error) *best = (fct_candidate){.at = at, .end = end, .error = error};
}

/* The lowest of the ends and, where the policy has it, the middle. */
static void place_at_ends(const double *r, v3 a, v3 b, bool middle, fct_candidate *best) {
    try_point(r, a, 0, best);
    try_point(r, b, 1, best);
    if (middle) try_point(r, v3_scale(v3_add(a, b), .5), 2, best);
}

static void place_on_segment(const double *r, v3 a, v3 b, double ridge, fct_candidate *best) {
    v3 along = v3_sub(b, a), middle = v3_scale(v3_add(a, b), .5);
    double curvature = sym3_form(r, along, along) + ridge * v3_norm2(along);
    double t = curvature > 0 ? -v3_dot(along, quadric_gradient(r, middle)) / curvature : 0;
    t = fmin(fmax(t, -.5), .5);
    v3 at = t == -.5 ? a : t == .5 ? b : v3_mad(middle, t, along);
    *best = (fct_candidate){.at = at, .end = t == -.5 ? 0 : t == .5 ? 1 : 2, .error = quadric_at(r, at)};
}

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
        if (solve(r, ridge, g, &delta) && v3_norm2(delta) <= MAX_REACH * MAX_REACH * v3_norm2(v3_sub(b, a))) {
            *out = (fct_candidate){.at = v3_add(middle, delta), .end = 2};
            out->error = quadric_at(r, out->at);
            return;
        }
    }
    place_on_segment(r, a, b, ridge, out);
}

/* With subset placement attributes come from the chosen end too, so they count as they are. */
static void place_subset(const fct_simplifier *s, const fct_groups *g, double sums[][MAX_QUADRIC], v3 a, v3 b,
                         fct_candidate *out) {
    for (uint32_t end = 0; end < 2; ++end) {
        double error = 0;
        for (uint32_t i = 0; i < g->group_count; ++i)
            error += fct_quadric_value(sums[i], s->steering, end ? b : a, end_attributes(s, g, i, end));
        if (end == 0 || error < out->error)
            *out = (fct_candidate){.at = end ? b : a, .end = end, .error = error};
    }
}

/* The quadric of the position: summed over the groups, attributes eliminated. */
static bool position_quadric(fct_simplifier *s, uint32_t a, uint32_t b, double *r, fct_groups *g,
                             double sums[][MAX_QUADRIC]) {
    memset(r, 0, POSITION_QUADRIC * sizeof *r);
    if (!s->corner_wedges) {
        const double *qa = s->quadrics + (size_t)POSITION_QUADRIC * a;
        const double *qb = s->quadrics + (size_t)POSITION_QUADRIC * b;
        for (int k = 0; k < POSITION_QUADRIC; ++k) r[k] = qa[k] + qb[k];
        return true;
    }
    if (!fct_groups_find(s, a, b, g)) return false;
    for (uint32_t i = 0; i < g->group_count; ++i) {
        double prior[SIMPLIFY_MAX_CHANNELS];
        sum_group(s, g, i, sums[i], prior);
        fct_elimination e;
        fct_quadric_eliminate(sums[i], s->steering, prior, group_ridge(s, sums[i]), &e);
        for (int k = 0; k < POSITION_QUADRIC; ++k) r[k] += e.position[k];
    }
    return true;
}

bool fct_place(fct_simplifier *s, uint32_t a, uint32_t b, bool ends_only, fct_candidate *out) {
    double r[POSITION_QUADRIC], sums[SIMPLIFY_MAX_WEDGES][MAX_QUADRIC];
    fct_groups g;
    v3 pa = point_position(s, a), pb = point_position(s, b);
    bool larger_b = s->valences[b] > s->valences[a]; /* of two hubs the larger stays */
    bool hub_a = !larger_b && s->valences[a] > SIMPLIFY_HUB;
    bool hub_b = larger_b && s->valences[b] > SIMPLIFY_HUB;
    if (!position_quadric(s, a, b, r, &g, sums)) return false;
    if (hub_a || hub_b)
        *out = (fct_candidate){.at = hub_a ? pa : pb, .end = hub_b, .error = quadric_at(r, hub_a ? pa : pb)};
    else if (s->steering && s->def->placement == FCT_PLACE_SUBSET)
        place_subset(s, &g, sums, pa, pb, out);
    else
        place_by_policy(s, r, pa, pb, ends_only, out);
    if (!(out->error > 0)) out->error = 0;
    out->area = r[10];
    memcpy(out->resistance, r, sizeof out->resistance);
    double reach2 = v3_norm2(v3_sub(out->at, pa)) + v3_norm2(v3_sub(out->at, pb));
    out->key = out->error + .5 * s->def->regularization * quadric_trace(r) * reach2;
    return true;
}
