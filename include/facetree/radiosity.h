/* facetree/radiosity.h: hierarchical radiosity on face clusters, and a Monte Carlo reference.
 *
 * Source: Garland 1999, section 8.3.2, after Willmott, Heckbert, Garland, "Face Cluster Radiosity", EGWR
 * 1999. What the solver adds is derived in docs/radiosity.md.
 *
 * Radiosity B = e + rho E is power leaving per area, E irradiance, both in the unit of emission, RGB.
 */
#ifndef FACETREE_RADIOSITY_H
#define FACETREE_RADIOSITY_H

#include "facetree/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* FACE: the solver. REFERENCE: path tracing with next-event estimation at every vertex (or probe). */
typedef enum fct_bake_method { FCT_BAKE_FACE, FCT_BAKE_REFERENCE } fct_bake_method;
/* How the output's light is made: NONE from the solution alone; DIRECT with shadow rays to the lamps and
 * indirect light from anchors; GATHER the same with anchors as dense as the surface's relief asks for. */
typedef enum fct_final { FCT_FINAL_NONE, FCT_FINAL_DIRECT, FCT_FINAL_GATHER } fct_final;

typedef struct fct_bake_def {
    uint32_t size;
    fct_bake_method method;
    fct_final final;  /* default GATHER */
    double error;     /* epsilon: links and elements are split until none is uncertain by more than this share
                         of the emitted power; rays and anchors of the output grow with 1 / sqrt(error);
                         default 2e-5 */
    uint32_t samples; /* REFERENCE: paths per vertex; FACE: gather rays per anchor; 0: the default */
    uint64_t seed;
    bool indirect_only; /* leave out e and direct light */
    double max_edge; /* longest edge of the output's triangles on flat ground, world units; 0: chosen from the
                        scene */
} fct_bake_def;
FCT_API fct_bake_def fct_bake_def_default(void);

typedef struct fct_bake_stats {
    bool converged;
    uint32_t passes;
    uint64_t elements, links, rays, output_rays;
    uint64_t vertices, faces; /* of the output */
    double seconds_open, seconds_solve, seconds_push,
        seconds_total;      /* scene to elements and links; iteration; output */
    uint64_t touched_bytes; /* of hierarchy nodes read by the solve */
    double power_emitted, power_absorbed,
        power_escaped;     /* sums over RGB; emitted = absorbed + escaped up to the balance */
    double error_estimate; /* relative, of the solution, from the last iteration and the links' bounds */
} fct_bake_stats;

typedef struct fct_bake fct_bake;

/* Solves (FACE) or prepares (REFERENCE). The scene must outlive the bake. Errors: DATA (an error that is not
 * positive, a negative max_edge, a scene or a model that is not 1e-15 to 1e18 across), MEMORY, CANCELLED. */
FCT_API fct_result fct_bake_create(const fct_env *env, const fct_scene *scene, const fct_bake_def *def,
                                   fct_bake **out);
FCT_API void fct_bake_destroy(fct_bake *bake);
FCT_API fct_bake_stats fct_bake_get_stats(const fct_bake *bake);

/* The lit mesh of one instance, in world space, colours = radiosity per vertex. Large flat triangles are
 * tessellated and vertices on creases are doubled; source_faces tells the face of the mesh as it was added.
 * Of a two-sided instance it is the side that the solution finds brighter as a whole, and triangles wind so
 * that this side is in front. Errors: MEMORY, CANCELLED. */
FCT_API fct_result fct_bake_instance(fct_bake *bake, uint32_t instance, fct_mesh *out);
/* All instances in one mesh, instance after instance; face_counts, if not NULL, receives instance_count
 * numbers of faces. */
FCT_API fct_result fct_bake_mesh(fct_bake *bake, fct_mesh *out, uint32_t *face_counts);

typedef struct fct_probe {
    float radiosity[3], irradiance[3];
    uint32_t instance, face; /* the surface the probe was found on; FCT_NONE: free space, irradiance only */
} fct_probe;
/* Light at points (count x 3) with unit normals (count x 3): on a surface within 1e-3 of the scene's diagonal
 * and facing the same way, else in free space. Errors: MEMORY, CANCELLED. */
FCT_API fct_result fct_bake_probe(fct_bake *bake, size_t count, const float *points, const float *normals,
                                  fct_probe *out);

#ifdef __cplusplus
}
#endif
#endif
