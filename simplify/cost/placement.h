/* simplify/cost/placement.h: the position and the attributes of a contracted edge's point, and their cost. */
#ifndef FCT_SIMPLIFY_PLACEMENT_H
#define FCT_SIMPLIFY_PLACEMENT_H

#include "simplify/cost/groups.h"

/* The largest distance of a minimiser from the edge's midpoint, in lengths of the edge. */
#define PLACE_REACH 2.0

typedef struct fct_candidate {
    v3 at;
    uint32_t end;     /* 0 or 1 if `at` is that end of the edge, else 2 */
    double error;     /* Q(at) with the best attributes, at least 0 */
    bool locked;      /* the end is locked: its attributes stay */
    double distance2; /* squared distance from the faces and held curves, times `area`, without attributes */
    double area;      /* of the faces that the quadric sums */
    double quadric[POSITION_QUADRIC]; /* of the position, with the best attributes */
    double key;                       /* error plus the energy of the regularisation; orders the queue */
} fct_candidate;

/* The error of the contraction in the unit cube, as fct_simplify_def.max_error measures it. */
static inline double fct_candidate_error(const fct_candidate *c) {
    return c->distance2 > 0 ? sqrt(c->distance2 / c->area) : 0;
}

/* The candidate for contracting the edge a-b, by the policy def->placement. ends_only: try only both ends and
 * the midpoint. A hub does not move: it is the result. False if the edge has too many wedges, if a
 * constraint does not allow this, or if a group has not exactly one wedge of a locked end. */
bool fct_place(fct_simplifier *s, uint32_t a, uint32_t b, bool ends_only, fct_candidate *out);
/* The best attributes (channel_count) of a group for the candidate, clamped to the input's range. pa, pb: the
 * ends' positions. Channels that do not steer are interpolated along the edge. */
void fct_place_attributes(const fct_simplifier *s, const fct_groups *groups, uint32_t group,
                          const fct_candidate *candidate, v3 pa, v3 pb, double *attributes);

#endif
