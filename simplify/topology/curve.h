/* simplify/topology/curve.h: the input in the order of a space-filling curve, so that what is near in space
 * is near in memory. */
#ifndef FCT_SIMPLIFY_CURVE_H
#define FCT_SIMPLIFY_CURVE_H

#include "base/env.h"
#include "facetree/mesh.h"

/* The valid mesh with its vertices and faces sorted along the curve. `places` (face_count) receives the place
 * in *out of each face of the input; the caller releases it. *out borrows the material names: release it with
 * fct_simplify_release_sorted. Errors: MEMORY, with nothing to release. */
fct_result fct_simplify_sort(const fct_env *env, const fct_mesh *mesh, fct_mesh *out, uint32_t **places);
void fct_simplify_release_sorted(const fct_env *env, fct_mesh *sorted);

#endif
