/* simplify/topology/link.h: whether a contraction keeps the topology. */
#ifndef FCT_SIMPLIFY_LINK_H
#define FCT_SIMPLIFY_LINK_H

#include "simplify/state.h"

/* Whether contracting b into a satisfies the link condition. ring_a and ring_b hold the corners of both ends;
 * count_a is 0 if a is a hub, and the answer is then false. Needs link_marks. */
bool fct_simplify_link_holds(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b);

#endif
