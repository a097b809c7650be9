/* dual/dual.c: the dual graph as pairs of neighbouring faces, sorted by (a, b). The pairs are the entries of
 * the lists whose neighbour has the greater id. */
#include "facetree/dual.h"

#include "base/parallel.h"
#include "dual/lists.h"

enum { GRAIN = 1 << 14 };

typedef struct writer {
    const fct_lists *lists;
    fct_dual *dual;
    uint32_t *places; /* per chunk: number of edges, then the place of its first edge */
} writer;

static void count_edges(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    writer *w = user;
    uint32_t count = 0;
    for (size_t f = begin; f < end; ++f)
        for (uint32_t i = 0; i < w->lists->counts[f]; ++i)
            count += w->lists->neighbors[w->lists->starts[f] + i] > f;
    w->places[chunk] = count;
}

static void write_edges(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    writer *w = user;
    const fct_lists *lists = w->lists;
    size_t place = w->places[chunk];
    for (size_t f = begin; f < end; ++f)
        for (size_t i = lists->starts[f], first = place; i < lists->starts[f] + lists->counts[f]; ++i) {
            uint32_t neighbor = lists->neighbors[i], *edges = w->dual->edges;
            float *lengths = w->dual->lengths;
            if (neighbor < f) continue;
            size_t to = place++;
            for (; to > first && edges[2 * to - 1] > neighbor; --to)
                edges[2 * to + 1] = edges[2 * to - 1], lengths[to] = lengths[to - 1];
            edges[2 * (place - 1)] = (uint32_t)f;
            edges[2 * to + 1] = neighbor, lengths[to] = lists->lengths[i];
        }
}

static fct_result write_dual(const fct_env *env, fct_lists *lists, fct_dual *out) {
    size_t faces = lists->face_count, chunks = fct_chunk_count(faces, GRAIN);
    writer w = {lists, out, fct_allocate(env, chunks, sizeof *w.places)};
    if (!w.places) return fct_fail_memory(env, "the dual graph");
    fct_parallel_for(env, faces, GRAIN, count_edges, &w);
    for (size_t i = 0; i < chunks; ++i) {
        uint32_t count = w.places[i];
        w.places[i] = out->edge_count;
        out->edge_count += count;
    }
    const fct_array arrays[] = {FCT_ARRAY(out->edges, 2 * (size_t)out->edge_count),
                                FCT_ARRAY(out->lengths, out->edge_count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the dual graph");
    if (result == FCT_OK) fct_parallel_for(env, faces, GRAIN, write_edges, &w);
    fct_release(env, w.places);
    return result;
}

fct_result fct_dual_build(const fct_env *env, const fct_mesh *mesh, fct_dual *out) {
    *out = (fct_dual){.face_count = mesh->face_count};
    fct_lists lists;
    fct_result result = fct_lists_build(env, mesh, 1, &lists);
    if (result != FCT_OK) return result;
    result = write_dual(env, &lists, out);
    if (result == FCT_OK) {
        out->perimeters = lists.perimeters;
        lists.perimeters = NULL;
        out->boundary_edges = lists.boundary_edges, out->nonmanifold_edges = lists.nonmanifold_edges;
    } else {
        fct_dual_release(env, out);
    }
    fct_lists_release(env, &lists);
    return result;
}

void fct_dual_release(const fct_env *env, fct_dual *dual) {
    fct_release(env, dual->edges);
    fct_release(env, dual->lengths);
    fct_release(env, dual->perimeters);
    *dual = (fct_dual){0};
}
