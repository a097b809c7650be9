/* radiosity/output/probe.h: light at single points. */
#ifndef FCT_RADIOSITY_PROBE_H
#define FCT_RADIOSITY_PROBE_H

#include "radiosity/output/solution.h"

/* The surface point of a probe. */
typedef struct fct_site {
    uint32_t instance, face, place; /* instance FCT_NONE: free space */
    float u, v;
    bool back; /* the normal is on the back of a two-sided surface */
    float offset;
    float point[3]; /* on the surface; the point itself in free space */
} fct_site;

/* Finds the surface within 1e-3 of the scene's diagonal of the point that faces the unit normal. */
fct_site fct_probe_site(const fct_scene *scene, const float point[3], const float normal[3]);

/* Lifts the point of a site (shading.h). */
void fct_probe_lift(const fct_solution *s, fct_site *site);

/* Irradiance and radiosity at points with normals (count x 3 each, normals of any length). *rays grows.
 * Errors: MEMORY, CANCELLED. */
fct_result fct_output_probe(const fct_solution *s, size_t count, const float *points, const float *normals,
                            fct_probe *out, uint64_t *rays);

#endif
