/* radiosity/surface/tessellate.h: splits a model's long edges, so that flat walls can carry light. */
#ifndef FCT_RADIOSITY_TESSELLATE_H
#define FCT_RADIOSITY_TESSELLATE_H

#include "radiosity/surface/surface.h"

/* The longest edge for max_edge 0: the diagonal / 72 of the surfaces that emit no light, or of the scene if
 * all do. */
double fct_surface_default_edge(const fct_scene *scene);

/* Builds the surface of the shading's instance. Splits edges longer than max_edge (world units; 0: the
 * default) at their midpoints, and edges down to a quarter of it near other instances. Errors: MEMORY (also
 * if the result would have 2^31 faces), CANCELLED. */
fct_result fct_surface_build(const fct_env *env, const fct_shading *shading, double max_edge,
                             fct_surface *out);

#endif
