/* radiosity/surface/surface.c: see surface.h. */
#include "radiosity/surface/surface.h"

#include <string.h>

#include "base/env.h"

enum { ARRAYS = 7 };

/* The arrays beside the mesh. */
static void list_arrays(fct_surface *s, size_t vertices, size_t faces, fct_array out[ARRAYS]) {
    const fct_array arrays[ARRAYS] = {
        FCT_ARRAY_ZERO(s->normals, 3 * vertices), FCT_ARRAY_ZERO(s->sample_points, 3 * vertices),
        FCT_ARRAY_ZERO(s->offsets, vertices),     FCT_ARRAY_ZERO(s->areas, vertices),
        FCT_ARRAY(s->places, vertices),           FCT_ARRAY_ZERO(s->flat, vertices),
        FCT_ARRAY(s->face_places, faces),
    };
    memcpy(out, arrays, sizeof arrays);
}

fct_result fct_surface_allocate(const fct_env *env, uint32_t vertex_count, uint32_t face_count,
                                fct_surface *out) {
    *out = (fct_surface){0};
    fct_result result =
        fct_mesh_create(env, vertex_count, face_count,
                        FCT_MESH_COLORS | FCT_MESH_SOURCE_FACES | FCT_MESH_SOURCE_UV, &out->mesh);
    if (result != FCT_OK) return result;
    fct_array arrays[ARRAYS];
    list_arrays(out, vertex_count, face_count, arrays);
    result = fct_allocate_all(env, arrays, ARRAYS, "a surface");
    if (result != FCT_OK) {
        fct_mesh_release(env, &out->mesh);
        return result;
    }
    memset(out->places, 0xff, vertex_count * sizeof *out->places);
    return FCT_OK;
}

void fct_surface_release(const fct_env *env, fct_surface *surface) {
    fct_array arrays[ARRAYS];
    list_arrays(surface, 0, 0, arrays);
    fct_release_all(env, arrays, ARRAYS);
    fct_mesh_release(env, &surface->mesh);
    *surface = (fct_surface){0};
}

void fct_surface_place(fct_surface *surface, uint32_t v, const fct_foothold *at) {
    v3_store(surface->normals + 3 * (size_t)v, at->normal);
    v3_store(surface->sample_points + 3 * (size_t)v, at->sample);
    surface->offsets[v] = (float)at->offset;
    surface->places[v] = surface->face_places[at->face];
    surface->flat[v] = at->flat;
}
