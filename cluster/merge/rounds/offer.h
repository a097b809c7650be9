/* cluster/merge/rounds/offer.h: an edge and its cost as one number. Each cluster keeps its least number.
 *
 *   63                        37 36          32 31                            0
 *  +----------------------------+--------------+-------------------------------+
 *  | upper 27 bits of the cost  | log2 of the  | scramble(a ^ b ^ round bits)  |
 *  | as fct_float_key           | union's faces|                               |
 *  +----------------------------+--------------+-------------------------------+
 *   \_______________ key _____________________/ \___________ tie _____________/
 *
 * Scrambling is a bijection, so a cluster finds the other end of the edge from its own number and the tie.
 * Ties by number instead would give a flat grid one merge per chain and round. The cost keeps 18 bits of its
 * mantissa.
 */
#ifndef FCT_CLUSTER_OFFER_H
#define FCT_CLUSTER_OFFER_H

#include "cluster/merge/rounds/round.h"

/* Factors of the scramble (odd, so that they have inverses modulo 2^32) and their inverses. */
#define FCT_SCRAMBLE_ROUND  0x85EBCA6Bu
#define FCT_SCRAMBLE_FIRST  0x9E3779B1u
#define FCT_SCRAMBLE_SECOND 0x21F0AAADu
#define FCT_RESTORE_SECOND  0x333C4925u
#define FCT_RESTORE_FIRST   0x0E8B2F51u
#define FCT_NO_OFFER        UINT64_MAX

/* The end other than i of the edge that an offer to i names; i itself for FCT_NO_OFFER. */
static inline uint32_t fct_offer_other_end(uint32_t round, uint32_t i, uint64_t offer) {
    uint32_t x = (uint32_t)offer * FCT_RESTORE_SECOND;
    uint32_t other = (x ^ x >> 16) * FCT_RESTORE_FIRST ^ round * FCT_SCRAMBLE_ROUND ^ i;
    return offer == FCT_NO_OFFER ? i : other;
}

static inline uint64_t fct_offer_load(const _Atomic uint64_t *offers, uint32_t i) {
    return atomic_load_explicit(&offers[i], memory_order_relaxed);
}

/* *least = min(*least, offer), in any order of threads. */
static inline void fct_offer_lower(const fct_rounds *r, _Atomic uint64_t *least, uint64_t offer) {
    uint64_t now = atomic_load_explicit(least, memory_order_relaxed);
    if (r->alone) {
        atomic_store_explicit(least, offer < now ? offer : now, memory_order_relaxed);
        return;
    }
    while (offer < now && !atomic_compare_exchange_weak_explicit(least, &now, offer, memory_order_relaxed,
                                                                 memory_order_relaxed))
        continue;
}

/* Offers the edge between a and b to both. */
static inline void fct_offer_edge(const fct_rounds *r, _Atomic uint64_t *offers, uint32_t a, uint32_t b,
                                  uint32_t key) {
    uint32_t x = (a ^ b ^ r->round * FCT_SCRAMBLE_ROUND) * FCT_SCRAMBLE_FIRST;
    uint64_t offer = (uint64_t)key << 32 | (x ^ x >> 16) * FCT_SCRAMBLE_SECOND;
    fct_offer_lower(r, &offers[a], offer);
    fct_offer_lower(r, &offers[b], offer);
}

#endif
