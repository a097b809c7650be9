/* simplify/faces.h: contracts faces in the order of their cost: the three corners of a face become one point
 * (Garland 1999, section 3.8).
 */
#ifndef FCT_SIMPLIFY_FACES_H
#define FCT_SIMPLIFY_FACES_H

#include "simplify/state.h"

/* Contracts until target_faces is reached, or until no face may be contracted any more. Errors: CANCELLED,
 * MEMORY. */
fct_result fct_simplify_contract_faces(fct_simplifier *s);

#endif
