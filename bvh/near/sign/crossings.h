/* bvh/near/sign/crossings.h: the winding number of a closed surface, by the faces that a ray crosses.
 *
 * About a surface without a border the winding number is whole: the faces that a ray from the point leaves
 * the surface by, less those that it enters by. Rays cross each closed surface exactly (ray/exact.h).
 */
#ifndef FCT_BVH_CROSSINGS_H
#define FCT_BVH_CROSSINGS_H

#include "bvh/model.h"

/* Sets bvh->is_closed: each side of a face, from position to position, is taken by as many faces the other
 * way. So parts may touch, overlap and be several, but all faces of a part wind alike. Errors: MEMORY. */
fct_result fct_crossings_prepare(fct_bvh *bvh);

/* The winding number about a finite point. False if the surface is not closed, or if the point is so close to
 * it that rounding could decide. visits may be NULL. */
bool fct_crossings_count(const fct_bvh *bvh, v3 point, int64_t *winding, fct_visits *visits);

#endif
