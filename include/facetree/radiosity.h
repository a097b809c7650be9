/* facetree/radiosity.h: hierarchical radiosity on face clusters, and a Monte Carlo reference.
 *
 * Source: Garland 1999, section 8.3.2, which summarizes Willmott, Heckbert and Garland, "Face Cluster
 * Radiosity", EGWR 1999. docs/radiosity.md derives the rest.
 *
 * Radiosity B = e + rho E is the power that leaves a unit of area; E is the irradiance, the power that
 * arrives per unit of area. Both are RGB and have the unit of the scene's emission e.
 */
#ifndef FACETREE_RADIOSITY_H
#define FACETREE_RADIOSITY_H

#include "facetree/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* FACE: the solver. REFERENCE: path tracing with next-event estimation at every vertex and probe. */
typedef enum fct_bake_method { FCT_BAKE_FACE, FCT_BAKE_REFERENCE } fct_bake_method;
/* Light of the output's vertices and probes (FACE only).
 * NONE: from the links between elements alone: 9 % RMS error on the museum.
 * DIRECT: shadow rays to the lamps; indirect light from few anchors. For surfaces without relief.
 * GATHER: the same with enough anchors for contacts and relief. */
typedef enum fct_final { FCT_FINAL_NONE, FCT_FINAL_DIRECT, FCT_FINAL_GATHER } fct_final;

/* The mesh of the output.
 * NONE: finer than the model where light needs it.
 * CORNER: the faces of the mesh as it was added, in its order, with a vertex per smooth side of a crease: its
 * vertices keep their numbers, others follow.
 * VERTEX: the mesh as it was added. A vertex on a crease has the mean of its sides, weighted by their area.
 * FACE: the same with face_colors instead of colors: the mean of each face, from its corners and its centre.
 */
typedef enum fct_keep { FCT_KEEP_NONE, FCT_KEEP_CORNER, FCT_KEEP_VERTEX, FCT_KEEP_FACE } fct_keep;

/* The shading normals of the output: what they face decides how much light a vertex gets, while the geometry
 * decides what it sees.
 * FILE: those of the model's file, interpolated inside its triangles. Corners at one position are one vertex
 * if they have the same normal, within a degree, at any angle between their faces. A normal that is zero or
 * more than 88 degrees from that of its face is not usable; there, and for a model without normals, the rule
 * is CREASE with 40 degrees.
 * CREASE: the mean of the faces around a vertex, weighted by their angles. An edge at which the faces turn by
 * more than fct_bake_def.crease is a crease; it has a vertex per side.
 * FLAT: that of the face. Every face has vertices of its own. */
typedef enum fct_normals { FCT_NORMALS_FILE, FCT_NORMALS_CREASE, FCT_NORMALS_FLAT } fct_normals;

