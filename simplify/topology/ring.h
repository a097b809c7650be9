/* simplify/topology/ring.h: the corners around a point, and the edges between two points. */
#ifndef FCT_SIMPLIFY_RING_H
#define FCT_SIMPLIFY_RING_H

#include "simplify/state.h"

/* Collects the live corners of a point in `ring`, drops the dead ones from its list, and returns the count.
 * The ring needs room for the point's valence. */
uint32_t fct_simplify_gather(fct_simplifier *s, uint32_t point, uint32_t *ring);
/* The first live corner at `point` from corner c on whose face also has a corner at `other`; FCT_NONE if
 * there is none. Start with c = first_corners[point], and continue with the next corner of the result. */
uint32_t fct_simplify_find_side(const fct_simplifier *s, uint32_t c, uint32_t other);
/* The apex of a face between b (at `corner`) and a; FCT_NONE if the face does not touch a. */
uint32_t fct_simplify_find_apex(const fct_simplifier *s, uint32_t corner, uint32_t a);

#endif
