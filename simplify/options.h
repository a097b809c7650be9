/* simplify/options.h: checks of the options and of the input. */
#ifndef FCT_SIMPLIFY_OPTIONS_H
#define FCT_SIMPLIFY_OPTIONS_H

#include "facetree/simplify.h"

/* Whether the options are those of this library. Errors: DATA. */
fct_result fct_simplify_check_size(const fct_env *env, const fct_simplify_def *def);
/* Whether fct_simplify accepts the mesh and the options. Errors: DATA, MEMORY. */
fct_result fct_simplify_check(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def);

#endif