typedef struct fct_bake_def {
    uint32_t size;
    fct_bake_method method;
    fct_final final; /* default GATHER */
    double error; /* epsilon, default 2e-5: share of the absorbed power that a link may carry as uncertainty.
                     Numbers of rays and anchors of the output grow with 1 / sqrt(error) */
    uint32_t samples; /* REFERENCE: paths per vertex, default 256; FACE: gather rays per anchor; 0: default */
    uint64_t seed;    /* of all random numbers; equal seeds give equal results */
    bool indirect_only;  /* the output leaves out emission and direct light */
    unsigned outputs;    /* arrays of the lit meshes beside the colours: FCT_MESH_IRRADIANCE, FCT_MESH_DIRECT,
                            FCT_MESH_INDIRECT, FCT_MESH_ERROR, FCT_MESH_NORMALS; default 0. REFERENCE knows
                            the irradiance alone, and NONE knows neither its parts nor the error.
                            indirect_only leaves the direct part out of the irradiance too. The error of a
                            vertex is the expected RMS error of its radiosity over the channels, in the unit
                            of radiosity: large where the light is uncertain. Over the area of a surface its
                            RMS is about fct_bake_error.error times light */
    fct_keep keep;       /* default NONE. FACE has no outputs beside the colours and the normals */
    bool sources;        /* fct_bake_mesh also gives source_faces and source_uv; default false */
    fct_normals normals; /* default FILE */
    double crease;       /* CREASE: degrees, in (0, 180]; default 40 */
    uint64_t max_links; /* links of the solution, up to 4e9; those with the largest errors are split first. 0:
                           (1,000,000 + 30 per instance) sqrt(2e-5 / error), the root from 1/4 to 16. A link
                           takes about 60 bytes */
    /* Asked between steps, in the calling thread; true ends the bake early. If a pass of the links was
     * solved, calls still succeed, with stats.interrupted: the solution is that of the last complete pass or
     * gather, and further instances have the light of FCT_FINAL_NONE, without an error estimate. Otherwise
     * fct_bake_create gives CANCELLED. NULL: not asked. Nor is it with REFERENCE, or with outputs DIRECT,
     * INDIRECT and ERROR, which the links do not know. */
    bool (*stop)(void *user);
    void *stop_user;
    double max_edge; /* longest edge of the output's triangles far from other surfaces, world units; 0: a
                        72nd of the diagonal of all surfaces that emit no light */
} fct_bake_def;
FCT_API fct_bake_def fct_bake_def_default(void);

typedef struct fct_bake_stats {
    bool interrupted;           /* def.stop has ended the solution or the output early */
    bool converged;             /* the iteration reached its tolerance */
    uint32_t passes;            /* sweeps of all iterations */
    uint64_t elements, links;   /* of the solution */
    uint64_t max_links;         /* def.max_links, or the default for this scene and error */
    bool links_limited;         /* max_links has left links coarser than error asks for */
    double link_error;          /* share of the absorbed power that links carry as uncertainty: def.error, or
                                   more if links_limited */
    uint64_t rays, output_rays; /* of the solution; of the output so far */
    uint64_t vertices, faces;   /* of the output so far */
    double seconds_open;        /* refinement of links and elements */
    double seconds_solve;       /* iterations and gathers */
    double seconds_push;        /* output so far */
    double seconds_total;       /* all of fct_bake_create, and the output so far */
    uint64_t normals_unusable;  /* corners of models, with FCT_NORMALS_FILE; each model counts once */
    uint64_t normals_given;     /* corners of models with normals */
    uint32_t sides_left_out;    /* lit sides of two-sided instances that keep has no place for, so far */
    uint64_t touched_bytes;     /* pages of the hierarchies that were read, without rays */
    /* The reference counts the power of the instances that it has written. */
    double power_emitted;                 /* area times emission, summed over RGB */
    double power_absorbed, power_escaped; /* their sum equals power_emitted up to the noise of the rays. Of
                                             an interrupted bake: absorbed over the links, escaped unknown */
    /* RMS error over the mean of the light that the surfaces without emission show between their vertices,
     * for the output so far (see fct_bake_error). Before any output: the noise of the stored solution.
     * Without meaning if the bake was interrupted. */
    double error_estimate;
    uint64_t check_rays; /* of the error estimate, not in output_rays */
    double max_edge;     /* def.max_edge, or the default for this scene */
} fct_bake_stats;

typedef struct fct_bake fct_bake;

/* The error of an object's light, estimated at random points of its output: 16 to 512 per instance, by area.
 * There the shown light is compared with two independent gathers, whose own noise cancels. An error of the
 * stored solution is not in it. With def.keep, the shown light is that of the corners, before vertices or
 * faces take a mean of them. All zero for an object without output, and for REFERENCE. */
typedef struct fct_bake_error {
    double error; /* RMS over the mean light */
    double bias;  /* mean difference over the mean light */
    double light; /* mean reflected radiosity, of the three channels */
    double area;  /* that was checked */
} fct_bake_error;

/* Solves (FACE) or prepares (REFERENCE). The scene must be committed and must outlive the bake. Errors: DATA
 * (error <= 0, max_edge < 0, a crease outside (0, 180], max_links > 4e9, outputs that the method does not
 * know, a scene or model with a diagonal outside [1e-15, 1e18]), MEMORY, CANCELLED. */
