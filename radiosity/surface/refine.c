/* radiosity/surface/refine.c: see refine.h.
 *
 * An edge on a crease exists once per side, with its own vertices at the same positions. A mark on one side
 * also splits the other, so that no T-junction opens along the crease.
 */
#include "radiosity/surface/refine.h"

#include "base/env.h"
#include "radiosity/surface/split.h"

#include <string.h>

/* Marks the edges to split: bit k of a face is the edge from corner k to corner k + 1. */
static fct_result mark_faces(const fct_env *env, const fct_mesh *mesh, fct_edge_test *test, void *user,
                             uint8_t *marks) {
    const uint32_t *t = mesh->triangles;
    size_t corners = 3 * (size_t)mesh->face_count, wanted = 0;
    fct_edge_table edges = {0};
    bool fresh;
    uint32_t *first = fct_allocate(env, mesh->vertex_count, sizeof *first);
    if (!first) return fct_fail_memory(env, "a refined surface");
    fct_result result = fct_weld(env, mesh->vertex_count, mesh->positions, first);
    if (result != FCT_OK) goto done;
    memset(marks, 0, mesh->face_count);
    for (size_t c = 0; c < corners; ++c) {
        uint32_t a = t[c], b = t[c % 3 == 2 ? c - 2 : c + 1];
        if (first[a] == first[b] || !(a < b ? test(user, a, b) : test(user, b, a))) continue;
        marks[c / 3] |= (uint8_t)(1 << c % 3);
        ++wanted;
    }
    result = fct_edge_table_init(env, wanted, &edges);
    if (result != FCT_OK) goto done;
    for (size_t c = 0; c < corners; ++c)
        if (marks[c / 3] >> c % 3 & 1)
            *fct_edge_table_insert(&edges, first[t[c]], first[t[c % 3 == 2 ? c - 2 : c + 1]], &fresh) = 1;
    for (size_t c = 0; wanted && c < corners; ++c)
        if (fct_edge_table_find(&edges, first[t[c]], first[t[c % 3 == 2 ? c - 2 : c + 1]]))
            marks[c / 3] |= (uint8_t)(1 << c % 3);
done:
    fct_edge_table_release(env, &edges);
    fct_release(env, first);
    return result;
}

/* Copies the old vertices and the faces of the split, and appends the midpoints. */
static void copy_surface(const fct_surface *old, const fct_split *split, fct_surface *out) {
    size_t count = old->mesh.vertex_count;
    memcpy(out->mesh.positions, old->mesh.positions, 3 * count * sizeof(float));
    memcpy(out->mesh.colors, old->mesh.colors, 3 * count * sizeof(float));
    memcpy(out->normals, old->normals, 3 * count * sizeof(float));
    memcpy(out->sample_points, old->sample_points, 3 * count * sizeof(float));
    memcpy(out->offsets, old->offsets, count * sizeof(float));
    memcpy(out->places, old->places, count * sizeof *out->places);
    memcpy(out->flat, old->flat, count);
    for (size_t i = 0; i < split->vertex_count; ++i) {
        size_t a = 3 * (size_t)split->ends[2 * i], b = 3 * (size_t)split->ends[2 * i + 1],
               to = 3 * (count + i);
        for (size_t k = 0; k < 3; ++k) {
            float ca = old->mesh.colors[a + k], cb = old->mesh.colors[b + k];
            out->mesh.colors[to + k] = .5f * ca + .5f * cb;
        }
        v3 pa = v3_load(old->mesh.positions + a), pb = v3_load(old->mesh.positions + b);
        v3_store(out->mesh.positions + to, v3_scale(v3_add(pa, pb), .5));
    }
    memcpy(out->mesh.triangles, split->triangles, split->face_count * 3 * sizeof *split->triangles);
    for (size_t f = 0; f < split->face_count; ++f) {
        out->mesh.source_faces[f] = old->mesh.source_faces[split->parents[f]];
        out->face_places[f] = old->face_places[split->parents[f]];
    }
}

/* Adds a third of each face's area to its vertices. */
static void add_areas(fct_surface *s) {
    for (size_t f = 0; f < s->mesh.face_count; ++f) {
        const uint32_t *t = s->mesh.triangles + 3 * f;
        v3 a = v3_load(s->mesh.positions + 3 * (size_t)t[0]);
        v3 e1 = v3_sub(v3_load(s->mesh.positions + 3 * (size_t)t[1]), a);
        v3 e2 = v3_sub(v3_load(s->mesh.positions + 3 * (size_t)t[2]), a);
        double third = v3_norm(v3_cross(e1, e2)) / 6;
        for (int k = 0; k < 3; ++k) s->areas[t[k]] += (float)third;
    }
}

