/* simplify/topology/weld.h: which vertices at one place are one point. */
#ifndef FCT_SIMPLIFY_WELD_H
#define FCT_SIMPLIFY_WELD_H

#include "simplify/state.h"

/* On entry point_of numbers the places of the vertices; on return it numbers the points. Updates point_count.
 * Errors: MEMORY. */
fct_result fct_simplify_weld(fct_simplifier *s);

#endif
