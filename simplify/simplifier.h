/* simplify/simplifier.h: creates and destroys the data of one run. */
#ifndef FCT_SIMPLIFY_SIMPLIFIER_H
#define FCT_SIMPLIFY_SIMPLIFIER_H

#include "simplify/state.h"

/* Topology, attributes and quadrics of a valid mesh, ready to contract. env, mesh and def must outlive *out.
 * Errors: MEMORY, with *out = NULL. */
fct_result fct_simplifier_create(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                                 fct_simplifier **out);
/* NULL is allowed. */
void fct_simplifier_destroy(fct_simplifier *s);

#endif
