/* simplify/topology/pinch.h: splits vertices at which closed fans of faces only touch.
 *
 *      \    /
 *     --\  /--     The faces above v and those below are closed fans. As one point the fans could not move
 *        v         apart, and the edges around a loop of the surface through v could never be contracted. So
 *     --/  \--     each fan gets a vertex of its own, as bodies that only touch have.
 *      /    \
 */
#ifndef FCT_SIMPLIFY_PINCH_H
#define FCT_SIMPLIFY_PINCH_H

#include "simplify/topology/curve.h"

/* At each vertex whose faces form several closed fans of one orientation, all fans but the first one get a
 * new vertex at the end of sorted->mesh, listed in `copies`. New vertices do not lie on the curve, so their
 * edges are between the blocks of a sweep. A vertex with an open fan, a duplicate face or faces of both
 * orientations stays one. Errors: MEMORY, without a change. */
fct_result fct_simplify_split_pinches(const fct_env *env, fct_sorted *sorted);
/* The copies of a vertex of sorted->mesh: [*first, the result) of `copies`. */
uint32_t fct_simplify_find_copies(const fct_sorted *sorted, uint32_t vertex, uint32_t *first);

#endif
