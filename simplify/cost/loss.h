/* simplify/cost/loss.h: see loss.c. */
#ifndef FCT_SIMPLIFY_LOSS_H
#define FCT_SIMPLIFY_LOSS_H

#include "simplify/cost/placement.h"

/* Shorter distances, in the unit cube, are rounding of the input's floats. */
#define LOSS_NOISE 1e-7

enum { LOSS_POINTS = 6 };

/* The points that go, the nearest points of the faces that stay, and what each weighs. */
typedef struct fct_loss {
    uint32_t count;
    v3 lost[LOSS_POINTS], nearest[LOSS_POINTS];
    double distance2[LOSS_POINTS], weights[LOSS_POINTS];
} fct_loss;

/* What contracting a and b, no hubs, costs beside the candidate's error; their rings are gathered. */
double fct_simplify_loss(const fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b,
                         const fct_candidate *candidate, fct_loss *loss);
/* Adds the loss to the quadric of the point that is left. */
void fct_simplify_remember(const fct_loss *loss, double *q);

#endif
