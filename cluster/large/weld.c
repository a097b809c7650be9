/* cluster/large/weld.c: joins vertices of equal position, as dual/weld.c does in memory.
 *
 * 1. A hash table finds the first vertex at each place.
 * 2. A second table finds the sides that only one face has, between places of several vertices.
 * 3. Each vertex of such a side becomes the first such vertex at its place. The triangles of these vertices
 * go to the spool `welded`, unless no vertex changes.
 *
 * A table has the memory that the budget leaves. If it is too small for all keys, several passes over the
 * file take the keys by ranges of their hash. Memory: 4 bytes and 2 bits per vertex, a table, and buffers.
 */
#include <string.h>

#include "base/hash.h"
#include "base/key.h"
#include "cluster/large/large.h"

enum {
    ROWS = 1 << 16,         /* vertices or faces per read */
    LEAST_SLOTS = 1 << 12,  /* of a table */
    SEVERAL = FCT_NONE - 1, /* in place of a face: several faces have the side */
};

/* FCT_NONE in the last member: the slot is empty. */
typedef struct place_slot {
    float position[3];
    uint32_t vertex;
} place_slot;
typedef struct side_slot {
    uint32_t low, high, face;
} side_slot;

typedef struct welder {
    fct_large *large;
    uint32_t *places;  /* per vertex: the first vertex at its place; after choose_targets, of an open vertex
                          the vertex that replaces it */
    uint32_t *crowded; /* one bit per vertex: others have its position */
    uint32_t *open;    /* one bit per vertex: it is the end of a side of one face */
    float *positions;
    uint32_t *triangles;
    void *table;
    size_t slots, used;
    uint32_t pass, passes;
    bool full; /* the table is, as only hashes that collide on purpose can make it */
} welder;

static bool is_set(const uint32_t *bits, uint32_t i) {
    return bits[i / 32] >> i % 32 & 1;
}

static void set_bit(uint32_t *bits, uint32_t i) {
    bits[i / 32] |= 1u << i % 32;
}

/* Whether a key with this hash belongs to the pass. The upper half of the hash decides, and the lower half
 * chooses the slot. */
static bool is_due(const welder *w, uint64_t hash) {
    return (hash >> 32) * w->passes >> 32 == w->pass;
}

static size_t first_slot(const welder *w, uint64_t hash) {
    return (size_t)((hash & 0xffffffffu) * w->slots >> 32);
}

/* Notes that a slot is taken. A table has a free slot in eight, so a search ends soon. */
static void note_slot(welder *w) {
    if (++w->used >= w->slots / 8 * 7) w->full = true;
}

/* Runs `visit` once per pass over an empty table for about `keys` keys of `size` bytes. begin: the share of
 * the weld that is done before. */
static fct_result run_passes(welder *w, uint64_t keys, size_t size, double begin,
                             fct_result (*visit)(welder *)) {
    fct_large *l = w->large;
    uint64_t held = 4 * (uint64_t)l->info.vertex_count, room = l->budget > held ? l->budget - held : 0;
    uint64_t wanted = keys + keys / 2 + LEAST_SLOTS, slots = room / size;
    if (slots > wanted) slots = wanted;
    if (slots < LEAST_SLOTS) slots = LEAST_SLOTS;
    w->slots = (size_t)slots, w->full = false;
    w->table = fct_allocate(l->env, w->slots, size);
    fct_result result = w->table ? FCT_OK : fct_fail_memory(l->env, "a table of vertices");
    w->passes = (uint32_t)(keys / (slots / 4 * 3)) + 1;
    for (w->pass = 0; result == FCT_OK && w->pass < w->passes; ++w->pass) {
        memset(w->table, 0xff, w->slots * size);
        w->used = 0;
        result = visit(w);
        if (result == FCT_OK && w->full) result = fct_fail_memory(l->env, "a table of vertices");
        if (result == FCT_OK) result = fct_progress(l->env, "weld", begin + .4 * w->pass / w->passes);
    }
    fct_release(l->env, w->table);
    w->table = NULL;
    return result;
}

/* --- Places --- */

static void find_place(welder *w, uint32_t vertex, const float *p) {
    place_slot *table = w->table;
    const float q[3] = {p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f}; /* -0 counts as 0 */
    uint64_t hash = fct_hash(fct_hash((uint64_t)fct_float_bits(q[0]) << 32 | fct_float_bits(q[1])) +
                             fct_float_bits(q[2]));
    if (!is_due(w, hash) || w->full) return;
    size_t i = first_slot(w, hash);
    while (table[i].vertex != FCT_NONE && memcmp(table[i].position, q, sizeof q) != 0)
        if (++i == w->slots) i = 0;
    if (table[i].vertex == FCT_NONE) {
        memcpy(table[i].position, q, sizeof q);
        table[i].vertex = vertex;
        note_slot(w);
    } else {
        set_bit(w->crowded, vertex);
        set_bit(w->crowded, table[i].vertex);
    }
    w->places[vertex] = table[i].vertex;
}

static fct_result find_places(welder *w) {
    fct_large *l = w->large;
    for (uint32_t v = 0; v < l->info.vertex_count && !w->full; v += ROWS) {
        uint32_t rows = l->info.vertex_count - v < ROWS ? l->info.vertex_count - v : ROWS;
        fct_result result = fct_stream_vertices(l->stream, v, rows, w->positions, NULL);
        if (result != FCT_OK) return result;
        for (uint32_t i = 0; i < rows; ++i) find_place(w, v + i, w->positions + 3 * (size_t)i);
    }
    return FCT_OK;
}

