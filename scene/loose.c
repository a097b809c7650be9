/* scene/loose.c: vertices without faces, which the parts of a mesh of several materials do not have. */
#include <string.h>

#include "scene/scene.h"

/* Marks the vertices that a face uses. Returns the number of the others. */
static uint32_t mark_used(const fct_mesh *mesh, uint8_t *used) {
    uint32_t count = mesh->vertex_count;
    memset(used, 0, mesh->vertex_count);
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c) {
        count -= !used[mesh->triangles[c]];
        used[mesh->triangles[c]] = 1;
    }
    return count;
}

fct_result fct_scene_note_loose(fct_scene *scene, uint32_t first, const fct_mesh *mesh) {
    const fct_env *env = scene->env;
    fct_model *model = &scene->models[first];
    fct_scene_model *own = &scene->own[first];
    for (uint32_t m = first; m < scene->model_count; ++m) {
        scene->models[m].source_face_count = mesh->face_count;
        scene->models[m].source_vertex_count = mesh->vertex_count;
    }
    uint8_t *used = fct_allocate(env, mesh->vertex_count, 1);
    if (!used) return fct_fail_memory(env, "a model's parts");
    const uint32_t count = mark_used(mesh, used);
    const fct_array arrays[] = {FCT_ARRAY_IF(count, own->loose_vertices, count),
                                FCT_ARRAY_IF(count, own->loose_positions, 3 * (size_t)count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "a model's parts");
    for (uint32_t v = 0; result == FCT_OK && count && v < mesh->vertex_count; ++v) {
        if (used[v]) continue;
        float *to = own->loose_positions + 3 * (size_t)model->loose_count;
        for (size_t c = 0; c < 3; ++c)
            to[c] = (float)((double)mesh->positions[3 * (size_t)v + c] + (mesh->origin[c] - own->origin[c]));
        own->loose_vertices[model->loose_count++] = v;
    }
    model->loose_vertices = own->loose_vertices, model->loose_positions = own->loose_positions;
    fct_release(env, used);
    return result;
}
