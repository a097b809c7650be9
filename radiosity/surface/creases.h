/* radiosity/surface/creases.h: one vertex per smooth side of a crease. */
#ifndef FCT_RADIOSITY_CREASES_H
#define FCT_RADIOSITY_CREASES_H

#include "radiosity/surface/surface.h"

/* Makes a surface from a mesh. Adds a vertex for each smooth group of corners at a position beyond the first
 * group, and fills every array of *out except colours. Vertices at one position count as one.
 *
 * The rule of the shading decides which corners are smooth:
 * FILE: corners with the same normal in the file, within a degree, if an edge joins their faces or if they
 * share a vertex, at any angle between the faces. Corners without a usable normal follow CREASE.
 * CREASE: those of two faces at an edge that has no other face, if their windings agree and their normals
 * turn by at most the crease angle.
 * FLAT: those of one source face.
 *
 * source_faces, source_uv (per face x 3 x 2) and face_places (per face) are copied, and so is the shading.
 * Errors: MEMORY. */
fct_result fct_surface_vertices(const fct_env *env, const fct_corners *mesh, const uint32_t *source_faces,
                                const float *source_uv, const uint32_t *face_places,
                                const fct_shading *shading, fct_surface *out);

#endif
