/* cluster/merge/rounds/merge.h: merges the pairs of a round. */
#ifndef FCT_CLUSTER_MERGE_H
#define FCT_CLUSTER_MERGE_H

#include "cluster/merge/rounds/round.h"

/* Chunk body over the live clusters; user: fct_rounds, where kept, merged and room hold the sums of the
 * chunks before. Merges records and numbers the clusters of the next round, in the order of their lower
 * parts. */
#define fct_merge_pairs FCT_KERNEL(fct_merge_pairs)
FCT_DECLARE_KERNEL(void, fct_merge_pairs,
                   (void *user, size_t begin, size_t end, size_t chunk, uint32_t thread));

#endif
