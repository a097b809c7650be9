/* simplify/topology/ring.h: the corners around a point, and the test whether moving the point folds a face.
 */
#ifndef FCT_SIMPLIFY_RING_H
#define FCT_SIMPLIFY_RING_H

#include "simplify/state.h"

/* Collects the live corners of a point in `ring`, drops the dead ones from its list, and returns the count.
 * The ring needs room for the point's valence. */
uint32_t fct_simplify_gather(fct_simplifier *s, uint32_t point, uint32_t *ring);
/* Whether a move of the point of these corners from `from` to `at` turns the normal of a face by more than 84
 * degrees (Garland 1999, section 3.7, the test by normals). Faces that touch `other` vanish and do not count;
 * with FCT_NONE all faces count. Faces without area never fold. */
bool fct_simplify_folds_over(const fct_simplifier *s, const uint32_t *ring, uint32_t count, uint32_t other,
                             v3 from, v3 at);

#endif
