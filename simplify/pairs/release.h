/* simplify/pairs/release.h: frees the points of an inner wall from its planes.
 *
 * The points at the rim of a wall have summed its planes, which would hold them where the bodies met (the
 * first difficulty of Garland 1999, section 6.4, with figure 6.32).
 */
#ifndef FCT_SIMPLIFY_RELEASE_H
#define FCT_SIMPLIFY_RELEASE_H

#include "simplify/state.h"

/* Subtracts weight times the squared distance from a plane with the unit normal n from the quadric q of a
 * position. It subtracts less where the rest would become negative somewhere. The plane goes through the
 * minimum of q, so that the minimum stays. `whole`: as q, or, if q is part of one with attributes, q with the
 * attributes eliminated. */
void fct_simplify_release_plane(double *q, const double *whole, v3 n, double weight);
/* Takes the planes of a face that is about to vanish out of the quadrics of its corners. */
void fct_simplify_release_face(fct_simplifier *s, uint32_t f);
/* Computes the costs of the edges at such points again, because they may be lower than in the queue. */
void fct_simplify_reprice(fct_simplifier *s);

#endif
