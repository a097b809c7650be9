/* radiosity/output/output.h: light on the vertices of one instance. */
#ifndef FCT_RADIOSITY_OUTPUT_H
#define FCT_RADIOSITY_OUTPUT_H

#include "radiosity/output/check.h"

/* Rays of the output. */
typedef struct fct_output_rays {
    uint64_t light, check; /* of the vertices; of the estimate of their error */
} fct_output_rays;

/* The lit mesh of one side of an instance in world space, wound so that this side is in front. *check grows
 * by what check.h finds, *rays by the rays traced. With def.keep, the surface is not refined and keeps the
 * winding of the front. Errors: MEMORY, CANCELLED. */
fct_result fct_output_side(const fct_solution *s, uint32_t instance, bool back, fct_mesh *out,
                           fct_check *check, fct_output_rays *rays);

/* The surface to light, for one of its sides: with def.keep, the model's faces without splits. Errors:
 * MEMORY, CANCELLED. */
fct_result fct_output_surface(const fct_solution *s, uint32_t instance, bool back, fct_surface *out);

/* Moves the mesh out of a lit surface, with its shading normals, and winds it so that the lit side is in
 * front. With def.keep it keeps the winding and the normals of the front. */
void fct_output_take(const fct_solution *s, fct_surface *surface, bool back, fct_mesh *out);

/* Share of the power of an instance's brighter side below which the other side counts as dark. */
#define FCT_OUTPUT_DARK 1e-4

/* The sides of an instance that the output shows, the brighter one first; returns their number. A one-sided
 * instance has its front, a two-sided one also its other side unless that is dark. */
uint32_t fct_output_sides(const fct_solution *s, uint32_t instance, bool back[2]);

/* True if the radiosities of two neighbouring vertices differ so much that the edge must be split: by more
 * than 10 % of their sum plus 4 % of the scene's mean radiosity, summed over channels; .6 times that on an
 * edge above a fifth of max_edge. */
bool fct_output_crosses_border(const float a[3], const float b[3], double mean_radiosity, bool is_long);

#endif
