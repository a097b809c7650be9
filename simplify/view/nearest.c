/* simplify/view/nearest.c: see nearest.h. */
#include "simplify/view/nearest.h"

#include <math.h>

#include "base/math/nearest8.h"
#include "base/math/simd.h"

static inline f8x3 load_corner(const float rows[3][8], const float point[3]) {
    return (f8x3){f8_sub(f8_load(rows[0]), f8_set(point[0])), f8_sub(f8_load(rows[1]), f8_set(point[1])),
                  f8_sub(f8_load(rows[2]), f8_set(point[2]))};
}

uint32_t fct_view_nearest(const fct_octet *octets, uint32_t count, const float point[3]) {
    uint32_t best = 0;
    float least = INFINITY;
    for (uint32_t i = 0; i < count; ++i) {
        const fct_octet *o = &octets[i];
        fct_nearest8 near =
            fct_nearest8_find(load_corner(o->corners[0], point), load_corner(o->corners[1], point),
                              load_corner(o->corners[2], point));
        float distance2[8];
        f8_store(distance2, f8x3_dot(near.point, near.point));
        for (uint32_t k = 0; k < 8; ++k)
            if (distance2[k] < least) least = distance2[k], best = 8 * i + k;
    }
    return best;
}
