/* simplify/simplify.h: parts of fct_simplify that the handle shares. */
#ifndef FCT_SIMPLIFY_SIMPLIFY_H
#define FCT_SIMPLIFY_SIMPLIFY_H

#include "simplify/state.h"

/* Whether fct_simplify accepts the mesh and the options. Errors: DATA, MEMORY. */
fct_result fct_simplify_check(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def);
/* Writes the mesh of a handle, with its refit, which is then undone. stats: NULL, or receives the errors of
 * the result. On failure *out may be filled in part. Errors: MEMORY, CANCELLED. */
fct_result fct_simplify_write(fct_simplifier *s, fct_mesh *out, fct_simplify_stats *stats);

#endif
