/* radiosity/surface/surface.h: the mesh that carries the light of one instance, in world space.
 *
 * The surface is finer than the model where light needs it (tessellate.h, refine.h), has one vertex per side
 * of a crease (creases.h), and knows for each vertex where and along which normal its light is computed
 * (foothold.h). Vertices of the model keep their numbers; vertices of creases and splits follow. Faces are in
 * the model's order, parts of one face next to each other, and wind so that their front is outside, in
 * mirrored instances too.
 */
#ifndef FCT_RADIOSITY_SURFACE_H
#define FCT_RADIOSITY_SURFACE_H

#include "facetree/scene.h"
#include "radiosity/surface/foothold.h"
#include "radiosity/surface/shading.h"

typedef struct fct_surface {
    fct_mesh mesh; /* world positions, triangles, source_faces and source_uv (in the mesh as it was added),
                      and colours, which are undefined until the output lights them */
    fct_shading shading;
    float *normals; /* per vertex x 3: shading normals, unit, n . n_f > 0 for all its faces; zero if all are
                       degenerate */
    float *sample_points; /* per vertex x 3: the vertex, or a point inside a face if the vertex is on the rim
                             of its smooth group; lifted (shading.h) */
    float *offsets;       /* per vertex: rays start at sample point + offset * normal */
    float *areas;         /* per vertex: a third of its faces' area */
    uint32_t *places;     /* per vertex: tree place of a face with the sample point; FCT_NONE without faces */
    uint8_t *flat;        /* per vertex: 1 if all its faces lie in one plane */
    uint32_t *face_places; /* per face: tree place of the model's face */
} fct_surface;

/* Allocates all arrays. Places are FCT_NONE, other vertex arrays 0, face arrays undefined. Errors: MEMORY. */
fct_result fct_surface_allocate(const fct_env *env, uint32_t vertex_count, uint32_t face_count,
                                fct_surface *out);
void fct_surface_release(const fct_env *env, fct_surface *surface);

/* Whether a vertex has a face and a normal, so that it can receive light. */
static inline bool fct_surface_is_solid(const fct_surface *surface, size_t vertex) {
    const float *n = surface->normals + 3 * vertex;
    return surface->places[vertex] != FCT_NONE && (n[0] != 0 || n[1] != 0 || n[2] != 0);
}

/* The normal of a vertex on the side that receives the light. */
static inline void fct_surface_normal(const fct_surface *surface, size_t vertex, bool back, float normal[3]) {
    for (size_t c = 0; c < 3; ++c)
        normal[c] = back ? -surface->normals[3 * vertex + c] : surface->normals[3 * vertex + c];
}

/* Stores the foothold of a vertex; the foothold's face is a face of the surface. */
void fct_surface_place(fct_surface *surface, uint32_t vertex, const fct_foothold *at);

#endif
