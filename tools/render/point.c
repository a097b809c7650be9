/* tools/render/point.c: see point.h. */
#include "tools/render/point.h"

#include <math.h>

void raster_to_camera(const raster_camera *camera, const float *p, double out[3]) {
    double d[3];
    for (int k = 0; k < 3; ++k) d[k] = (p[k] - camera->eye[k]) / camera->unit;
    for (int i = 0; i < 3; ++i)
        out[i] = camera->axes[i][0] * d[0] + camera->axes[i][1] * d[1] + camera->axes[i][2] * d[2];
}

raster_plane raster_make_plane(const raster_camera *camera, const fct_mesh *mesh, uint32_t face) {
    raster_plane out = {.face = face};
    double v[3][3];
    for (int i = 0; i < 3; ++i)
        raster_to_camera(camera, mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)face + i], v[i]);
    for (int i = 0; i < 3; ++i) {
        const double *a = v[(i + 1) % 3], *b = v[(i + 2) % 3];
        for (int k = 0; k < 3; ++k) {
            int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
            out.n[i][k] = a[k1] * b[k2] - a[k2] * b[k1];
            out.sum[k] += out.n[i][k];
        }
    }
    /* The frame (right, up, forward) is left-handed: a front face has a positive volume v0 . (v1 x v2). */
    out.back = v[0][0] * out.n[0][0] + v[0][1] * out.n[0][1] + v[0][2] * out.n[0][2] < 0;
    return out;
}

raster_point raster_find_point(const raster_camera *camera, const raster_plane *p, double x, double y) {
    double ray[3] = {(x - .5 * camera->width) / camera->focal, (.5 * camera->height - y) / camera->focal, 1};
    double sum = p->sum[0] * ray[0] + p->sum[1] * ray[1] + p->sum[2] * ray[2];
    raster_point point = {.face = p->face, .back = p->back};
    double total = 0;
    for (int i = 0; i < 3; ++i) {
        const double *n = p->n[i];
        double along = n[0] * ray[0] + n[1] * ray[1] + n[2] * ray[2], slope = hypot(n[0], n[1]),
               w = along / sum;
        point.side[i] = w > 0 && slope > 0 ? camera->focal * fabs(along) / slope : 0;
        w = w > 0 ? w < 1 ? w : 1 : 0; /* a NaN becomes 0 too */
        point.weight[i] = w;
        total += w;
    }
    for (int i = 0; i < 3; ++i) point.weight[i] = total > 0 ? point.weight[i] / total : 1. / 3;
    return point;
}
