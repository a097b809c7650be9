/* dual/lists.c: the neighbours of every face, by a counting sort of sides.
 *
 *   1. Put each side into the bucket of its lower vertex, in any order.
 *   2. In a bucket of at most FEW sides, compare each side with all others at once. If exactly two sides of
 *      different faces match, each stores the face of the other.
 *   3. Sort any other bucket by (higher vertex, side). The faces of a mesh edge are then adjacent, by face
 * id. Edges with other than two plain sides become connections, sorted by face.
 *   4. Finish the list of each face, in place unless the face has connections.
 * O(F), plus O(v log v) per vertex of valence v.
 */
#include "dual/lists.h"

#include <stdatomic.h>
#include <string.h>

#include "base/math/simd.h"
#include "base/math/vec.h"
#include "base/parallel.h"
#include "base/sift.h"
#include "base/sort.h"

enum { GRAIN = 1 << 13, SEVERAL = 0x80000000u };
enum { FEW = 16 }; /* sides in a bucket that is matched without sorting */

/* A neighbour across a mesh edge that has other than two plain sides. */
typedef struct connection {
    uint32_t from, to;
    float length;
} connection;

typedef struct builder {
    const fct_mesh *mesh;
    double scale;
    bool alone;               /* one thread: counters need no atomic additions */
    _Atomic uint32_t *begins; /* vertex_count + 1: sides per vertex, then the begin of its bucket */
    uint64_t *sides; /* higher vertex << 32 | 4 face + number, in buckets of the lower vertex; FEW more */
    uint32_t *boundary, *nonmanifold, *places; /* per chunk of vertices; places: first connection */
    uint32_t connection_count;
    connection *connections, *sorted; /* sorted: by (from, to) */
    fct_lists *lists; /* neighbors: per side its rank in the bucket, then the face across; FCT_NONE: none;
                         SEVERAL: see connections */
} builder;

/* Counts a side at its lower vertex. Returns its rank in the bucket. */
static inline uint32_t count_side(_Atomic uint32_t *counters, uint32_t u, uint32_t v, bool alone) {
    _Atomic uint32_t *counter = &counters[u < v ? u : v];
    if (u == v) return 0;
    if (!alone) return atomic_fetch_add_explicit(counter, 1, memory_order_relaxed);
    uint32_t rank = atomic_load_explicit(counter, memory_order_relaxed);
    atomic_store_explicit(counter, rank + 1, memory_order_relaxed);
    return rank;
}

static inline void count_range(const builder *b, size_t begin, size_t end, bool alone) {
    _Atomic uint32_t *counters = b->begins;
    const uint32_t *t = b->mesh->triangles + 3 * begin;
    uint32_t *ranks = b->lists->neighbors + 3 * begin;
    for (size_t f = begin; f < end; ++f, t += 3, ranks += 3) {
        uint32_t u = t[0], v = t[1], w = t[2];
        ranks[0] = count_side(counters, u, v, alone);
        ranks[1] = count_side(counters, v, w, alone);
        ranks[2] = count_side(counters, w, u, alone);
    }
}

static void count_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const builder *b = user;
    if (b->alone)
        count_range(b, begin, end, true);
    else
        count_range(b, begin, end, false);
}

static inline size_t bucket_begin(const builder *b, size_t vertex) {
    return atomic_load_explicit(&b->begins[vertex], memory_order_relaxed);
}

/* A side from a vertex to itself has no neighbour. */
static inline void place_side(const builder *b, uint64_t *sides, uint32_t u, uint32_t v, uint32_t code,
                              uint32_t *rank) {
    if (u == v)
        *rank = FCT_NONE;
    else
        sides[bucket_begin(b, u < v ? u : v) + *rank] = (uint64_t)(u < v ? v : u) << 32 | code;
}

static void place_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const builder *b = user;
    uint64_t *sides = b->sides;
    const uint32_t *t = b->mesh->triangles + 3 * begin;
    uint32_t *ranks = b->lists->neighbors + 3 * begin;
    for (uint32_t f = (uint32_t)begin; f < end; ++f, t += 3, ranks += 3) {
        uint32_t u = t[0], v = t[1], w = t[2];
        place_side(b, sides, u, v, 4 * f, ranks);
        place_side(b, sides, v, w, 4 * f + 1, ranks + 1);
        place_side(b, sides, w, u, 4 * f + 2, ranks + 2);
    }
}

