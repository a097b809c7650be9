/* partition/adjacency.h: which labels meet along mesh edges, for callers that have sides already. */
#ifndef FCT_CLUSTER_ADJACENCY_H
#define FCT_CLUSTER_ADJACENCY_H

#include "facetree/partition.h"
#include "partition/sides.h"

/* Fills pairs, lengths and edges of *out, which is all zero; the rest stays zero. mesh: positions and
 * triangles only. Errors: MEMORY, CANCELLED; what was made is in *out then, to be released. */
fct_result fct_adjacency_pairs(const fct_env *env, const fct_mesh *mesh, const fct_sides *sides,
                               const uint32_t *labels, fct_adjacency *out);

#endif
