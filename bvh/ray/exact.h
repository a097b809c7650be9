/* bvh/ray/exact.h: whether a line crosses a triangle, by exact arithmetic. */
#ifndef FCT_BVH_EXACT_H
#define FCT_BVH_EXACT_H

#include <stdbool.h>

#include "base/math/vec.h"

/* Whether the line through `origin` along `direction`, which is not zero, crosses the triangle. Coordinates
 * have at most 24 significant bits, as floats have, and magnitudes from 2^-300 to 2^300 or zero. A line
 * through an edge or a vertex counts as moved aside by an infinitesimal vector, the same for all triangles.
 * So a line that crosses none or several triangles of a closed surface crosses an even number. A triangle
 * without area, seen along the line, is never crossed. */
bool fct_line_crosses(v3 origin, v3 direction, const v3 p[3]);

#endif
