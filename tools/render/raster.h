/* tools/render/raster.h: draws triangles with hidden surfaces removed, on the processor.
 *
 * The rasteriser knows only positions. For each pixel it finds the faces that the pixel's samples see. It
 * asks the caller for the light of each such face once, at the mean of the samples that see it. The pixel is
 * the weighted mean of these. Camera space is that of point.h.
 */
#ifndef FCT_TOOLS_RASTER_H
#define FCT_TOOLS_RASTER_H

#include "tools/kit/env.h"
#include "tools/render/point.h"

typedef void raster_shade(void *user, const raster_point *point, float rgb[3]);

/* Fills image (width x height x 4: red, green and blue times coverage, then coverage). The mesh may be any
 * valid one. Every run gives the same bits. Returns TOOL_DONE, TOOL_MEMORY or TOOL_CANCELLED. */
int raster_draw(tool *t, const raster_camera *camera, const fct_mesh *mesh, raster_shade *shade, void *user,
                float *image);

#endif
