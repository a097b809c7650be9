/* simplify/pairs/release.c: see release.h.
 *
 * A - w n n^T has no negative eigenvalue if w is at most 1 / (n^T A^-1 n). If faces with other normals do not
 * resist along n, that is all of the weight of the wall's planes. Cost: constant per corner.
 */
#include "simplify/pairs/release.h"

#include "simplify/cost/placement.h"

/* Added to the diagonal, relative to the trace: keeps the matrix regular. */
#define RIDGE 1e-9

/* Buckets of the queue: the edges that were released wait until pairs of up to four times the cost, such as
 * the other pairs of the same wall, are contracted. */
enum { WAIT = 16 };

void fct_simplify_release_plane(double *q, const double *whole, v3 n, double weight) {
    double ridge = RIDGE * quadric_trace(whole);
    v3 away, minimum;
    if (!sym3_solve(whole, ridge, n, &away) ||
        !sym3_solve(whole, ridge, (v3){-whole[6], -whole[7], -whole[8]}, &minimum))
        return;
    double most = 1 / v3_dot(n, away) - ridge;
    weight = fct_min(weight, most);
    if (!(weight > 0)) return;
    quadric_add_plane(q, n, minimum, -weight);
    q[10] -= fct_min(weight, q[10]);
}

void fct_simplify_release_face(fct_simplifier *s, uint32_t f) {
    const uint32_t *t = s->triangles + 3 * (size_t)f;
    v3 a = point_position(s, t[0]);
    v3 cross = v3_cross(v3_sub(point_position(s, t[1]), a), v3_sub(point_position(s, t[2]), a));
    double twice = v3_norm(cross);
    if (!(twice > 0)) return;
    v3 n = v3_scale(cross, 1 / twice);
    for (uint32_t k = 0; k < 3; ++k) {
        double *q = point_at(s, t[k])->quadric;
        fct_simplify_release_plane(q, q, n, twice / 6);
        if (!s->steering) continue;
        uint32_t w = corner_wedge(s, 3 * f + k);
        fct_elimination e;
        q = wedge_quadric(s, w);
        fct_quadric_eliminate(q, s->steering, s->attributes + (size_t)s->channel_count * w,
                              RIDGE * (quadric_trace(q) + q[10]), &e);
        fct_simplify_release_plane(q, e.position, n, twice / 6);
    }
    s->released = true;
}

void fct_simplify_reprice(fct_simplifier *s) {
    if (!s->released) return;
    s->released = false;
    for (uint32_t e = 0; e < s->edge_count; ++e) {
        fct_edge *edge = &s->edges[e];
        uint32_t a = fct_sets_find(s->point_parents, edge->ends[0]);
        uint32_t b = fct_sets_find(s->point_parents, edge->ends[1]);
        bool open = edge->state == EDGE_QUEUED || edge->state == EDGE_OVER_BOUND;
        if (a == b || !open || !(s->walled[a] | s->walled[b])) continue;
        fct_candidate candidate;
        if (!fct_place(s, a, b, edge->ends_only, &candidate)) continue;
        uint32_t bucket = queue_bucket(candidate.key), least = s->released_bucket + WAIT;
        if (least >= QUEUE_BUCKETS) least = QUEUE_BUCKETS - 1;
        edge->bucket = (uint16_t)(bucket > least || e >= s->first_pair ? bucket : least);
        edge->state = EDGE_QUEUED;
    }
}
