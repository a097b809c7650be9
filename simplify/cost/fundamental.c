/* simplify/cost/fundamental.c: see fundamental.h.
 *
 * 1. Each face adds a third of its area times the quadric of its plane to the wedge of each corner. With
 *    attributes the plane is a 2-plane in position and attributes (5.8)-(5.10), else (3.10).
 * 2. Boundary edges and borders between materials or face colours add a constraint plane per adjacent face:
 *    through the edge, perpendicular to the face, weighted by boundary_weight times the squared length (3.6).
 * 3. Seams, where both sides of an edge have different attributes, add the same plane times the squared
 *    difference. So faint seams may move, and strong ones stay.
 * Faces without area add nothing. Cost: linear in the corners.
 */
#include "simplify/cost/fundamental.h"

static double *corner_quadric(const fct_simplifier *s, uint32_t c) {
    return wedge_quadric(s, s->corner_wedges ? s->corner_wedges[c] : s->triangles[c]);
}

/* Adds the face's quadric to the wedges of its corners. A corner gets a third of the area (3.4.1). */
static void add_face_quadric(fct_simplifier *s, uint32_t f, v3 normal, double area) {
    uint32_t m = s->steering;
    double q[MAX_QUADRIC] = {0};
    if (m == 0) {
        quadric_add_plane(q, normal, point_position(s, s->triangles[3 * f]), 1);
        q[10] = 1;
    } else {
        double x[3][3 + SIMPLIFY_MAX_CHANNELS];
        for (uint32_t k = 0; k < 3; ++k) {
            v3 p = point_position(s, s->triangles[3 * f + k]);
            x[k][0] = p.x, x[k][1] = p.y, x[k][2] = p.z;
            const double *a = s->attributes + (size_t)s->channel_count * s->corner_wedges[3 * f + k];
            for (uint32_t i = 0; i < m; ++i) x[k][3 + i] = a[i];
        }
        fct_quadric_of_plane(q, m, x);
    }
    for (uint32_t k = 0; k < 3; ++k) {
        double *to = corner_quadric(s, 3 * f + k);
        for (uint32_t i = 0; i < s->quadric_size; ++i) to[i] += area / 3 * q[i];
    }
}

/* Squared difference of two wedges' attributes, at most 1. Each channel is divided by its range. */
static double squared_gap(const fct_simplifier *s, uint32_t w, uint32_t u) {
    if (w == u) return 0;
    double sum = 0;
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        const fct_channel *channel = &s->channels[i];
        double d =
            s->attributes[(size_t)s->channel_count * w + i] - s->attributes[(size_t)s->channel_count * u + i];
        double range = channel->upper - channel->lower;
        if (range > 0) sum += d * d / (range * range);
    }
    return sum < 1 ? sum : 1;
}

/* The strength of each edge's constraint planes, in [0, 1]: 1 at boundaries and borders, the gap at seams,
 * else 0. first_sides: scratch, one per edge. */
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

/* Adds constraint planes through the held sides of face f to the wedges at both ends (3.6). */
static void add_constraint_planes(fct_simplifier *s, uint32_t f, v3 normal, const float *strength) {
    for (uint32_t c = 3 * f; c < 3 * f + 3; ++c) {
        double held = strength[s->side_edges[c]];
        if (held == 0) continue;
        v3 p = point_position(s, s->triangles[c]);
        v3 side = v3_sub(point_position(s, s->triangles[corner_next(c)]), p);
        double weight = s->def->boundary_weight * held * v3_norm2(side);
        v3 across = v3_unit(v3_cross(normal, side));
        quadric_add_plane(corner_quadric(s, c), across, p, weight);
        quadric_add_plane(corner_quadric(s, corner_next(c)), across, p, weight);
    }
}

fct_result fct_simplify_quadrics(fct_simplifier *s) {
    s->quadric_size = quadric_size(s->steering);
    if (s->channel_count)
        s->quadrics = fct_allocate_zero(s->env, s->wedge_count, s->quadric_size * sizeof *s->quadrics);
    float *strength = fct_allocate(s->env, s->edge_count, sizeof *strength);
    uint32_t *first_sides = fct_allocate(s->env, s->corner_wedges ? s->edge_count : 0, sizeof *first_sides);
    fct_result result = FCT_OK;
    if ((s->channel_count && !s->quadrics) || !strength || !first_sides)
        result = fct_fail_memory(s->env, "quadrics");
    else {
        find_strengths(s, strength, first_sides);
        for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
            if (corner_dead(s, 3 * f)) continue;
            v3 p = point_position(s, s->triangles[3 * f]);
            v3 cross = v3_cross(v3_sub(point_position(s, s->triangles[3 * f + 1]), p),
                                v3_sub(point_position(s, s->triangles[3 * f + 2]), p));
            double twice = v3_norm(cross);
            if (!(twice > 0)) continue;
            v3 normal = v3_scale(cross, 1 / twice);
            add_face_quadric(s, f, normal, .5 * twice);
            add_constraint_planes(s, f, normal, strength);
        }
    }
    fct_release(s->env, strength);
    fct_release(s->env, first_sides);
    return result;
}
