/* bvh/near/measure.h: distances from a point to eight boxes or eight triangles at a time, in float. For
 * kernel files.
 *
 * A triangle is measured between two bounds that hold whatever the rounding:
 *
 *   1. base/math/nearest8.h gives a point q of the triangle. The distance of q is an upper bound.
 *   2. Each corner c has (c - p).q' / |q'| of its way from p along q' = q - p. The least of the three is a
 *      lower bound, because the triangle lies beyond that plane. If q is the nearest point, both are equal.
 *
 * Rounding in step 1 makes the bounds differ, but never wrong. With u = 2^-24 and every corner within R of p,
 * q errs by at most 20 u R, and the products of step 2 by 6 u R. FCT_MEASURE_MARGIN is 32 u.
 */
#ifndef FCT_BVH_MEASURE_H
#define FCT_BVH_MEASURE_H

#include "base/math/nearest8.h"
#include "base/math/round.h"
#include "base/math/simd.h"
#include "bvh/model.h"

/* Times the distance to the farthest point of the model: the error of either bound. */
#define FCT_MEASURE_MARGIN 0x1p-19

/* Farther points move to this distance from the centre, along each axis. */
#define FCT_AT_CLAMP 1e9

/* A point as the boxes and triangles see it. */
typedef struct fct_at {
    float at[3];       /* the scaled point in float, clamped to a cube around the centre */
    float centered[3]; /* relative to the centre */
    double rounding;   /* at least the distance between `at` and the clamped point */
    double margin;     /* error of the bounds of a triangle */
} fct_at;

/* Clamping the point to a large cube around the model moves it nearer to everything in the model, so box
 * distances from the clamped point are lower bounds of those from the point. */
static inline fct_at fct_at_make(const fct_bvh *bvh, v3 scaled) {
    fct_at a = {.rounding = 0};
    double p[3] = {scaled.x, scaled.y, scaled.z}, farthest2 = 0;
    for (int k = 0; k < 3; ++k) {
        double c = (double)bvh->center[k],
               clamped = fct_min(fct_max(p[k], c - FCT_AT_CLAMP), c + FCT_AT_CLAMP);
        double rounded = fct_round(clamped);
        a.at[k] = (float)rounded;
        a.centered[k] = a.at[k] - bvh->center[k];
        a.rounding += fabs(rounded - clamped);
        double far = fct_max(fabs((double)bvh->lower[k] - rounded), fabs((double)bvh->upper[k] - rounded));
        farthest2 += far * far;
    }
    a.margin = FCT_MEASURE_MARGIN * sqrt(farthest2);
    return a;
}

/* The square of a distance up to which boxes are open: beyond `distance` from the point by float rounding. */
static inline float fct_box_limit2(const fct_at *a, double distance) {
    double limit = distance + a->rounding;
    return distance < INFINITY ? (float)fct_min(limit * limit * 1.0001 + 1e-30, 3e38) : INFINITY;
}

/* The same for the lower bounds of triangles: a triangle beyond is farther than `distance` from the point. */
static inline float fct_triangle_limit2(const fct_at *a, double distance) {
    double limit = distance * (1 + 1e-6) + a->margin + a->rounding;
    return distance < INFINITY ? (float)fct_min(limit * limit, 3e38) : INFINITY;
}

/* Squared distances of eight axis boxes; bit i of the result: box i is within the limit. */
static inline uint32_t fct_measure_axis_boxes(const fct_axis_node *node, const fct_at *a, float limit2,
                                              float distance2[8]) {
    f8 zero = f8_set(0), sum = zero;
    for (int k = 0; k < 3; ++k) {
        f8 p = f8_set(a->at[k]);
        f8 below = f8_sub(f8_load(node->bounds[k][0]), p), above = f8_sub(p, f8_load(node->bounds[k][1]));
        f8 d = f8_max(f8_max(below, above), zero);
        sum = f8_add(sum, f8_mul(d, d));
    }
    f8_store(distance2, sum);
    return f8_le(sum, f8_set(limit2));
}

/* The same for oriented boxes. A row of a map is an axis of the box over its half extent h, so a distance d
 * in mapped units is d h = d / |row|. */
static inline uint32_t fct_measure_oriented_boxes(const fct_oriented_node *node, const fct_at *a,
                                                  float limit2, float distance2[8]) {
    f8 zero = f8_set(0), one = f8_set(1), sum = zero;
    f8 x = f8_set(a->centered[0]), y = f8_set(a->centered[1]), z = f8_set(a->centered[2]);
    for (int k = 0; k < 3; ++k) {
        f8 mx = f8_load(node->map[k][0]), my = f8_load(node->map[k][1]), mz = f8_load(node->map[k][2]);
        f8 q = f8_add(f8_add(f8_mul(mx, x), f8_mul(my, y)), f8_add(f8_mul(mz, z), f8_load(node->map[k][3])));
        f8 d = f8_max(f8_sub(f8_abs(q), one), zero);
        f8 row2 = f8_add(f8_add(f8_mul(mx, mx), f8_mul(my, my)), f8_mul(mz, mz));
        sum = f8_add(sum, f8_div(f8_mul(d, d), f8_max(row2, f8_set(1e-30f))));
    }
    f8_store(distance2, sum);
    return f8_le(sum, f8_set(limit2));
}

