/* simplify/cost/face.h: what the contraction of a face costs. */
#ifndef FCT_SIMPLIFY_FACE_H
#define FCT_SIMPLIFY_FACE_H

#include "simplify/cost/placement.h"

typedef struct fct_face_price {
    double key;        /* orders the queue */
    uint32_t order[3]; /* the sides, from the cheapest on; side k goes from corner k to the next one */
} fct_face_price;

/* The cost of contracting three points to one, at the best position that the policy def->placement allows.
 * With Q_ab the quadric of the edge a-b, its attributes eliminated, with what holds its ends, it is the
 * larger of min over p of (Q_ab + Q_bc + Q_ca)(p) / 2 and the largest cost of the three edges. Without
 * attributes and constraints the sum is Qa + Qb + Qc, and its minimum the exact cost; else it is an estimate.
 * The energy of the regularisation is that of an edge: gamma trace(Q) / 2 times the sum of the squared
 * distances from the corners. False if an edge has no place.
 */
bool fct_price_face(fct_simplifier *s, const uint32_t points[3], fct_face_price *out);

#endif
