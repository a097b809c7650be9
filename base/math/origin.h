/* base/math/origin.h: a local origin for coordinates that lose digits when they become floats.
 *
 * An fct_extent collects points of double coordinates. It asks for a local origin if both hold:
 *   - The largest coordinate is over 64 times the longest side of the bounding box, which is not 0.
 *   - A coordinate has more digits than a float. A float that was printed with 9 digits has no more.
 * The answer depends on the set of the points, not on their order. Adding stops, at the cost of one branch
 * per point, when no further point can make the first condition true.
 */
#ifndef FCT_BASE_ORIGIN_H
#define FCT_BASE_ORIGIN_H

#include <stdbool.h>

/* All zero: no points. */
typedef struct fct_extent {
    double lower[3], upper[3];
    bool any;  /* a point was added */
    bool near; /* the first condition cannot become true */
    bool fine; /* the second condition is true */
} fct_extent;

void fct_extent_widen(fct_extent *extent, const double point[3]);

/* A point with a coordinate that is not finite as a float is ignored. */
static inline void fct_extent_add(fct_extent *extent, const double point[3]) {
    if (!extent->near) fct_extent_widen(extent, point);
}

/* Returns whether the points need a local origin. It is the centre of the bounding box, rounded to multiples
 * of a power of two that is at least the longest side. origin is zero otherwise. */
bool fct_extent_origin(const fct_extent *extent, double origin[3]);

#endif
