/* dual/lists.c: neighbours of every face, by a counting sort of sides and no hash table.
 *
 * In: triangles. Out: lists. Sides are put into a bucket of their lower vertex, whatever order threads get
 * there, and each bucket is sorted by (higher vertex, side), which brings the faces of a mesh edge together
 * in order of face id. Two faces with one side each on an edge note each other in place. What is left (three
 * faces or more, a face that folds onto itself) becomes connections of their own, sorted by face. Lists are
 * then written face by face. O(F), and O(v log v) for a vertex of valence v.
 */
#include "dual/lists.h"

#include <stdatomic.h>
#include <string.h>

#include "base/parallel.h"
#include "base/sort.h"
#include "base/vec.h"

enum { GRAIN = 1 << 13, FEW = 32, SEVERAL = 0x80000000u };

/* One direction of a connection on an edge that is not two plain sides. */
typedef struct connection {
    uint32_t from, to;
    float length;
} connection;

typedef struct builder {
    const fct_mesh *mesh;
    bool alone;             /* one thread: counters need no lock */
    _Atomic uint32_t *ends; /* per vertex: sides, then where its bucket ends */
    uint64_t *sides;        /* higher vertex << 32 | side, in buckets of the lower vertex */
    uint32_t *opposite;     /* per side: the face across; FCT_NONE: none; SEVERAL: see connections */
    uint32_t *boundary, *nonmanifold, *places; /* per chunk of vertices; places: of connections */
    uint32_t connection_count;
    connection *connections, *sorted; /* sorted: by (from, to), in the order found */
    fct_lists *lists;
} builder;

static inline uint32_t next_of(const builder *b, _Atomic uint32_t *counter) {
    if (!b->alone) return atomic_fetch_add_explicit(counter, 1, memory_order_relaxed);
    uint32_t value = atomic_load_explicit(counter, memory_order_relaxed);
    atomic_store_explicit(counter, value + 1, memory_order_relaxed);
    return value;
}

static void count_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    builder *b = user;
    for (size_t f = begin; f < end; ++f) {
        const uint32_t *t = b->mesh->triangles + 3 * f;
        for (int k = 0; k < 3; ++k) {
            uint32_t u = t[k], v = t[k == 2 ? 0 : k + 1];
            if (u != v) next_of(b, &b->ends[u < v ? u : v]);
        }
    }
}

static void place_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    builder *b = user;
    for (size_t f = begin; f < end; ++f) {
        const uint32_t *t = b->mesh->triangles + 3 * f;
        for (size_t k = 0; k < 3; ++k) {
            uint32_t u = t[k], v = t[k == 2 ? 0 : k + 1], low = u < v ? u : v;
            b->opposite[3 * f + k] = FCT_NONE;
            if (u != v) b->sides[next_of(b, &b->ends[low])] = (uint64_t)(u < v ? v : u) << 32 | (3 * f + k);
        }
    }
}

static void sift_down(uint64_t *keys, size_t at, size_t count) {
    uint64_t key = keys[at];
    for (size_t child; (child = 2 * at + 1) < count; at = child) {
        if (child + 1 < count && keys[child + 1] > keys[child]) ++child;
        if (keys[child] <= key) break;
        keys[at] = keys[child];
    }
    keys[at] = key;
}

/* Keys differ. By insertion, or by a heap where there are many. */
static void sort_bucket(uint64_t *keys, size_t count) {
    if (count <= FEW) {
        for (size_t i = 1; i < count; ++i) {
            uint64_t key = keys[i];
            size_t j = i;
            for (; j > 0 && keys[j - 1] > key; --j) keys[j] = keys[j - 1];
            keys[j] = key;
        }
        return;
    }
    for (size_t i = count / 2; i-- > 0;) sift_down(keys, i, count);
    for (size_t i = count; --i > 0;) {
        uint64_t key = keys[0];
        keys[0] = keys[i], keys[i] = key;
        sift_down(keys, 0, i);
    }
}

static inline uint32_t face_of(uint64_t key) {
    return (uint32_t)key / 3;
}

/* One past the sides of one mesh edge, and of one face on it. */
static size_t group_end(const uint64_t *sides, size_t i, size_t end) {
    size_t last = i + 1;
    while (last < end && sides[last] >> 32 == sides[i] >> 32) ++last;
    return last;
}
static size_t run_end(const uint64_t *sides, size_t i, size_t end) {
    size_t last = i + 1;
    while (last < end && face_of(sides[last]) == face_of(sides[i])) ++last;
    return last;
}

static size_t bucket_begin(const builder *b, size_t vertex) {
    return vertex ? atomic_load_explicit(&b->ends[vertex - 1], memory_order_relaxed) : 0;
}

