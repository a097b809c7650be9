/* partition/adjacency.h: pairs of labels that share mesh edges, for callers that already have sides. */
#ifndef FCT_PARTITION_ADJACENCY_H
#define FCT_PARTITION_ADJACENCY_H

#include "facetree/partition.h"
#include "partition/sides.h"

/* Fills pairs, lengths and edges of *out, which must be all zero; the rest stays zero. Reads only positions
 * and triangles of the mesh. Errors: MEMORY, CANCELLED; the caller releases *out then too. */
fct_result fct_adjacency_pairs(const fct_env *env, const fct_mesh *mesh, const fct_sides *sides,
                               const uint32_t *labels, fct_adjacency *out);

#endif
