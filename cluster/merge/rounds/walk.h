/* cluster/merge/rounds/walk.h: walks over lists of neighbours, eight entries at a time. For kernel files.
 *
 * A walk only puts the entries that it selects into a queue, without branches on their contents, because
 * those branches are unpredictable. The work on the entries follows when the queue is full.
 */
#ifndef FCT_CLUSTER_ROUNDS_WALK_H
#define FCT_CLUSTER_ROUNDS_WALK_H

#include "base/math/simd.h"
#include "cluster/merge/rounds/round.h"

enum { FCT_QUEUE = 128 }; /* entries, plus up to FCT_LIST_SLACK that the last vector adds */

typedef struct fct_edge_queue {
    uint32_t count;
    uint32_t clusters[FCT_QUEUE + FCT_LIST_SLACK]; /* the lower end */
    uint32_t others[FCT_QUEUE + FCT_LIST_SLACK], entries[FCT_QUEUE + FCT_LIST_SLACK];
} fct_edge_queue;

/* Appends the entries first + k of cluster i for the bits k of mask. */
static inline void fct_enqueue(fct_edge_queue *queue, uint32_t i, uint32_t first, i8 others, uint32_t mask) {
    i8 order = i8_chosen(mask);
    i8_store(queue->clusters + queue->count, i8_set(i));
    i8_store(queue->others + queue->count, i8_lookup8(others, order));
    i8_store(queue->entries + queue->count, i8_add(i8_set(first), order));
    queue->count += (uint32_t)__builtin_popcount(mask);
}

/* Bit k: entry k of `left` remaining ones leads to a cluster above i. */
static inline uint32_t fct_higher_ends(uint32_t i, i8 others, uint32_t left) {
    uint32_t within = left < 8 ? (1u << left) - 1 : 0xFF;
    return within & i8_lt(i8_set(i), others);
}

#endif
