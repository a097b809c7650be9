/* mesh/point.h: interpolation inside a face. */
#ifndef FCT_MESH_POINT_H
#define FCT_MESH_POINT_H

#include "base/math/vec.h"
#include "facetree/mesh.h"

/* The attributes of a mesh or a model; NULL where there are none. */
typedef struct fct_attribute_arrays {
    const float *normals, *colors;        /* per vertex */
    const float *corner_normals;          /* per face and corner; if there are no others */
    const float *texcoords, *face_colors; /* per face and corner; per face, if there are no others */
} fct_attribute_arrays;

/* fct_mesh_point for the face with these vertices. The normal keeps its length. */
void fct_interpolate_face(const fct_attribute_arrays *arrays, const uint32_t vertices[3], size_t face,
                          float u, float v, v3 *normal, fct_surface_point *out);

#endif
