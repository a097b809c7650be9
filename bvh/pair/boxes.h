/* bvh/pair/boxes.h: one oriented box against eight, for kernel files.
 *
 * Separating axes (Gottschalk, Lin, Manocha 1996): two boxes are apart if and only if they are apart along
 * one of 15 directions: the axes of each, and the products of two axes. With d the vector between the
 * centres, B the axes and e the half extents of the single box, A and h those of one of the eight, and C =
 * B^T A:
 *
 *     along B_r:        |B_r . d|  >  e_r + sum_s h_s |C_rs|
 *     along A_s:        |A_s . d|  >  h_s + sum_r e_r |C_rs|
 *     along B_r x A_s:  |(B_r x A_s) . d|  >  e_i |C_js| + e_j |C_is| + h_k |C_rl| + h_l |C_rk|
 *                       where r i j and s k l are 0 1 2 in a circle
 */
#ifndef FCT_BVH_BOXES_H
#define FCT_BVH_BOXES_H

#include "base/math/simd.h"
#include "bvh/pair/map.h"

/* What the tests of all directions share. */
typedef struct box_terms {
    f8 turn[3][3], size[3][3]; /* C and |C| */
    f8 along_b[3];             /* B_r . d */
    f8 d[3];
} box_terms;

static inline f8 dot3(f8 ax, f8 ay, f8 az, f8 bx, f8 by, f8 bz) {
    return f8_add(f8_add(f8_mul(ax, bx), f8_mul(ay, by)), f8_mul(az, bz));
}

static inline void find_box_terms(const fct_placed_box *b, const fct_pair_node *n, box_terms *t) {
    for (int k = 0; k < 3; ++k) t->d[k] = f8_sub(f8_load(n->center[k]), f8_set(b->center[k]));
    for (int r = 0; r < 3; ++r) {
        f8 x = f8_set(b->axes[r][0]), y = f8_set(b->axes[r][1]), z = f8_set(b->axes[r][2]);
        for (int s = 0; s < 3; ++s) {
            t->turn[r][s] =
                dot3(x, y, z, f8_load(n->axes[s][0]), f8_load(n->axes[s][1]), f8_load(n->axes[s][2]));
            t->size[r][s] = f8_abs(t->turn[r][s]);
        }
        t->along_b[r] = dot3(x, y, z, t->d[0], t->d[1], t->d[2]);
    }
}

/* How far the boxes are apart along B_r, and along A_s; negative if they overlap there. */
static inline f8 separate_along_b(const fct_placed_box *b, const fct_pair_node *n, const box_terms *t,
                                  int r) {
    f8 radius = dot3(f8_load(n->half[0]), f8_load(n->half[1]), f8_load(n->half[2]), t->size[r][0],
                     t->size[r][1], t->size[r][2]);
    return f8_sub(f8_abs(t->along_b[r]), f8_add(f8_set(b->half[r]), radius));
}
static inline f8 separate_along_a(const fct_placed_box *b, const fct_pair_node *n, const box_terms *t,
                                  int s) {
    f8 at = dot3(f8_load(n->axes[s][0]), f8_load(n->axes[s][1]), f8_load(n->axes[s][2]), t->d[0], t->d[1],
                 t->d[2]);
    f8 radius = dot3(f8_set(b->half[0]), f8_set(b->half[1]), f8_set(b->half[2]), t->size[0][s], t->size[1][s],
                     t->size[2][s]);
    return f8_sub(f8_abs(at), f8_add(f8_load(n->half[s]), radius));
}

/* A mask of the boxes of the node that may lie within a distance of box b. depth[i]: along the axis of a box
 * on which they overlap least, how far box i and b are apart, so it is negative for boxes that overlap far.
 * gap: for boxes outside of the mask, a lower bound of the distance plus the slack; a product of two axes is
 * at most 1 long. */
static inline uint32_t meet_boxes(const fct_placed_box *b, const fct_pair_node *n, float within,
                                  float depth[8], f8 *gap) {
    box_terms t;
    find_box_terms(b, n, &t);
    f8 most = f8_set(b->slack + within), apart = f8_set(-INFINITY);
    for (int k = 0; k < 3; ++k) {
        apart = f8_max(apart, separate_along_b(b, n, &t, k));
        apart = f8_max(apart, separate_along_a(b, n, &t, k));
    }
    uint32_t open = f8_le(apart, most);
    f8_store(depth, apart);
    *gap = apart;
    if (!open) return 0;
    f8 crossed = f8_set(-INFINITY);
    for (int r = 0; r < 3; ++r) {
        int i = (r + 1) % 3, j = (r + 2) % 3;
        for (int s = 0; s < 3; ++s) {
            int k = (s + 1) % 3, l = (s + 2) % 3;
            f8 at = f8_sub(f8_mul(t.along_b[j], t.turn[i][s]), f8_mul(t.along_b[i], t.turn[j][s]));
            f8 radius_b =
                f8_add(f8_mul(f8_set(b->half[i]), t.size[j][s]), f8_mul(f8_set(b->half[j]), t.size[i][s]));
            f8 radius_a =
                f8_add(f8_mul(f8_load(n->half[k]), t.size[r][l]), f8_mul(f8_load(n->half[l]), t.size[r][k]));
            crossed = f8_max(crossed, f8_sub(f8_abs(at), f8_add(radius_b, radius_a)));
        }
    }
    *gap = f8_max(apart, crossed);
    return open & f8_le(crossed, most);
}

/* A mask of the boxes of the node that may lie within sqrt(limit2) of box b. distance2[i]: a lower bound of
 * the squared distance. In the coordinates of one box, the gaps along its three axes are at right angles.
 * guess[i]: an estimate of the distance, to sort boxes with the bound 0: the distance of the centres less
 * half the radius of the box of the node. (Without the radius, and with all of it, a search visits 9 % more.)
 */
static inline uint32_t bound_boxes(const fct_placed_box *b, const fct_pair_node *n, float limit2,
                                   float distance2[8], float guess[8]) {
    box_terms t;
    find_box_terms(b, n, &t);
    f8 slack = f8_set(b->slack), zero = f8_set(0), sum_a = zero, sum_b = zero;
    for (int k = 0; k < 3; ++k) {
        f8 gap_b = f8_max(f8_sub(separate_along_b(b, n, &t, k), slack), zero);
        f8 gap_a = f8_max(f8_sub(separate_along_a(b, n, &t, k), slack), zero);
        sum_b = f8_add(sum_b, f8_mul(gap_b, gap_b));
        sum_a = f8_add(sum_a, f8_mul(gap_a, gap_a));
    }
    /* The sum of three squares rounds by less than 8 u. */
    f8 bound = f8_mul(f8_max(sum_a, sum_b), f8_set(1 - 0x1p-20f));
    f8_store(distance2, bound);
    f8 h0 = f8_load(n->half[0]), h1 = f8_load(n->half[1]), h2 = f8_load(n->half[2]);
    f8 away = f8_sqrt(dot3(t.d[0], t.d[1], t.d[2], t.d[0], t.d[1], t.d[2]));
    f8_store(guess, f8_sub(away, f8_mul(f8_set(.5f), f8_sqrt(dot3(h0, h1, h2, h0, h1, h2)))));
    return f8_le(bound, f8_set(limit2));
}

#endif
