/* simplify/output.h: the mesh that remains. */
#ifndef FCT_SIMPLIFY_OUTPUT_H
#define FCT_SIMPLIFY_OUTPUT_H

#include "simplify/state.h"

/* Gives a normal unit length, if it has a length. */
void fct_simplify_write_normal(float *n);

/* Writes the live faces in the order of the input, with the arrays that the simplifier keeps
 * (facetree/simplify.h). places: per face of the
 * input its number in s->mesh. Vertices are numbered in the order in which faces first use them. Errors:
 * MEMORY; *out is then partly filled: release it. */
fct_result fct_simplify_output(fct_simplifier *s, const uint32_t *places, fct_mesh *out);
/* Gives each point the largest value of its vertices in that mesh; 0 if it has none. values: count, above 0.
 * out: point_count. Errors: MEMORY, DATA (another count). */
fct_result fct_simplify_spread(fct_simplifier *s, const uint32_t *places, const float *values, uint32_t count,
                               float *out);

#endif
