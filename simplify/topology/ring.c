/* simplify/topology/ring.c: see ring.h. Cost: linear in the corners of the point. */
#include "simplify/topology/ring.h"

/* Cosine of the largest angle by which the normal of a face may turn in one contraction: 84 degrees. */
#define MIN_TURN_COSINE .1

uint32_t fct_simplify_gather(fct_simplifier *s, uint32_t point, uint32_t *ring) {
    uint32_t count = 0, last = FCT_NONE;
    for (uint32_t c = s->first_corners[point]; c != FCT_NONE; c = s->next_corners[c]) {
        if (corner_dead(s, c)) continue;
        if (last == FCT_NONE)
            s->first_corners[point] = c;
        else
            s->next_corners[last] = c;
        last = c;
        ring[count++] = c;
    }
    if (last == FCT_NONE)
        s->first_corners[point] = FCT_NONE;
    else
        s->next_corners[last] = FCT_NONE;
    s->last_corners[point] = last;
    return count;
}

bool fct_simplify_folds_over(const fct_simplifier *s, const uint32_t *ring, uint32_t count, uint32_t other,
                             v3 from, v3 at) {
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t x = s->triangles[corner_next(ring[i])], y = s->triangles[corner_previous(ring[i])];
        if (x == other || y == other) continue;
        v3 px = point_position(s, x), side = v3_sub(point_position(s, y), px);
        v3 before = v3_cross(v3_sub(px, from), side), after = v3_cross(v3_sub(px, at), side);
        double before2 = v3_norm2(before), dot = v3_dot(before, after);
        if (before2 == 0) continue;
        if (!(dot > 0 && dot * dot > MIN_TURN_COSINE * MIN_TURN_COSINE * before2 * v3_norm2(after)))
            return true;
    }
    return false;
}
