/* mesh/point.c: attributes at a point of a face. */
#include "mesh/point.h"

/* The rows of three vertices. */
static void take_vertices(const float *values, const uint32_t vertices[3], const float *out[3]) {
    for (int k = 0; k < 3; ++k) out[k] = values + 3 * (size_t)vertices[k];
}

/* The three rows of a face, `width` numbers each. */
static void take_corners(const float *values, size_t width, const float *out[3]) {
    for (size_t k = 0; k < 3; ++k) out[k] = values + width * k;
}

/* The weighted sum of component i of three corners. */
static double mix_component(const double weights[3], const float *const corner[3], int i) {
    return weights[0] * (double)corner[0][i] + weights[1] * (double)corner[1][i] +
           weights[2] * (double)corner[2][i];
}

void fct_interpolate_face(const fct_attribute_arrays *a, const uint32_t vertices[3], size_t face, float u,
                          float v, v3 *normal, fct_surface_point *out) {
    const double weights[3] = {1 - (double)u - (double)v, u, v};
    const float *row[3];
    *out = (fct_surface_point){0};
    *normal = v3_make(0, 0, 0);
    if (a->normals || a->corner_normals) {
        out->found |= FCT_MESH_NORMALS;
        if (a->normals)
            take_vertices(a->normals, vertices, row);
        else
            take_corners(a->corner_normals + 9 * face, 3, row);
        *normal = v3_make(mix_component(weights, row, 0), mix_component(weights, row, 1),
                          mix_component(weights, row, 2));
    }
    if (a->texcoords) {
        out->found |= FCT_MESH_TEXCOORDS;
        take_corners(a->texcoords + 6 * face, 2, row);
        for (int i = 0; i < 2; ++i) out->texcoord[i] = (float)mix_component(weights, row, i);
    }
    if (a->colors || a->face_colors) {
        out->found |= FCT_MESH_COLORS;
        if (a->colors)
            take_vertices(a->colors, vertices, row);
        else
            take_corners(a->face_colors + 3 * face, 0, row);
        for (int i = 0; i < 3; ++i) out->color[i] = (float)mix_component(weights, row, i);
    }
}

void fct_mesh_point(const fct_mesh *mesh, uint32_t face, float u, float v, fct_surface_point *out) {
    const fct_attribute_arrays arrays = {.normals = mesh->normals,
                                         .colors = mesh->colors,
                                         .corner_normals = mesh->corner_normals,
                                         .texcoords = mesh->texcoords,
                                         .face_colors = mesh->face_colors};
    v3 normal;
    fct_interpolate_face(&arrays, mesh->triangles + 3 * (size_t)face, face, u, v, &normal, out);
    v3_store(out->normal, v3_unit(normal));
}
