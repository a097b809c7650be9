/* simplify/cost/fundamental.h: the initial quadric of every wedge, the sum of the fundamental quadrics of its
 * faces (Garland 1999, sections 3.4.1 and 5.2). */
#ifndef FCT_SIMPLIFY_FUNDAMENTAL_H
#define FCT_SIMPLIFY_FUNDAMENTAL_H

#include "simplify/state.h"

/* Allocates and fills `quadrics` and sets quadric_size. Needs topology, channels and attributes. Errors:
 * MEMORY. */
fct_result fct_simplify_quadrics(fct_simplifier *s);

#endif
