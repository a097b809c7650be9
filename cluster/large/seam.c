/* cluster/large/seam.c: edges between tops across the cuts of a large mesh.
 *
 * The sides of all faces on cuts are sorted by their vertices, then by face. Where those of one mesh edge
 * belong to several parts, the edge's faces are connected as in the dual graph: in a chain in order of face
 * id, with half the length each where there are three or more. What parts had connected on their own there
 * (two of an edge's faces in the same part) goes off again, as edges of negative length, for all edges
 * between the same tops are added up.
 */
#include <string.h>

#include "base/sort.h"
#include "cluster/large/large.h"

typedef struct seam {
    fct_large *large;
    fct_seam_side *sides; /* as they were found */
    uint32_t *by_face;    /* by vertices, then face */
    uint32_t *by_part;    /* by vertices, then part, then face */
    uint32_t count;
    double scale;
    fct_top_edge *edges; /* room for twice as many as sides */
    size_t edge_count;
} seam;

static void connect(seam *s, const uint32_t *from, uint32_t count, bool first, bool last, const uint32_t *to,
                    uint32_t to_count, double sign) {
    const fct_seam_side *a = &s->sides[*from], *b = &s->sides[*to];
    double one = (double)count / (first ? 1 : 2), other = (double)to_count / (last ? 1 : 2);
    float length = (float)((double)a->length * (one < other ? one : other));
    if (a->top != b->top)
        s->edges[s->edge_count++] = (fct_top_edge){a->top, b->top, (float)((double)length * s->scale * sign)};
}

/* Connects the faces of the listed sides, which are in order of faces; returns how many faces there are. */
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

/* The sides [begin, end) of one mesh edge, in both orders. */
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
        s->by_part[i] = s->by_face[i] = i; /* the spool goes by part and by face in it */
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
