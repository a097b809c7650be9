/* simplify/simplifier.h: creates the data of one run. */
#ifndef FCT_SIMPLIFY_SIMPLIFIER_H
#define FCT_SIMPLIFY_SIMPLIFIER_H

#include "simplify/state.h"

/* Topology, attributes and quadrics of a valid mesh, ready to contract. env, mesh and def must outlive *out.
 * fct_simplifier_destroy releases it. Errors: MEMORY, with *out = NULL. */
fct_result fct_simplifier_build(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                                fct_simplifier **out);
/* The same for a zeroed simplifier with env, mesh and def; on failure it is filled in part. Errors: MEMORY.
 */
fct_result fct_simplifier_fill(fct_simplifier *s);
/* Makes room for all threads of the environment, whose number may grow between runs. Errors: MEMORY. */
fct_result fct_simplifier_scratch(fct_simplifier *s);

#endif