static bool less_keys(const void *keys, size_t i, size_t j) {
    return ((const uint64_t *)keys)[i] < ((const uint64_t *)keys)[j];
}

static void swap_keys(void *keys, size_t i, size_t j) {
    uint64_t *k = keys, key = k[i];
    k[i] = k[j], k[j] = key;
}

/* Keys differ. */
static void sort_bucket(uint64_t *keys, size_t count) {
    if (count > FEW) {
        fct_sift_sort(keys, count, less_keys, swap_keys);
        return;
    }
    for (size_t i = 1; i < count; ++i) {
        uint64_t key = keys[i];
        size_t j = i;
        for (; j > 0 && keys[j - 1] > key; --j) keys[j] = keys[j - 1];
        keys[j] = key;
    }
}

static inline uint32_t face_of(uint64_t side) {
    return (uint32_t)side >> 2;
}

/* The entry of the face across a side. */
static inline uint32_t *across(const builder *b, uint64_t side) {
    return &b->lists->neighbors[(uint32_t)side - face_of(side)];
}

/* The end of the sides of one mesh edge, and of one face on it. */
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

typedef struct tally {
    uint32_t boundary, nonmanifold, connections;
} tally;

/* Matches a bucket of at most FEW sides (FEW / 2 if `half`). Returns false if some faces do not meet in
 * pairs. */
static inline bool match_few(const builder *b, const uint64_t *bucket, uint32_t count, bool half, tally *t) {
    i8 low = i8_load_upper(bucket), high = half ? low : i8_load_upper(bucket + 8);
    uint32_t all = (1u << count) - 1, boundary = 0, several = 0;
    for (uint32_t i = 0; i < count; ++i) {
        i8 vertex = i8_set((uint32_t)(bucket[i] >> 32));
        uint32_t same = i8_eq(low, vertex) | (half ? 0 : i8_eq(high, vertex) << 8);
        same &= all ^ 1u << i;
        uint32_t none = !same;
        uint32_t face = face_of(bucket[__builtin_ctz(same | none << count)]);
        several |= (same & (same - 1)) | (!none & (face == face_of(bucket[i])));
        boundary += none;
        *across(b, bucket[i]) = none ? FCT_NONE : face;
    }
    if (several) return false;
    t->boundary += boundary;
    return true;
}

static void match_many(const builder *b, uint64_t *bucket, size_t count, tally *t) {
    sort_bucket(bucket, count);
    for (size_t from = 0, to; from < count; from = to) {
        to = group_end(bucket, from, count);
        uint32_t first = face_of(bucket[from]), second = face_of(bucket[to - 1]), faces = 0;
        if (to - from == 2 && first != second) {
            *across(b, bucket[from]) = second;
            *across(b, bucket[to - 1]) = first;
            continue;
        }
        for (size_t i = from; i < to; i = run_end(bucket, i, to)) ++faces;
        t->boundary += faces == 1;
        t->nonmanifold += faces > 2;
        t->connections += 2 * (faces - 1);
        for (size_t i = from; i < to; ++i) *across(b, bucket[i]) = faces > 1 ? SEVERAL : FCT_NONE;
    }
}

static void match_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    const builder *b = user;
    tally t = {0};
    const uint64_t *last = b->sides + bucket_begin(b, end);
    for (size_t v = begin; v < end; ++v) {
        uint64_t *bucket = b->sides + bucket_begin(b, v);
        size_t count = bucket_begin(b, v + 1) - bucket_begin(b, v);
        uint64_t copy[FEW + 1] = {0};
        const uint64_t *few = bucket;
        /* match_few always reads FEW sides. Another thread may be changing those of the next chunk: copy. */
        if (count <= FEW && last - bucket <= FEW) few = memcpy(copy, bucket, count * sizeof *copy);
        bool done = count <= FEW / 2 ? match_few(b, few, (uint32_t)count, true, &t)
                    : count <= FEW   ? match_few(b, few, (uint32_t)count, false, &t)
                                     : false;
        if (!done) match_many(b, bucket, count, &t);
    }
    b->boundary[chunk] = t.boundary, b->nonmanifold[chunk] = t.nonmanifold, b->places[chunk] = t.connections;
}

