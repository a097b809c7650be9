/* radiosity/output/surface.h: the mesh that carries the light of one instance, in world space.
 *
 * Triangles with long edges are split so that flat walls can carry light, vertices are doubled on creases,
 * and each vertex knows where and along which normal its light is to be found.
 */
#ifndef FCT_RADIOSITY_SURFACE_H
#define FCT_RADIOSITY_SURFACE_H

#include "facetree/scene.h"

/* Vertices of the model keep their numbers, doubled ones and those of splits follow; faces are in the model's
 * order, the parts of one next to each other. Triangles wind so that the front is outside, in mirrored
 * instances too. */
typedef struct fct_surface {
    fct_mesh mesh;  /* world positions, triangles, source_faces (of the mesh as it was added), colours
                       (undefined after build) */
    float *normals; /* per vertex x 3: unit, in front of all faces of the vertex (n . n_f > 0); zero where
                       a vertex has only degenerate faces or none */
    float *sample_points;  /* per vertex x 3: on a face of the vertex; the vertex itself, or pulled inwards
                              from  the rim of its smooth group */
    float *offsets;        /* per vertex: rays start at sample point + offset * normal */
    float *areas;          /* per vertex: a third of its faces' area */
    uint32_t *places;      /* per vertex: the place in the tree's order of a face that holds the sample point;
                              FCT_NONE for a vertex without faces */
    uint8_t *flat;         /* per vertex: 1 where all its faces lie in one plane */
    uint32_t *face_places; /* per face: place in the tree's order of the model's face it is a part of */
} fct_surface;

/* The longest edge that fct_surface_build allows on open ground when max_edge is 0. */
double fct_surface_default_edge(const fct_scene *scene);

/* Edges longer than max_edge (world units; 0: the default) are split at their midpoints, and so are edges
 * down to a quarter of it near other instances. Errors: MEMORY (also when the result would have 2^31 faces),
 * CANCELLED. */
fct_result fct_surface_build(const fct_env *env, const fct_scene *scene, uint32_t instance, double max_edge,
                             fct_surface *out);
void fct_surface_release(const fct_env *env, fct_surface *surface);

/* Whether the edge between two vertices, a < b, is to be split. May be asked several times for one edge. */
typedef bool fct_edge_test(void *user, uint32_t a, uint32_t b);
/* One round of splits at midpoints: an edge is split when the test says so for it or for an edge that
 * coincides with it (on a crease), and every triangle at it follows. Old vertices keep their numbers and
 * data, new ones are appended with colours half-way between the ends'; faces are renumbered. On failure the
 * surface is as it was. *added (may be NULL): new vertices. Errors: MEMORY. */
fct_result fct_surface_refine(const fct_env *env, fct_surface *surface, fct_edge_test *test, void *user,
                              uint32_t *added);

#endif
