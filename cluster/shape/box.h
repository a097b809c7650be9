/* cluster/shape/box.h: the oriented box of a cluster, from the extents of its points. */
#ifndef FCT_CLUSTER_BOX_H
#define FCT_CLUSTER_BOX_H

#include "cluster/shape/extents.h"
#include "facetree/cluster.h"

/* The axes of fct_cluster_box for this rotation. */
void fct_box_axes(const float rotation[4], float axes[3][3]);

/* Sets the centre and the half extents of a cluster's box from the extents of its points along the axes of
 * its rotation. `point` is any of the points. Returns false if a number leaves the range of a float; half
 * extents are then FLT_MAX. */
bool fct_box_set(const fct_extents *extents, const float axes[3][3], v3 point, fct_cluster *cluster);

/* Half the surface area of the box, for comparisons. */
double fct_box_area(const fct_extents *extents);

#endif
