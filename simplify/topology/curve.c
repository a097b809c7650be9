/* simplify/topology/curve.c: see curve.h.
 *
 * 1. Each vertex gets its number on a Morton curve through 1024^3 cells of the bounds.
 * 2. Vertices are sorted by this number.
 * 3. Faces are sorted by the first of their sorted vertices (a counting sort).
 * Items with equal numbers keep the order of the input. Cost: linear.
 */
#include "simplify/topology/curve.h"

#include <string.h>

#include "base/math/vec.h"
#include "base/sort.h"
#include "simplify/streams.h"

enum { CELL_BITS = 10 };

/* Moves bit i of a cell's coordinate to bit 3 i. */
static uint32_t spread_bits(uint32_t x) {
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

static fct_result sort_vertices(const fct_env *env, const fct_mesh *mesh, uint64_t *items) {
    float lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t v = 0; v < mesh->vertex_count; ++v)
        for (int k = 0; k < 3; ++k) {
            float x = mesh->positions[3 * v + k];
            lower[k] = x < lower[k] ? x : lower[k], upper[k] = x > upper[k] ? x : upper[k];
        }
    double extent = 0;
    for (int k = 0; k < 3; ++k) extent = fct_max(extent, (double)upper[k] - lower[k]);
    double scale = extent > 0 ? ((1 << CELL_BITS) - 1) / extent : 0;
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        uint64_t code = 0;
        for (int k = 0; k < 3; ++k)
            code |= (uint64_t)spread_bits((uint32_t)((mesh->positions[3 * v + k] - (double)lower[k]) * scale))
                    << k;
        items[v] = code << 32 | v;
    }
    return fct_sort_items(env, items, mesh->vertex_count);
}

/* places[f] = the place of face f when faces are sorted by their lowest vertex. starts: scratch, one per
 * vertex and one more. */
static void sort_faces(const fct_mesh *mesh, const uint32_t *vertex_places, uint32_t *starts,
                       uint32_t *places) {
    memset(starts, 0, ((size_t)mesh->vertex_count + 1) * sizeof *starts);
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * (size_t)f;
        uint32_t a = vertex_places[t[0]], b = vertex_places[t[1]], c = vertex_places[t[2]];
        uint32_t low = a < b ? a : b;
        places[f] = low < c ? low : c;
        ++starts[places[f] + 1];
    }
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) starts[v + 1] += starts[v];
    for (uint32_t f = 0; f < mesh->face_count; ++f) places[f] = starts[places[f]]++;
}

/* Moves `count` rows of `width` floats to their places. NULL arrays are left out. */
static void place_rows(const float *from, float *to, const uint32_t *places, uint32_t count, size_t width) {
    for (size_t i = 0; i < count && from; ++i)
        memcpy(to + width * places[i], from + width * i, width * sizeof *to);
}

static void place_numbers(const uint32_t *from, uint32_t *to, const uint32_t *places, uint32_t count) {
    for (size_t i = 0; i < count && from; ++i) to[places[i]] = from[i];
}

static void fill_sorted(const fct_mesh *mesh, const uint32_t *vertex_places, const uint32_t *places,
                        fct_mesh *out) {
    place_rows(mesh->positions, out->positions, vertex_places, mesh->vertex_count, 3);
    for (uint32_t i = 0; i < STREAM_COUNT; ++i)
        place_rows(stream_values(mesh, i), *stream_slot(out, i), vertex_places, mesh->vertex_count,
                   stream_width(i));
    place_rows(mesh->texcoords, out->texcoords, places, mesh->face_count, 6);
    place_rows(mesh->face_colors, out->face_colors, places, mesh->face_count, 3);
    place_numbers(mesh->materials, out->materials, places, mesh->face_count);
    place_numbers(mesh->source_faces, out->source_faces, places, mesh->face_count);
    for (size_t f = 0; f < mesh->face_count; ++f)
        for (size_t k = 0; k < 3; ++k)
            out->triangles[3 * (size_t)places[f] + k] = vertex_places[mesh->triangles[3 * f + k]];
    memcpy(out->origin, mesh->origin, sizeof out->origin);
    out->source_count = mesh->source_count;
    out->material_count = mesh->material_count;
    out->material_names = mesh->material_names;
}

fct_result fct_simplify_sort(const fct_env *env, const fct_mesh *mesh, const uint8_t *locks,
                             fct_sorted *out) {
    uint32_t vertices = mesh->vertex_count, *starts;
    uint64_t *items;
    unsigned kinds = stream_kinds(mesh) | (mesh->texcoords ? FCT_MESH_TEXCOORDS : 0) |
                     (mesh->face_colors ? FCT_MESH_FACE_COLORS : 0) |
                     (mesh->materials ? FCT_MESH_MATERIALS : 0) |
                     (mesh->source_faces ? FCT_MESH_SOURCE_FACES : 0);
    const fct_array scratch[] = {FCT_ARRAY(items, vertices), FCT_ARRAY(starts, (size_t)vertices + 1)};
    *out = (fct_sorted){0};
    const fct_array results[] = {FCT_ARRAY(out->places, mesh->face_count),
                                 FCT_ARRAY(out->vertex_places, vertices),
                                 FCT_ARRAY_IF(locks, out->locks, vertices)};
    fct_result result = fct_allocate_all(env, scratch, FCT_LENGTH(scratch), "sorted vertices");
    if (result != FCT_OK) return result;
    result = fct_allocate_all(env, results, FCT_LENGTH(results), "sorted faces");
    if (result == FCT_OK) result = sort_vertices(env, mesh, items);
    if (result == FCT_OK) result = fct_mesh_create(env, vertices, mesh->face_count, kinds, &out->mesh);
    if (result == FCT_OK) {
        for (uint32_t i = 0; i < vertices; ++i) out->vertex_places[(uint32_t)items[i]] = i;
        for (uint32_t v = 0; v < vertices && locks; ++v) out->locks[out->vertex_places[v]] = locks[v];
        sort_faces(mesh, out->vertex_places, starts, out->places);
        fill_sorted(mesh, out->vertex_places, out->places, &out->mesh);
    } else
        fct_release_all(env, results, FCT_LENGTH(results));
    fct_release_all(env, scratch, FCT_LENGTH(scratch));
    return result;
}

void fct_simplify_release_sorted(const fct_env *env, fct_sorted *sorted) {
    sorted->mesh.material_names = NULL;
    sorted->mesh.material_count = 0;
    fct_mesh_release(env, &sorted->mesh);
    fct_release(env, sorted->places);
    fct_release(env, sorted->vertex_places);
    fct_release(env, sorted->locks);
    fct_release(env, sorted->copies);
}
