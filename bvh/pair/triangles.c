/* bvh/pair/triangles.c: see triangles.h.
 *
 * Two closed triangles meet if and only if an edge of one meets the other triangle:
 *
 *   1. If all corners of one lie strictly on one side of the plane of the other, they do not meet.
 *   2. An edge whose ends lie on different sides of the plane crosses it in one point. The point lies in the
 * triangle if the line of the edge passes its three sides in the same sense.
 *   3. An edge in the plane is compared with the triangle in the plane, seen along a coordinate axis.
 *
 * Each decision is the sign of a determinant (orient.h), so the answer is exact. The points of contact are
 * computed in double.
 */
#include "bvh/pair/triangles.h"

#include "bvh/near/triangle.h"
#include "bvh/pair/orient.h"

/* The signs of the corners of t over the plane of `plane`. Returns whether the plane separates them. */
static bool find_sides(const v3 plane[3], const v3 t[3], int side[3]) {
    fct_orient_corners(plane, t, side);
    return (side[0] > 0 && side[1] > 0 && side[2] > 0) || (side[0] < 0 && side[1] < 0 && side[2] < 0);
}

static bool have_one_sense(int a, int b, int c) {
    return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

/* Whether the line p q, which crosses the plane of t, passes through t. */
static bool passes_through(v3 p, v3 q, const v3 t[3]) {
    int s[3];
    for (int i = 0; i < 3; ++i) s[i] = fct_orient_space(p, q, t[i], t[(i + 1) % 3]);
    return have_one_sense(s[0], s[1], s[2]);
}

/* An axis along which t is seen with area, or -1 if it has none. The axis of the largest component comes
 * first. */
static int find_axis(const v3 t[3]) {
    v3 n = v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0]));
    double x = fabs(n.x), y = fabs(n.y), z = fabs(n.z);
    int first = x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
    for (int i = 0; i < 3; ++i) {
        int axis = (first + i) % 3;
        if (fct_orient_plane(axis, t[0], t[1], t[2]) != 0) return axis;
    }
    return -1;
}

/* For a point in the plane of t, seen along `axis`. */
static bool lies_in_triangle(int axis, v3 p, const v3 t[3]) {
    int s[3];
    for (int i = 0; i < 3; ++i) s[i] = fct_orient_plane(axis, t[i], t[(i + 1) % 3], p);
    return have_one_sense(s[0], s[1], s[2]);
}

static bool lies_between(double x, double a, double b) {
    return a < b ? a <= x && x <= b : b <= x && x <= a;
}

/* For a point on the line a b. */
static bool lies_on_segment(v3 p, v3 a, v3 b) {
    return lies_between(p.x, a.x, b.x) && lies_between(p.y, a.y, b.y) && lies_between(p.z, a.z, b.z);
}

/* Whether the segments a b and c d cross, or c or d lies on a b. They lie in one plane that is seen along
 * `axis` with area. */
static bool segments_cross(int axis, v3 a, v3 b, v3 c, v3 d) {
    int ac = fct_orient_plane(axis, a, b, c), ad = fct_orient_plane(axis, a, b, d);
    if ((ac == 0 && lies_on_segment(c, a, b)) || (ad == 0 && lies_on_segment(d, a, b))) return true;
    return ac * ad < 0 && fct_orient_plane(axis, c, d, a) * fct_orient_plane(axis, c, d, b) < 0;
}

static bool segment_meets_triangle(int axis, v3 p, v3 q, const v3 t[3]) {
    if (lies_in_triangle(axis, p, t) || lies_in_triangle(axis, q, t)) return true;
    for (int i = 0; i < 3; ++i)
        if (segments_cross(axis, p, q, t[i], t[(i + 1) % 3])) return true;
    return false;
}

/* Whether an edge of t meets the triangle `other`. side: the signs of t's corners over other's plane, not all
 * 0. axis: along which `other` is seen with area. */
static bool edges_meet(const v3 t[3], const int side[3], const v3 other[3], int axis) {
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3;
        if (side[i] * side[j] > 0) continue;
        if (side[i] == 0 && side[j] == 0 ? segment_meets_triangle(axis, t[i], t[j], other)
                                         : passes_through(t[i], t[j], other))
            return true;
    }
    return false;
}

static bool meet_in_plane(int axis, const v3 a[3], const v3 b[3]) {
    if (lies_in_triangle(axis, a[0], b)) return true;
    for (int i = 0; i < 3; ++i)
        if (segment_meets_triangle(axis, b[i], b[(i + 1) % 3], a)) return true;
    return false;
}

static bool is_zero(const int side[3]) {
    return side[0] == 0 && side[1] == 0 && side[2] == 0;
}

