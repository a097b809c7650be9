/* radiosity/output/surface_vertex.h: the vertices of a surface: creases, normals, sample points. */
#ifndef FCT_RADIOSITY_SURFACE_VERTEX_H
#define FCT_RADIOSITY_SURFACE_VERTEX_H

#include "base/math/vec.h"
#include "radiosity/output/surface.h"

/* A mesh before its vertices are doubled. A corner is number 3 * face + k. */
typedef struct fct_corners {
    uint32_t vertex_count, face_count;
    const float *positions;
    const uint32_t *triangles;
} fct_corners;

/* What light at a vertex needs, found from the corners of one smooth group. */
typedef struct fct_foothold {
    v3 normal; /* unit, or zero when every face is degenerate */
    v3 sample;
    double offset;
    uint32_t face; /* that holds the sample point */
    bool flat;
} fct_foothold;

/* The angle-weighted normal of `count` > 0 corners that meet in one point, turned so that it is in front of
 * all faces; false where no such direction is found (then it is the weighted one). */
bool fct_corner_normal(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 *normal);
/* Whether the unit direction is in front of all the corners' faces. */
bool fct_corner_front(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 direction);
/* The rest, given the normal; rim: the corners do not close around the point. */
fct_foothold fct_corner_foothold(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 normal,
                                 bool rim);

/* Stores it; the foothold's face is one of the surface's. */
void fct_surface_place(fct_surface *surface, uint32_t vertex, const fct_foothold *at);

/* Allocates all arrays of *out; face arrays undefined, places FCT_NONE, else 0. Errors: MEMORY. */
fct_result fct_surface_allocate(const fct_env *env, uint32_t vertex_count, uint32_t face_count,
                                fct_surface *out);
/* Doubles vertices on creases and fills every per-vertex array of *out but colours, its positions and
 * triangles, from a mesh whose faces lie at face_places; source_faces and face_places are copied. Faces at an
 * edge are smooth when it has two, they agree in orientation, and their normals differ by less than 40
 * degrees; vertices at one position count as one. Errors: MEMORY. */
fct_result fct_surface_vertices(const fct_env *env, const fct_corners *mesh, const uint32_t *source_faces,
                                const uint32_t *face_places, fct_surface *out);

#endif
