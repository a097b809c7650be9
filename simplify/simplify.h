/* simplify/simplify.h: the check of an input. */
#ifndef FCT_SIMPLIFY_SIMPLIFY_H
#define FCT_SIMPLIFY_SIMPLIFY_H

#include "simplify/state.h"

/* Whether fct_simplify accepts the mesh and the options. Errors: DATA, MEMORY. */
fct_result fct_simplify_check(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def);
#endif
