/* tools/render/raster.h: draws triangles with hidden surfaces removed, on the processor.
 *
 * The rasteriser knows only positions. For each pixel it finds the faces that the pixel's samples see. It
 * asks the caller for the light of each such face once, at the mean of the samples that see it. The pixel is
 * the weighted mean of these. Camera space: x right, y up, z forward.
 */
#ifndef FCT_TOOLS_RASTER_H
#define FCT_TOOLS_RASTER_H

#include "tools/kit/env.h"

enum { RASTER_MAX_SIZE = 16384, RASTER_MAX_SAMPLES = 64 };

typedef struct raster_camera {
    double eye[3];
    double axes[3][3]; /* rows: right, up, forward; orthonormal */
    double focal;      /* pixels per unit of slope */
    double unit;       /* about the extent of the mesh: coordinates are divided by it */
    uint32_t width, height;
    uint32_t samples; /* per pixel, 1 to RASTER_MAX_SAMPLES */
    bool cull;        /* leave out faces that are seen from behind */
} raster_camera;

/* The point of a face that a pixel sees. */
typedef struct raster_point {
    uint32_t face;
    bool back;        /* seen from behind */
    double weight[3]; /* barycentric coordinates: at least 0, sum 1 */
    double side[3];   /* distance to the side opposite each corner, in pixels */
} raster_point;

typedef void raster_shade(void *user, const raster_point *point, float rgb[3]);

/* Fills image (width x height x 4: red, green and blue times coverage, then coverage). The mesh may be any
 * valid one. Every run gives the same bits. Returns TOOL_DONE, TOOL_MEMORY or TOOL_CANCELLED. */
int raster_draw(tool *t, const raster_camera *camera, const fct_mesh *mesh, raster_shade *shade, void *user,
                float *image);

#endif
