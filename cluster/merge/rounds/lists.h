/* cluster/merge/rounds/lists.h: the lists of neighbours of the next round. */
#ifndef FCT_CLUSTER_LISTS_H
#define FCT_CLUSTER_LISTS_H

#include "cluster/merge/rounds/round.h"

/* Chunk body over the live clusters, after fct_merge_pairs; user: fct_rounds. Writes the lists of the
 * clusters that the next round has from this chunk. */
#define fct_join_lists FCT_KERNEL(fct_join_lists)
FCT_DECLARE_KERNEL(void, fct_join_lists,
                   (void *user, size_t begin, size_t end, size_t chunk, uint32_t thread));

#endif
