/* base/key.h: unsigned integers that sort like floats, doubles and edges. */
#ifndef FCT_BASE_KEY_H
#define FCT_BASE_KEY_H

#include <stdint.h>
#include <string.h>

static inline uint32_t fct_float_bits(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}
static inline float fct_float_of_bits(uint32_t bits) {
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}
/* The bits of doubles that are not negative sort like the doubles. */
static inline uint64_t fct_double_bits(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* a < b exactly if key(a) < key(b), for all floats but NaN. The key of -0 is below the key of +0. */
static inline uint32_t fct_float_key(float value) {
    uint32_t bits = fct_float_bits(value);
    return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}
static inline float fct_float_of_key(uint32_t key) {
    return fct_float_of_bits(key & 0x80000000u ? key ^ 0x80000000u : ~key);
}

/* The same for doubles. */
static inline uint64_t fct_double_key(double value) {
    uint64_t bits = fct_double_bits(value), sign = (uint64_t)1 << 63;
    return bits & sign ? ~bits : bits | sign;
}

/* The unordered pair of two ids: the smaller id in the upper half. */
static inline uint64_t fct_pair_key(uint32_t a, uint32_t b) {
    return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
}

#endif
