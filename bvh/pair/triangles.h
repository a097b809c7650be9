/* bvh/pair/triangles.h: two triangles: whether they meet, where, and how far they are apart. */
#ifndef FCT_BVH_TRIANGLES_H
#define FCT_BVH_TRIANGLES_H

#include <stdbool.h>

#include "base/math/vec.h"
#include "facetree/collide.h"

/* Whether the closed triangles share a point, by exact arithmetic (orient.h gives the range of coordinates).
 * A triangle without area shares nothing. */
bool fct_triangles_meet(const v3 a[3], const v3 b[3]);

/* Fills *out (collide.h). Returns whether the triangles meet. */
bool fct_triangles_contact(const v3 a[3], const v3 b[3], fct_contact *out);

/* The squared distance of the triangles; *pa and *pb receive the nearest points. Triangles without area count
 * as their sides. 0 if they meet. */
double fct_triangles_distance(const v3 a[3], const v3 b[3], v3 *pa, v3 *pb);

#endif
