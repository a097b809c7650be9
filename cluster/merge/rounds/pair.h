/* cluster/merge/rounds/pair.h: finds the pairs of clusters that merge in a round. */
#ifndef FCT_CLUSTER_PAIR_H
#define FCT_CLUSTER_PAIR_H

#include "cluster/merge/rounds/round.h"

/* Chunk bodies over the live clusters; user: fct_rounds. Each must end for all chunks before the next begins.
 * 1. Makes pairs of clusters that are each other's cheapest partner, and sets the limits of the others. */
#define fct_pair_first FCT_KERNEL(fct_pair_first)
FCT_DECLARE_KERNEL(void, fct_pair_first,
                   (void *user, size_t begin, size_t end, size_t chunk, uint32_t thread));
/* 2. Offers edges within the limits of both ends to clusters without a mate. */
#define fct_pair_offer FCT_KERNEL(fct_pair_offer)
FCT_DECLARE_KERNEL(void, fct_pair_offer,
                   (void *user, size_t begin, size_t end, size_t chunk, uint32_t thread));
/* 3. Makes the second pairs and counts, per chunk, the clusters and list entries of the next round. */
#define fct_pair_second FCT_KERNEL(fct_pair_second)
FCT_DECLARE_KERNEL(void, fct_pair_second,
                   (void *user, size_t begin, size_t end, size_t chunk, uint32_t thread));

#endif
