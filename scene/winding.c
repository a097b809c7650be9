/* scene/winding.c: see winding.h. O(F). */
#include "scene/winding.h"

#include <string.h>

#include "base/math/vec.h"
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

bool fct_scene_is_inward(const fct_mesh *mesh, const fct_tree *tree) {
    fct_tree_view view = fct_tree_get(tree); /* counted edges when it was built */
    double volume = 0;
    if (view.boundary_edges || view.nonmanifold_edges) return false;
    v3 origin = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[0]);
    for (size_t f = 0; f < mesh->face_count; ++f) {
        v3 p[3];
        for (size_t k = 0; k < 3; ++k)
            p[k] = v3_sub(v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * f + k]), origin);
        volume += v3_dot(p[0], v3_cross(p[1], p[2]));
    }
    return volume < 0;
}
