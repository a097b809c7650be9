/* radiosity/surface/paint.c: see paint.h. */
#include "radiosity/surface/paint.h"

#include <string.h>

#include "base/math/barycentric.h"
#include "scene/transform.h"

/* Barycentrics of the sample point of a vertex in the face at its place. */
static void find_barycentrics(const fct_scene *scene, uint32_t instance, const fct_surface *surface,
                              size_t vertex, float uv[2]) {
    const fct_scene_view view = fct_scene_get(scene);
    const fct_instance *in = &view.instances[instance];
    const fct_tree_view t = fct_tree_get(view.models[in->model].tree);
    const size_t place = surface->places[vertex];
    v3 p[3];
    double at[2];
    for (size_t k = 0; k < 3; ++k)
        p[k] =
            fct_transform_point(in->to_world, v3_load(t.positions + 3 * (size_t)t.triangles[3 * place + k]));
    fct_barycentrics(p, v3_load(surface->sample_points + 3 * vertex), at);
    uv[0] = (float)at[0], uv[1] = (float)at[1];
}

void fct_surface_reflectance(const fct_scene *scene, uint32_t instance, const fct_surface *surface,
                             size_t vertex, float out[3]) {
    const fct_scene_view view = fct_scene_get(scene);
    if (surface->places[vertex] == FCT_NONE || !fct_scene_is_painted(scene, instance)) {
        memcpy(out, view.materials[view.instances[instance].material].reflectance, 3 * sizeof *out);
        return;
    }
    float uv[2];
    find_barycentrics(scene, instance, surface, vertex, uv);
    fct_scene_reflectance(scene, instance, surface->places[vertex], uv[0], uv[1],
                          sqrtf(surface->areas[vertex]), out);
}
