/* bvh/build/slabs.h: the oriented box of a set of leaves, as three slabs. */
#ifndef FCT_BVH_SLABS_H
#define FCT_BVH_SLABS_H

#include "bvh/build/top.h"

/* Three slabs that hold every vertex x: lower[i] <= axes[i] . (x - center) <= upper[i]. The axes are
 * orthonormal to float rounding. */
typedef struct fct_slabs {
    v3 axes[3];
    double lower[3], upper[3];
} fct_slabs;

/* Half of the surface of a box of these sides. */
static inline double fct_half_area(double x, double y, double z) {
    return x * y + y * z + z * x;
}
/* Half of the surface of the box, padded. */
double fct_slabs_area(const fct_slabs *s);

/* Empties the slabs of these axes, and widens them to hold the vertices of a leaf. */
void fct_slabs_clear(fct_slabs *s);
void fct_slabs_hold(const fct_bvh *bvh, const fct_leaf *leaf, fct_slabs *s);

/* The slabs of least area of the leaves of a node of the top. Of three sets of axes: those of the smallest
 * face cluster that holds all its faces, those of its leaf of largest area, and the coordinate axes. */
fct_slabs fct_slabs_fit(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                        const fct_top_node *node);

#endif