static void match_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    builder *b = user;
    uint32_t boundary = 0, nonmanifold = 0, connections = 0;
    size_t from = bucket_begin(b, begin);
    for (size_t v = begin; v < end; ++v) {
        size_t last = bucket_begin(b, v + 1);
        sort_bucket(b->sides + from, last - from);
        while (from < last) {
            size_t to = group_end(b->sides, from, last);
            uint32_t first = face_of(b->sides[from]), second = face_of(b->sides[to - 1]), faces = 0;
            if (to - from == 2 && first != second) {
                b->opposite[(uint32_t)b->sides[from]] = second;
                b->opposite[(uint32_t)b->sides[to - 1]] = first;
            } else {
                for (size_t i = from; i < to; i = run_end(b->sides, i, to)) ++faces;
                boundary += faces == 1;
                nonmanifold += faces > 2;
                connections += 2 * (faces - 1);
                for (size_t i = from; i < to && faces > 1; ++i) b->opposite[(uint32_t)b->sides[i]] = SEVERAL;
            }
            from = to;
        }
    }
    b->boundary[chunk] = boundary, b->nonmanifold[chunk] = nonmanifold, b->places[chunk] = connections;
}

static double side_length(const fct_mesh *mesh, uint32_t a, uint32_t b) {
    v3 p = v3_load(mesh->positions + 3 * (size_t)a), q = v3_load(mesh->positions + 3 * (size_t)b);
    return v3_norm(v3_sub(q, p));
}

/* A chain along one mesh edge: each face and the next share it; a face in the middle gives half to either. */
static uint32_t connect(const builder *b, size_t vertex, size_t from, size_t end, uint32_t place) {
    double length = side_length(b->mesh, (uint32_t)vertex, (uint32_t)(b->sides[from] >> 32));
    for (size_t i = from, middle = run_end(b->sides, i, end); middle < end;) {
        size_t to = run_end(b->sides, middle, end);
        double first_share = (double)(middle - i) / (i == from ? 1 : 2);
        double second_share = (double)(to - middle) / (to == end ? 1 : 2);
        float shared = (float)(length * fmin(first_share, second_share));
        uint32_t p = face_of(b->sides[i]), q = face_of(b->sides[middle]);
        b->connections[place++] = (connection){p, q, shared};
        b->connections[place++] = (connection){q, p, shared};
        i = middle, middle = to;
    }
    return place;
}

static void find_connections(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    builder *b = user;
    uint32_t place = b->places[chunk];
    if (place == b->places[chunk + 1]) return;
    size_t from = bucket_begin(b, begin);
    for (size_t v = begin; v < end; ++v)
        for (size_t last = bucket_begin(b, v + 1), to; from < last; from = to) {
            to = group_end(b->sides, from, last);
            if (b->opposite[(uint32_t)b->sides[from]] == SEVERAL) place = connect(b, v, from, to, place);
        }
}

static fct_result sort_connections(const fct_env *env, builder *b) {
    uint32_t count = b->connection_count;
    uint64_t *keys = fct_allocate(env, count, sizeof *keys);
    uint32_t *order = fct_allocate(env, count, sizeof *order);
    b->sorted = fct_allocate(env, count, sizeof *b->sorted);
    fct_result result = FCT_OK;
    if (!keys || !order || !b->sorted) {
        result = fct_fail_memory(env, "the dual graph");
    } else {
        for (uint32_t i = 0; i < count; ++i) {
            keys[i] = (uint64_t)b->connections[i].from << 32 | b->connections[i].to;
            order[i] = i;
        }
        result = fct_sort_pairs(env, keys, order, count);
        for (uint32_t i = 0; result == FCT_OK && i < count; ++i) b->sorted[i] = b->connections[order[i]];
    }
    fct_release(env, keys);
    fct_release(env, order);
    return result;
}

static uint32_t counts_to_places(uint32_t *counts, size_t chunks) {
    uint32_t place = 0;
    for (size_t i = 0; i <= chunks; ++i) {
        uint32_t count = i < chunks ? counts[i] : 0;
        counts[i] = place;
        place += count;
    }
    return place;
}

static fct_result sort_sides(const fct_env *env, builder *b) {
    size_t faces = b->mesh->face_count, vertices = b->mesh->vertex_count,
           chunks = fct_chunk_count(vertices, GRAIN);
    fct_parallel_for(env, faces, GRAIN, count_sides, b);
    uint32_t place = 0;
    for (size_t v = 0; v < vertices; ++v) { /* begins now, ends when all sides are placed */
        uint32_t count = atomic_load_explicit(&b->ends[v], memory_order_relaxed);
        atomic_store_explicit(&b->ends[v], place, memory_order_relaxed);
        place += count;
    }
    fct_parallel_for(env, faces, GRAIN, place_sides, b);
    fct_result result = fct_progress(env, "dual graph", 0.4);
    if (result != FCT_OK) return result;
    fct_parallel_for(env, vertices, GRAIN, match_sides, b);
    for (size_t i = 0; i < chunks; ++i)
        b->lists->boundary_edges += b->boundary[i], b->lists->nonmanifold_edges += b->nonmanifold[i];
    b->connection_count = counts_to_places(b->places, chunks);
    if (b->connection_count == 0) return FCT_OK;
    b->connections = fct_allocate(env, b->connection_count, sizeof *b->connections);
    if (!b->connections) return fct_fail_memory(env, "the dual graph");
    fct_parallel_for(env, vertices, GRAIN, find_connections, b);
    return sort_connections(env, b);
}

