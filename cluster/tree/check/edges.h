/* cluster/tree/check/edges.h: counts of a mesh's edges and components, in bounded memory. */
#ifndef FCT_CLUSTER_EDGES_H
#define FCT_CLUSTER_EDGES_H

#include "base/env.h"
#include "facetree/cluster.h"

/* Edges with one face, with three or more, and the parts that edges connect. */
typedef struct fct_edge_counts {
    uint32_t boundary, nonmanifold, components;
} fct_edge_counts;

enum { FCT_EDGE_PORTION = 1 << 24 };

/* Counts from the triangles of the view, welded if the tree is, about `portion` sides of faces at a time.
 * Errors: MEMORY, CANCELLED.
 */
fct_result fct_tree_count_edges(const fct_env *env, const fct_tree_view *view, uint32_t portion,
                                fct_edge_counts *out);

#endif
