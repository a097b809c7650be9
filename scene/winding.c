/* scene/winding.c: see winding.h. O(F). */
#include "scene/winding.h"

#include <string.h>

#include "facetree/dual.h"

void fct_scene_release_turned(const fct_env *env, fct_mesh *turned) {
    fct_release(env, turned->triangles);
    fct_release(env, turned->normals);
    fct_release(env, turned->corner_normals);
    fct_release(env, turned->texcoords);
    turned->triangles = NULL, turned->normals = turned->corner_normals = turned->texcoords = NULL;
}

fct_result fct_scene_turn(const fct_env *env, const fct_mesh *mesh, fct_mesh *out) {
    const size_t corners = 3 * (size_t)mesh->face_count, components = 3 * (size_t)mesh->vertex_count;
    uint32_t count;
    *out = *mesh;
    out->normals = out->corner_normals = out->texcoords = NULL;
    out->triangles = NULL;
    const fct_array arrays[] = {FCT_ARRAY(out->triangles, corners),
                                FCT_ARRAY_IF(mesh->normals, out->normals, components),
                                FCT_ARRAY_IF(mesh->corner_normals, out->corner_normals, 3 * corners),
                                FCT_ARRAY_IF(mesh->texcoords, out->texcoords, 2 * corners)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "a model");
    if (result != FCT_OK) return result;
    memcpy(out->triangles, mesh->triangles, corners * sizeof *out->triangles);
    if (mesh->normals) memcpy(out->normals, mesh->normals, components * sizeof *out->normals);
    if (mesh->corner_normals)
        memcpy(out->corner_normals, mesh->corner_normals, 3 * corners * sizeof *out->corner_normals);
    if (mesh->texcoords) memcpy(out->texcoords, mesh->texcoords, 2 * corners * sizeof *out->texcoords);
    return fct_inward_flip(env, out, &count);
}
