/* simplify/topology/ring.c: see ring.h. Cost: linear in the corners of the point. */
#include "simplify/topology/ring.h"

uint32_t fct_simplify_gather(fct_simplifier *s, uint32_t point, uint32_t *ring) {
    uint32_t count = 0, last = FCT_NONE;
    for (uint32_t c = point_at(s, point)->first_corner; c != FCT_NONE; c = s->next_corners[c]) {
        if (corner_dead(s, c)) continue;
        if (last == FCT_NONE)
            point_at(s, point)->first_corner = c;
        else
            s->next_corners[last] = c;
        last = c;
        ring[count++] = c;
    }
    if (last == FCT_NONE)
        point_at(s, point)->first_corner = FCT_NONE;
    else
        s->next_corners[last] = FCT_NONE;
    point_at(s, point)->last_corner = last;
    return count;
}

uint32_t fct_simplify_find_side(const fct_simplifier *s, uint32_t c, uint32_t other) {
    for (; c != FCT_NONE; c = s->next_corners[c]) {
        const uint32_t *t = s->triangles + (c - c % 3);
        if (t[0] != FCT_NONE && (t[0] == other || t[1] == other || t[2] == other)) break;
    }
    return c;
}

uint32_t fct_simplify_find_apex(const fct_simplifier *s, uint32_t corner, uint32_t a) {
    uint32_t x = s->triangles[corner_next(corner)], y = s->triangles[corner_previous(corner)];
    return x == a ? y : y == a ? x : FCT_NONE;
}
