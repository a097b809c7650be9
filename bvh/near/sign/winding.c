/* bvh/near/sign/winding.c: the generalised winding number (Jacobson, Kavan, Sorkine-Hornung 2013): the sum of
 * the solid angles of the faces, over 4 pi. A kernel file.
 *
 * Far clusters count by their moments (moments.h), eight at a time. Faces near the point count by their solid
 * angles (van Oosterom and Strackee 1983), eight at a time in float:
 *
 *     tan(angle / 2) = a.(b x c) / (|a| |b| |c| + (a.b) |c| + (b.c) |a| + (c.a) |b|)
 *
 * for corners a, b, c relative to the point. Where both terms of the fraction are small against |a| |b| |c|,
 * the point lies close to a side of the face; where the first is below its rounding and the second negative,
 * close to the inside. Such a face is measured again in double. So a half angle errs by at most 3e-5, on
 * nearly all faces by less than 1e-6.
 */
#include "bvh/near/sign/winding.h"

#include "base/math/elementary.h"
#include "base/math/simd.h"
#include "bvh/near/measure.h"
#include "bvh/near/sign/moments.h"

#define HALF_PI 1.57079632679489662
/* A fraction whose terms are smaller than this, over |a| |b| |c|, is computed in double. */
#define SMALL_TERMS 0x1p-5f
/* Rounding of the first term in float, over the product of its three lengths. */
#define TERM_ROUNDING 0x1p-19f

typedef struct winding {
    const fct_bvh *bvh;
    v3 point; /* scaled */
    fct_at at;
    float reach2;
    f8 far;      /* sum of the solid angles of clusters, per lane */
    double near; /* sum of the half angles of faces */
    fct_visits visits;
} winding;

/* The arc tangent of t in [0, 1], within 1.2e-7: t times a polynomial in t^2, fitted at Chebyshev points. */
static inline f8 atan_of(f8 t) {
    static const float factors[8] = {.0028340643f, -.01600503f, .04258761f, -.07495446f,
                                     .106367543f,  -.14202571f, .19992484f, -.33333066f};
    f8 z = f8_mul(t, t), sum = f8_set(factors[0]);
    for (int i = 1; i < 8; ++i) sum = f8_add(f8_mul(sum, z), f8_set(factors[i]));
    return f8_add(t, f8_mul(t, f8_mul(z, sum)));
}

/* The angles of the points (x, y). */
static inline f8 atan2_of(f8 y, f8 x) {
    f8 ax = f8_abs(x), ay = f8_abs(y), zero = f8_set(0);
    f8 less = f8_min(ax, ay), more = f8_max(f8_max(ax, ay), f8_set(1e-37f));
    f8 angle = atan_of(f8_div(less, more));
    angle = f8_if_lt(ax, ay, f8_sub(f8_set((float)HALF_PI), angle), angle);
    angle = f8_if_lt(x, zero, f8_sub(f8_set((float)(2 * HALF_PI)), angle), angle);
    return f8_copysign(angle, y);
}

/* Half the solid angle of a face, in double. */
static double measure_half_angle(v3 point, const fct_leaf *leaf, uint32_t number) {
    v3 p[3];
    fct_leaf_triangle(leaf, number, p);
    v3 a = v3_sub(p[0], point), b = v3_sub(p[1], point), c = v3_sub(p[2], point);
    double la = v3_norm(a), lb = v3_norm(b), lc = v3_norm(c);
    return fct_atan2(v3_dot(a, v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]))),
                     la * lb * lc + v3_dot(a, b) * lc + v3_dot(b, c) * la + v3_dot(c, a) * lb);
}

static inline f8x3 f8x3_cross(f8x3 a, f8x3 b) {
    return (f8x3){f8_sub(f8_mul(a.y, b.z), f8_mul(a.z, b.y)), f8_sub(f8_mul(a.z, b.x), f8_mul(a.x, b.z)),
                  f8_sub(f8_mul(a.x, b.y), f8_mul(a.y, b.x))};
}

static void add_leaf(winding *w, const fct_leaf *leaf) {
    fct_near_vertices vertices;
    fct_near_vertices_load(leaf, &w->at, &vertices);
    uint32_t octets = leaf->vertex_octets;
    const uint8_t *corners = fct_leaf_corners(leaf);
    w->visits.triangles += leaf->count;
    for (uint32_t first = 0; first < leaf->count; first += 8, corners += 24) {
        f8x3 a = f8x3_lookup(&vertices, octets, i8_load_bytes(corners)),
             b = f8x3_lookup(&vertices, octets, i8_load_bytes(corners + 8)),
             c = f8x3_lookup(&vertices, octets, i8_load_bytes(corners + 16));
        f8 la = f8_sqrt(f8x3_dot(a, a)), lb = f8_sqrt(f8x3_dot(b, b)), lc = f8_sqrt(f8x3_dot(c, c));
        f8 all = f8_mul(f8_mul(la, lb), lc);
        f8x3 ab = f8x3_sub(b, a), ac = f8x3_sub(c, a);
        f8 y = f8x3_dot(a, f8x3_cross(ab, ac));
        f8 x = f8_add(f8_add(all, f8_mul(f8x3_dot(a, b), lc)),
                      f8_add(f8_mul(f8x3_dot(b, c), la), f8_mul(f8x3_dot(c, a), lb)));
        float half[8];
        f8_store(half, atan2_of(y, x));
        uint32_t count = leaf->count - first < 8 ? leaf->count - first : 8;
        uint32_t small = f8_le(f8_max(f8_abs(x), f8_abs(y)), f8_mul(f8_set(SMALL_TERMS), all));
        f8 lengths = f8_mul(la, f8_sqrt(f8_mul(f8x3_dot(ab, ab), f8x3_dot(ac, ac))));
        small |= f8_lt(x, f8_set(0)) & f8_le(f8_abs(y), f8_mul(f8_set(TERM_ROUNDING), f8_max(all, lengths)));
        for (uint32_t i = 0; i < count; ++i)
            w->near += small >> i & 1 ? measure_half_angle(w->point, leaf, first + i) : (double)half[i];
    }
}

