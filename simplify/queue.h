/* simplify/queue.h: a priority queue of edges in buckets of equal leading float bits.
 *
 * Eight buckets an octave: what comes out costs at most 1/8 more than the cheapest. Insertion and removal are
 * constant time; the last edge in is the first out of a bucket, so the order depends on the calls alone.
 */
#ifndef FCT_SIMPLIFY_QUEUE_H
#define FCT_SIMPLIFY_QUEUE_H

#include <string.h>

#include "base/env.h"

enum { QUEUE_BUCKETS = 2048 };

typedef struct fct_queue {
    uint32_t *next; /* by edge */
    uint16_t *bucket_of;
    uint32_t first[QUEUE_BUCKETS];
    uint32_t current; /* no bucket below holds an edge */
} fct_queue;

/* The bucket of a cost; anything that is not a positive number goes first. */
static inline uint32_t queue_bucket(double cost) {
    float narrow = (float)cost;
    uint32_t bits;
    memcpy(&bits, &narrow, sizeof bits);
    return cost > 0 ? bits >> 20 : 0;
}

static inline void queue_push(fct_queue *q, uint32_t edge, uint32_t bucket) {
    q->next[edge] = q->first[bucket];
    q->first[bucket] = edge;
    q->bucket_of[edge] = (uint16_t)bucket;
    if (bucket < q->current) q->current = bucket;
}

/* FCT_NONE when empty. */
static inline uint32_t queue_pop(fct_queue *q) {
    while (q->current < QUEUE_BUCKETS && q->first[q->current] == FCT_NONE) ++q->current;
    if (q->current == QUEUE_BUCKETS) return FCT_NONE;
    uint32_t edge = q->first[q->current];
    q->first[q->current] = q->next[edge];
    return edge;
}

static inline fct_result queue_create(const fct_env *env, uint32_t edge_count, fct_queue *q) {
    q->next = fct_allocate(env, edge_count, sizeof *q->next);
    q->bucket_of = fct_allocate(env, edge_count, sizeof *q->bucket_of);
    for (uint32_t i = 0; i < QUEUE_BUCKETS; ++i) q->first[i] = FCT_NONE;
    q->current = QUEUE_BUCKETS;
    return q->next && q->bucket_of ? FCT_OK : fct_fail_memory(env, "the queue of contractions");
}

static inline void queue_release(const fct_env *env, fct_queue *q) {
    fct_release(env, q->next);
    fct_release(env, q->bucket_of);
}

#endif
