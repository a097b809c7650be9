/* simplify/topology/link.c: the link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999).
 *
 * A contraction of a-b keeps the topology if the intersection of the links of a and b is the link of the
 * edge. An open boundary counts as one more vertex, which all boundary edges see. Edges of more than two
 * faces, and ends at such edges, fail. Cost: O(|ring a| * |ring b|) in the worst case.
 */
#include "simplify/topology/link.h"

/* For each neighbour x of the ring's point p: link_marks[x] = epoch * 4 + the number of faces at the edge
 * p-x, at most 3. A new epoch makes all old marks invalid. */
static void mark_ring(fct_simplifier *s, const uint32_t *ring, uint32_t count) {
    s->link_epoch += 4;
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t k = 0; k < 2; ++k) {
            uint32_t x = s->triangles[k ? corner_previous(ring[i]) : corner_next(ring[i])];
            uint32_t *mark = &s->link_marks[x];
            *mark = *mark - *mark % 4 == s->link_epoch ? *mark + (*mark % 4 < 3) : s->link_epoch + 1;
        }
}

/* The number of faces at the edge from x to the point whose ring was marked last; at most 3. */
static uint32_t count_edge_faces(const fct_simplifier *s, uint32_t x) {
    uint32_t mark = s->link_marks[x];
    return mark - mark % 4 == s->link_epoch ? mark % 4 : 0;
}

typedef struct ring_shape {
    bool boundary; /* an edge of the point has one face */
    bool regular;  /* no edge of the point has more than two faces */
} ring_shape;

static ring_shape find_ring_shape(const fct_simplifier *s, const uint32_t *ring, uint32_t count) {
    ring_shape shape = {false, true};
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t k = 0; k < 2; ++k) {
            uint32_t faces =
                count_edge_faces(s, s->triangles[k ? corner_previous(ring[i]) : corner_next(ring[i])]);
            if (faces == 1) shape.boundary = true;
            if (faces > 2) shape.regular = false;
        }
    return shape;
}

bool fct_simplify_link_holds(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b) {
    if (count_a == 0) return false; /* a hub */
    mark_ring(s, s->ring_b, count_b);
    ring_shape at_b = find_ring_shape(s, s->ring_b, count_b);
    /* The neighbours of b along its boundary, except a. */
    uint32_t open_b[2] = {FCT_NONE, FCT_NONE}, open_count = 0;
    for (uint32_t i = 0; i < count_b; ++i)
        for (uint32_t k = 0; k < 2; ++k) {
            uint32_t x = s->triangles[k ? corner_previous(s->ring_b[i]) : corner_next(s->ring_b[i])];
            if (count_edge_faces(s, x) != 1 || x == a) continue;
            if (open_count == 2) return false;
            open_b[open_count++] = x;
        }
    mark_ring(s, s->ring_a, count_a);
    ring_shape at_a = find_ring_shape(s, s->ring_a, count_a);
    if (!at_a.regular || !at_b.regular) return false;
    bool open_edge = count_edge_faces(s, b) == 1;
    if (at_a.boundary && at_b.boundary && !open_edge) return false;
    for (uint32_t i = 0; i < open_count; ++i)
        if (count_edge_faces(s, open_b[i]) == 1) return false;

    /* A common neighbour must be the apex of a face at the edge. No triangle may lie opposite both ends. */
    uint32_t common = 0, apexes = 0;
    for (uint32_t i = 0; i < count_b; ++i) {
        uint32_t x = s->triangles[corner_next(s->ring_b[i])];
        uint32_t y = s->triangles[corner_previous(s->ring_b[i])];
        apexes += x == a || y == a;
        if (x != a && count_edge_faces(s, x)) ++common;
        if (y != a && count_edge_faces(s, y)) ++common;
        if (x == a || y == a || !count_edge_faces(s, x) || !count_edge_faces(s, y)) continue;
        for (uint32_t k = 0; k < count_a; ++k) {
            uint32_t u = s->triangles[corner_next(s->ring_a[k])];
            uint32_t v = s->triangles[corner_previous(s->ring_a[k])];
            if ((u == x && v == y) || (u == y && v == x)) return false;
        }
    }
    /* `common` counts a common neighbour once per face that it shares with b. Subtract those of the apexes:
     * the condition holds if nothing remains. */
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
