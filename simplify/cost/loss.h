/* simplify/cost/loss.h: the part of a contraction's error that face planes cannot measure.
 *
 * A rod, a fin or a needle can become shorter at no cost in its planes, because its end slides along all of
 * them. So the loss measures the distance from the points that vanish to the faces that remain.
 */
#ifndef FCT_SIMPLIFY_LOSS_H
#define FCT_SIMPLIFY_LOSS_H

#include "simplify/cost/placement.h"

/* Shorter distances, in the unit cube, are rounding errors of the input's floats. */
#define LOSS_NOISE 1e-7

enum { LOSS_POINTS = 6 };

/* The lost points, their nearest points on the remaining faces, and the weights. */
typedef struct fct_loss {
    uint32_t count;
    v3 lost[LOSS_POINTS], nearest[LOSS_POINTS];
    double distance2[LOSS_POINTS], weights[LOSS_POINTS];
} fct_loss;

/* The cost of contracting a and b in addition to candidate->error. Neither end is a hub; ring_a and ring_b
 * hold their corners, `remaining` the faces after the move. */
double fct_loss_measure(const fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b,
                        const fct_candidate *candidate, fct_loss *loss);
/* The same if the whole body of four faces vanishes. */
double fct_loss_measure_body(const fct_simplifier *s, uint32_t b, uint32_t count_b,
                             const fct_candidate *candidate, fct_loss *loss);
/* Adds a plane through each lost point to the quadric q of the new point, so that later contractions count
 * the same loss again. */
void fct_loss_add(const fct_loss *loss, double *q);

#endif
