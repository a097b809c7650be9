/* cluster/shape/box.c: the oriented box of a cluster, from the extents of its points.
 *
 * Extents are taken in double along the axes that fct_cluster_box expands from the stored quaternion. So the
 * box contains its points for these axes, and is as tight as they allow.
 */
#include "cluster/shape/box.h"

#include <float.h>

#include "base/key.h"
#include "base/math/round.h"

/* fmax is a call, because it handles NaN. */
static inline double greater(double a, double b) {
    return a > b ? a : b;
}

void fct_box_axes(const float q[4], float axes[3][3]) {
    double x = (double)q[0], y = (double)q[1], z = (double)q[2], w = (double)q[3];
    double s = 2 / (x * x + y * y + z * z + w * w);
    v3_store(axes[0], (v3){1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)});
    v3_store(axes[1], (v3){s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)});
    v3_store(axes[2], (v3){s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)});
}

void fct_cluster_box(const fct_cluster *cluster, fct_box *out) {
    for (int k = 0; k < 3; ++k) out->center[k] = cluster->box_center[k], out->half[k] = cluster->box_half[k];
    fct_box_axes(cluster->box_rotation, out->axes);
}

/* The next float above `value`, which is not negative. */
static float above(float value) {
    uint32_t bits = fct_float_bits(value);
    return fct_float_of_bits(bits + (bits < 0x7F800000u));
}

bool fct_box_set(const fct_extents *e, const float axes[3][3], v3 point, fct_cluster *cluster) {
    /* from a point, because the axes are orthonormal only to float rounding and the model may be far from 0
     */
    v3 center = point, a[3];
    double size = 0;
    bool within = true;
    for (int k = 0; k < 3; ++k) {
        a[k] = v3_load(axes[k]);
        center = v3_mad(center, 0.5 * (e->low[k] + e->high[k]) - v3_dot(point, a[k]), a[k]);
        size = greater(size, greater(fabs(e->low[k]), fabs(e->high[k])));
    }
    center = v3_round(center);
    v3_store(cluster->box_center, center);
    for (int k = 0; k < 3; ++k) {
        double middle = v3_dot(center, a[k]), half = greater(e->high[k] - middle, middle - e->low[k]);
        half += 16 * DBL_EPSILON * size; /* for any order of operations in a check */
        cluster->box_half[k] = above((float)half);
        within = within && isfinite(cluster->box_half[k]) && isfinite(cluster->box_center[k]);
        cluster->box_half[k] = cluster->box_half[k] < FLT_MAX ? cluster->box_half[k] : FLT_MAX;
    }
    return within;
}

double fct_box_area(const fct_extents *e) {
    double x = e->high[0] - e->low[0], y = e->high[1] - e->low[1], z = e->high[2] - e->low[2];
    return x * y + y * z + z * x;
}
