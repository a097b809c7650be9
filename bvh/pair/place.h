/* bvh/pair/place.h: places boxes of one model in the space of the other, for kernel files. */
#ifndef FCT_BVH_PLACE_H
#define FCT_BVH_PLACE_H

#include <math.h>

#include "base/math/simd.h"
#include "bvh/pair/map.h"

/* x, y and z times the columns of a matrix, in the order of fct_rotate. */
static inline f8 turn_axis(const float columns[3][8], float x, float y, float z) {
    f8 sum = f8_add(f8_mul(f8_load(columns[0]), f8_set(x)), f8_mul(f8_load(columns[1]), f8_set(y)));
    return f8_add(sum, f8_mul(f8_load(columns[2]), f8_set(z)));
}

/* Box `box` of `from`; does nothing if it is placed already. */
static inline void place_box(const fct_space_map *map, const fct_bvh *from, uint32_t box,
                             fct_placed_box *out) {
    if (out->box == box) return;
    const fct_pair_node *node = &from->pairs[box >> 3];
    uint32_t slot = box & 7;
    d4 x = d4_set((double)node->center[0][slot]), y = d4_set((double)node->center[1][slot]),
       z = d4_set((double)node->center[2][slot]);
    d4 at = d4_add(d4_mul(d4_load(map->columns[0]), x), d4_mul(d4_load(map->columns[1]), y));
    at = d4_add(at, d4_mul(d4_load(map->columns[2]), z));
    at = d4_add(d4_mul(at, d4_set(map->factor)), d4_load(map->shift));
    out->box = box;
    d4_store(out->exact_center, at);
    d4_store_floats(out->center, at);
    for (int k = 0; k < 3; ++k) {
        out->half[k] = node->half[k][slot] * map->factor_float;
        f8_store(out->axes[k], turn_axis(map->columns_float, node->axes[k][0][slot], node->axes[k][1][slot],
                                         node->axes[k][2][slot]));
    }
    const double *c = out->exact_center;
    double size = fabs(c[0]) + fabs(c[1]) + fabs(c[2]) + (double)(out->half[0] + out->half[1] + out->half[2]);
    out->slack = fct_round_up(map->slack + map->slack_per_size * size);
}

#endif
