/* base/hash.h: a hash of 64-bit words. */
#ifndef FCT_BASE_HASH_H
#define FCT_BASE_HASH_H

#include <stdint.h>

/* The finaliser of splitmix64: a bijection of 64-bit words; each output bit depends on all input bits. */
static inline uint64_t fct_hash(uint64_t x) {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

#endif