bool fct_triangles_meet(const v3 a[3], const v3 b[3]) {
    int side_a[3], side_b[3];
    if (find_sides(a, b, side_b) || find_sides(b, a, side_a)) return false;
    int axis_a = find_axis(a), axis_b = find_axis(b);
    if (axis_a < 0 || axis_b < 0) return false;
    if (is_zero(side_a)) return meet_in_plane(axis_a, a, b);
    return edges_meet(b, side_b, a, axis_a) || edges_meet(a, side_a, b, axis_b);
}

/* Points that both triangles share. Two triangles share at most nine corners and crossings of edges. */
typedef struct shared_points {
    v3 p[36];
    int count;
} shared_points;

static void add_point(shared_points *s, v3 p) {
    s->p[s->count++] = p;
}

/* Distance of p from the plane of t, times the length of its normal. */
static double find_height(const v3 t[3], v3 p) {
    return v3_dot(v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0])), v3_sub(p, t[0]));
}

/* The point where the segment p q, with ends at the heights hp and hq on different sides, crosses the plane.
 */
static v3 cross_plane(v3 p, v3 q, double hp, double hq) {
    double sum = fabs(hp) + fabs(hq); /* 0 if both heights vanish as doubles */
    return v3_mad(p, sum > 0 ? fabs(hp) / sum : .5, v3_sub(q, p));
}

/* The points of a segment in the plane of t where it enters and leaves t. */
static void add_clipped_segment(shared_points *s, int axis, v3 p, v3 q, const v3 t[3]) {
    if (lies_in_triangle(axis, p, t)) add_point(s, p);
    if (lies_in_triangle(axis, q, t)) add_point(s, q);
    v3 n = v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0]));
    for (int i = 0; i < 3; ++i) {
        v3 from = t[i], to = t[(i + 1) % 3], out = v3_cross(v3_sub(to, from), n);
        if (!segments_cross(axis, p, q, from, to)) continue;
        double hp = v3_dot(out, v3_sub(p, from)), hq = v3_dot(out, v3_sub(q, from));
        /* Of segments on one line, the ends are among the points. */
        if (hp != 0 || hq != 0) add_point(s, cross_plane(p, q, hp, hq));
    }
}

static void add_edges(shared_points *s, const v3 t[3], const int side[3], const v3 other[3], int axis) {
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3;
        if (side[i] * side[j] > 0) continue;
        if (side[i] == 0 && side[j] == 0) {
            add_clipped_segment(s, axis, t[i], t[j], other);
        } else if (passes_through(t[i], t[j], other)) {
            double hi = side[i] ? find_height(other, t[i]) : 0, hj = side[j] ? find_height(other, t[j]) : 0;
            add_point(s, side[i] == 0 ? t[i] : side[j] == 0 ? t[j] : cross_plane(t[i], t[j], hi, hj));
        }
    }
}

/* The two points that are farthest apart. */
static void find_ends(const shared_points *s, fct_contact *out) {
    int from = 0, to = 0;
    double most = -1;
    for (int i = 0; i < s->count; ++i)
        for (int j = i; j < s->count; ++j) {
            double length2 = v3_norm2(v3_sub(s->p[i], s->p[j]));
            if (length2 > most) most = length2, from = i, to = j;
        }
    const v3 *p = &s->p[from], *q = &s->p[to];
    out->from[0] = p->x, out->from[1] = p->y, out->from[2] = p->z;
    out->to[0] = q->x, out->to[1] = q->y, out->to[2] = q->z;
}

/* Replaces the contact's way if b leaves a by a shorter one along the axis, which need not have unit length.
 */
static void try_axis(const v3 a[3], const v3 b[3], v3 axis, double least_length, fct_contact *out) {
    double length = v3_norm(axis), low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    if (!(length > least_length)) return;
    axis = v3_scale(axis, 1 / length);
    for (int i = 0; i < 3; ++i) {
        double at[2] = {v3_dot(axis, v3_sub(a[i], a[0])), v3_dot(axis, v3_sub(b[i], a[0]))};
        for (int k = 0; k < 2; ++k) low[k] = fct_min(low[k], at[k]), high[k] = fct_max(high[k], at[k]);
    }
    double up = fct_max(high[0] - low[1], 0), down = fct_max(high[1] - low[0], 0);
    if (up >= out->depth && down >= out->depth) return;
    if (down < up) axis = v3_scale(axis, -1);
    out->depth = fct_min(up, down);
    out->normal[0] = axis.x, out->normal[1] = axis.y, out->normal[2] = axis.z;
}

/* The faces of the difference of two triangles, as sets of points, are parallel to one of the triangles or to
 * an edge of each. So the shortest way out is along one of these 11 normals. */
