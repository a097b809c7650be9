/* tools/render/shade.h: the light of a face at a point. */
#ifndef FCT_TOOLS_SHADE_H
#define FCT_TOOLS_SHADE_H

#include "tools/render/drawing.h"

/* Computes the normals, lines and cluster colours that the shading needs. crease: the cosine of the largest
 * angle between faces that are shaded as smooth. Returns an exit code. */
int drawing_prepare(tool *t, drawing *d, double crease, bool wireframe);
/* A raster_shade; user is the drawing. */
void drawing_shade(void *user, const raster_point *point, float rgb[3]);

#endif