FCT_API fct_result fct_bake_create(const fct_env *env, const fct_scene *scene, const fct_bake_def *def,
                                   fct_bake **out);
/* NULL is allowed. */
FCT_API void fct_bake_destroy(fct_bake *bake);
FCT_API fct_bake_stats fct_bake_get_stats(const fct_bake *bake);
/* object < object_count of the scene. */
FCT_API fct_bake_error fct_bake_get_error(const fct_bake *bake, uint32_t object);
/* The rule that gives the shading normals of an object: def.normals, or CREASE for FILE where the object's
 * file has no normals. object < object_count of the scene. */
FCT_API fct_normals fct_bake_get_normals(const fct_bake *bake, uint32_t object);

/* The lit mesh of one instance in world space, with the scene's origin; colours are radiosity per vertex.
 * Large flat triangles are tessellated, and vertices on creases are doubled; source_faces gives the face of
 * the mesh as it was added, and source_uv where in this face each corner lies. With env->flip_inward, a face
 * that was turned has its corners in the turned order. A two-sided instance has each of its sides that is
 * lit, with its own vertices and wound so that this side is in front: first the side with more radiosity,
 * then the other one unless it has less than 1e-4 of that. The caller releases *out with fct_mesh_release.
 * Errors: MEMORY, CANCELLED; *out is empty then.
 *
 * With def.keep, the mesh is that of the object, in world space, with all its vertices: those without faces
 * are black. A mirrored instance has corners 1 and 2 of each face exchanged, so that its front stays outside.
 * A two-sided instance has the light of its brighter side and the winding of its front. An instance that is
 * one of several parts of an object is an error (DATA): use fct_bake_object. */
FCT_API fct_result fct_bake_instance(fct_bake *bake, uint32_t instance, fct_mesh *out);
/* The lit mesh of an object: of all its instances. With def.keep, its parts are one mesh again, in the order
 * of the mesh as it was added. Errors: as above. */
FCT_API fct_result fct_bake_object(fct_bake *bake, uint32_t object, fct_mesh *out);
/* All instances in one mesh, in their order. face_counts (may be NULL) receives the number of faces of each
 * instance. Errors: as above; MEMORY also above 2^31 vertices or faces. */
FCT_API fct_result fct_bake_mesh(fct_bake *bake, fct_mesh *out, uint32_t *face_counts);

/* Writes the lit scene as a .glb that keeps its nodes: each object has a node with its name and transform,
 * and a mesh in the space of that node, with a primitive per material. fct_mesh_save describes
 * its colours and lights, and docs/radiosity.md the data that the file keeps.
 *
 * document: the .glb or .gltf that the scene was read from, which keeps its hierarchy, materials, textures,
 * cameras, lights and extras; or NULL: the nodes, materials and camera are those of the scene. def may be
 * NULL. merged (may be NULL) receives what fct_bake_mesh gives. Errors: OUTPUT, INPUT, DATA (the scene is not
 * that of the document, other than .glb, more than 4 GB), MEMORY, CANCELLED. */
FCT_API fct_result fct_bake_save_scene(fct_bake *bake, const char *path, const char *document,
                                       const fct_mesh_save_def *def, fct_mesh *merged);

typedef struct fct_probe {
    float radiosity[3], irradiance[3];
    uint32_t instance, face; /* the probe's surface; FCT_NONE in free space, where radiosity is 0 */
} fct_probe;
/* Light at points (count x 3) with normals (count x 3, any length). A probe belongs to the surface within
 * 1e-3 of the scene's diagonal that faces its normal; without such a surface it is in free space. Errors:
 * MEMORY, CANCELLED (also if the bake was stopped before its gather was complete). */
FCT_API fct_result fct_bake_probe(fct_bake *bake, size_t count, const float *points, const float *normals,
                                  fct_probe *out);

#ifdef __cplusplus
}
#endif
#endif
