/* simplify/topology/pinch.h: splits vertices at which closed fans of faces only touch.
 *
 *      \    /
 *     --\  /--     Both sides of v are closed fans. As one point they could not move apart, and a surface
 *        v         that is pinched at v could not get simpler than its loops through v. So each fan gets a
 *     --/  \--     vertex of its own, as bodies that only touch have.
 *      /    \
 */
#ifndef FCT_SIMPLIFY_PINCH_H
#define FCT_SIMPLIFY_PINCH_H

#include "simplify/topology/curve.h"

/* At each vertex whose faces form several closed fans of one orientation, all fans but the first one get a
 * new vertex at the end of sorted->mesh, listed in `copies`. Errors: MEMORY, without a change. */
fct_result fct_simplify_split_pinches(const fct_env *env, fct_sorted *sorted);
/* The copies of a vertex of sorted->mesh: [*first, the result) of `copies`. */
uint32_t fct_simplify_find_copies(const fct_sorted *sorted, uint32_t vertex, uint32_t *first);

#endif
