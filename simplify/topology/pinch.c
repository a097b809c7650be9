/* simplify/topology/pinch.c: see pinch.h.
 *
 * 1. List the corners of each vertex (a counting sort).
 * 2. In closed fans each neighbour begins one corner and ends one. The corners then form cycles, one per fan.
 * 3. Append a vertex per further fan, and give it the corners of the fan.
 * Cost: linear.
 */
#include "simplify/topology/pinch.h"

#include <string.h>

#include "simplify/streams.h"

typedef struct pinches {
    const fct_env *env;
    const fct_mesh *mesh;
    uint32_t *starts, *corners; /* the corners of vertex v are corners[starts[v]] to corners[starts[v + 1]] */
    uint32_t *owners, *slots;   /* per vertex x: the vertex of which x is a neighbour (FCT_NONE: the fan there
                                   was visited); the place in `corners` of the corner that x follows */
    uint32_t *moved;            /* corners of new vertices, each followed by its vertex */
    uint32_t *copies;           /* per new vertex: the one that it was split from */
    size_t moved_count, moved_room, copy_count, copy_room;
} pinches;

static uint32_t next_corner(uint32_t c) {
    return c % 3 == 2 ? c - 2 : c + 1;
}

static void list_corners(pinches *k) {
    const uint32_t *t = k->mesh->triangles;
    size_t count = 3 * (size_t)k->mesh->face_count;
    memset(k->starts, 0, ((size_t)k->mesh->vertex_count + 1) * sizeof *k->starts);
    for (size_t c = 0; c < count; ++c) ++k->starts[t[c] + 1];
    for (uint32_t v = 0; v < k->mesh->vertex_count; ++v) k->starts[v + 1] += k->starts[v];
    for (uint32_t c = 0; c < count; ++c) k->corners[k->starts[t[c]]++] = c;
    for (uint32_t v = k->mesh->vertex_count; v > 0; --v) k->starts[v] = k->starts[v - 1];
    k->starts[0] = 0;
}

/* Whether each neighbour of v follows at most one corner of it. */
static bool note_neighbours(pinches *k, uint32_t v) {
    const uint32_t *t = k->mesh->triangles;
    for (uint32_t i = k->starts[v]; i < k->starts[v + 1]; ++i) {
        uint32_t x = t[next_corner(k->corners[i])];
        if (x == v || k->owners[x] == v) return false;
        k->owners[x] = v, k->slots[x] = i;
    }
    return true;
}

/* Visits the fan of a corner. Returns its number of corners; 0 if it is no cycle. The corners go to a new
 * vertex unless that is FCT_NONE. */
static uint32_t visit_fan(pinches *k, uint32_t v, uint32_t i, uint32_t vertex) {
    const uint32_t *t = k->mesh->triangles;
    uint32_t first = t[next_corner(k->corners[i])], count = 0, x = first;
    do {
        uint32_t c = k->corners[k->slots[x]];
        k->owners[x] = FCT_NONE;
        if (vertex != FCT_NONE) k->moved[k->moved_count++] = c, k->moved[k->moved_count++] = vertex;
        ++count;
        x = t[next_corner(next_corner(c))];
        if (x == first) return count;
    } while (k->owners[x] == v);
    return 0; /* no face follows, or it was visited */
}

static fct_result split_vertex(pinches *k, uint32_t v) {
    uint32_t count = k->starts[v + 1] - k->starts[v], visited;
    size_t moved_before = k->moved_count, copies_before = k->copy_count;
    if (count < 4 || !note_neighbours(k, v)) return FCT_OK;
    visited = visit_fan(k, v, k->starts[v], FCT_NONE);
    if (visited == 0 || visited == count) return FCT_OK;
    fct_result result = fct_grow(k->env, (void **)&k->moved, &k->moved_room, moved_before + 2 * (size_t)count,
                                 sizeof *k->moved);
    if (result == FCT_OK)
        result =
            fct_grow(k->env, (void **)&k->copies, &k->copy_room, copies_before + count, sizeof *k->copies);
    if (result != FCT_OK) return result;
    for (uint32_t i = k->starts[v]; i < k->starts[v + 1]; ++i) {
        if (k->owners[k->mesh->triangles[next_corner(k->corners[i])]] != v) continue;
        uint32_t fan = visit_fan(k, v, i, k->mesh->vertex_count + (uint32_t)k->copy_count);
        k->copies[k->copy_count++] = v;
        if (fan > 0) continue;
        k->moved_count = moved_before, k->copy_count = copies_before;
        return FCT_OK;
    }
    return FCT_OK;
}

