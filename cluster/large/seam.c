/* cluster/large/seam.c: edges between tops across the cuts of a large mesh.
 *
 * 1. Sort the sides of all faces on cuts by their vertices, then by face. The sides of one mesh edge become
 *    neighbours.
 * 2. If the sides of a mesh edge belong to several parts, connect its faces as the dual graph does: in a
 * chain in the order of face ids. If the chain has three or more faces, each connection has half the length.
 * 3. Take back the connections that a part made at this mesh edge by itself: emit the same edges with
 * negative length. contract.c adds up all edges between the same tops.
 */
#include <string.h>

#include "base/sort.h"
#include "cluster/large/large.h"

typedef struct seam {
    fct_large *large;
    fct_seam_side *sides; /* by part, then by face within the part */
    uint32_t *by_face;    /* sides sorted by vertices, then face */
    uint32_t *by_part;    /* sides sorted by vertices, then part, then face */
    uint32_t count;
    double scale;
    /* Room for 2 x count: a chain adds fewer edges than it has sides, and each side is in two chains. */
    fct_top_edge *edges;
    size_t edge_count;
} seam;

/* Adds an edge between the faces of two groups of sides (one face each). A face in the middle of the chain
 * shares its sides with two neighbours. */
static void connect(seam *s, const uint32_t *from, uint32_t count, bool first, bool last, const uint32_t *to,
                    uint32_t to_count, double sign) {
    const fct_seam_side *a = &s->sides[*from], *b = &s->sides[*to];
    double one = (double)count / (first ? 1 : 2), other = (double)to_count / (last ? 1 : 2);
    float length = (float)((double)a->length * (one < other ? one : other));
    if (a->top != b->top)
        s->edges[s->edge_count++] = (fct_top_edge){a->top, b->top, (float)((double)length * s->scale * sign)};
}

/* Connects the faces of the listed sides, which are in the order of faces. Returns the number of faces. */
static uint32_t chain(seam *s, const uint32_t *list, uint32_t count, double sign) {
    uint32_t faces = 0;
    for (uint32_t i = 0, before = 0; i < count;) {
        uint32_t end = i;
        while (end < count && s->sides[list[end]].face == s->sides[list[i]].face) ++end;
        if (faces++ > 0)
            connect(s, list + before, i - before, before == 0, end == count, list + i, end - i, sign);
        before = i, i = end;
    }
    return faces;
}

/* Connects the faces of one mesh edge, whose sides are [begin, end) in both orders. */
static void join_group(seam *s, uint32_t begin, uint32_t end) {
    fct_large *l = s->large;
    const uint32_t *list = s->by_part;
    if (s->sides[list[begin]].part == s->sides[list[end - 1]].part) return;
    l->nonmanifold_edges += chain(s, s->by_face + begin, end - begin, 1) > 2;
    for (uint32_t i = begin, last; i < end; i = last) {
        for (last = i + 1; last < end && s->sides[list[last]].part == s->sides[list[i]].part;) ++last;
        uint32_t inside = chain(s, list + i, last - i, -1);
        l->boundary_edges -= inside == 1;
        l->nonmanifold_edges -= inside > 2;
    }
}

static fct_result sort_by_edge(seam *s, uint64_t *keys, uint32_t *order) {
    for (uint32_t i = 0; i < s->count; ++i)
        keys[i] = (uint64_t)s->sides[order[i]].low << 32 | s->sides[order[i]].high;
    return fct_sort_pairs(s->large->env, keys, order, s->count);
}

static fct_result find_edges(seam *s, uint64_t *keys) {
    const fct_env *env = s->large->env;
    for (uint32_t i = 0; i < s->count; ++i) {
        keys[i] = s->sides[i].face;
        s->by_part[i] = s->by_face[i] = i; /* the spool is in the order of parts, then of faces in a part */
    }
    fct_result result = fct_sort_pairs(env, keys, s->by_face, s->count);
    if (result == FCT_OK) result = sort_by_edge(s, keys, s->by_face);
    if (result == FCT_OK) result = sort_by_edge(s, keys, s->by_part);
    if (result != FCT_OK) return result;
    for (uint32_t i = 0, end; i < s->count; i = end) {
        for (end = i + 1; end < s->count && keys[end] == keys[i];) ++end;
        join_group(s, i, end);
    }
    return fct_spool_append(&s->large->edges, s->edges, s->edge_count * sizeof *s->edges);
}

fct_result fct_large_seams(fct_large *large) {
    const fct_env *env = large->env;
    seam s = {.large = large, .count = (uint32_t)(large->sides.size / sizeof *s.sides)};
    s.scale = fct_metric_make(large->def, &large->bounds).scale;
    s.sides = fct_allocate(env, s.count, sizeof *s.sides);
    s.by_face = fct_allocate(env, s.count, sizeof *s.by_face);
    s.by_part = fct_allocate(env, s.count, sizeof *s.by_part);
    s.edges = fct_allocate(env, s.count, 2 * sizeof *s.edges);
    uint64_t *keys = fct_allocate(env, s.count, sizeof *keys);
    fct_result result;
    if (!s.sides || !s.by_face || !s.by_part || !s.edges || !keys)
        result = fct_fail_memory(env, "the seams of a mesh");
    else
        result = fct_spool_read(&large->sides, 0, s.sides, s.count * sizeof *s.sides);
    if (result == FCT_OK) result = find_edges(&s, keys);
    fct_release(env, s.sides);
    fct_release(env, s.by_face);
    fct_release(env, s.by_part);
    fct_release(env, s.edges);
    fct_release(env, keys);
    fct_spool_close(&large->sides);
    return result;
}
