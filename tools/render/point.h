/* tools/render/point.h: the point of a face that a ray through the picture sees. */
#ifndef FCT_TOOLS_POINT_H
#define FCT_TOOLS_POINT_H

#include "tools/render/raster.h"

/* A face, prepared for rays from the eye. With the corners v_i in camera space and n_i = v_j x v_k, the
 * barycentric coordinate i of the point on a ray r is n_i . r / sum . r, where sum = n_0 + n_1 + n_2. */
typedef struct raster_plane {
    uint32_t face;
    double n[3][3], sum[3];
    bool back; /* seen from behind */
} raster_plane;

/* A point of the world in camera space: right, up, forward, in camera->unit. */
void raster_to_camera(const raster_camera *camera, const float *p, double out[3]);
raster_plane raster_make_plane(const raster_camera *camera, const fct_mesh *mesh, uint32_t face);
/* The point at the picture's (x, y). A point outside the face by rounding moves into it. */
raster_point raster_find_point(const raster_camera *camera, const raster_plane *p, double x, double y);

#endif
