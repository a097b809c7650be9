/* bvh/pair/apart.h: the distances of one triangle from eight, in float, for kernel files.
 *
 * Two triangles that do not meet are nearest between two edges, or between a corner and the inside of a
 * triangle. So the distance is the least of nine distances of segments and six of points.
 *
 * The result may err by DISTANCE_ERROR times the extent L of both triangles together, with u = 2^-24:
 *
 *   1. Two edges at an angle with the sine x: the nearest point of an edge e moves by up to 16 u L / x^2
 * along it, and not by more than |e|. So the distance grows by at most x min(|e|, 16 u L / x^2), which is
 * largest, below 2^-10 L, at x = 2^-10.
 *   2. A triangle with a sine under 2^-11 between its longest edges does not count as a face: no point of it
 * is farther from its edges than 2^-11 L. The normal of the others errs by 4 u / x < 2^-11.
 */
#ifndef FCT_BVH_APART_H
#define FCT_BVH_APART_H

#include "base/math/simd.h"
#include "bvh/pair/leaves.h"

#define DISTANCE_ERROR 0x1p-10f
#define FACE_SINE2     0x1p-22f
/* Four times a squared area, scaled. A face with less is smaller than the error, and floats would vanish. */
#define LEAST_FACE 1e-30f

#define W3_LANES f8
#include "base/math/w3.h"

/* A triangle per lane: eight, or eight times the same. */
typedef struct lane_triangles {
    w3 p[3], edge[3];
    f8 edge2[3], over_edge2[3]; /* squared lengths, and their inverses */
} lane_triangles;

static inline w3 make_w3(const f8 p[3]) {
    return (w3){p[0], p[1], p[2]};
}

static inline void find_edges(lane_triangles *t) {
    for (int i = 0; i < 3; ++i) {
        t->edge[i] = w3_sub(t->p[(i + 1) % 3], t->p[i]);
        t->edge2[i] = f8_max(w3_dot(t->edge[i], t->edge[i]), f8_set(1e-30f));
        t->over_edge2[i] = f8_div(f8_set(1), t->edge2[i]);
    }
}

static inline lane_triangles spread_triangle(const float p[3][3]) {
    lane_triangles t;
    for (int c = 0; c < 3; ++c) t.p[c] = (w3){f8_set(p[c][0]), f8_set(p[c][1]), f8_set(p[c][2])};
    find_edges(&t);
    return t;
}

static inline f8 clamp_to_unit(f8 x) {
    return f8_max(f8_min(x, f8_set(1)), f8_set(0));
}

/* Edge i of a, p + s u, and edge j of b, q + t v, with r = p - q. */
static inline f8 edge_distance2(const lane_triangles *a, int i, const lane_triangles *b, int j) {
    w3 r = w3_sub(a->p[i], b->p[j]), u = a->edge[i], v = b->edge[j];
    f8 uu = a->edge2[i], vv = b->edge2[j], uv = w3_dot(u, v), ur = w3_dot(u, r), vr = w3_dot(v, r);
    f8 det = f8_sub(f8_mul(uu, vv), f8_mul(uv, uv));
    f8 s = clamp_to_unit(f8_div(f8_sub(f8_mul(uv, vr), f8_mul(vv, ur)), f8_max(det, f8_set(1e-37f))));
    f8 t = clamp_to_unit(f8_mul(f8_mad(vr, uv, s), b->over_edge2[j]));
    s = clamp_to_unit(f8_mul(f8_sub(f8_mul(uv, t), ur), a->over_edge2[i]));
    w3 d = {f8_sub(f8_mad(r.x, s, u.x), f8_mul(t, v.x)), f8_sub(f8_mad(r.y, s, u.y), f8_mul(t, v.y)),
            f8_sub(f8_mad(r.z, s, u.z), f8_mul(t, v.z))};
    return w3_dot(d, d);
}

/* The smaller of `least` and the squared distances of the corners of `from` above the inside of `face`. */
static inline f8 face_distance2(const lane_triangles *face, const lane_triangles *from, f8 least) {
    w3 n = w3_cross(face->edge[0], face->edge[1]);
    const f8 *e = face->edge2;
    f8 edges = f8_max(f8_mul(e[0], e[1]), f8_max(f8_mul(e[1], e[2]), f8_mul(e[2], e[0])));
    f8 least_n2 = f8_mul(edges, f8_set(FACE_SINE2));
    f8 n2 = w3_dot(n, n), good = f8_sub(n2, f8_max(least_n2, f8_set(LEAST_FACE)));
    w3 in[3];
    for (int i = 0; i < 3; ++i) in[i] = w3_cross(n, face->edge[i]);
    f8 over_n2 = f8_div(f8_set(1), f8_max(n2, f8_set(1e-37f)));
    for (int c = 0; c < 3; ++c) {
        f8 inside = good;
        for (int i = 0; i < 3; ++i) inside = f8_min(inside, w3_dot(in[i], w3_sub(from->p[c], face->p[i])));
        f8 height = w3_dot(n, w3_sub(from->p[c], face->p[0]));
        f8 d2 = f8_mul(f8_mul(height, height), over_n2);
        least = f8_min(least, f8_if_lt(inside, f8_set(0), least, d2));
    }
    return least;
}

/* The squared distances of triangles that do not meet. */
static inline f8 find_distances2(const eight_triangles *eight, const lane_triangles *one) {
    lane_triangles a;
    for (int c = 0; c < 3; ++c) a.p[c] = make_w3(eight->p[c]);
    find_edges(&a);
    f8 least = f8_set(INFINITY);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) least = f8_min(least, edge_distance2(&a, i, one, j));
    least = face_distance2(&a, one, least);
    return face_distance2(one, &a, least);
}

#endif
