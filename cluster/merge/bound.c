/* cluster/merge/bound.c: bounds of faces, four corners at a time. */
#include "cluster/merge/bound.h"

#include <math.h>

#include "base/math/simd.h"

void fct_bound_faces(const fct_mesh *mesh, size_t begin, size_t end, fct_bounds *out) {
    d4 lower[3], upper[3], points[3];
    for (int k = 0; k < 3; ++k) lower[k] = d4_set(INFINITY), upper[k] = d4_set(-INFINITY);
    for (size_t corner = 3 * begin, last = 3 * end - 1; corner <= last; corner += 4) {
        const float *p[4];
        for (size_t i = 0; i < 4; ++i)
            p[i] = mesh->positions + 3 * (size_t)mesh->triangles[corner + i < last ? corner + i : last];
        d4_load_points(p, points);
        for (int k = 0; k < 3; ++k)
            lower[k] = d4_min(lower[k], points[k]), upper[k] = d4_max(upper[k], points[k]);
    }
    for (int k = 0; k < 3; ++k) {
        float low[4], high[4];
        d4_store_floats(low, lower[k]), d4_store_floats(high, upper[k]);
        out->lower[k] = low[0], out->upper[k] = high[0];
        for (int i = 1; i < 4; ++i) {
            if (low[i] < out->lower[k]) out->lower[k] = low[i];
            if (high[i] > out->upper[k]) out->upper[k] = high[i];
        }
    }
}
