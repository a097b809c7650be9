/* dual/dual.c: the dual graph by two sorts and no hash table.
 *
 * In: triangles. Out: pairs of neighbouring faces in (a, b) order with the length they share. Sorting the 3F
 * sides by their vertex pair brings the faces of a mesh edge together in order of face id; the connections
 * found there are sorted again by face pair, and equal pairs become one edge. Chunks own the groups that
 * begin in them, so the result does not depend on threads. O(F log F); a hub of any valence costs no more.
 */
#include "facetree/dual.h"

#include <string.h>

#include "base/parallel.h"
#include "base/sort.h"
#include "base/vec.h"

enum { GRAIN = 1 << 15 };

/* A group of sides on one mesh edge, cut into runs of one face each. */
typedef struct builder {
    const fct_mesh *mesh;
    float *perimeters;
    unsigned bits; /* of a vertex id */
    unsigned face_bits;
    uint64_t none; /* key of a side that connects nothing */
    size_t side_count, connection_count;
    uint64_t *keys;                   /* of the sides, in order */
    uint32_t *sides;                  /* 3 face + corner, in order of key, then face */
    uint32_t *counts;                 /* per chunk: connections, then their first place */
    uint32_t *boundary, *nonmanifold; /* per chunk */
    uint64_t *pairs;
    uint32_t *order;
    float *lengths; /* of the connections, by place of emission */
} builder;

static double side_length(const fct_mesh *mesh, uint32_t a, uint32_t b) {
    v3 p = v3_load(mesh->positions + 3 * (size_t)a), q = v3_load(mesh->positions + 3 * (size_t)b);
    return v3_norm(v3_sub(q, p));
}

static unsigned bit_count(uint32_t value) {
    return value ? 32 - (unsigned)__builtin_clz(value) : 1;
}

static void list_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    builder *b = user;
    for (size_t f = begin; f < end; ++f) {
        const uint32_t *t = b->mesh->triangles + 3 * f;
        double perimeter = 0;
        for (int k = 0; k < 3; ++k) {
            uint32_t u = t[k], v = t[k == 2 ? 0 : k + 1];
            perimeter += side_length(b->mesh, u, v);
            uint64_t low = u < v ? u : v, high = u < v ? v : u;
            b->keys[3 * f + (size_t)k] = u == v ? b->none : low << b->bits | high;
            b->sides[3 * f + (size_t)k] = (uint32_t)(3 * f + (size_t)k);
        }
        b->perimeters[f] = (float)perimeter;
    }
}

/* One past the sides of the group that begins at i. */
static size_t group_end(const builder *b, size_t i) {
    size_t end = i + 1;
    while (end < b->side_count && b->keys[end] == b->keys[i]) ++end;
    return end;
}

/* One past the sides of the face whose sides begin at i, in a group that ends at end. */
static size_t run_end(const builder *b, size_t i, size_t end) {
    uint32_t face = b->sides[i] / 3;
    size_t run = i + 1;
    while (run < end && b->sides[run] / 3 == face) ++run;
    return run;
}

static bool begins_group(const builder *b, size_t i) {
    return b->keys[i] != b->none && (i == 0 || b->keys[i - 1] != b->keys[i]);
}

static void count_connections(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    builder *b = user;
    uint32_t connections = 0, boundary = 0, nonmanifold = 0;
    for (size_t i = begin; i < end; ++i) {
        if (!begins_group(b, i)) continue;
        size_t last = group_end(b, i);
        uint32_t faces = 0;
        for (size_t j = i; j < last; j = run_end(b, j, last)) ++faces;
        connections += faces - 1;
        boundary += faces == 1;
        nonmanifold += faces > 2;
    }
    b->counts[chunk] = connections, b->boundary[chunk] = boundary, b->nonmanifold[chunk] = nonmanifold;
}

static void emit_connections(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    builder *b = user;
    uint32_t place = b->counts[chunk];
    for (size_t i = begin; i < end; ++i) {
        if (!begins_group(b, i)) continue;
        size_t last = group_end(b, i), from = i, middle = run_end(b, i, last);
        if (middle == last) continue;
        uint64_t mask = ((uint64_t)1 << b->bits) - 1;
        double length =
            side_length(b->mesh, (uint32_t)(b->keys[i] >> b->bits), (uint32_t)(b->keys[i] & mask));
        while (middle < last) {
            size_t to = run_end(b, middle, last);
            double first_share = (double)(middle - from) / (from == i ? 1 : 2);
            double second_share = (double)(to - middle) / (to == last ? 1 : 2);
            b->pairs[place] = (uint64_t)(b->sides[from] / 3) << b->face_bits | b->sides[middle] / 3;
            b->order[place] = place;
            b->lengths[place] = (float)(length * fmin(first_share, second_share));
            ++place;
            from = middle, middle = to;
        }
    }
}

static void count_edges(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    builder *b = user;
    uint32_t count = 0;
    for (size_t i = begin; i < end; ++i) count += i == 0 || b->pairs[i - 1] != b->pairs[i];
    b->counts[chunk] = count;
}

typedef struct writer {
    builder *b;
    fct_dual *dual;
} writer;

