/* simplify/cost/quadric.c: quadrics of faces and of constraints, gathered at the wedges.
 *
 * A face adds a third of its area times the squared distance from its plane, a 2-plane in position and
 * attributes, to each of its corners. Open edges and borders between materials or face colours add the plane
 * through the edge and perpendicular to each of its faces, weighted by the squared length (3.6). A seam,
 * where the two sides of an edge carry different attributes, does so in proportion to the squared difference:
 * faint seams may move. Faces of no area add nothing.
 */
#include "simplify/cost/quadric.h"

void fct_quadric_eliminate(const double *q, uint32_t m, const double *prior, double ridge,
                           fct_elimination *out) {
    double *r = out->position;
    memcpy(r, q, POSITION_QUADRIC * sizeof *r);
    const double *cross = q + POSITION_QUADRIC, *square = cross + 4 * m;
    for (uint32_t j = 0; j < m; ++j) {
        memcpy(out->rows[j], cross + 4 * j, 4 * sizeof(double));
        out->rows[j][3] -= ridge * prior[j];
        for (uint32_t k = j; k < m; ++k) out->upper[j][k] = *square++;
        out->upper[j][j] += ridge;
        r[9] += ridge * prior[j] * prior[j];
    }
    for (uint32_t j = 0; j < m; ++j) {
        const double *row = out->rows[j];
        double inverse = out->upper[j][j] > 0 ? 1 / out->upper[j][j] : 0;
        double x = row[0] * inverse, y = row[1] * inverse, z = row[2] * inverse, w = row[3] * inverse;
        r[0] -= x * row[0], r[1] -= x * row[1], r[2] -= x * row[2];
        r[3] -= y * row[1], r[4] -= y * row[2], r[5] -= z * row[2];
        r[6] -= x * row[3], r[7] -= y * row[3], r[8] -= z * row[3], r[9] -= w * row[3];
        for (uint32_t k = j + 1; k < m; ++k) {
            double factor = out->upper[j][k] * inverse;
            for (int i = 0; i < 4; ++i) out->rows[k][i] -= factor * row[i];
            for (uint32_t i = k; i < m; ++i) out->upper[k][i] -= factor * out->upper[j][i];
        }
    }
}

void fct_quadric_attributes(const fct_elimination *e, uint32_t m, v3 p, double *attributes) {
    for (uint32_t j = m; j-- > 0;) {
        const double *row = e->rows[j];
        double sum = row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3];
        for (uint32_t k = j + 1; k < m; ++k) sum += e->upper[j][k] * attributes[k];
        attributes[j] = e->upper[j][j] > 0 ? -sum / e->upper[j][j] : 0;
    }
}

double fct_quadric_value(const double *q, uint32_t m, v3 p, const double *a) {
    double value = quadric_at(q, p);
    const double *cross = q + POSITION_QUADRIC, *square = cross + 4 * m;
    for (uint32_t j = 0; j < m; ++j, cross += 4) {
        value += 2 * a[j] * (cross[0] * p.x + cross[1] * p.y + cross[2] * p.z + cross[3]);
        value += a[j] * a[j] * *square++;
        for (uint32_t k = j + 1; k < m; ++k) value += 2 * a[j] * a[k] * *square++;
    }
    return value;
}

/* q = the squared distance from the 2-plane through x[0..2] in R^(3 + m) (5.8)-(5.10), for a face of
 * weight 1.
 */
