/* scene/attributes.c: see attributes.h. */
#include "scene/attributes.h"

#include <string.h>

static bool has_values(const float *values, size_t count) {
    for (size_t i = 0; values && i < count; ++i)
        if (values[i] != 0) return true;
    return false;
}

/* Copies `count` rows of `width` floats in the order of ids. */
static fct_result copy_rows(const fct_env *env, const float *from, const uint32_t *ids, size_t count,
                            size_t width, float **out) {
    *out = fct_allocate(env, count, width * sizeof **out);
    if (!*out) return fct_fail_memory(env, "a model's texture coordinates and normals");
    for (size_t i = 0; i < count; ++i)
        memcpy(*out + width * i, from + width * (size_t)ids[i], width * sizeof **out);
    return FCT_OK;
}

fct_result fct_attributes_copy(const fct_env *env, const fct_mesh *mesh, const fct_tree *tree,
                               fct_attributes *out) {
    *out = (fct_attributes){0};
    const bool normals = has_values(mesh->normals, 3 * (size_t)mesh->vertex_count);
    const bool corners = !normals && has_values(mesh->corner_normals, 9 * (size_t)mesh->face_count);
    const bool colors = mesh->face_colors && !mesh->colors;
    if (!mesh->texcoords && !normals && !corners && !colors) return FCT_OK;
    fct_result result = fct_tree_check(env, tree);
    if (result != FCT_OK) return result;
    const fct_tree_view t = fct_tree_get(tree);
    if (t.face_count != mesh->face_count || t.vertex_count != mesh->vertex_count)
        return fct_fail(env, FCT_ERROR_DATA, "the tree has %u faces and %u vertices, its mesh %u and %u",
                        t.face_count, t.vertex_count, mesh->face_count, mesh->vertex_count);
    if (mesh->texcoords)
        result = copy_rows(env, mesh->texcoords, t.face_ids, t.face_count, 6, &out->texcoords);
    if (result == FCT_OK && normals)
        result = copy_rows(env, mesh->normals, t.vertex_ids, t.vertex_count, 3, &out->normals);
    if (result == FCT_OK && corners)
        result = copy_rows(env, mesh->corner_normals, t.face_ids, t.face_count, 9, &out->corner_normals);
    if (result == FCT_OK && colors)
        result = copy_rows(env, mesh->face_colors, t.face_ids, t.face_count, 3, &out->face_colors);
    return result;
}

void fct_attributes_count_from_top(fct_mesh *mesh) {
    const size_t corners = 3 * (size_t)mesh->face_count;
    for (size_t c = 0; mesh->texcoords && c < corners; ++c)
        mesh->texcoords[2 * c + 1] = 1 - mesh->texcoords[2 * c + 1];
}