static void write_edges(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    writer *w = user;
    builder *b = w->b;
    uint64_t mask = ((uint64_t)1 << b->face_bits) - 1;
    uint32_t place = b->counts[chunk];
    for (size_t i = begin; i < end; ++i) {
        if (i > 0 && b->pairs[i - 1] == b->pairs[i]) continue;
        double length = 0;
        for (size_t j = i; j < b->connection_count && b->pairs[j] == b->pairs[i]; ++j)
            length += b->lengths[b->order[j]];
        w->dual->edges[2 * (size_t)place] = (uint32_t)(b->pairs[i] >> b->face_bits);
        w->dual->edges[2 * (size_t)place + 1] = (uint32_t)(b->pairs[i] & mask);
        w->dual->lengths[place++] = (float)length;
    }
}

static size_t counts_to_places(uint32_t *counts, size_t chunks) {
    size_t total = 0;
    for (size_t i = 0; i < chunks; ++i) {
        uint32_t count = counts[i];
        counts[i] = (uint32_t)total;
        total += count;
    }
    return total;
}

static fct_result find_connections(const fct_env *env, builder *b, fct_dual *out) {
    size_t faces = b->mesh->face_count, chunks = fct_chunk_count(b->side_count, GRAIN);
    fct_parallel_for(env, faces, GRAIN, list_sides, b);
    fct_result result = fct_sort_pairs(env, b->keys, b->sides, b->side_count);
    if (result != FCT_OK) return result;
    result = fct_progress(env, "dual graph", 0.5);
    if (result != FCT_OK) return result;
    fct_parallel_for(env, b->side_count, GRAIN, count_connections, b);
    for (size_t i = 0; i < chunks; ++i)
        out->boundary_edges += b->boundary[i], out->nonmanifold_edges += b->nonmanifold[i];
    b->connection_count = counts_to_places(b->counts, chunks);
    b->pairs = fct_allocate(env, b->connection_count, sizeof *b->pairs);
    b->order = fct_allocate(env, b->connection_count, sizeof *b->order);
    b->lengths = fct_allocate(env, b->connection_count, sizeof *b->lengths);
    if (!b->pairs || !b->order || !b->lengths) return fct_fail_memory(env, "the dual graph");
    fct_parallel_for(env, b->side_count, GRAIN, emit_connections, b);
    return FCT_OK;
}

static fct_result join_connections(const fct_env *env, builder *b, fct_dual *out) {
    fct_release(env, b->keys);
    fct_release(env, b->sides);
    b->keys = NULL, b->sides = NULL;
    fct_result result = fct_sort_pairs(env, b->pairs, b->order, b->connection_count);
    if (result != FCT_OK) return result;
    fct_parallel_for(env, b->connection_count, GRAIN, count_edges, b);
    out->edge_count = (uint32_t)counts_to_places(b->counts, fct_chunk_count(b->connection_count, GRAIN));
    out->edges = fct_allocate(env, out->edge_count, 2 * sizeof *out->edges);
    out->lengths = fct_allocate(env, out->edge_count, sizeof *out->lengths);
    if (!out->edges || !out->lengths) return fct_fail_memory(env, "the dual graph");
    writer w = {b, out};
    fct_parallel_for(env, b->connection_count, GRAIN, write_edges, &w);
    return fct_progress(env, "dual graph", 1);
}

fct_result fct_dual_build(const fct_env *env, const fct_mesh *mesh, fct_dual *out) {
    *out = (fct_dual){.face_count = mesh->face_count};
    size_t sides = 3 * (size_t)mesh->face_count, chunks = fct_chunk_count(sides, GRAIN);
    builder b = {.mesh = mesh,
                 .side_count = sides,
                 .bits = bit_count(mesh->vertex_count),
                 .face_bits = bit_count(mesh->face_count)};
    b.none = ((uint64_t)1 << 2 * b.bits) - 1; /* no vertex has id 2^bits - 1 on both sides */
    b.keys = fct_allocate(env, sides, sizeof *b.keys);
    b.sides = fct_allocate(env, sides, sizeof *b.sides);
    b.counts = fct_allocate(env, chunks, sizeof *b.counts);
    b.boundary = fct_allocate(env, chunks, sizeof *b.boundary);
    b.nonmanifold = fct_allocate(env, chunks, sizeof *b.nonmanifold);
    b.perimeters = out->perimeters = fct_allocate(env, mesh->face_count, sizeof *out->perimeters);
    fct_result result;
    if (!b.keys || !b.sides || !b.counts || !b.boundary || !b.nonmanifold || !out->perimeters)
        result = fct_fail_memory(env, "the dual graph");
    else
        result = find_connections(env, &b, out);
    if (result == FCT_OK) result = join_connections(env, &b, out);
    fct_release(env, b.keys);
    fct_release(env, b.sides);
    fct_release(env, b.counts);
    fct_release(env, b.boundary);
    fct_release(env, b.nonmanifold);
    fct_release(env, b.pairs);
    fct_release(env, b.order);
    fct_release(env, b.lengths);
    if (result != FCT_OK) fct_dual_release(env, out);
    return result;
}

void fct_dual_release(const fct_env *env, fct_dual *dual) {
    fct_release(env, dual->edges);
    fct_release(env, dual->lengths);
    fct_release(env, dual->perimeters);
    *dual = (fct_dual){0};
}
