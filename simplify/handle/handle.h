/* simplify/handle/handle.h: what the handle of facetree/simplifier.h has beyond the data of one run. */
#ifndef FCT_SIMPLIFY_HANDLE_H
#define FCT_SIMPLIFY_HANDLE_H

#include "simplify/state.h"

/* A zeroed simplifier with these options, without a mesh. Errors: MEMORY. */
fct_result fct_handle_open(const fct_env *env, const fct_simplify_def *def, fct_simplifier **out);
/* fct_simplifier_create, also with pair_distance: such a handle cannot be saved, and has no way back. */
fct_result fct_handle_create(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                             fct_simplifier **out);
/* Contracts without a way back. */
fct_result fct_handle_contract(fct_simplifier *s, uint32_t target_faces, double max_error, fct_stop *stop);

#endif
