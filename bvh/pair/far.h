/* bvh/pair/far.h: lower bounds of distances between models that are far apart beside their size.
 *
 * There, floats have too few digits. The bounds are separations along the line between two centres, in
 * double: the distance of two sets of radius r with centres d apart exceeds such a bound by at most about
 * r^2 / d. If d is not much larger than r, as near a large triangle, other bounds are better.
 */
#ifndef FCT_BVH_FAR_H
#define FCT_BVH_FAR_H

#include "bvh/pair/map.h"

/* Lower bounds of the distances of box b from the boxes of a node, in the node's scaled unit; negative if the
 * boxes overlap along the line. */
void fct_bound_far_boxes(const fct_placed_box *b, const fct_pair_node *n, const fct_space_map *map,
                         double bound[8]);

/* The extents of the faces of two leaves along two directions, unscaled in the coordinates of a: face i of a
 * does not reach beyond top_a[.][i], face j of b not below bottom_b[.][j]. Rounding included. */
typedef struct fct_far_leaves {
    double top_a[2][FCT_LEAF_FACES], bottom_b[2][FCT_LEAF_FACES];
    uint32_t first_a, first_b; /* the faces with the least bound along the better direction */
} fct_far_leaves;
/* The directions: the line between the leaves, and `way` (a unit vector, or zero), which may separate faces
 * beside a large triangle. Returns false if one of them shows that no faces are within `reach`. */
bool fct_bound_far_leaves(const fct_pair_map *map, const fct_leaf *a, const fct_leaf *b, v3 way, double reach,
                          fct_far_leaves *out);
/* A lower bound of the distance of face i of a and face j of b. */
static inline double fct_far_gap(const fct_far_leaves *far, uint32_t i, uint32_t j) {
    return fct_max(far->bottom_b[0][j] - far->top_a[0][i], far->bottom_b[1][j] - far->top_a[1][i]);
}

#endif
