/* cluster/merge/rounds/price.h: prices edges and offers them to their ends. */
#ifndef FCT_CLUSTER_PRICE_H
#define FCT_CLUSTER_PRICE_H

#include "cluster/merge/rounds/round.h"

/* Chunk bodies; user: fct_rounds. The first takes live clusters [begin, end). The second takes the clusters
 * that came of the same chunk of the round before: no other chunk's lists overlap theirs, slack included. */
#define fct_price_first FCT_KERNEL(fct_price_first)
FCT_DECLARE_KERNEL(void, fct_price_first,
                   (void *user, size_t begin, size_t end, size_t chunk, uint32_t thread));
#define fct_price_next FCT_KERNEL(fct_price_next)
FCT_DECLARE_KERNEL(void, fct_price_next,
                   (void *user, size_t begin, size_t end, size_t chunk, uint32_t thread));

#endif
