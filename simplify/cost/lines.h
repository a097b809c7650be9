/* simplify/cost/lines.h: the straight parts of boundaries, of borders and of strong seams. */
#ifndef FCT_SIMPLIFY_LINES_H
#define FCT_SIMPLIFY_LINES_H

#include "simplify/state.h"

/* Fills `lines`, and `hold` and `line` of the constraints. strength: per edge. Needs constraint_of. Errors:
 * MEMORY. */
fct_result fct_simplify_find_lines(fct_simplifier *s, const float *strength);

#endif
