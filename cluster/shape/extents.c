/* cluster/shape/extents.c: extents of points along three axes, four points at a time. */
#include "cluster/shape/extents.h"

#include "base/math/simd.h"

/* fmax and fmin are calls, because they handle NaN. */
static inline double greater(double a, double b) {
    return a > b ? a : b;
}
static inline double lesser(double a, double b) {
    return a < b ? a : b;
}

typedef struct lanes {
    d4 low[3], high[3];
} lanes;

static inline void widen(lanes *l, const float *x, const float *y, const float *z, d4 a[3][3]) {
    d4 px = d4_load_floats(x), py = d4_load_floats(y), pz = d4_load_floats(z);
    for (int k = 0; k < 3; ++k) {
        d4 d = d4_add(d4_add(d4_mul(px, a[k][0]), d4_mul(py, a[k][1])), d4_mul(pz, a[k][2]));
        l->low[k] = d4_min(d, l->low[k]);
        l->high[k] = d4_max(d, l->high[k]);
    }
}

void fct_extents_add(fct_extents *extents, fct_points points, size_t begin, size_t end,
                     const float axes[3][3]) {
    if (begin >= end) return;
    d4 a[3][3];
    lanes l;
    for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < 3; ++i) a[k][i] = d4_set((double)axes[k][i]);
        l.low[k] = d4_set(extents->low[k]), l.high[k] = d4_set(extents->high[k]);
    }
    size_t i = begin;
    for (; i + 4 <= end; i += 4) widen(&l, points.x + i, points.y + i, points.z + i, a);
    if (i < end && end - begin >= 4) {
        widen(&l, points.x + end - 4, points.y + end - 4, points.z + end - 4, a);
    } else if (i < end) {
        float tail[3][4];
        for (size_t k = 0; k < 4; ++k) {
            size_t from = begin + k < end ? begin + k : begin;
            tail[0][k] = points.x[from], tail[1][k] = points.y[from], tail[2][k] = points.z[from];
        }
        widen(&l, tail[0], tail[1], tail[2], a);
    }
    for (int k = 0; k < 3; ++k) {
        double low[4], high[4];
        d4_store(low, l.low[k]);
        d4_store(high, l.high[k]);
        extents->low[k] = lesser(lesser(low[0], low[1]), lesser(low[2], low[3]));
        extents->high[k] = greater(greater(high[0], high[1]), greater(high[2], high[3]));
    }
}
