/* simplify/cost/quadric.h: the algebra of quadrics over a position p and m attributes a.
 *
 * Q(p, a) = p^T A p + 2 b^T p + c + 2 a^T (C p + d) + a^T D a
 *
 * The doubles of one quadric, in order:
 *   [0, 6)       A as xx xy xz yy yz zz
 *   [6, 9)       b
 *   [9]          c
 *   [10]         area of the faces that were added
 *   [11, 11+4m)  per attribute: its row of C (3) and its d (1)
 *   then         the upper triangle of D by rows, m (m + 1) / 2
 * With m = 0 this is Garland's Q = (A, b, c) of (3.8) and (3.9).
 * Source: Garland 1999, sections 3.4 and 5.2.
 */
#ifndef FCT_SIMPLIFY_QUADRIC_H
#define FCT_SIMPLIFY_QUADRIC_H

#include <stdbool.h>
#include <stdint.h>

#include "base/math/vec.h"

enum {
    QUADRIC_MAX_ATTRIBUTES = 8, /* red, green, blue, u, v and the three components of the normal */
    POSITION_QUADRIC = 11,
    MAX_QUADRIC = POSITION_QUADRIC + 4 * QUADRIC_MAX_ATTRIBUTES +
                  QUADRIC_MAX_ATTRIBUTES * (QUADRIC_MAX_ATTRIBUTES + 1) / 2
};

/* Number of doubles of a quadric with m attributes. */
static inline uint32_t quadric_size(uint32_t m) {
    return POSITION_QUADRIC + 4 * m + m * (m + 1) / 2;
}

static inline double quadric_trace(const double *q) {
    return q[0] + q[3] + q[5];
}
/* A p + b, which is half the gradient of the position's part. */
static inline v3 quadric_gradient(const double *q, v3 p) {
    return (v3){q[0] * p.x + q[1] * p.y + q[2] * p.z + q[6], q[1] * p.x + q[3] * p.y + q[4] * p.z + q[7],
                q[2] * p.x + q[4] * p.y + q[5] * p.z + q[8]};
}
/* Q(p) of (3.9): the position's part alone. */
static inline double quadric_at(const double *q, v3 p) {
    v3 g = quadric_gradient(q, p);
    return v3_dot(p, g) + q[6] * p.x + q[7] * p.y + q[8] * p.z + q[9];
}

/* delta = -(A + ridge I)^-1 g for a quadric r, by an L D L^T decomposition; false if a pivot is not positive.
 */
static inline bool quadric_solve(const double *r, double ridge, v3 g, v3 *delta) {
    double d0 = r[0] + ridge, i0 = 1 / d0;
    double l1 = r[1] * i0, l2 = r[2] * i0;
    double d1 = r[3] + ridge - l1 * r[1], i1 = 1 / d1, k = r[4] - l1 * r[2];
    double l3 = k * i1, d2 = r[5] + ridge - l2 * r[2] - l3 * k;
    if (!(d0 > 0 && d1 > 0 && d2 > 0)) return false;
    double y = g.y - l1 * g.x, z = (g.z - l2 * g.x - l3 * y) / d2;
    y = y * i1 - l3 * z;
    *delta = (v3){-(g.x * i0 - l1 * y - l2 * z), -y, -z};
    return true;
}

/* q += weight times the quadric (3.10) of the plane through p with the unit normal n. */
static inline void quadric_add_plane(double *q, v3 n, v3 p, double weight) {
    double d = -v3_dot(n, p);
    sym3_add_outer(q, weight, n);
    q[6] += weight * d * n.x, q[7] += weight * d * n.y, q[8] += weight * d * n.z;
    q[9] += weight * d * d;
}

/* q = the squared distance from the 2-plane through the three points x of R^(3 + m), (5.8)-(5.10), with area
 * 1. The first two points must differ. */
void fct_quadric_of_plane(double *q, uint32_t m, double x[3][3 + QUADRIC_MAX_ATTRIBUTES]);

/* Q(p, a) for m attributes. */
double fct_quadric_value(const double *q, uint32_t m, v3 p, const double *a);

/* The result of fct_quadric_eliminate. */
typedef struct fct_elimination {
    double position[POSITION_QUADRIC]; /* min over a of Q(p, a) + ridge |a - prior|^2, as a quadric of p */
    double rows[QUADRIC_MAX_ATTRIBUTES][4];
    double upper[QUADRIC_MAX_ATTRIBUTES][QUADRIC_MAX_ATTRIBUTES];
} fct_elimination;

/* Eliminates the m attributes (a Schur complement). One 3 x 3 system then serves any number of attributes and
 * wedges. `ridge` times the squared distance from `prior` makes the best attributes unique. */
void fct_quadric_eliminate(const double *q, uint32_t m, const double *prior, double ridge,
                           fct_elimination *out);
/* The attributes that minimise Q(p, a) + ridge |a - prior|^2 at the position p. */
void fct_quadric_attributes(const fct_elimination *e, uint32_t m, v3 p, double *attributes);

#endif
