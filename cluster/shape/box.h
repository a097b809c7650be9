/* cluster/shape/box.h: oriented boxes of streams of points. */
#ifndef FCT_CLUSTER_BOX_H
#define FCT_CLUSTER_BOX_H

#include "cluster/shape/extents.h"
#include "facetree/cluster.h"

/* The axes that fct_cluster_box gives for a rotation. */
void fct_box_axes(const float rotation[4], float axes[3][3]);

/* Centre and half extents of a cluster's box from the extents of its points along the axes of its rotation;
 * `point` is any of them. False where they leave the range of a float: then they end there. */
bool fct_box_set(const fct_extents *extents, const float axes[3][3], v3 point, fct_cluster *cluster);

/* A quarter of the surface area, for comparison. */
double fct_box_area(const fct_extents *extents);

#endif
