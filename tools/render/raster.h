/* tools/render/raster.h: hidden-surface drawing of triangles on the processor.
 *
 * The rasteriser knows positions only. For every pixel it finds the faces that the pixel's samples see and
 * asks the caller for the light of each such face once, at the middle of the samples that see it; the pixel
 * is the mean. Camera space is x to the right, y up, z forwards.
 */
#ifndef FCT_TOOLS_RASTER_H
#define FCT_TOOLS_RASTER_H

#include "tools/kit/tool.h"

enum { RASTER_MAX_SIZE = 16384, RASTER_MAX_SAMPLES = 64 };

typedef struct raster_camera {
    double eye[3];
    double axes[3][3]; /* rows: right, up, forward; orthonormal */
    double focal;      /* pixels per unit of slope */
    double unit;       /* a length of the order of the mesh's extent: coordinates are divided by it */
    uint32_t width, height;
    uint32_t samples; /* a pixel, 1 to RASTER_MAX_SAMPLES */
    bool cull;        /* leave out faces seen from behind */
} raster_camera;

/* Where a pixel sees a face. */
typedef struct raster_point {
    uint32_t face;
    bool back;        /* seen from behind */
    double weight[3]; /* barycentric coordinates, at least 0, of sum 1 */
    double side[3];   /* distance in pixels from the side opposite each corner */
} raster_point;

typedef void raster_shade(void *user, const raster_point *point, float rgb[3]);

/* Fills image (width x height x 4: red, green, blue times coverage, coverage). Any valid mesh. The same bits
 * on every run. Returns TOOL_DONE, TOOL_MEMORY or TOOL_CANCELLED. */
int raster_draw(tool *t, const raster_camera *camera, const fct_mesh *mesh, raster_shade *shade, void *user,
                float *image);

#endif