static double side_length(const builder *b, size_t from, uint64_t side) {
    const float *positions = b->mesh->positions;
    v3 p = v3_load(positions + 3 * from), q = v3_load(positions + 3 * (size_t)(side >> 32));
    return v3_norm(v3_sub(q, p)) * b->scale;
}

/* Connects the faces of one mesh edge in a chain. A face inside the chain gives half of its sides to either
 * neighbour. The shared length is the smaller share of the two faces. */
static uint32_t connect_faces(const builder *b, size_t vertex, size_t from, size_t end, uint32_t place) {
    double length = side_length(b, vertex, b->sides[from]);
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
    for (size_t v = begin; v < end; ++v)
        for (size_t from = bucket_begin(b, v), last = bucket_begin(b, v + 1), to; from < last; from = to) {
            to = group_end(b->sides, from, last);
            if (*across(b, b->sides[from]) == SEVERAL) place = connect_faces(b, v, from, to, place);
        }
}

static fct_result sort_connections(const fct_env *env, builder *b) {
    uint32_t count = b->connection_count;
    uint64_t *keys;
    uint32_t *order;
    const fct_array arrays[] = {FCT_ARRAY(keys, count), FCT_ARRAY(order, count), FCT_ARRAY(b->sorted, count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the dual graph");
    if (result == FCT_OK) {
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
    for (size_t v = 0; v <= vertices; ++v) {
        uint32_t count = atomic_load_explicit(&b->begins[v], memory_order_relaxed);
        atomic_store_explicit(&b->begins[v], place, memory_order_relaxed);
        place += count;
    }
    memset(b->sides + place, 0, FEW * sizeof *b->sides);
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

/* The first sorted connection of a face >= `face`. */
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

/* Inserts a neighbour in order, or adds its length to the same neighbour. Returns the new count. */
static uint32_t insert_neighbor(neighbor *list, uint32_t count, uint32_t face, float length) {
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

/* Writes the list of a face that has a boundary edge, one neighbour twice, or connections. Its connections
 * begin at number `at`. With connections, its list stands behind the lists of all plain faces. Returns the
 * first connection of later faces. */
static uint32_t write_list(const builder *b, size_t f, uint32_t at, const float lengths[3]) {
    fct_lists *lists = b->lists;
    neighbor list[9];
    uint32_t count = 0, first = at, start = 3 * (uint32_t)f;
    for (uint32_t k = 0; k < 3; ++k)
        if (lists->neighbors[start + k] < SEVERAL)
            count = insert_neighbor(list, count, lists->neighbors[start + k], lengths[k]);
    for (; at < b->connection_count && b->sorted[at].from == f; ++at)
        count = insert_neighbor(list, count, b->sorted[at].to, b->sorted[at].length);
    memset(lists->neighbors + start, 0, 3 * sizeof *lists->neighbors);
    if (at > first) {
        start = 3 * (lists->face_count + first);
        memset(lists->neighbors + start, 0, 3 * (size_t)(at - first) * sizeof *lists->neighbors);
    }
    for (uint32_t k = 0; k < count; ++k)
        lists->neighbors[start + k] = list[k].face, lists->lengths[start + k] = list[k].length;
    lists->starts[f] = start, lists->counts[f] = count;
    return at;
}

/* Lengths of the three sides of four faces, one face per lane. */
static inline void measure_sides(const builder *b, const uint32_t *triangles[4], float lengths[3][4],
                                 float perimeters[4]) {
    d4 corners[3][3], scale = d4_set(b->scale), sum = d4_set(0);
    for (int c = 0; c < 3; ++c) {
        const float *p[4];
        for (int i = 0; i < 4; ++i) p[i] = b->mesh->positions + 3 * (size_t)triangles[i][c];
        d4_load_points(p, corners[c]);
    }
    for (int c = 0; c < 3; ++c) {
        d4 squares = d4_set(0);
        for (int k = 0; k < 3; ++k) {
            d4 d = d4_sub(corners[c == 2 ? 0 : c + 1][k], corners[c][k]);
            squares = d4_add(squares, d4_mul(d, d));
        }
        d4 length = d4_mul(d4_sqrt(squares), scale);
        d4_store_floats(lengths[c], length);
        sum = d4_add(sum, length);
    }
    d4_store_floats(perimeters, sum);
}

static void write_lists(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const builder *b = user;
    fct_lists *lists = b->lists;
    uint32_t at = first_connection(b, begin);
    for (size_t f = begin; f < end;) {
        const uint32_t *triangles[4];
        float sides[3][4], perimeters[4];
        for (size_t i = 0; i < 4; ++i)
            triangles[i] = b->mesh->triangles + 3 * (f + i < end ? f + i : end - 1);
        measure_sides(b, triangles, sides, perimeters);
        for (size_t i = 0; i < 4 && f < end; ++i, ++f) {
            const uint32_t *n = lists->neighbors + 3 * f;
            float *lengths = lists->lengths + 3 * f;
            for (int k = 0; k < 3; ++k) lengths[k] = sides[k][i];
            lists->perimeters[f] = perimeters[i];
            lists->starts[f] = (uint32_t)(3 * f), lists->counts[f] = 3;
            if ((n[0] | n[1] | n[2]) >= SEVERAL || n[0] == n[1] || n[1] == n[2] || n[2] == n[0])
                at = write_list(b, f, at, (const float[3]){sides[0][i], sides[1][i], sides[2][i]});
        }
    }
}

/* Moves the neighbours to an array with room for connections. */
static fct_result make_room(const fct_env *env, const builder *b, size_t room) {
    fct_lists *lists = b->lists;
    uint32_t *neighbors = fct_allocate(env, room + FCT_LISTS_SLACK, sizeof *neighbors);
    if (!neighbors) return fct_fail_memory(env, "the dual graph");
    memcpy(neighbors, lists->neighbors, 3 * (size_t)lists->face_count * sizeof *neighbors);
    fct_release(env, lists->neighbors);
    lists->neighbors = neighbors;
    return FCT_OK;
}

static fct_result fill_lists(const fct_env *env, builder *b) {
    fct_lists *lists = b->lists;
    size_t faces = b->mesh->face_count, room = 3 * (faces + b->connection_count);
    fct_release(env, b->sides);
    b->sides = NULL;
    if (b->connection_count > 0) {
        fct_result result = make_room(env, b, room);
        if (result != FCT_OK) return result;
    }
    memset(lists->neighbors + room, 0, FCT_LISTS_SLACK * sizeof *lists->neighbors);
    if (room > UINT32_MAX) return fct_fail_memory(env, "the dual graph");
    lists->entry_count = (uint32_t)room;
    const fct_array arrays[] = {FCT_ARRAY(lists->starts, faces), FCT_ARRAY(lists->counts, faces),
                                FCT_ARRAY(lists->perimeters, faces), FCT_ARRAY(lists->lengths, room)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the dual graph");
    if (result != FCT_OK) return result;
    fct_parallel_for(env, faces, GRAIN, write_lists, b);
    return fct_progress(env, "dual graph", 1);
}

fct_result fct_lists_build(const fct_env *env, const fct_mesh *mesh, double scale, fct_lists *out) {
    size_t faces = mesh->face_count, vertices = mesh->vertex_count, chunks = fct_chunk_count(vertices, GRAIN);
    *out = (fct_lists){0};
    if (4 * faces > UINT32_MAX) return fct_fail_memory(env, "the dual graph");
    out->face_count = mesh->face_count;
    builder b = {.mesh = mesh, .scale = scale, .lists = out, .alone = fct_env_threads(env) == 1};
    const fct_array arrays[] = {FCT_ARRAY(out->neighbors, 3 * faces + FCT_LISTS_SLACK),
                                FCT_ARRAY_ZERO(b.begins, vertices + 1),
                                FCT_ARRAY(b.sides, 3 * faces + FEW),
                                FCT_ARRAY(b.boundary, chunks),
                                FCT_ARRAY(b.nonmanifold, chunks),
                                FCT_ARRAY(b.places, chunks + 1)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the dual graph");
    if (result == FCT_OK) result = sort_sides(env, &b);
    if (result == FCT_OK) result = fill_lists(env, &b);
    fct_release(env, (void *)b.begins);
    fct_release(env, b.sides);
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
