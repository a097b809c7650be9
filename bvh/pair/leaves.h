/* bvh/pair/leaves.h: boxes of the triangles of two leaves, for kernel files.
 *
 * Both leaves are seen in the coordinates of the box of leaf a, which lies along its surface. There the boxes
 * of its triangles are flat, and few pairs of triangles are left for the exact test.
 */
#ifndef FCT_BVH_PAIR_LEAVES_H
#define FCT_BVH_PAIR_LEAVES_H

#include "base/math/simd.h"
#include "bvh/pair/map.h"

/* The vertices of a leaf, seen from the box. A leaf of eight vertices fills both halves with them. */
typedef struct placed_leaf {
    f8 at[3][2];
} placed_leaf;

static inline placed_leaf place_leaf(const fct_leaf *leaf, const fct_leaf_map *map) {
    const float *rows = fct_leaf_vertices(leaf);
    uint32_t stride = 8u * leaf->vertex_octets, second = leaf->vertex_octets == 2 ? 8 : 0;
    placed_leaf placed;
    for (uint32_t h = 0; h < 2; ++h) {
        f8 p[3];
        for (uint32_t k = 0; k < 3; ++k)
            p[k] = f8_sub(f8_load(rows + k * stride + h * second), f8_set(map->from[k]));
        for (uint32_t k = 0; k < 3; ++k) {
            f8 sum = f8_add(f8_mul(f8_set(map->turn[k][0]), p[0]), f8_mul(f8_set(map->turn[k][1]), p[1]));
            sum = f8_add(sum, f8_mul(f8_set(map->turn[k][2]), p[2]));
            placed.at[k][h] = f8_add(sum, f8_set(map->shift[k]));
        }
    }
    return placed;
}

/* Corners of eight triangles: corner, coordinate. */
typedef struct eight_triangles {
    f8 p[3][3];
} eight_triangles;

/* Triangles 8 octet to 8 octet + 7. The unused ones at the end repeat vertices of the leaf. */
static inline eight_triangles pick_triangles(const fct_leaf *leaf, const placed_leaf *placed,
                                             uint32_t octet) {
    const uint8_t *corners = fct_leaf_corners(leaf) + 24 * (size_t)octet;
    eight_triangles t;
    for (int c = 0; c < 3; ++c) {
        i8 index = i8_load_bytes(corners + 8 * c);
        for (int k = 0; k < 3; ++k) t.p[c][k] = f8_lookup16(placed->at[k][0], placed->at[k][1], index);
    }
    return t;
}

/* Per coordinate and triangle. */
typedef struct triangle_boxes {
    float low[3][16], high[3][16];
} triangle_boxes;

static inline void find_triangle_boxes(const fct_leaf *leaf, const placed_leaf *placed, triangle_boxes *out) {
    for (uint32_t octet = 0; octet < fct_leaf_octets(leaf); ++octet) {
        eight_triangles t = pick_triangles(leaf, placed, octet);
        for (int k = 0; k < 3; ++k) {
            f8_store(out->low[k] + 8 * octet, f8_min(t.p[0][k], f8_min(t.p[1][k], t.p[2][k])));
            f8_store(out->high[k] + 8 * octet, f8_max(t.p[0][k], f8_max(t.p[1][k], t.p[2][k])));
        }
    }
}

/* A mask of the triangles whose boxes come within `slack` of the box low..high. */
static inline uint32_t meet_triangles(const triangle_boxes *t, uint32_t count, const float low[3],
                                      const float high[3], float slack) {
    uint32_t met = 0;
    for (uint32_t first = 0; first < count; first += 8) {
        uint32_t open = 0xff;
        for (int k = 0; k < 3; ++k)
            open &= f8_le(f8_load(t->low[k] + first), f8_set(high[k] + slack)) &
                    f8_le(f8_set(low[k] - slack), f8_load(t->high[k] + first));
        met |= open << first;
    }
    return met & ((1u << count) - 1);
}

/* Lower bounds of the squared distances of the boxes of triangles first to first + 7 from the box low..high.
 */
static inline f8 bound_triangles(const triangle_boxes *t, uint32_t first, const float low[3],
                                 const float high[3], float slack) {
    f8 zero = f8_set(0), sum = zero;
    for (int k = 0; k < 3; ++k) {
        f8 below = f8_sub(f8_load(t->low[k] + first), f8_set(high[k])),
           above = f8_sub(f8_set(low[k]), f8_load(t->high[k] + first));
        f8 gap = f8_max(f8_sub(f8_max(below, above), f8_set(slack)), zero);
        sum = f8_add(sum, f8_mul(gap, gap));
    }
    return f8_mul(sum, f8_set(1 - 0x1p-20f));
}

#endif
