/* simplify/cost/quadric.h: quadrics over a position and m attributes (Garland 1999, (3.10), (5.8)-(5.10)).
 *
 * Q(p, a) = p^T A p + 2 b^T p + c + 2 a^T (C p + d) + a^T D a, packed as
 *   [0, 6) A as xx xy xz yy yz zz, [6, 9) b, 9 c, 10 the area that was added up,
 *   then for each attribute its row of C and its d (4), then D's upper triangle by rows.
 * Eliminating the attributes leaves the first 11 numbers, the quadric of the position whose attributes are
 * the best for it (a Schur complement); the sum of these over the wedges of a point is the point's.
 */
#ifndef FCT_SIMPLIFY_QUADRIC_H
#define FCT_SIMPLIFY_QUADRIC_H

#include "simplify/state.h"

enum { POSITION_QUADRIC = 11, MAX_QUADRIC = 11 + 4 * 8 + 36 };

static inline uint32_t quadric_size(uint32_t m) {
    return POSITION_QUADRIC + 4 * m + m * (m + 1) / 2;
}

static inline double quadric_trace(const double *q) {
    return q[0] + q[3] + q[5];
}
/* A p + b: half the gradient. */
static inline v3 quadric_gradient(const double *q, v3 p) {
    return (v3){q[0] * p.x + q[1] * p.y + q[2] * p.z + q[6], q[1] * p.x + q[3] * p.y + q[4] * p.z + q[7],
                q[2] * p.x + q[4] * p.y + q[5] * p.z + q[8]};
}
static inline double quadric_at(const double *q, v3 p) {
    v3 g = quadric_gradient(q, p);
    return v3_dot(p, g) + q[6] * p.x + q[7] * p.y + q[8] * p.z + q[9];
}

/* q += weight times the squared distance from the plane through p with unit normal n. */
static inline void quadric_add_plane(double *q, v3 n, v3 p, double weight) {
    double d = -v3_dot(n, p);
    sym3_add_outer(q, weight, n);
    q[6] += weight * d * n.x, q[7] += weight * d * n.y, q[8] += weight * d * n.z;
    q[9] += weight * d * d;
}

/* The attributes eliminated from a quadric: what is left for the position, and how to find them again. */
typedef struct fct_elimination {
    double position[POSITION_QUADRIC];
    double rows[SIMPLIFY_MAX_CHANNELS][4];
    double upper[SIMPLIFY_MAX_CHANNELS][SIMPLIFY_MAX_CHANNELS];
} fct_elimination;

/* `ridge` times the squared distance of the attributes from `prior` (m of them) makes them unique. */
void fct_quadric_eliminate(const double *q, uint32_t m, const double *prior, double ridge,
                           fct_elimination *out);
/* The best attributes for a position. */
void fct_quadric_attributes(const fct_elimination *e, uint32_t m, v3 p, double *attributes);
/* Q(p, a). */
double fct_quadric_value(const double *q, uint32_t m, v3 p, const double *a);

#endif
