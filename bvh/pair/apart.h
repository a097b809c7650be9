/* bvh/pair/apart.h: bounds of the distances of eight pairs of triangles, in float, for kernel files.
 *
 * Two triangles that do not meet are nearest between two edges, or between a corner and the inside of a
 * triangle. Each of these 15 cases yields a point of each triangle, whose difference d is
 *
 *   1. an upper bound: the distance is at most |d|, because the parameters of the points are clamped;
 *   2. a lower bound: along d / |d|, the triangles are apart by min a . d - max b . d, over their corners.
 *
 * So both hold however much the parameters err. They are equal if d joins the nearest points. Rounding moves
 * them by at most APART_ERROR times the extent L of both triangles together: a coordinate is below 1.8 L, and
 * with u = 2^-24, a difference of points errs by less than 16 u L, and so does a separation.
 */
#ifndef FCT_BVH_APART_H
#define FCT_BVH_APART_H

#include "base/math/simd.h"
#include "bvh/pair/leaves.h"

#define APART_ERROR 0x1p-20

#define W3_LANES f8
#include "base/math/w3.h"

/* A triangle per lane. */
typedef struct lane_triangles {
    w3 p[3], edge[3];
    f8 edge2[3], over_edge2[3]; /* squared lengths, and their inverses */
} lane_triangles;

static inline void find_edges(lane_triangles *t) {
    for (int i = 0; i < 3; ++i) {
        t->edge[i] = w3_sub(t->p[(i + 1) % 3], t->p[i]);
        t->edge2[i] = w3_dot(t->edge[i], t->edge[i]);
        t->over_edge2[i] = f8_div(f8_set(1), t->edge2[i]);
    }
}

/* The corners of up to 16 triangles: corner, coordinate, triangle. */
typedef struct leaf_corners {
    float p[3][3][16];
} leaf_corners;

static inline void store_corners(const fct_leaf *leaf, const placed_leaf *placed, leaf_corners *out) {
    for (uint32_t octet = 0; octet < fct_leaf_octets(leaf); ++octet) {
        eight_triangles t = pick_triangles(leaf, placed, octet);
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 3; ++k) f8_store(out->p[c][k] + 8 * octet, t.p[c][k]);
    }
}

static inline void load_corners(const leaf_corners *corners, uint32_t first, w3 p[3]) {
    for (int c = 0; c < 3; ++c)
        p[c] = (w3){f8_load(corners->p[c][0] + first), f8_load(corners->p[c][1] + first),
                    f8_load(corners->p[c][2] + first)};
}

static inline lane_triangles gather_triangles(const leaf_corners *corners, const uint32_t list[8]) {
    lane_triangles t;
    i8 index = i8_load(list);
    for (int c = 0; c < 3; ++c) {
        f8 p[3];
        for (int k = 0; k < 3; ++k)
            p[k] = f8_lookup16(f8_load(corners->p[c][k]), f8_load(corners->p[c][k] + 8), index);
        t.p[c] = w3_load(p);
    }
    find_edges(&t);
    return t;
}

/* 1 for the NaN of edges and faces without extent. */
static inline f8 clamp_to_unit(f8 x) {
    return f8_max(f8_min(x, f8_set(1)), f8_set(0));
}

/* The difference d of the nearest points of a and b so far, and its square. */
typedef struct lane_gaps {
    w3 d;
    f8 d2;
} lane_gaps;

static inline void try_gap(lane_gaps *gaps, w3 d) {
    f8 d2 = w3_dot(d, d);
    gaps->d.x = f8_if_lt(d2, gaps->d2, d.x, gaps->d.x);
    gaps->d.y = f8_if_lt(d2, gaps->d2, d.y, gaps->d.y);
    gaps->d.z = f8_if_lt(d2, gaps->d2, d.z, gaps->d.z);
    gaps->d2 = f8_min(d2, gaps->d2);
}

/* Edge i of a, p + s u, and edge j of b, q + t v, with r = p - q. */
static inline void try_edges(const lane_triangles *a, int i, const lane_triangles *b, int j,
                             lane_gaps *gaps) {
    w3 r = w3_sub(a->p[i], b->p[j]), u = a->edge[i], v = b->edge[j];
    f8 uu = a->edge2[i], vv = b->edge2[j], uv = w3_dot(u, v), ur = w3_dot(u, r), vr = w3_dot(v, r);
    f8 det = f8_sub(f8_mul(uu, vv), f8_mul(uv, uv));
    f8 s = clamp_to_unit(f8_div(f8_sub(f8_mul(uv, vr), f8_mul(vv, ur)), f8_max(det, f8_set(1e-37f))));
    f8 t = clamp_to_unit(f8_mul(f8_mad(vr, uv, s), b->over_edge2[j]));
    s = clamp_to_unit(f8_mul(f8_sub(f8_mul(uv, t), ur), a->over_edge2[i]));
    try_gap(gaps, w3_sub(w3_add(r, w3_scale(u, s)), w3_scale(v, t)));
}

/* The corners of `from`, and the points p + u e + v f of `face`. sign: 1 if `face` is a, -1 if it is b. */
static inline void try_face(const lane_triangles *face, const lane_triangles *from, float sign,
                            lane_gaps *gaps) {
    w3 e = face->edge[0], f = w3_sub(face->p[2], face->p[0]), n = w3_cross(e, f);
    f8 over_n2 = f8_div(f8_set(1), w3_dot(n, n));
    w3 along_u = w3_scale(w3_cross(f, n), over_n2), along_v = w3_scale(w3_cross(n, e), over_n2);
    for (int c = 0; c < 3; ++c) {
        w3 r = w3_sub(face->p[0], from->p[c]);
        f8 u = clamp_to_unit(f8_sub(f8_set(0), w3_dot(along_u, r)));
        f8 v = f8_sub(f8_set(0), w3_dot(along_v, r));
        v = f8_max(f8_min(v, f8_sub(f8_set(1), u)), f8_set(0));
        w3 d = w3_add(w3_add(r, w3_scale(e, u)), w3_scale(f, v));
        try_gap(gaps, w3_scale(d, f8_set(sign)));
    }
}

/* The least and the most of d over the corners of a triangle. */
static inline f8 least_along(const w3 p[3], w3 d) {
    return f8_min(w3_dot(p[0], d), f8_min(w3_dot(p[1], d), w3_dot(p[2], d)));
}
static inline f8 most_along(const w3 p[3], w3 d) {
    return f8_max(w3_dot(p[0], d), f8_max(w3_dot(p[1], d), w3_dot(p[2], d)));
}

/* Bounds of the distance of each pair. Of triangles that meet, *lower is at most 0. Returns the differences
 * whose lengths are the upper bounds. */
static inline w3 bound_distances(const lane_triangles *a, const lane_triangles *b, f8 *lower, f8 *upper) {
    f8 zero = f8_set(0);
    lane_gaps gaps = {{zero, zero, zero}, f8_set(INFINITY)};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) try_edges(a, i, b, j, &gaps);
    try_face(a, b, 1, &gaps);
    try_face(b, a, -1, &gaps);
    *upper = f8_sqrt(gaps.d2);
    f8 along = f8_sub(least_along(a->p, gaps.d), most_along(b->p, gaps.d));
    *lower = f8_div(along, f8_max(*upper, f8_set(1e-18f)));
    return gaps.d;
}

#endif
