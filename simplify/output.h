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

#endif
