/* simplify/cost/loss.c: see loss.h.
 *
 * 1. List the lost points: both ends; apexes that lose their last face; middles of sides that lose theirs.
 *    Each weighs a third of the area that the quadrics gathered there.
 * 2. Find the nearest point of the remaining faces for each.
 * 3. The quadric resists a move in this direction with n^T A n. Only the rest of the weight counts:
 *    weight * (1 - n^T A n / area), times the squared distance.
 * On a smooth surface the points are lost along the normal, which the quadric resists in full: the loss is 0.
 * Cost: O(lost points * faces of both rings).
 */
#include "simplify/cost/loss.h"
#include "simplify/cost/nearest.h"
#include "simplify/topology/ring.h"

/* The area that the quadric of a point has summed. */
static double sum_area(const fct_simplifier *s, uint32_t point) {
    return point_at(s, point)->quadric[10];
}

static void add_lost(fct_loss *loss, v3 lost, v3 at, double weight) {
    uint32_t k = loss->count++;
    loss->lost[k] = lost, loss->nearest[k] = at;
    loss->distance2[k] = v3_norm2(v3_sub(lost, at));
    loss->weights[k] = weight;
}

/* Whether a face of the ring, other than those at `other`, has a side to `point`. */
static bool ring_touches(const fct_simplifier *s, const uint32_t *ring, uint32_t count, uint32_t other,
                         uint32_t point) {
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t x = s->triangles[corner_next(ring[i])], y = s->triangles[corner_previous(ring[i])];
        if ((x == point && y != other) || (y == point && x != other)) return true;
    }
    return false;
}

/* Adds what vanishing faces take away. An apex that no remaining face joins to the new point loses a side:
 * its middle counts, with the area of the face. An apex without any other face is lost itself, with its area.
 */
static void add_apexes(const fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b,
                       v3 at, fct_loss *loss) {
    for (uint32_t i = 0; i < count_b && loss->count < LOSS_POINTS; ++i) {
        uint32_t apex = fct_simplify_find_apex(s, s->ring_b[i], a), faces = 0;
        if (apex == FCT_NONE || ring_touches(s, s->ring_a, count_a, b, apex) ||
            ring_touches(s, s->ring_b, count_b, a, apex))
            continue;
        v3 p = point_position(s, apex), pa = point_position(s, a), pb = point_position(s, b);
        for (uint32_t k = 0; k < count_b; ++k) faces += fct_simplify_find_apex(s, s->ring_b[k], a) == apex;
        if (faces < point_at(s, apex)->valence) {
            double area = .5 * v3_norm(v3_cross(v3_sub(pa, p), v3_sub(pb, p)));
            add_lost(loss, v3_scale(v3_add(p, at), .5), at, area / 3);
        } else
            add_lost(loss, p, at, sum_area(s, apex) / (3 * faces));
    }
}

/* Measures the distance from the lost points to the remaining faces, whose corner moves to `at`. A point is
 * at least as far from a face as from its plane. */
static void search_remaining(const fct_simplifier *s, v3 at, fct_loss *loss) {
    for (const fct_remaining *r = s->remaining; r < s->remaining + s->remaining_count; ++r) {
        triangle t;
        bool made = false;
        for (uint32_t k = 0; k < loss->count; ++k) {
            if (loss->distance2[k] <= LOSS_NOISE * LOSS_NOISE) continue;
            double height = v3_dot(r->normal, v3_sub(loss->lost[k], at));
            if (r->norm2 > 0 && height * height >= loss->distance2[k] * r->norm2) continue;
            if (!made) t = triangle_make(at, point_position(s, r->x), point_position(s, r->y));
            made = true;
            foot found = triangle_nearest(&t, loss->lost[k]);
            if (found.distance2 >= loss->distance2[k]) continue;
            loss->distance2[k] = found.distance2;
            loss->nearest[k] = v3_add(at, v3_add(v3_scale(t.ab, found.u), v3_scale(t.ac, found.v)));
        }
    }
}

/* Reduces the weights by the quadric's resistance. Returns the cost. */
static double weigh_lost(const fct_candidate *candidate, fct_loss *loss) {
    double cost = 0;
    for (uint32_t k = 0; k < loss->count; ++k) {
        double distance2 = loss->distance2[k];
        v3 away = v3_sub(loss->lost[k], loss->nearest[k]);
        bool noise = distance2 <= LOSS_NOISE * LOSS_NOISE;
        double resistance = noise ? INFINITY : sym3_form(candidate->quadric, away, away) / distance2;
        loss->weights[k] *= resistance < candidate->area ? 1 - resistance / candidate->area : 0;
        cost += loss->weights[k] * distance2;
    }
    return cost;
}

double fct_loss_measure(const fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b,
                        const fct_candidate *candidate, fct_loss *loss) {
    loss->count = 0;
    add_lost(loss, point_position(s, a), candidate->at, sum_area(s, a) / 3);
    add_lost(loss, point_position(s, b), candidate->at, sum_area(s, b) / 3);
    add_apexes(s, a, b, count_a, count_b, candidate->at, loss);
    search_remaining(s, candidate->at, loss);
    return weigh_lost(candidate, loss);
}

double fct_loss_measure_body(const fct_simplifier *s, uint32_t b, uint32_t count_b,
                             const fct_candidate *candidate, fct_loss *loss) {
    loss->count = 0;
    add_lost(loss, point_position(s, b), candidate->at, sum_area(s, b) / 3);
    for (uint32_t i = 0; i < count_b; ++i) {
        uint32_t x = s->triangles[corner_next(s->ring_b[i])]; /* each other point of the body once */
        add_lost(loss, point_position(s, x), candidate->at, sum_area(s, x) / 3);
    }
    return weigh_lost(candidate, loss);
}

void fct_loss_add(const fct_loss *loss, double *q) {
    for (uint32_t k = 0; k < loss->count; ++k) {
        if (!(loss->weights[k] > 0)) continue;
        v3 away = v3_sub(loss->lost[k], loss->nearest[k]);
        quadric_add_plane(q, v3_scale(away, 1 / v3_norm(away)), loss->lost[k], loss->weights[k]);
    }
}