/* Measures the children of a node, of either kind, from an fct_at. */
static inline uint32_t fct_measure_children(const fct_bvh *bvh, uint32_t ref, const void *at, float limit2,
                                            float distance2[8], const uint32_t **child) {
    const fct_at *a = at;
    if (ref & FCT_REF_ORIENTED) {
        const fct_oriented_node *node = fct_bvh_node(bvh, ref);
        *child = node->child;
        return fct_measure_oriented_boxes(node, a, limit2, distance2) & node->present;
    }
    const fct_axis_node *node = fct_bvh_node(bvh, ref);
    *child = node->child;
    return fct_measure_axis_boxes(node, a, limit2, distance2) & node->present;
}

/* The vertices of a leaf relative to the point. A leaf of eight vertices uses the first half alone. */
typedef struct fct_near_vertices {
    f8 x[2], y[2], z[2];
} fct_near_vertices;

static inline void fct_near_vertices_load(const fct_leaf *leaf, const fct_at *a, fct_near_vertices *out) {
    const float *rows = fct_leaf_vertices(leaf);
    uint32_t stride = 8u * leaf->vertex_octets;
    for (uint32_t i = 0; i < leaf->vertex_octets; ++i) {
        out->x[i] = f8_sub(f8_load(rows + 8 * i), f8_set(a->at[0]));
        out->y[i] = f8_sub(f8_load(rows + stride + 8 * i), f8_set(a->at[1]));
        out->z[i] = f8_sub(f8_load(rows + 2 * stride + 8 * i), f8_set(a->at[2]));
    }
}

static inline f8x3 f8x3_lookup(const fct_near_vertices *v, uint32_t vertex_octets, i8 index) {
    if (vertex_octets == 1)
        return (f8x3){f8_lookup8(v->x[0], index), f8_lookup8(v->y[0], index), f8_lookup8(v->z[0], index)};
    return (f8x3){f8_lookup16(v->x[0], v->x[1], index), f8_lookup16(v->y[0], v->y[1], index),
                  f8_lookup16(v->z[0], v->z[1], index)};
}

/* Both bounds of eight triangles. The lower bound is plane / sqrt(upper2), or 0 if plane is not positive. */
typedef struct fct_eight_near {
    f8 upper2; /* squared distance of a point of the triangle */
    f8 plane;  /* least product of a corner with that point, both relative to the point */
} fct_eight_near;

/* `corners`: three rows of eight vertex numbers. */
static inline fct_eight_near fct_measure_triangles(const fct_near_vertices *vertices, uint32_t vertex_octets,
                                                   const uint8_t *corners) {
    f8x3 a = f8x3_lookup(vertices, vertex_octets, i8_load_bytes(corners)),
         b = f8x3_lookup(vertices, vertex_octets, i8_load_bytes(corners + 8)),
         c = f8x3_lookup(vertices, vertex_octets, i8_load_bytes(corners + 16));
    f8x3 q = fct_nearest8_find(a, b, c).point;
    fct_eight_near near;
    near.upper2 = f8x3_dot(q, q);
    near.plane = f8_min(f8x3_dot(q, a), f8_min(f8x3_dot(q, b), f8x3_dot(q, c)));
    return near;
}

/* Bit i: the lower bound of triangle i is at most sqrt(limit2). */
static inline uint32_t fct_triangles_within(const fct_eight_near *near, float limit2) {
    f8 plane = f8_max(near->plane, f8_set(0));
    return ~f8_lt(f8_mul(f8_set(limit2), near->upper2), f8_mul(plane, plane)) & 0xffu;
}

/* Whether the triangles of a leaf may be within sqrt(limit2) of the point: false if the plane through the
 * vertex nearest to the point, across the way to it, moved to the nearest vertex along that way, lies beyond.
 * The same lower bound as that of a triangle, with the vertex in place of q, at a tenth of the cost. */
static inline bool fct_leaf_within(const fct_near_vertices *v, uint32_t vertex_octets, float limit2) {
    static const uint32_t numbers[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    i8 lane = i8_load(numbers);
    uint32_t last = vertex_octets - 1;
    f8x3 low = {v->x[0], v->y[0], v->z[0]}, high = {v->x[last], v->y[last], v->z[last]};
    f8 low2 = f8x3_dot(low, low), high2 = f8x3_dot(high, high);
    f8x3 to = {f8_if_lt(high2, low2, high.x, low.x), f8_if_lt(high2, low2, high.y, low.y),
               f8_if_lt(high2, low2, high.z, low.z)};
    /* The lowest bits of the keys are lane numbers, so the least key names a lane. */
    i8 key = i8_or(i8_without(i8_bits(f8_min(high2, low2)), i8_set(7)), lane);
    for (uint32_t i = 4; i > 0; i /= 2) {
        i8 other = i8_lookup8(key, i8_xor(lane, i8_set(i)));
        key = i8_if(i8_less(other, key), other, key);
    }
    i8 nearest = i8_and(key, i8_set(7));
    to = (f8x3){f8_lookup8(to.x, nearest), f8_lookup8(to.y, nearest), f8_lookup8(to.z, nearest)};
    fct_eight_near plane = {.upper2 = f8x3_dot(to, to),
                            .plane = f8_min(f8x3_dot(high, to), f8x3_dot(low, to))};
    return fct_triangles_within(&plane, limit2) != 0;
}

#endif
