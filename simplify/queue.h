/* simplify/queue.h: a priority queue of edges, in buckets by the leading 12 bits of a float cost.
 *
 * Invariants: no bucket below `current` holds an edge, and none above `limit`.
 * Order: 8 buckets per octave, so a popped edge costs at most 1/8 more than the cheapest edge. Inside a
 * bucket the last pushed edge leaves first. The order depends only on the sequence of calls.
 * Cost: push and pop take constant time, plus one pass over empty buckets.
 */
#ifndef FCT_SIMPLIFY_QUEUE_H
#define FCT_SIMPLIFY_QUEUE_H

#include "base/env.h"
#include "base/key.h"

/* Positive floats have 2^11 values of their 12 leading bits: sign 0, 8 of exponent, 3 of mantissa. */
enum { QUEUE_BUCKETS = 2048, QUEUE_BUCKET_SHIFT = 20 };

enum { EDGE_QUEUED, EDGE_REFUSED, EDGE_OVER_BOUND, EDGE_DEAD };

typedef struct fct_edge {
    uint32_t ends[2]; /* points at the time when the edge was made; resolve with point_parents */
    uint32_t parent;  /* the edge that replaced this one; the edge itself while it lives */
    uint32_t next;    /* next edge of the same bucket, FCT_NONE at the end */
    uint16_t bucket;
    uint8_t state;
    bool ends_only; /* the optimal position folds a face over: try only the ends and the midpoint */
} fct_edge;

typedef struct fct_queue {
    fct_edge *edges;
    uint32_t first[QUEUE_BUCKETS];
    uint32_t current, limit;
} fct_queue;

/* The bucket of a cost. Costs that are not positive go to bucket 0. */
static inline uint32_t queue_bucket(double cost) {
    return cost > 0 ? fct_float_bits((float)cost) >> QUEUE_BUCKET_SHIFT : 0;
}

/* An edge above the limit only gets its bucket. */
static inline void queue_push(fct_queue *q, uint32_t edge, uint32_t bucket) {
    q->edges[edge].bucket = (uint16_t)bucket;
    if (bucket > q->limit) return;
    q->edges[edge].next = q->first[bucket];
    q->first[bucket] = edge;
    if (bucket < q->current) q->current = bucket;
}

/* Removes an edge of the lowest bucket; FCT_NONE if the queue is empty. */
static inline uint32_t queue_pop(fct_queue *q) {
    while (q->current <= q->limit && q->first[q->current] == FCT_NONE) ++q->current;
    if (q->current > q->limit) return FCT_NONE;
    uint32_t edge = q->first[q->current];
    q->first[q->current] = q->edges[edge].next;
    return edge;
}

/* An empty queue of edges up to the bucket `limit`. */
static inline void queue_clear(fct_queue *q, fct_edge *edges, uint32_t limit) {
    q->edges = edges;
    for (uint32_t i = 0; i <= limit; ++i) q->first[i] = FCT_NONE;
    q->current = QUEUE_BUCKETS;
    q->limit = limit;
}

#endif
