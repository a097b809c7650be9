/* dual/weld.c: joins the vertices of open sides that have equal positions.
 *
 * 1. A hash table finds the first vertex at each place. Without a second vertex anywhere, the weld ends here.
 * 2. A side is open if no other face has it. Only sides between places of several vertices can matter; they
 * are sorted by their ends.
 * 3. Each vertex of an open side becomes the first such vertex at its place.
 * Cost: linear, about 40 instructions per vertex, plus a sort of the sides at places of several vertices.
 */
#include <string.h>

#include "base/env.h"
#include "base/key.h"
#include "base/sort.h"
#include "facetree/dual.h"

typedef struct joiner {
    const fct_mesh *mesh;
    uint32_t *places;  /* per vertex: the first vertex with its position */
    uint8_t *crowded;  /* per first vertex: others have its position */
    uint32_t *targets; /* per first vertex: the first vertex of an open side at its place; FCT_NONE: none */
    uint8_t *open;     /* per vertex: it is the end of an open side */
} joiner;

/* -0 counts as 0. */
static uint64_t hash_position(const float *p) {
    uint64_t x = fct_float_bits(p[0] + 0.0f), y = fct_float_bits(p[1] + 0.0f),
             z = fct_float_bits(p[2] + 0.0f);
    uint64_t h = (x << 32 | y) * 0x9e3779b97f4a7c15u ^ z * 0xbf58476d1ce4e5b9u;
    h = (h ^ h >> 29) * 0x94d049bb133111ebu;
    return h ^ h >> 32;
}

static bool same_position(const float *p, const float *q) {
    return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

/* Sets places[v] to v, except where an earlier vertex has the position. Returns whether there is one. */
static bool find_places(joiner *j, uint32_t *table, size_t size) {
    const float *positions = j->mesh->positions;
    bool several = false;
    memset(table, 0xff, size * sizeof *table);
    for (uint32_t v = 0; v < j->mesh->vertex_count; ++v) {
        const float *p = positions + 3 * (size_t)v;
        size_t slot = hash_position(p) & (size - 1);
        while (table[slot] != FCT_NONE && !same_position(p, positions + 3 * (size_t)table[slot]))
            slot = (slot + 1) & (size - 1);
        if (table[slot] == FCT_NONE) table[slot] = v;
        j->places[v] = table[slot];
        several |= table[slot] != v;
    }
    return several;
}

static fct_result list_places(const fct_env *env, joiner *j, bool *several) {
    size_t size = 64;
    while (size < 2 * (size_t)j->mesh->vertex_count) size *= 2;
    uint32_t *table;
    const fct_array arrays[] = {FCT_ARRAY(table, size), FCT_ARRAY(j->places, j->mesh->vertex_count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "a table of vertices");
    if (result == FCT_OK) *several = find_places(j, table, size);
    fct_release(env, table);
    return result;
}

/* Lists the sides whose ends are both at places of several vertices; only counts them while keys is NULL. */
static size_t list_sides(const joiner *j, uint64_t *keys, uint32_t *order) {
    const uint32_t *t = j->mesh->triangles;
    size_t count = 0;
    for (size_t c = 0; c < 3 * (size_t)j->mesh->face_count; ++c) {
        uint32_t u = t[c], v = t[c % 3 == 2 ? c - 2 : c + 1];
        if (u == v || !j->crowded[j->places[u]] || !j->crowded[j->places[v]]) continue;
        if (keys) keys[count] = fct_pair_key(u, v), order[count] = (uint32_t)(c / 3);
        ++count;
    }
    return count;
}

/* Marks the ends of open sides. A face that has a side twice is one face there. */
static fct_result mark_open_vertices(const fct_env *env, joiner *j) {
    size_t count = list_sides(j, NULL, NULL);
    uint64_t *keys;
    uint32_t *order;
    const fct_array arrays[] = {FCT_ARRAY(keys, count), FCT_ARRAY(order, count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "coincident sides");
    if (result == FCT_OK) {
        list_sides(j, keys, order);
        result = fct_sort_pairs(env, keys, order, count);
    }
    for (size_t i = 0, end; i < count && result == FCT_OK; i = end) {
        bool alone = true;
        for (end = i + 1; end < count && keys[end] == keys[i]; ++end) alone &= order[end] == order[i];
        if (alone) j->open[keys[i] >> 32] = j->open[(uint32_t)keys[i]] = 1;
    }
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

/* Sets `targets`. Returns the number of vertices that another one replaces. */
static uint32_t choose_targets(joiner *j) {
    uint32_t joined = 0;
    memset(j->targets, 0xff, j->mesh->vertex_count * sizeof *j->targets);
    for (uint32_t v = 0; v < j->mesh->vertex_count; ++v) {
        if (!j->open[v]) continue;
        uint32_t *target = &j->targets[j->places[v]];
        if (*target == FCT_NONE)
            *target = v;
        else
            ++joined;
    }
    return joined;
}

static fct_result write_triangles(const fct_env *env, const joiner *j, fct_weld *out) {
    size_t corners = 3 * (size_t)j->mesh->face_count;
    out->triangles = fct_allocate(env, corners, sizeof *out->triangles);
    if (!out->triangles) return fct_fail_memory(env, "joined vertices");
    for (size_t c = 0; c < corners; ++c) {
        uint32_t v = j->mesh->triangles[c];
        out->triangles[c] = j->open[v] ? j->targets[j->places[v]] : v;
    }
    return FCT_OK;
}

static fct_result join_vertices(const fct_env *env, joiner *j, fct_weld *out) {
    size_t vertices = j->mesh->vertex_count;
    const fct_array arrays[] = {FCT_ARRAY_ZERO(j->crowded, vertices), FCT_ARRAY(j->targets, vertices),
                                FCT_ARRAY_ZERO(j->open, vertices)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "joined vertices");
    if (result == FCT_OK) {
        for (uint32_t v = 0; v < vertices; ++v)
            if (j->places[v] != v) j->crowded[j->places[v]] = 1;
        result = mark_open_vertices(env, j);
    }
    if (result == FCT_OK) {
        out->joined = choose_targets(j);
        if (out->joined) result = write_triangles(env, j, out);
    }
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_weld_build(const fct_env *env, const fct_mesh *mesh, fct_weld *out) {
    *out = (fct_weld){0};
    joiner j = {.mesh = mesh};
    bool several = false;
    fct_result result = list_places(env, &j, &several);
    if (result == FCT_OK && several) result = join_vertices(env, &j, out);
    fct_release(env, j.places);
    if (result != FCT_OK) fct_weld_release(env, out);
    return result;
}

void fct_weld_release(const fct_env *env, fct_weld *weld) {
    fct_release(env, weld->triangles);
    *weld = (fct_weld){0};
}