static void make_plane_n(double *q, uint32_t m, double x[3][3 + SIMPLIFY_MAX_CHANNELS]) {
    uint32_t n = 3 + m;
    double e1[3 + SIMPLIFY_MAX_CHANNELS], e2[3 + SIMPLIFY_MAX_CHANNELS], b[3 + SIMPLIFY_MAX_CHANNELS];
    double h = 0, dot = 0, k2 = 0;
    for (uint32_t i = 0; i < n; ++i) e1[i] = x[1][i] - x[0][i], h += e1[i] * e1[i];
    h = 1 / sqrt(h);
    for (uint32_t i = 0; i < n; ++i) e1[i] *= h, e2[i] = x[2][i] - x[0][i], dot += e1[i] * e2[i];
    for (uint32_t i = 0; i < n; ++i) e2[i] -= dot * e1[i], k2 += e2[i] * e2[i];
    k2 = k2 > 0 ? 1 / sqrt(k2) : 0;
    double p1 = 0, p2 = 0, pp = 0;
    for (uint32_t i = 0; i < n; ++i) {
        e2[i] *= k2;
        p1 += x[0][i] * e1[i], p2 += x[0][i] * e2[i], pp += x[0][i] * x[0][i];
    }
    for (uint32_t i = 0; i < n; ++i) b[i] = p1 * e1[i] + p2 * e2[i] - x[0][i];
    double *a = q, *square = q + POSITION_QUADRIC + 4 * m;
    for (uint32_t i = 0; i < 3; ++i)
        for (uint32_t j = i; j < 3; ++j) *a++ = (i == j) - e1[i] * e1[j] - e2[i] * e2[j];
    q[6] = b[0], q[7] = b[1], q[8] = b[2];
    q[9] = pp - p1 * p1 - p2 * p2;
    q[10] = 1;
    for (uint32_t i = 0; i < m; ++i) {
        double *cross = q + POSITION_QUADRIC + 4 * i;
        for (uint32_t j = 0; j < 3; ++j) cross[j] = -e1[3 + i] * e1[j] - e2[3 + i] * e2[j];
        cross[3] = b[3 + i];
        for (uint32_t j = i; j < m; ++j) *square++ = (i == j) - e1[3 + i] * e1[3 + j] - e2[3 + i] * e2[3 + j];
    }
}

static double *wedge_quadric(const fct_simplifier *s, uint32_t c) {
    uint32_t w = s->corner_wedges ? s->corner_wedges[c] : s->triangles[c];
    return s->quadrics + (size_t)s->quadric_size * w;
}

static void add_face(fct_simplifier *s, uint32_t f, v3 normal, double area) {
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
        make_plane_n(q, m, x);
    }
    for (uint32_t k = 0; k < 3; ++k) {
        double *to = wedge_quadric(s, 3 * f + k);
        for (uint32_t i = 0; i < s->quadric_size; ++i) to[i] += area / 3 * q[i];
    }
}

/* Squared difference of two wedges' attributes, each channel over its range, at most 1. */
static double wedge_gap(const fct_simplifier *s, uint32_t w, uint32_t u) {
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

/* How strongly each edge is held, in [0, 1]: 1 for boundaries and borders, the gap at seams. */
static void find_seams(const fct_simplifier *s, float *strength, uint32_t *first_sides) {
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
            fmax(wedge_gap(s, here, same_way ? from : to), wedge_gap(s, there, same_way ? to : from));
        if (gap > strength[e]) strength[e] = (float)gap;
    }
}

static void add_constraints(fct_simplifier *s, uint32_t f, v3 normal, const float *strength) {
    for (uint32_t c = 3 * f; c < 3 * f + 3; ++c) {
        double held = strength[s->side_edges[c]];
        if (held == 0) continue;
        v3 p = point_position(s, s->triangles[c]);
        v3 side = v3_sub(point_position(s, s->triangles[corner_next(c)]), p);
        double weight = s->def->boundary_weight * held * v3_norm2(side);
        v3 across = v3_unit(v3_cross(normal, side));
        quadric_add_plane(wedge_quadric(s, c), across, p, weight);
        quadric_add_plane(wedge_quadric(s, corner_next(c)), across, p, weight);
    }
}

fct_result fct_simplify_quadrics(fct_simplifier *s) {
    s->quadric_size = quadric_size(s->steering);
    s->quadrics = fct_allocate_zero(s->env, s->wedge_count, s->quadric_size * sizeof *s->quadrics);
    float *strength = fct_allocate(s->env, s->edge_count, sizeof *strength);
    uint32_t *first_sides = fct_allocate(s->env, s->corner_wedges ? s->edge_count : 0, sizeof *first_sides);
    fct_result result = FCT_OK;
    if (!s->quadrics || !strength || !first_sides)
        result = fct_fail_memory(s->env, "quadrics");
    else {
        find_seams(s, strength, first_sides);
        for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
            if (corner_dead(s, 3 * f)) continue;
            v3 p = point_position(s, s->triangles[3 * f]);
            v3 cross = v3_cross(v3_sub(point_position(s, s->triangles[3 * f + 1]), p),
                                v3_sub(point_position(s, s->triangles[3 * f + 2]), p));
            double twice = v3_norm(cross);
            if (!(twice > 0)) continue;
            v3 normal = v3_scale(cross, 1 / twice);
            add_face(s, f, normal, .5 * twice);
            add_constraints(s, f, normal, strength);
        }
    }
    fct_release(s->env, strength);
    fct_release(s->env, first_sides);
    return result;
}