/* --- Open sides --- */

/* Whether a side of a triangle lies between two places of several vertices. */
static bool get_side(const welder *w, const uint32_t *triangle, int k, uint32_t *low, uint32_t *high) {
    uint32_t a = triangle[k], b = triangle[k == 2 ? 0 : k + 1];
    *low = a < b ? a : b, *high = a < b ? b : a;
    return a != b && is_set(w->crowded, a) && is_set(w->crowded, b);
}

static void note_side(welder *w, uint32_t low, uint32_t high, uint32_t face) {
    side_slot *table = w->table;
    uint64_t hash = fct_hash((uint64_t)low << 32 | high);
    if (!is_due(w, hash) || w->full) return;
    size_t i = first_slot(w, hash);
    while (table[i].face != FCT_NONE && (table[i].low != low || table[i].high != high))
        if (++i == w->slots) i = 0;
    if (table[i].face == FCT_NONE) {
        table[i] = (side_slot){low, high, face};
        note_slot(w);
    } else if (table[i].face != face) {
        table[i].face = SEVERAL;
    }
}

/* Reads the faces; notes their sides in the table, or counts them if there is no table. */
static fct_result visit_sides(welder *w, uint64_t *count) {
    fct_large *l = w->large;
    for (uint32_t f = 0; f < l->info.face_count && !w->full; f += ROWS) {
        uint32_t rows = l->info.face_count - f < ROWS ? l->info.face_count - f : ROWS, low, high;
        fct_result result = fct_stream_faces(l->stream, f, rows, w->triangles, NULL);
        if (result != FCT_OK) return result;
        for (uint32_t i = 0; i < rows; ++i)
            for (int k = 0; k < 3; ++k) {
                if (!get_side(w, w->triangles + 3 * (size_t)i, k, &low, &high)) continue;
                if (w->table)
                    note_side(w, low, high, f + i);
                else
                    ++*count;
            }
    }
    return FCT_OK;
}

/* Marks the ends of the sides of the pass that one face has. */
static fct_result mark_open(welder *w) {
    const side_slot *table = w->table;
    fct_result result = visit_sides(w, NULL);
    for (size_t i = 0; i < w->slots && result == FCT_OK && !w->full; ++i) {
        if (table[i].face == FCT_NONE || table[i].face == SEVERAL) continue;
        set_bit(w->open, table[i].low);
        set_bit(w->open, table[i].high);
    }
    return result;
}

/* --- Targets --- */

/* Replaces places[v] of each open vertex by the first open vertex at its place. Returns the number of other
 * vertices there. The entry of a first vertex that is not open holds that target meanwhile. */
static uint32_t choose_targets(welder *w) {
    uint32_t joined = 0;
    for (uint32_t v = 0; v < w->large->info.vertex_count; ++v) {
        if (!is_set(w->open, v)) continue;
        uint32_t first = w->places[v];
        if (first != v && !is_set(w->open, first)) {
            if (w->places[first] == first) w->places[first] = v;
            first = w->places[first];
        }
        w->places[v] = first;
        joined += first != v;
    }
    return joined;
}

static fct_result spool_triangles(welder *w) {
    fct_large *l = w->large;
    fct_result result = fct_spool_open(l->env, l->folder, l->path, &l->welded);
    for (uint32_t f = 0; f < l->info.face_count && result == FCT_OK; f += ROWS) {
        uint32_t rows = l->info.face_count - f < ROWS ? l->info.face_count - f : ROWS;
        result = fct_stream_faces(l->stream, f, rows, w->triangles, NULL);
        for (size_t i = 0; i < 3 * (size_t)rows && result == FCT_OK; ++i)
            if (is_set(w->open, w->triangles[i])) w->triangles[i] = w->places[w->triangles[i]];
        if (result == FCT_OK) result = fct_spool_append(&l->welded, w->triangles, 12 * (size_t)rows);
        if (result == FCT_OK) result = fct_progress(l->env, "weld", .8 + .2 * f / l->info.face_count);
    }
    return result;
}

static bool is_any_set(const uint32_t *bits, size_t words) {
    for (size_t i = 0; i < words; ++i)
        if (bits[i]) return true;
    return false;
}

static fct_result join_vertices(welder *w, size_t words) {
    uint64_t sides = 0;
    fct_result result = run_passes(w, w->large->info.vertex_count, sizeof(place_slot), 0, find_places);
    if (result != FCT_OK || !is_any_set(w->crowded, words)) return result;
    result = visit_sides(w, &sides);
    if (result == FCT_OK) result = run_passes(w, sides, sizeof(side_slot), .4, mark_open);
    return result == FCT_OK && choose_targets(w) ? spool_triangles(w) : result;
}

fct_result fct_large_weld(fct_large *large) {
    size_t vertices = large->info.vertex_count, words = vertices / 32 + 1;
    welder w = {.large = large};
    const fct_array arrays[] = {FCT_ARRAY(w.places, vertices), FCT_ARRAY_ZERO(w.crowded, words),
                                FCT_ARRAY_ZERO(w.open, words), FCT_ARRAY(w.positions, 3 * ROWS),
                                FCT_ARRAY(w.triangles, 3 * ROWS)};
    fct_result result = fct_allocate_all(large->env, arrays, FCT_LENGTH(arrays), "joined vertices");
    if (result == FCT_OK) result = join_vertices(&w, words);
    fct_release_all(large->env, arrays, FCT_LENGTH(arrays));
    return result;
}
