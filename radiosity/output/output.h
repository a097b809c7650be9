/* radiosity/output/output.h: from a solution to light on the vertices of one instance, and at single points.
 */
#ifndef FCT_RADIOSITY_OUTPUT_H
#define FCT_RADIOSITY_OUTPUT_H

#include "facetree/radiosity.h"
#include "radiosity/output/anchor.h"
#include "radiosity/solve/link.h"
#include "radiosity/solve/transport.h"

/* All that the output reads. */
typedef struct fct_solution {
    const fct_env *env;
    const fct_scene *scene;
    fct_bake_def def;
    fct_lamps *lamps;
    fct_elements elements;
    fct_links links;
    fct_transport transport;
    double max_edge;       /* resolved */
    double fineness;       /* 1 at the default error; rays grow with it */
    double mean_radiosity; /* over the scene, mean of the channels: the scale of what is visible */
} fct_solution;

/* The lit mesh of an instance; rays are counted. Errors: MEMORY, CANCELLED. */
fct_result fct_output_instance(const fct_solution *s, uint32_t instance, fct_mesh *out, uint64_t *rays);

/* Irradiance and radiosity at points. Errors: MEMORY, CANCELLED. */
fct_result fct_output_probe(const fct_solution *s, size_t count, const float *points, const float *normals,
                            fct_probe *out, uint64_t *rays);

/* Where a probe lies: its instance and face, or FCT_NONE in free space; *back where it faces a two-sided
 * surface's back. */
typedef struct fct_site {
    uint32_t instance, face, place;
    float u, v;
    bool back;
    float offset;
    float point[3]; /* on the surface; the point asked for in free space */
} fct_site;
fct_site fct_output_site(const fct_scene *scene, const float point[3], const float normal[3]);

#endif
