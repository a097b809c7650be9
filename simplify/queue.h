/* simplify/queue.h: a priority queue of edges in buckets of equal leading float bits.
 *
 * Eight buckets an octave: what comes out costs at most 1/8 more than the cheapest. Insertion and removal are
 * constant time; the last edge in is the first out of a bucket, so the order depends on the calls alone.
 */
#ifndef FCT_SIMPLIFY_QUEUE_H
#define FCT_SIMPLIFY_QUEUE_H

#include "base/env.h"
#include "base/key.h"

enum { QUEUE_BUCKETS = 2048 };

enum { EDGE_QUEUED, EDGE_REFUSED, EDGE_OVER_BOUND, EDGE_DEAD };

typedef struct fct_edge {
    uint32_t ends[2]; /* points when the edge was made; resolve */
    uint32_t parent;  /* the twin that took its place, itself while alive */
    uint32_t next;    /* in its bucket */
    uint16_t bucket;
    uint8_t state;
    bool ends_only; /* the minimiser turned a face over: place at an end or the middle */
} fct_edge;

typedef struct fct_queue {
    fct_edge *edges;
    uint32_t first[QUEUE_BUCKETS];
    uint32_t current; /* no bucket below holds an edge */
} fct_queue;

/* The bucket of a cost; anything that is not a positive number goes first. */
static inline uint32_t queue_bucket(double cost) {
    return cost > 0 ? fct_float_bits((float)cost) >> 20 : 0;
}

static inline void queue_push(fct_queue *q, uint32_t edge, uint32_t bucket) {
    q->edges[edge].next = q->first[bucket];
    q->first[bucket] = edge;
    q->edges[edge].bucket = (uint16_t)bucket;
    if (bucket < q->current) q->current = bucket;
}

/* FCT_NONE when empty. */
static inline uint32_t queue_pop(fct_queue *q) {
    while (q->current < QUEUE_BUCKETS && q->first[q->current] == FCT_NONE) ++q->current;
    if (q->current == QUEUE_BUCKETS) return FCT_NONE;
    uint32_t edge = q->first[q->current];
    q->first[q->current] = q->edges[edge].next;
    return edge;
}

static inline void queue_clear(fct_queue *q, fct_edge *edges) {
    q->edges = edges;
    for (uint32_t i = 0; i < QUEUE_BUCKETS; ++i) q->first[i] = FCT_NONE;
    q->current = QUEUE_BUCKETS;
}

#endif
