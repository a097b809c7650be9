/* radiosity/output/error_map.h: the expected error of the light at each vertex of a surface.
 *
 * The pattern comes from how the light varies between neighbouring anchors and vertices. One factor per
 * surface brings its RMS over the area to what check.h has measured, the closer the more points that had.
 */
#ifndef FCT_RADIOSITY_ERROR_MAP_H
#define FCT_RADIOSITY_ERROR_MAP_H

#include "radiosity/output/check.h"

typedef struct fct_error_map_def {
    const fct_solution *solution;
    const fct_surface *surface;
    uint32_t instance; /* of the surface, and its side */
    bool back;
    const fct_anchors *anchors;
    const float *light;     /* irradiance, per vertex x 3 */
    const uint8_t *covered; /* per vertex */
    const fct_check *check; /* of this surface alone; without points, the pattern keeps its own scale */
} fct_error_map_def;

/* Gives surface->mesh the array `error`: the expected RMS error of the radiosity over the channels. 0 at
 * vertices that are covered or have no light. *rays grows by the visibility tests. Errors: MEMORY, CANCELLED;
 * the mesh has no such array then. */
fct_result fct_error_map_add(const fct_error_map_def *def, fct_mesh *mesh, uint64_t *rays);

#endif
