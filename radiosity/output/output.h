/* radiosity/output/output.h: light on the vertices of one instance. */
#ifndef FCT_RADIOSITY_OUTPUT_H
#define FCT_RADIOSITY_OUTPUT_H

#include "radiosity/output/solution.h"

/* The lit mesh of an instance in world space, of the side that fct_output_back chooses. *rays grows by the
 * rays traced. Errors: MEMORY, CANCELLED. */
fct_result fct_output_instance(const fct_solution *s, uint32_t instance, fct_mesh *out, uint64_t *rays);

/* True if the output shows the back of a two-sided instance, because it has more radiosity than the front. */
bool fct_output_back(const fct_solution *s, uint32_t instance);

/* Factor on the rays of a vertex: sqrt(200,000 / faces of the scene), in [1, 4]. A small scene has few
 * vertices, so more rays per vertex cost little time. */
double fct_output_ray_factor(const fct_solution *s);

/* True if the radiosities of two neighbouring vertices differ so much that the edge must be split: by more
 * than 10 % of their sum plus 4 % of the scene's mean radiosity, summed over channels. */
bool fct_output_crosses_border(const float a[3], const float b[3], double mean_radiosity);

#endif
