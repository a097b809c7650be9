/* radiosity/surface/creases.h: one vertex per smooth side of a crease. */
#ifndef FCT_RADIOSITY_CREASES_H
#define FCT_RADIOSITY_CREASES_H

#include "radiosity/surface/surface.h"

/* Makes a surface from a mesh. Adds a vertex for each smooth group of corners at a position beyond the first
 * group, and fills every array of *out except colours. Two faces at an edge are smooth if the edge has no
 * other face, their windings agree, and their normals differ by less than 40 degrees; vertices at one
 * position count as one. source_faces, source_uv (per face x 3 x 2) and face_places (per face) are copied.
 * Errors: MEMORY. */
fct_result fct_surface_vertices(const fct_env *env, const fct_corners *mesh, const uint32_t *source_faces,
                                const float *source_uv, const uint32_t *face_places, fct_surface *out);

#endif
