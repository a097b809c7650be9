/* simplify/link.c: the link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999): contracting an edge keeps the
 * topology when what surrounds both ends is what surrounds the edge. An open boundary counts as one more
 * point that all boundary edges see; edges of more than two faces are not touched.
 */
#include "simplify/state.h"

/* Marks hold, for a neighbour x of a: epoch * 4 + the number of faces at edge a-x, at most 3. */
static void mark_ring(fct_simplifier *s, const uint32_t *ring, uint32_t count) {
    s->link_epoch += 4;
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t k = 0; k < 2; ++k) {
            uint32_t x = s->triangles[k ? corner_previous(ring[i]) : corner_next(ring[i])];
            uint32_t *mark = &s->link_marks[x];
            *mark = *mark - *mark % 4 == s->link_epoch ? *mark + (*mark % 4 < 3) : s->link_epoch + 1;
        }
}

static uint32_t faces_at(const fct_simplifier *s, uint32_t x) {
    uint32_t mark = s->link_marks[x];
    return mark - mark % 4 == s->link_epoch ? mark % 4 : 0;
}

typedef struct ring_shape {
    bool boundary, regular;
} ring_shape;

static ring_shape ring_shape_of(const fct_simplifier *s, const uint32_t *ring, uint32_t count) {
    ring_shape shape = {false, true};
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t k = 0; k < 2; ++k) {
            uint32_t faces = faces_at(s, s->triangles[k ? corner_previous(ring[i]) : corner_next(ring[i])]);
            if (faces == 1) shape.boundary = true;
            if (faces > 2) shape.regular = false;
        }
    return shape;
}

bool fct_simplify_link_holds(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b) {
    if (count_a == 0) return false; /* a hub */
    mark_ring(s, s->ring_b, count_b);
    ring_shape at_b = ring_shape_of(s, s->ring_b, count_b);
    uint32_t open_b[2] = {FCT_NONE, FCT_NONE}, open_count = 0; /* boundary neighbours of b beside a */
    for (uint32_t i = 0; i < count_b; ++i)
        for (uint32_t k = 0; k < 2; ++k) {
            uint32_t x = s->triangles[k ? corner_previous(s->ring_b[i]) : corner_next(s->ring_b[i])];
            if (faces_at(s, x) != 1 || x == a) continue;
            if (open_count == 2) return false;
            open_b[open_count++] = x;
        }
    mark_ring(s, s->ring_a, count_a);
    ring_shape at_a = ring_shape_of(s, s->ring_a, count_a);
    if (!at_a.regular || !at_b.regular) return false;
    bool open_edge = faces_at(s, b) == 1;
    if (at_a.boundary && at_b.boundary && !open_edge) return false;
    for (uint32_t i = 0; i < open_count; ++i)
        if (faces_at(s, open_b[i]) == 1) return false;

    /* Common neighbours must be apexes of the faces at the edge, and no face of both may lie across from it.
     */
    uint32_t common = 0, apexes = 0;
    for (uint32_t i = 0; i < count_b; ++i) {
        uint32_t x = s->triangles[corner_next(s->ring_b[i])];
        uint32_t y = s->triangles[corner_previous(s->ring_b[i])];
        apexes += x == a || y == a;
        if (x != a && faces_at(s, x)) ++common;
        if (y != a && faces_at(s, y)) ++common;
        if (x == a || y == a || !faces_at(s, x) || !faces_at(s, y)) continue;
        for (uint32_t k = 0; k < count_a; ++k) {
            uint32_t u = s->triangles[corner_next(s->ring_a[k])];
            uint32_t v = s->triangles[corner_previous(s->ring_a[k])];
            if ((u == x && v == y) || (u == y && v == x)) return false;
        }
    }
    /* Each common neighbour was met once for each of b's faces with it: twice, or once on the boundary. */
    for (uint32_t i = 0; i < count_b; ++i) {
        uint32_t x = s->triangles[corner_next(s->ring_b[i])];
        uint32_t y = s->triangles[corner_previous(s->ring_b[i])];
        uint32_t apex = x == a ? y : y == a ? x : FCT_NONE;
        if (apex == FCT_NONE) continue;
        uint32_t met = 0;
        for (uint32_t k = 0; k < count_b; ++k)
            met += s->triangles[corner_next(s->ring_b[k])] == apex ||
                   s->triangles[corner_previous(s->ring_b[k])] == apex;
        if (met > common) return false;
        common -= met;
    }
    return common == 0 && apexes > 0;
}