/* Adds the children that are far enough, and returns the others. */
static uint32_t add_children(winding *w, const fct_moment_node *node) {
    f8 zero = f8_set(0);
    f8 dx = f8_sub(f8_load(node->center[0]), f8_set(w->at.at[0])),
       dy = f8_sub(f8_load(node->center[1]), f8_set(w->at.at[1])),
       dz = f8_sub(f8_load(node->center[2]), f8_set(w->at.at[2]));
    f8 d2 = f8_add(f8_add(f8_mul(dx, dx), f8_mul(dy, dy)), f8_mul(dz, dz));
    f8 limit2 = f8_mul(f8_load(node->radius2), f8_set(w->reach2));
    f8 inverse = f8_div(f8_set(1), f8_sqrt(f8_max(d2, f8_set(1e-37f))));
    f8 x = f8_mul(dx, inverse), y = f8_mul(dy, inverse), z = f8_mul(dz, inverse);
    f8 xx = f8_mul(x, x), yy = f8_mul(y, y), zz = f8_mul(z, z), three = f8_set(3);
    f8 n = f8_add(f8_add(f8_mul(f8_load(node->dipole[0]), x), f8_mul(f8_load(node->dipole[1]), y)),
                  f8_mul(f8_load(node->dipole[2]), z));
    f8 mixed = f8_add(f8_add(f8_mul(f8_load(node->quadrupole[2]), f8_mul(x, y)),
                             f8_mul(f8_load(node->quadrupole[3]), f8_mul(x, z))),
                      f8_mul(f8_load(node->quadrupole[4]), f8_mul(y, z)));
    f8 q = f8_add(f8_add(f8_mul(f8_load(node->quadrupole[0]), f8_sub(xx, zz)),
                         f8_mul(f8_load(node->quadrupole[1]), f8_sub(yy, zz))),
                  f8_add(mixed, mixed));
    f8 zz3 = f8_mul(three, zz), xx3 = f8_mul(three, xx), yy3 = f8_mul(three, yy);
    f8 in_x = f8_add(f8_mul(f8_load(node->octupole[0]), f8_sub(xx, zz3)),
                     f8_mul(f8_load(node->octupole[3]), f8_sub(yy3, zz3)));
    f8 in_y = f8_add(f8_mul(f8_load(node->octupole[1]), f8_sub(yy, zz3)),
                     f8_mul(f8_load(node->octupole[2]), f8_sub(xx3, zz3)));
    f8 in_z = f8_add(f8_mul(f8_load(node->octupole[4]), f8_sub(xx3, zz)),
                     f8_mul(f8_load(node->octupole[5]), f8_sub(yy3, zz)));
    f8 in_xyz = f8_mul(f8_mul(f8_set(6), f8_load(node->octupole[6])), f8_mul(f8_mul(x, y), z));
    f8 s = f8_add(f8_add(f8_mul(in_x, x), f8_mul(in_y, y)), f8_add(f8_mul(in_z, z), in_xyz));
    f8 higher = f8_sub(f8_mul(f8_set(7.5f), f8_mul(inverse, s)), f8_mul(three, q));
    f8 angle = f8_mul(f8_mul(inverse, inverse), f8_add(n, f8_mul(inverse, higher)));
    w->far = f8_add(w->far, f8_if_lt(limit2, d2, angle, zero));
    return ~f8_lt(limit2, d2) & node->present;
}

double fct_winding_sum(const fct_bvh *bvh, v3 point, float reach, fct_visits *visits) {
    winding w = {
        .bvh = bvh, .point = fct_bvh_to_scaled(bvh, point), .reach2 = reach * reach, .far = f8_set(0)};
    w.at = fct_at_make(bvh, w.point);
    uint32_t stack[FCT_STACK_SIZE], height = 1;
    stack[0] = bvh->root & FCT_REF_LEAF ? bvh->root : 0;
    while (height) {
        uint32_t ref = stack[--height];
        if (ref & FCT_REF_LEAF) {
            add_leaf(&w, fct_bvh_leaf(bvh, ref));
            continue;
        }
        const fct_moment_node *node = &bvh->moments[ref];
        ++w.visits.nodes;
        w.visits.boxes += 8;
        for (uint32_t near = add_children(&w, node); near; near &= near - 1)
            stack[height++] = node->child[__builtin_ctz(near)];
    }
    fct_visits_add(visits, &w.visits);
    float lanes[8];
    double far = 0;
    f8_store(lanes, w.far);
    for (int i = 0; i < 8; ++i) far += (double)lanes[i];
    return far / (8 * HALF_PI) + w.near / (4 * HALF_PI);
}
