/* cluster/tree/describe/single.h: the record of one cluster, from its points or its triangle. */
#ifndef FCT_CLUSTER_SINGLE_H
#define FCT_CLUSTER_SINGLE_H

#include "cluster/shape/octet.h"
#include "facetree/cluster.h"

/* Sets everything in the record except cost, children, first and count. The points fill all lanes of their
 * rows; the normals are rows of four floats. */
void fct_points_describe(const fct_octet_row *points, uint32_t point_count, const float *normals,
                         uint32_t normal_count, const fct_sums *sums, fct_cluster *out);

/* The whole record of the leaf at a place; its cost is 0. */
void fct_leaf_describe(const fct_tree_view *view, uint32_t place, fct_cluster *out);
/* The area in that record. It takes a hundredth of the time. */
float fct_leaf_area(const fct_tree_view *view, uint32_t place);

#endif
