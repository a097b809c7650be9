/* simplify/cost/loss.c: what a contraction takes from the reach of the surface.
 *
 * The planes of its faces do not notice when a rod, a fin or a needle gets shorter: the point slides along
 * all of them. So what goes is measured to the faces that stay: the two ends, apexes that lose their last
 * face, and the middles of sides that lose theirs. A third of the area gathered at each times its squared
 * distance counts, as far as the quadric does not resist that direction itself, and stays in the quadric as a
 * plane through the lost point. On smooth surfaces points are lost along the normal, which the quadric
 * resists in full, and nothing changes.
 */
#include "simplify/cost/loss.h"
#include "simplify/cost/nearest.h"

static double area_at(const fct_simplifier *s, uint32_t point) {
    if (!s->corner_wedges) return s->quadrics[(size_t)POSITION_QUADRIC * point + 10];
    double area = 0;
    for (uint32_t w = s->first_wedges[point]; w != FCT_NONE; w = s->next_wedges[w])
        area += s->quadrics[(size_t)s->quadric_size * w + 10];
    return area;
}

static void add_lost(fct_loss *loss, v3 lost, v3 at, double weight) {
    uint32_t k = loss->count++;
    loss->lost[k] = lost, loss->nearest[k] = at;
    loss->distance2[k] = v3_norm2(v3_sub(lost, at));
    loss->weights[k] = weight;
}

/* The corner of a face at b across from a, FCT_NONE when the face does not touch a. */
static uint32_t apex_of(const fct_simplifier *s, uint32_t corner, uint32_t a) {
    uint32_t x = s->triangles[corner_next(corner)], y = s->triangles[corner_previous(corner)];
    return x == a ? y : y == a ? x : FCT_NONE;
}

static bool touches(const fct_simplifier *s, const uint32_t *ring, uint32_t count, uint32_t other,
                    uint32_t point) {
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t x = s->triangles[corner_next(ring[i])], y = s->triangles[corner_previous(ring[i])];
        if ((x == point && y != other) || (y == point && x != other)) return true;
    }
    return false;
}

/* Apexes of the faces between a and b that no face will join to the point that is left. */
static void add_apexes(const fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b,
                       v3 at, fct_loss *loss) {
    for (uint32_t i = 0; i < count_b && loss->count < LOSS_POINTS; ++i) {
        uint32_t apex = apex_of(s, s->ring_b[i], a), faces = 0;
        if (apex == FCT_NONE || touches(s, s->ring_a, count_a, b, apex) ||
            touches(s, s->ring_b, count_b, a, apex))
            continue;
        v3 p = point_position(s, apex), pa = point_position(s, a), pb = point_position(s, b);
        for (uint32_t k = 0; k < count_b; ++k) faces += apex_of(s, s->ring_b[k], a) == apex;
        if (faces < s->valences[apex]) {
            double area = .5 * v3_norm(v3_cross(v3_sub(pa, p), v3_sub(pb, p)));
            add_lost(loss, v3_scale(v3_add(p, at), .5), at, area / 3);
        } else
            add_lost(loss, p, at, area_at(s, apex) / (3 * faces));
    }
}

/* Measures the lost points to the faces of the ring that do not touch `other`, once their corner is `at`. */
static void search(const fct_simplifier *s, const uint32_t *ring, uint32_t count, uint32_t other, v3 at,
                   fct_loss *loss) {
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t x = s->triangles[corner_next(ring[i])], y = s->triangles[corner_previous(ring[i])];
        if (x == other || y == other) continue;
        triangle t = triangle_make(at, point_position(s, x), point_position(s, y));
        for (uint32_t k = 0; k < loss->count; ++k) {
            if (loss->distance2[k] <= LOSS_NOISE * LOSS_NOISE) continue;
            foot found = triangle_nearest(&t, loss->lost[k]);
            if (found.distance2 >= loss->distance2[k]) continue;
            loss->distance2[k] = found.distance2;
            loss->nearest[k] = v3_add(at, v3_add(v3_scale(t.ab, found.u), v3_scale(t.ac, found.v)));
        }
    }
}

double fct_simplify_loss(const fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b,
                         const fct_candidate *candidate, fct_loss *loss) {
    double cost = 0;
    loss->count = 0;
    add_lost(loss, point_position(s, a), candidate->at, area_at(s, a) / 3);
    add_lost(loss, point_position(s, b), candidate->at, area_at(s, b) / 3);
    add_apexes(s, a, b, count_a, count_b, candidate->at, loss);
    search(s, s->ring_a, count_a, b, candidate->at, loss);
    search(s, s->ring_b, count_b, a, candidate->at, loss);
    for (uint32_t k = 0; k < loss->count; ++k) {
        double distance2 = loss->distance2[k];
        v3 away = v3_sub(loss->lost[k], loss->nearest[k]);
        bool noise = distance2 <= LOSS_NOISE * LOSS_NOISE;
        double resistance = noise ? INFINITY : sym3_form(candidate->resistance, away, away) / distance2;
        loss->weights[k] *= resistance < candidate->area ? 1 - resistance / candidate->area : 0;
        cost += loss->weights[k] * distance2;
    }
    return cost;
}

void fct_simplify_remember(const fct_loss *loss, double *q) {
    for (uint32_t k = 0; k < loss->count; ++k) {
        if (!(loss->weights[k] > 0)) continue;
        v3 away = v3_sub(loss->lost[k], loss->nearest[k]);
        quadric_add_plane(q, v3_scale(away, 1 / v3_norm(away)), loss->lost[k], loss->weights[k]);
    }
}
