/* scene/winding.c: see winding.h. O(F). */
#include "scene/winding.h"

#include <string.h>

#include "facetree/dual.h"

fct_result fct_scene_turn(const fct_env *env, const fct_mesh *mesh, fct_mesh *out) {
    size_t corners = 3 * (size_t)mesh->face_count;
    uint32_t count;
    *out = *mesh;
    out->normals = out->texcoords = NULL;
    out->triangles = fct_allocate(env, corners, sizeof *out->triangles);
    if (!out->triangles) return fct_fail_memory(env, "a model");
    memcpy(out->triangles, mesh->triangles, corners * sizeof *out->triangles);
    fct_result result = fct_inward_flip(env, out, &count);
    if (result == FCT_OK) return FCT_OK;
    fct_release(env, out->triangles);
    out->triangles = NULL;
    return result;
}
