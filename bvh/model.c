/* bvh/model.c: the scale of a model, and its faces without area. */
#include "bvh/model.h"

/* Distance between the scaled bounds and bvh->lower, bvh->upper. A ray from far away starts on the wider
 * bounds, so it starts outside of every padded box. */
#define ENTRY_MARGIN .01f

static const float *corner_position(const fct_bvh *bvh, uint32_t place, int c) {
    return bvh->view.positions + 3 * (size_t)bvh->view.triangles[3 * (size_t)place + (size_t)c];
}

bool fct_bvh_degenerate(const fct_bvh *bvh, uint32_t place) {
    const float *p[3] = {corner_position(bvh, place, 0), corner_position(bvh, place, 1),
                         corner_position(bvh, place, 2)};
    double scale = bvh->scale, e[2][3];
    for (int i = 0; i < 2; ++i)
        for (int k = 0; k < 3; ++k) e[i][k] = scale * (double)p[i + 1][k] - scale * (double)p[0][k];
    /* long double, because the product of two differences may need more digits than a double holds. */
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3;
        if ((long double)e[0][i] * (long double)e[1][j] != (long double)e[0][j] * (long double)e[1][i])
            return false;
    }
    return true;
}

static fct_bounds bound_used_vertices(const fct_tree_view *view) {
    fct_bounds b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t i = 0; i < 3 * (size_t)view->face_count; ++i) {
        const float *p = view->positions + 3 * (size_t)view->triangles[i];
        for (int k = 0; k < 3; ++k) {
            if (p[k] < b.lower[k]) b.lower[k] = p[k];
            if (p[k] > b.upper[k]) b.upper[k] = p[k];
        }
    }
    return b;
}

void fct_bvh_measure(fct_bvh *bvh) {
    fct_bounds b = bvh->bounds = bound_used_vertices(&bvh->view);
    double half = 0, farthest = 0;
    for (int k = 0; k < 3; ++k) {
        half = fmax(half, ((double)b.upper[k] - (double)b.lower[k]) / 2);
        farthest = fmax(farthest, fmax(fabs((double)b.upper[k]), fabs((double)b.lower[k])));
    }
    double size = half > 0 ? half : farthest;
    bvh->scale = size > 0 ? ldexp(1, -ilogb(size) - 1) : 1;
    for (int k = 0; k < 3; ++k) {
        double lower = bvh->scale * (double)b.lower[k], upper = bvh->scale * (double)b.upper[k];
        double center = (lower + upper) / 2;
        bvh->offset[k] = fabs(center) >= 2 * (double)FCT_REACH ? (float)center : 0;
        double offset = (double)bvh->offset[k];
        bvh->center[k] = (float)(center - offset);
        bvh->lower[k] = nextafterf((float)(lower - offset) - ENTRY_MARGIN, -INFINITY);
        bvh->upper[k] = nextafterf((float)(upper - offset) + ENTRY_MARGIN, INFINITY);
    }
}
