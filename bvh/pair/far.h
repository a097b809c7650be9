/* bvh/pair/far.h: lower bounds of distances between models that are far apart beside their size.
 *
 * There, floats have too few digits. The bounds are separations along the line between two centres, in
 * double: two sets of radius r at the distance d are nearer than such a bound by at most about r^2 / d.
 */
#ifndef FCT_BVH_FAR_H
#define FCT_BVH_FAR_H

#include "bvh/pair/map.h"

/* Lower bounds of the squared distances of box b from the boxes of a node, in the node's scaled unit. */
void fct_bound_far_boxes(const fct_placed_box *b, const fct_pair_node *n, const fct_space_map *map,
                         double bound2[8]);

/* The extents of the faces of two leaves along the line between the leaves, unscaled in the coordinates of a:
 * face i of a does not reach beyond top_a[i], face j of b not below bottom_b[j]. Rounding included. */
typedef struct fct_far_leaves {
    double top_a[FCT_LEAF_FACES], bottom_b[FCT_LEAF_FACES];
} fct_far_leaves;
void fct_bound_far_leaves(const fct_pair_map *map, const fct_leaf *a, const fct_leaf *b, fct_far_leaves *out);

#endif
