/* simplify/pairs/candidates.h: pairs of near points of different bodies, which may be contracted like edges.
 */
#ifndef FCT_SIMPLIFY_CANDIDATES_H
#define FCT_SIMPLIFY_CANDIDATES_H

#include "simplify/state.h"

/* Other bodies that a point may be paired with: the nearest ones. */
enum { PAIR_BODIES = 8 };

/* Appends the pairs to the edges, and makes the lists of pairs per point. Each point that is not locked, has
 * faces and is no hub is paired with the nearest such point of each other body at most pair_distance away, of
 * at most PAIR_BODIES bodies. Of equally near points the one with the lower number counts. A body is a set of
 * points that edges join. Needs the constraints. Does nothing without pair_distance. Errors: MEMORY. */
fct_result fct_simplify_pairs(fct_simplifier *s);

#endif