static void exchange(float **a, float **b) {
    float *swap = *a;
    *a = *b, *b = swap;
}

/* Exchanges the vertices of two meshes with the same arrays. */
static void exchange_arrays(fct_mesh *a, fct_mesh *b) {
    uint32_t count = a->vertex_count;
    a->vertex_count = b->vertex_count, b->vertex_count = count;
    exchange(&a->positions, &b->positions);
    for (uint32_t i = 0; i < STREAM_COUNT; ++i) exchange(stream_slot(a, i), stream_slot(b, i));
}

static void copy_rows(const pinches *k, float *to, const float *from, size_t width) {
    size_t count = k->mesh->vertex_count;
    memcpy(to, from, width * count * sizeof *to);
    for (size_t i = 0; i < k->copy_count; ++i)
        memcpy(to + width * (count + i), from + width * k->copies[i], width * sizeof *to);
}

/* Appends the new vertices to the arrays of the mesh, and gives them their corners. */
static fct_result append_copies(const pinches *k, fct_sorted *sorted) {
    fct_mesh *mesh = &sorted->mesh, longer;
    size_t before = mesh->vertex_count, count = before + k->copy_count;
    uint8_t *locks;
    uint32_t *copies;
    if (count >= INT32_MAX) return fct_fail(k->env, FCT_ERROR_MEMORY, "more than 2^31 vertices");
    const fct_array arrays[] = {FCT_ARRAY_IF(sorted->locks, locks, count), FCT_ARRAY(copies, k->copy_count)};
    fct_result result = fct_allocate_all(k->env, arrays, FCT_LENGTH(arrays), "split vertices");
    if (result != FCT_OK) return result;
    result = fct_mesh_create(k->env, (uint32_t)count, 0, stream_kinds(mesh), &longer);
    if (result != FCT_OK) {
        fct_release_all(k->env, arrays, FCT_LENGTH(arrays));
        return result;
    }
    copy_rows(k, longer.positions, mesh->positions, 3);
    for (uint32_t i = 0; i < STREAM_COUNT; ++i)
        if (stream_values(mesh, i))
            copy_rows(k, *stream_slot(&longer, i), stream_values(mesh, i), stream_width(i));
    memcpy(copies, k->copies, k->copy_count * sizeof *copies);
    for (size_t v = 0; v < count && sorted->locks; ++v)
        locks[v] = sorted->locks[v < before ? v : copies[v - before]];
    for (size_t i = 0; i < k->moved_count; i += 2) mesh->triangles[k->moved[i]] = k->moved[i + 1];
    exchange_arrays(mesh, &longer);
    fct_mesh_release(k->env, &longer);
    fct_release(k->env, sorted->locks);
    sorted->locks = locks, sorted->copies = copies, sorted->copy_count = (uint32_t)k->copy_count;
    return FCT_OK;
}

fct_result fct_simplify_split_pinches(const fct_env *env, fct_sorted *sorted) {
    pinches k = {.env = env, .mesh = &sorted->mesh};
    uint32_t vertices = sorted->mesh.vertex_count;
    const fct_array scratch[] = {FCT_ARRAY(k.starts, (size_t)vertices + 1),
                                 FCT_ARRAY(k.corners, 3 * (size_t)sorted->mesh.face_count),
                                 FCT_ARRAY(k.owners, vertices), FCT_ARRAY(k.slots, vertices)};
    fct_result result = fct_allocate_all(env, scratch, FCT_LENGTH(scratch), "corners of vertices");
    if (result != FCT_OK) return result;
    list_corners(&k);
    memset(k.owners, 0xff, vertices * sizeof *k.owners);
    for (uint32_t v = 0; v < vertices && result == FCT_OK; ++v) result = split_vertex(&k, v);
    if (result == FCT_OK && k.copy_count > 0) result = append_copies(&k, sorted);
    fct_release(env, k.moved);
    fct_release(env, k.copies);
    fct_release_all(env, scratch, FCT_LENGTH(scratch));
    return result;
}

uint32_t fct_simplify_find_copies(const fct_sorted *sorted, uint32_t vertex, uint32_t *first) {
    uint32_t low = 0, high = sorted->copy_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (sorted->copies[middle] < vertex)
            low = middle + 1;
        else
            high = middle;
    }
    *first = low;
    while (high < sorted->copy_count && sorted->copies[high] == vertex) ++high;
    return high;
}
