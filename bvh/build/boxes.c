/* bvh/build/boxes.c: see boxes.h. */
#include "bvh/build/boxes.h"

/* Of a pair node. The centre and the axes are rounded to floats, and axes are orthonormal to a few roundings.
 * All coordinates are below 1, so a vertex leaves the box by less than 16 u, u = 2^-24. */
#define PAIR_PAD 0x1p-19

void fct_pack_axis_box(const float bounds[6], uint32_t i, fct_axis_node *out) {
    for (int k = 0; k < 3; ++k) {
        out->bounds[k][0][i] = nextafterf(bounds[k] - FCT_AXIS_PAD, -INFINITY);
        out->bounds[k][1][i] = nextafterf(bounds[3 + k] + FCT_AXIS_PAD, INFINITY);
    }
}

void fct_pack_oriented_box(const fct_slabs *s, uint32_t i, fct_oriented_node *out) {
    for (int k = 0; k < 3; ++k) {
        double half = (s->upper[k] - s->lower[k]) / 2 + (double)FCT_ORIENTED_PAD;
        v3 row = v3_scale(s->axes[k], 1 / half);
        out->map[k][0][i] = (float)row.x;
        out->map[k][1][i] = (float)row.y;
        out->map[k][2][i] = (float)row.z;
        out->map[k][3][i] = (float)(-(s->upper[k] + s->lower[k]) / (2 * half));
    }
}

void fct_pack_pair_box(const fct_slabs *s, uint32_t i, fct_pair_node *out) {
    v3 center = {0, 0, 0};
    float c[3];
    for (int k = 0; k < 3; ++k) {
        center = v3_mad(center, (s->upper[k] + s->lower[k]) / 2, s->axes[k]);
        out->half[k][i] = (float)((s->upper[k] - s->lower[k]) / 2 + PAIR_PAD);
        v3_store(c, s->axes[k]);
        for (int j = 0; j < 3; ++j) out->axes[k][j][i] = c[j];
    }
    v3_store(c, center);
    for (int k = 0; k < 3; ++k) out->center[k][i] = c[k];
}
