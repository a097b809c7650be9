/* bvh/build/slabs.h: the oriented box of a set of leaves, as three slabs. */
#ifndef FCT_BVH_SLABS_H
#define FCT_BVH_SLABS_H

#include "base/variant.h"
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

/* Empties the slabs of these axes. */
void fct_slabs_clear(fct_slabs *s);
/* Widens them to hold the vertices of leaves: of those at offsets[order[i]], i < count. */
#define fct_slabs_hold FCT_KERNEL(fct_slabs_hold)
FCT_DECLARE_KERNEL(void, fct_slabs_hold,
                   (const fct_bvh *bvh, const uint32_t *offsets, const uint32_t *order, uint32_t count,
                    fct_slabs *s));

/* The axes of the largest face of a leaf: its shortest side, which is not the diagonal of a rectangle, a
 * direction across, and its normal. Returns false if no face has area. */
bool fct_slabs_face_axes(const fct_leaf *leaf, v3 axes[3]);

/* Of the leaves of a node of the top. */
typedef struct fct_span {
    uint32_t first, last; /* the least place of a face, and the largest plus 1 */
    uint32_t largest;     /* the cluster of largest area among the fct_leaf_list.nodes of its leaves */
    /* The smallest cluster that holds all faces. FCT_NONE if there is none, or if the tree has many roots. */
    uint32_t enclosing;
    float area; /* of `largest` */
} fct_span;

/* One per node of the top. The caller releases *out. Errors: MEMORY. */
fct_result fct_spans_build(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                           fct_span **out);

/* The slabs of least area of the leaves of a node of the top. Of these sets of axes: those of the smallest
 * face cluster that holds all its faces, those of its leaf of largest area, the coordinate axes, those along
 * which the top was split, and for a bulky leaf those of its largest face. */
fct_slabs fct_slabs_fit(const fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                        const fct_top_node *node, const fct_span *span);

#endif
