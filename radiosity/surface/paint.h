/* radiosity/surface/paint.h: the reflectance of a surface's vertices. */
#ifndef FCT_RADIOSITY_SURFACE_PAINT_H
#define FCT_RADIOSITY_SURFACE_PAINT_H

#include "radiosity/surface/surface.h"

/* The reflectance at a vertex: the mean over about the area that its colour fills, so that detail of a
 * texture between vertices does not alias. The material's where a vertex has no face. */
void fct_surface_reflectance(const fct_scene *scene, uint32_t instance, const fct_surface *surface,
                             size_t vertex, float out[3]);

#endif
