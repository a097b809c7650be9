/* simplify/view/create.h: makes the vertex hierarchy of a progressive mesh.
 */
#ifndef FCT_SIMPLIFY_CREATE_H
#define FCT_SIMPLIFY_CREATE_H

#include "simplify/view/hierarchy.h"

/* The hierarchy of m, with the base mesh as its cut. Does not change the level of m. Cost: linear, plus the
 * rings of all splits. Errors: MEMORY, CANCELLED. */
fct_result fct_hierarchy_create(const fct_progressive *m, fct_hierarchy **out);
#endif
