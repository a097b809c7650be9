/* mesh/point.h: interpolation inside a face. */
#ifndef FCT_MESH_POINT_H
#define FCT_MESH_POINT_H

#include "base/math/vec.h"
#include "facetree/mesh.h"

/* Attributes of one face, each three rows of numbers; NULL where there are none. */
typedef struct fct_face_attributes {
    const float *normals[3], *texcoords[3], *colors[3];
} fct_face_attributes;

/* The rows of three vertices. */
static inline void fct_take_vertices(const float *values, const uint32_t triangle[3], const float *out[3]) {
    for (int k = 0; k < 3; ++k) out[k] = values + 3 * (size_t)triangle[k];
}
/* The three rows of a face, `width` numbers each. */
static inline void fct_take_corners(const float *values, size_t width, const float *out[3]) {
    for (size_t k = 0; k < 3; ++k) out[k] = values + width * k;
}

/* fct_mesh_point. The normal keeps its length. */
void fct_interpolate_face(const fct_face_attributes *face, float u, float v, v3 *normal,
                          fct_surface_point *out);

#endif
