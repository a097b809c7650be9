/* simplify/cost/face.c: see face.h. Cost: three placements of edges and one 3 x 3 system. */
#include "simplify/cost/face.h"

/* The least value of r at the corners and, if `middles`, at the middles of the sides and of the face. */
static v3 find_best_place(const double *r, const v3 at[3], bool middles) {
    const v3 places[] = {at[0],
                         at[1],
                         at[2],
                         v3_scale(v3_add(at[0], at[1]), .5),
                         v3_scale(v3_add(at[1], at[2]), .5),
                         v3_scale(v3_add(at[2], at[0]), .5),
                         v3_scale(v3_add(v3_add(at[0], at[1]), at[2]), 1. / 3)};
    v3 best = places[0];
    for (int k = 1; k < (middles ? 7 : 3); ++k)
        if (quadric_at(r, places[k]) < quadric_at(r, best)) best = places[k];
    return best;
}

static v3 place_corners(const fct_simplifier *s, const double *r, const v3 at[3]) {
    if (s->def->placement == FCT_PLACE_OPTIMAL) {
        v3 middle = v3_scale(v3_add(v3_add(at[0], at[1]), at[2]), 1. / 3), delta;
        double longest2 = 0;
        for (int k = 0; k < 3; ++k) longest2 = fct_max(longest2, v3_norm2(v3_sub(at[(k + 1) % 3], at[k])));
        if (quadric_solve(r, s->def->regularization * quadric_trace(r), quadric_gradient(r, middle),
                          &delta) &&
            v3_norm2(delta) <= PLACE_REACH * PLACE_REACH * longest2)
            return v3_add(middle, delta);
    }
    return find_best_place(r, at, s->def->placement != FCT_PLACE_SUBSET);
}

bool fct_price_face(fct_simplifier *s, const uint32_t points[3], fct_face_price *out) {
    double r[POSITION_QUADRIC] = {0}, keys[3], factor = 0, reach2 = 0;
    v3 at[3];
    for (uint32_t k = 0; k < 3; ++k) {
        uint32_t a = points[k], b = points[(k + 1) % 3];
        fct_candidate side;
        if (!fct_place(s, a, b, false, &side)) return false;
        for (int i = 0; i < POSITION_QUADRIC; ++i) r[i] += .5 * side.quadric[i];
        double paint = paint_factor(s, a, b);
        keys[k] = side.key * paint;
        factor = fct_max(factor, paint);
        at[k] = point_position(s, a);
        out->order[k] = k;
    }
    for (uint32_t i = 1; i < 3; ++i)
        for (uint32_t k = i; k > 0 && keys[out->order[k]] < keys[out->order[k - 1]]; --k) {
            uint32_t swap = out->order[k];
            out->order[k] = out->order[k - 1], out->order[k - 1] = swap;
        }
    v3 place = place_corners(s, r, at);
    for (int k = 0; k < 3; ++k) reach2 += v3_norm2(v3_sub(place, at[k]));
    double energy = .5 * s->def->regularization * quadric_trace(r) * reach2;
    out->key = fct_max(keys[out->order[2]], factor * (fct_max(quadric_at(r, place), 0) + energy));
    return true;
}
