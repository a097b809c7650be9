/* simplify/contract.h: contracts edges in the order of their cost. */
#ifndef FCT_SIMPLIFY_CONTRACT_H
#define FCT_SIMPLIFY_CONTRACT_H

#include "simplify/state.h"

/* Contracts until target_faces or max_error is reached, or until no contraction is allowed; *stop says which.
 * Errors: CANCELLED, MEMORY. */
fct_result fct_simplify_contract(fct_simplifier *s, fct_stop *stop);

#endif
