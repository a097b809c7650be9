/* simplify/cost/face.h: what the contraction of a face costs. */
#ifndef FCT_SIMPLIFY_FACE_H
#define FCT_SIMPLIFY_FACE_H

#include "simplify/cost/placement.h"

typedef struct fct_face_price {
    double key;        /* orders the queue */
    uint32_t order[3]; /* the sides, from the cheapest on; side k goes from corner k to the next one */
} fct_face_price;

/* The cost of contracting three points to one, at the best position that the policy def->placement allows.
 * Let Q_ab be the quadric of the edge a-b, with its attributes eliminated and with the planes that hold its
 * ends. The cost is the minimum of (Q_ab + Q_bc + Q_ca) / 2, or that of the most expensive edge if it is
 * more. Without attributes and constraints the sum is Qa + Qb + Qc, and its minimum is exact; else it is an
 * estimate.
 * The energy of the regularisation is that of an edge: gamma trace(Q) / 2 times the sum of the squared
 * distances from the corners. False if an edge has no place.
 */
bool fct_price_face(fct_simplifier *s, const uint32_t points[3], fct_face_price *out);

#endif
