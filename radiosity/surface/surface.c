/* radiosity/surface/surface.c: see surface.h. */
#include "radiosity/surface/surface.h"

#include <string.h>

#include "base/env.h"

fct_result fct_surface_allocate(const fct_env *env, uint32_t vertex_count, uint32_t face_count,
                                fct_surface *out) {
    *out = (fct_surface){0};
    fct_result result =
        fct_mesh_create(env, vertex_count, face_count, FCT_MESH_COLORS | FCT_MESH_SOURCE_FACES, &out->mesh);
    if (result != FCT_OK) return result;
    size_t vertices = vertex_count;
    out->normals = fct_allocate_zero(env, vertices, 3 * sizeof *out->normals);
    out->sample_points = fct_allocate_zero(env, vertices, 3 * sizeof *out->sample_points);
    out->offsets = fct_allocate_zero(env, vertices, sizeof *out->offsets);
    out->areas = fct_allocate_zero(env, vertices, sizeof *out->areas);
    out->places = fct_allocate(env, vertices, sizeof *out->places);
    out->flat = fct_allocate_zero(env, vertices, sizeof *out->flat);
    out->face_places = fct_allocate(env, face_count, sizeof *out->face_places);
    if (!out->normals || !out->sample_points || !out->offsets || !out->areas || !out->places || !out->flat ||
        !out->face_places) {
        fct_surface_release(env, out);
        return fct_fail_memory(env, "a surface");
    }
    memset(out->places, 0xff, vertices * sizeof *out->places);
    return FCT_OK;
}

void fct_surface_release(const fct_env *env, fct_surface *surface) {
    fct_mesh_release(env, &surface->mesh);
    fct_release(env, surface->normals);
    fct_release(env, surface->sample_points);
    fct_release(env, surface->offsets);
    fct_release(env, surface->areas);
    fct_release(env, surface->places);
    fct_release(env, surface->flat);
    fct_release(env, surface->face_places);
    *surface = (fct_surface){0};
}

void fct_surface_place(fct_surface *surface, uint32_t v, const fct_foothold *at) {
    v3_store(surface->normals + 3 * (size_t)v, at->normal);
    v3_store(surface->sample_points + 3 * (size_t)v, at->sample);
    surface->offsets[v] = (float)at->offset;
    surface->places[v] = surface->face_places[at->face];
    surface->flat[v] = at->flat;
}