static void find_way_out(const v3 a[3], const v3 b[3], fct_contact *out) {
    v3 ea[3], eb[3];
    for (int i = 0; i < 3; ++i) ea[i] = v3_sub(a[(i + 1) % 3], a[i]), eb[i] = v3_sub(b[(i + 1) % 3], b[i]);
    *out = (fct_contact){.from = {out->from[0], out->from[1], out->from[2]},
                         .to = {out->to[0], out->to[1], out->to[2]},
                         .normal = {1, 0, 0},
                         .depth = INFINITY};
    try_axis(a, b, v3_cross(ea[0], ea[1]), 0, out);
    try_axis(a, b, v3_cross(eb[0], eb[1]), 0, out);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            try_axis(a, b, v3_cross(ea[i], eb[j]), 1e-9 * v3_norm(ea[i]) * v3_norm(eb[j]), out);
    if (!(out->depth < INFINITY)) out->depth = 0; /* needles without a normal */
}

bool fct_triangles_contact(const v3 a[3], const v3 b[3], fct_contact *out) {
    if (!fct_triangles_meet(a, b)) return false;
    int side_a[3], side_b[3], axis_a = find_axis(a), axis_b = find_axis(b);
    find_sides(a, b, side_b), find_sides(b, a, side_a);
    shared_points s;
    s.count = 0;
    add_edges(&s, b, side_b, a, axis_a);
    add_edges(&s, a, side_a, b, axis_b);
    /* The points of two needles may be lost to rounding. */
    if (s.count == 0) add_point(&s, a[0]);
    find_ends(&s, out);
    find_way_out(a, b, out);
    return true;
}

/* The nearest points of the segments p p+u and q q+v, as parameters in [0, 1]. */
static void approach_segments(v3 p, v3 u, v3 q, v3 v, double *s, double *t) {
    v3 r = v3_sub(p, q);
    double uu = v3_norm2(u), vv = v3_norm2(v), uv = v3_dot(u, v), ur = v3_dot(u, r), vr = v3_dot(v, r);
    /* The difference of products of dots would cancel at small angles; the cross products do not. Of parallel
     * segments, the first end counts; the clamps below find the nearest point of q's. */
    v3 n = v3_cross(u, v);
    double n2 = v3_norm2(n);
    *s = n2 > 0 ? fct_min(fct_max(-v3_dot(v3_cross(r, v), n) / n2, 0), 1) : 0;
    *t = vv > 0 ? (uv * *s + vr) / vv : 0;
    if (*t < 0 || *t > 1 || vv == 0) {
        *t = fct_min(fct_max(*t, 0), 1);
        *s = uu > 0 ? fct_min(fct_max((uv * *t - ur) / uu, 0), 1) : 0;
    }
}

/* Whether an edge of t, which has no area, crosses the inside of the triangle; *at receives the point. */
static bool needle_pierces(const v3 t[3], const v3 other[3], v3 *at) {
    int side[3];
    if (find_sides(other, t, side)) return false;
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3;
        if (side[i] * side[j] >= 0 || !passes_through(t[i], t[j], other)) continue;
        *at = cross_plane(t[i], t[j], find_height(other, t[i]), find_height(other, t[j]));
        return true;
    }
    return false;
}

static bool find_common_point(const v3 a[3], const v3 b[3], v3 *at) {
    int side[3];
    fct_contact contact;
    if (find_sides(a, b, side) || find_sides(b, a, side)) return false;
    bool flat_a = find_axis(a) < 0, flat_b = find_axis(b) < 0;
    if (flat_a || flat_b) return (flat_a && needle_pierces(a, b, at)) || (flat_b && needle_pierces(b, a, at));
    if (!fct_triangles_contact(a, b, &contact)) return false;
    *at = v3_make(contact.from[0], contact.from[1], contact.from[2]);
    return true;
}

double fct_triangles_distance(const v3 a[3], const v3 b[3], v3 *pa, v3 *pb) {
    if (find_common_point(a, b, pa)) {
        *pb = *pa;
        return 0;
    }
    double best = INFINITY;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            v3 u = v3_sub(a[(i + 1) % 3], a[i]), v = v3_sub(b[(j + 1) % 3], b[j]);
            double s, t;
            approach_segments(a[i], u, b[j], v, &s, &t);
            v3 p = v3_mad(a[i], s, u), q = v3_mad(b[j], t, v);
            double d2 = v3_norm2(v3_sub(p, q));
            if (d2 < best) best = d2, *pa = p, *pb = q;
        }
    for (int i = 0; i < 3; ++i) {
        double u, v;
        v3 p = fct_triangle_closest(b[i], a[0], a[1], a[2], &u, &v);
        v3 q = fct_triangle_closest(a[i], b[0], b[1], b[2], &u, &v);
        double dp = v3_norm2(v3_sub(p, b[i])), dq = v3_norm2(v3_sub(q, a[i]));
        if (dp < best) best = dp, *pa = p, *pb = b[i];
        if (dq < best) best = dq, *pa = a[i], *pb = q;
    }
    return best;
}
