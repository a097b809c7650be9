/* scene/attributes.c: see attributes.h. */
#include "scene/attributes.h"

#include <string.h>

fct_result fct_attributes_copy(const fct_env *env, const fct_mesh *mesh, const fct_tree *tree,
                               float **texcoords, float **normals) {
    *texcoords = *normals = NULL;
    if (!mesh->texcoords && !mesh->normals) return FCT_OK;
    fct_result result = fct_tree_check(env, tree);
    if (result != FCT_OK) return result;
    const fct_tree_view t = fct_tree_get(tree);
    if (t.face_count != mesh->face_count || t.vertex_count != mesh->vertex_count)
        return fct_fail(env, FCT_ERROR_DATA, "the tree has %u faces and %u vertices, its mesh %u and %u",
                        t.face_count, t.vertex_count, mesh->face_count, mesh->vertex_count);
    if (mesh->texcoords) *texcoords = fct_allocate(env, t.face_count, 6 * sizeof **texcoords);
    if (mesh->normals) *normals = fct_allocate(env, t.vertex_count, 3 * sizeof **normals);
    if ((mesh->texcoords && !*texcoords) || (mesh->normals && !*normals))
        return fct_fail_memory(env, "a model's texture coordinates and normals");
    for (size_t p = 0; *texcoords && p < t.face_count; ++p)
        memcpy(*texcoords + 6 * p, mesh->texcoords + 6 * (size_t)t.face_ids[p], 6 * sizeof **texcoords);
    bool any = false;
    for (size_t v = 0; *normals && v < t.vertex_count; ++v) {
        const float *from = mesh->normals + 3 * (size_t)t.vertex_ids[v];
        memcpy(*normals + 3 * v, from, 3 * sizeof *from);
        any |= from[0] != 0 || from[1] != 0 || from[2] != 0;
    }
    if (!any) {
        fct_release(env, *normals);
        *normals = NULL;
    }
    return FCT_OK;
}

void fct_attributes_count_from_top(fct_mesh *mesh) {
    const size_t corners = 3 * (size_t)mesh->face_count;
    for (size_t c = 0; mesh->texcoords && c < corners; ++c)
        mesh->texcoords[2 * c + 1] = 1 - mesh->texcoords[2 * c + 1];
}