/* The first sorted connection of a face that is not below `face`. */
static uint32_t first_connection(const builder *b, size_t face) {
    uint32_t low = 0, high = b->connection_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (b->sorted[middle].from < face)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

typedef struct neighbor {
    uint32_t face;
    float length;
} neighbor;

/* Puts a neighbour into a list in order, or adds to the one that is there. */
static uint32_t insert(neighbor *list, uint32_t count, uint32_t face, float length) {
    uint32_t i = count;
    while (i > 0 && list[i - 1].face > face) --i;
    if (i > 0 && list[i - 1].face == face) {
        list[i - 1].length += length;
        return count;
    }
    for (uint32_t k = count; k > i; --k) list[k] = list[k - 1];
    list[i] = (neighbor){face, length};
    return count + 1;
}

static void write_lists(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    builder *b = user;
    fct_lists *lists = b->lists;
    uint32_t at = first_connection(b, begin);
    for (size_t f = begin; f < end; ++f) {
        const uint32_t *t = b->mesh->triangles + 3 * f;
        neighbor list[9];
        uint32_t count = 0, start = (uint32_t)(3 * f) + at;
        double perimeter = 0;
        for (size_t k = 0; k < 3; ++k) {
            double length = side_length(b->mesh, t[k], t[k == 2 ? 0 : k + 1]);
            uint32_t across = b->opposite[3 * f + k];
            perimeter += length;
            if (across < SEVERAL) count = insert(list, count, across, (float)length);
        }
        for (; at < b->connection_count && b->sorted[at].from == f; ++at)
            count = insert(list, count, b->sorted[at].to, b->sorted[at].length);
        for (uint32_t k = 0; k < count; ++k)
            lists->neighbors[start + k] = list[k].face, lists->lengths[start + k] = list[k].length;
        for (uint32_t unused = start + count; unused < 3 * (uint32_t)(f + 1) + at; ++unused)
            lists->neighbors[unused] = 0;
        lists->starts[f] = start, lists->counts[f] = count;
        lists->perimeters[f] = (float)perimeter;
    }
}

static fct_result fill_lists(const fct_env *env, builder *b) {
    fct_lists *lists = b->lists;
    size_t faces = b->mesh->face_count, room = 3 * faces + b->connection_count;
    fct_release(env, b->sides);
    b->sides = NULL;
    lists->starts = fct_allocate(env, faces, sizeof *lists->starts);
    lists->counts = fct_allocate(env, faces, sizeof *lists->counts);
    lists->perimeters = fct_allocate(env, faces, sizeof *lists->perimeters);
    lists->entry_count = (uint32_t)room;
    lists->neighbors = fct_allocate(env, room + FCT_LISTS_SLACK, sizeof *lists->neighbors);
    lists->lengths = fct_allocate(env, room, sizeof *lists->lengths);
    if (room > UINT32_MAX || !lists->starts || !lists->counts || !lists->perimeters || !lists->neighbors ||
        !lists->lengths)
        return fct_fail_memory(env, "the dual graph");
    memset(lists->neighbors + room, 0, FCT_LISTS_SLACK * sizeof *lists->neighbors);
    fct_parallel_for(env, faces, GRAIN, write_lists, b);
    return fct_progress(env, "dual graph", 1);
}

fct_result fct_lists_build(const fct_env *env, const fct_mesh *mesh, fct_lists *out) {
    size_t faces = mesh->face_count, vertices = mesh->vertex_count, chunks = fct_chunk_count(vertices, GRAIN);
    *out = (fct_lists){.face_count = mesh->face_count};
    builder b = {.mesh = mesh, .lists = out, .alone = fct_env_threads(env) == 1};
    b.ends = fct_allocate_zero(env, vertices, sizeof *b.ends);
    b.sides = fct_allocate(env, faces, 3 * sizeof *b.sides);
    b.opposite = fct_allocate(env, faces, 3 * sizeof *b.opposite);
    b.boundary = fct_allocate(env, chunks, sizeof *b.boundary);
    b.nonmanifold = fct_allocate(env, chunks, sizeof *b.nonmanifold);
    b.places = fct_allocate(env, chunks + 1, sizeof *b.places);
    fct_result result;
    if (3 * faces > UINT32_MAX || !b.ends || !b.sides || !b.opposite || !b.boundary || !b.nonmanifold ||
        !b.places)
        result = fct_fail_memory(env, "the dual graph");
    else
        result = sort_sides(env, &b);
    if (result == FCT_OK) result = fill_lists(env, &b);
    fct_release(env, (void *)b.ends);
    fct_release(env, b.sides);
    fct_release(env, b.opposite);
    fct_release(env, b.boundary);
    fct_release(env, b.nonmanifold);
    fct_release(env, b.places);
    fct_release(env, b.connections);
    fct_release(env, b.sorted);
    if (result != FCT_OK) fct_lists_release(env, out);
    return result;
}

void fct_lists_release(const fct_env *env, fct_lists *lists) {
    fct_release(env, lists->starts);
    fct_release(env, lists->counts);
    fct_release(env, lists->neighbors);
    fct_release(env, lists->lengths);
    fct_release(env, lists->perimeters);
    *lists = (fct_lists){0};
}
