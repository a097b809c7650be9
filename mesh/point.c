/* mesh/point.c: attributes at a point of a face. */
#include "mesh/point.h"

/* The weighted sum of component i of three corners. */
static double mix_component(const double weights[3], const float *const corner[3], int i) {
    return weights[0] * (double)corner[0][i] + weights[1] * (double)corner[1][i] +
           weights[2] * (double)corner[2][i];
}

void fct_interpolate_face(const fct_face_attributes *face, float u, float v, v3 *normal,
                          fct_surface_point *out) {
    const double weights[3] = {1 - (double)u - (double)v, u, v};
    *out = (fct_surface_point){0};
    *normal = v3_make(0, 0, 0);
    if (face->normals[0]) {
        out->found |= FCT_MESH_NORMALS;
        *normal = v3_make(mix_component(weights, face->normals, 0), mix_component(weights, face->normals, 1),
                          mix_component(weights, face->normals, 2));
    }
    if (face->texcoords[0]) {
        out->found |= FCT_MESH_TEXCOORDS;
        for (int i = 0; i < 2; ++i) out->texcoord[i] = (float)mix_component(weights, face->texcoords, i);
    }
    if (face->colors[0]) {
        out->found |= FCT_MESH_COLORS;
        for (int i = 0; i < 3; ++i) out->color[i] = (float)mix_component(weights, face->colors, i);
    }
}

void fct_mesh_point(const fct_mesh *mesh, uint32_t face, float u, float v, fct_surface_point *out) {
    const uint32_t *triangle = mesh->triangles + 3 * (size_t)face;
    fct_face_attributes a = {0};
    v3 normal;
    if (mesh->normals)
        fct_take_vertices(mesh->normals, triangle, a.normals);
    else if (mesh->corner_normals)
        fct_take_corners(mesh->corner_normals + 9 * (size_t)face, 3, a.normals);
    if (mesh->texcoords) fct_take_corners(mesh->texcoords + 6 * (size_t)face, 2, a.texcoords);
    if (mesh->colors)
        fct_take_vertices(mesh->colors, triangle, a.colors);
    else if (mesh->face_colors)
        fct_take_corners(mesh->face_colors + 3 * (size_t)face, 0, a.colors);
    fct_interpolate_face(&a, u, v, &normal, out);
    v3_store(out->normal, v3_unit(normal));
}
