/* bvh/build/hold.c: widens slabs to the vertices of leaves, four vertices at a time. */
#include "base/math/simd.h"

#include "bvh/build/slabs.h"

typedef struct lanes {
    d4 axes[3][3], center[3], lower[3], upper[3];
} lanes;

static inline void widen(lanes *l, const float *x, const float *y, const float *z) {
    const d4 px = d4_sub(d4_load_floats(x), l->center[0]), py = d4_sub(d4_load_floats(y), l->center[1]),
             pz = d4_sub(d4_load_floats(z), l->center[2]);
    for (int k = 0; k < 3; ++k) {
        const d4 *a = l->axes[k];
        const d4 at = d4_add(d4_add(d4_mul(px, a[0]), d4_mul(py, a[1])), d4_mul(pz, a[2]));
        l->lower[k] = d4_min(at, l->lower[k]);
        l->upper[k] = d4_max(at, l->upper[k]);
    }
}

void fct_slabs_hold(const fct_bvh *bvh, const uint32_t *offsets, const uint32_t *order, uint32_t count,
                    fct_slabs *s) {
    lanes l;
    for (int k = 0; k < 3; ++k) {
        l.axes[k][0] = d4_set(s->axes[k].x), l.axes[k][1] = d4_set(s->axes[k].y);
        l.axes[k][2] = d4_set(s->axes[k].z);
        l.center[k] = d4_set((double)bvh->center[k]);
        l.lower[k] = d4_set(s->lower[k]), l.upper[k] = d4_set(s->upper[k]);
    }
    for (uint32_t i = 0; i < count; ++i) {
        const fct_leaf *leaf = fct_bvh_leaf(bvh, offsets[order[i]]);
        const float *rows = fct_leaf_vertices(leaf);
        const uint32_t stride = 8u * leaf->vertex_octets;
        for (uint32_t j = 0; j < stride; j += 4)
            widen(&l, rows + j, rows + stride + j, rows + 2 * stride + j);
    }
    for (int k = 0; k < 3; ++k) {
        double lower[4], upper[4];
        d4_store(lower, l.lower[k]), d4_store(upper, l.upper[k]);
        for (int i = 0; i < 4; ++i) {
            if (lower[i] < s->lower[k]) s->lower[k] = lower[i];
            if (upper[i] > s->upper[k]) s->upper[k] = upper[i];
        }
    }
}
