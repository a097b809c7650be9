/* tools/render/point.h: the camera, and the point of a face that a ray through the picture sees. Camera
 * space: x right, y up, z forward. */
#ifndef FCT_TOOLS_POINT_H
#define FCT_TOOLS_POINT_H

#include "facetree/mesh.h"

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