/* The mean of the ends' normals if it is in front of all faces, else the corners' own normal. */
static v3 find_middle_normal(const fct_surface *s, const fct_corners *mesh, const uint32_t ends[2],
                             const uint32_t *corners, size_t count) {
    v3 half =
        v3_unit(v3_add(v3_load(s->normals + 3 * (size_t)ends[0]), v3_load(s->normals + 3 * (size_t)ends[1])));
    v3 own;
    if (fct_corner_front(mesh, corners, count, half)) return half;
    fct_corner_normal(mesh, corners, count, &own);
    return own;
}

/* Sets the footholds of the new vertices from the corners around them. A midpoint is on the rim if only one
 * face of the old surface has its edge. */
static fct_result place_middles(const fct_env *env, const fct_split *split, uint32_t old_count,
                                fct_surface *s) {
    size_t corners = 3 * (size_t)s->mesh.face_count;
    fct_corners mesh = {s->mesh.vertex_count, s->mesh.face_count, s->mesh.positions, s->mesh.triangles};
    size_t *begin = fct_allocate_zero(env, (size_t)split->vertex_count + 2, sizeof *begin);
    uint32_t *list = NULL;
    fct_result result = begin ? FCT_OK : fct_fail_memory(env, "a refined surface");
    if (result != FCT_OK) goto done;
    for (size_t c = 0; c < corners; ++c)
        if (mesh.triangles[c] >= old_count) ++begin[mesh.triangles[c] - old_count + 2];
    for (size_t i = 0; i < split->vertex_count; ++i) begin[i + 2] += begin[i + 1];
    list = fct_allocate(env, begin[split->vertex_count + 1], sizeof *list);
    if (!list) {
        result = fct_fail_memory(env, "a refined surface");
        goto done;
    }
    for (size_t c = 0; c < corners; ++c)
        if (mesh.triangles[c] >= old_count) list[begin[mesh.triangles[c] - old_count + 1]++] = (uint32_t)c;
    for (uint32_t i = 0; i < split->vertex_count; ++i) {
        const uint32_t *around = list + begin[i];
        size_t count = begin[i + 1] - begin[i];
        uint32_t parent = split->parents[around[0] / 3];
        bool rim = true;
        for (size_t k = 1; k < count && rim; ++k) rim = split->parents[around[k] / 3] == parent;
        v3 normal = find_middle_normal(s, &mesh, split->ends + 2 * (size_t)i, around, count);
        fct_foothold at = fct_corner_foothold(&mesh, around, count, normal, rim);
        fct_surface_place(s, old_count + i, &at);
    }
done:
    fct_release(env, begin);
    fct_release(env, list);
    return result;
}

fct_result fct_surface_refine(const fct_env *env, fct_surface *surface, fct_edge_test *test, void *user,
                              uint32_t *added) {
    const fct_mesh *mesh = &surface->mesh;
    fct_split split = {0};
    fct_surface finer = {0};
    uint32_t old_count = mesh->vertex_count;
    if (added) *added = 0;
    uint8_t *marks = fct_allocate(env, mesh->face_count, sizeof *marks);
    fct_result result =
        marks ? mark_faces(env, mesh, test, user, marks) : fct_fail_memory(env, "a refined surface");
    if (result != FCT_OK) goto done;
    result =
        fct_split_edges(env, old_count, mesh->positions, mesh->face_count, mesh->triangles, marks, &split);
    if (result != FCT_OK || split.vertex_count == 0) goto done;
    if (split.face_count > UINT32_MAX / 3) {
        result = fct_fail(env, FCT_ERROR_MEMORY, "a surface of %u triangles has too many corners",
                          split.face_count);
        goto done;
    }
    result = fct_surface_allocate(env, old_count + split.vertex_count, split.face_count, &finer);
    if (result != FCT_OK) goto done;
    copy_surface(surface, &split, &finer);
    add_areas(&finer);
    result = place_middles(env, &split, old_count, &finer);
    if (result != FCT_OK) goto done;
    fct_surface swap = *surface;
    *surface = finer, finer = swap;
    if (added) *added = split.vertex_count;
done:
    fct_release(env, marks);
    fct_split_release(env, &split);
    fct_surface_release(env, &finer);
    return result;
}
