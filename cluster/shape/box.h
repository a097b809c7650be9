/* cluster/shape/box.h: oriented boxes of streams of points. */
#ifndef FCT_CLUSTER_BOX_H
#define FCT_CLUSTER_BOX_H

#include "base/math/vec.h"
#include "facetree/cluster.h"

typedef struct fct_points {
    const float *x, *y, *z;
} fct_points;

/* Least and greatest product of points with each of three axes. */
typedef struct fct_extents {
    double low[3], high[3];
} fct_extents;

static inline fct_extents fct_extents_none(void) {
    return (fct_extents){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

/* The axes that fct_cluster_box gives for a rotation. */
void fct_box_axes(const float rotation[4], float axes[3][3]);

/* Widens the extents to points [begin, end). */
void fct_extents_add(fct_extents *extents, fct_points points, size_t begin, size_t end,
                     const float axes[3][3]);

/* Centre and half extents of a cluster's box from the extents of its points along the axes of its rotation;
 * `point` is any of them. False where they leave the range of a float: then they end there. */
bool fct_box_set(const fct_extents *extents, const float axes[3][3], v3 point, fct_cluster *cluster);

/* A quarter of the surface area, for comparison. */
double fct_box_area(const fct_extents *extents);

#endif
