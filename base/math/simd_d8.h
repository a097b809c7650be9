/* base/math/simd_d8.h: eight doubles at a time, out of simd.h's fours. */
#ifndef FCT_BASE_SIMD_D8_H
#define FCT_BASE_SIMD_D8_H

#include "base/math/round.h"
#include "base/math/simd.h"

/* Eight doubles as two fours, whose waits overlap. */
typedef struct d8 {
    d4 low, high;
} d8;

static inline d8 d8_set(double a) {
    return (d8){d4_set(a), d4_set(a)};
}
static inline d8 d8_load(const double *p) {
    return (d8){d4_load(p), d4_load(p + 4)};
}
static inline d8 d8_load_floats(const float *p) {
    return (d8){d4_load_floats(p), d4_load_floats(p + 4)};
}
static inline void d8_store(double *p, d8 a) {
    d4_store(p, a.low), d4_store(p + 4, a.high);
}
static inline void d8_store_floats(float *p, d8 a) {
    d4_store_floats(p, a.low), d4_store_floats(p + 4, a.high);
}
/* Each as the nearest float. */
static inline d8 d8_round(d8 a) {
    float rounded[8];
    d8_store_floats(rounded, a);
    FCT_KEEP_STORED(rounded);
    return d8_load_floats(rounded);
}
static inline d8 d8_add(d8 a, d8 b) {
    return (d8){d4_add(a.low, b.low), d4_add(a.high, b.high)};
}
static inline d8 d8_sub(d8 a, d8 b) {
    return (d8){d4_sub(a.low, b.low), d4_sub(a.high, b.high)};
}
static inline d8 d8_mul(d8 a, d8 b) {
    return (d8){d4_mul(a.low, b.low), d4_mul(a.high, b.high)};
}
static inline d8 d8_div(d8 a, d8 b) {
    return (d8){d4_div(a.low, b.low), d4_div(a.high, b.high)};
}
static inline d8 d8_sqrt(d8 a) {
    return (d8){d4_sqrt(a.low), d4_sqrt(a.high)};
}
static inline d8 d8_abs(d8 a) {
    return (d8){d4_abs(a.low), d4_abs(a.high)};
}
static inline d8 d8_min(d8 a, d8 b) {
    return (d8){d4_min(a.low, b.low), d4_min(a.high, b.high)};
}
static inline d8 d8_max(d8 a, d8 b) {
    return (d8){d4_max(a.low, b.low), d4_max(a.high, b.high)};
}
static inline d8 d8_if_lt(d8 a, d8 b, d8 x, d8 y) {
    return (d8){d4_if_lt(a.low, b.low, x.low, y.low), d4_if_lt(a.high, b.high, x.high, y.high)};
}
/* Bit i: a_i < b_i. */
static inline uint32_t d8_lt(d8 a, d8 b) {
    return d4_lt(a.low, b.low) | d4_lt(a.high, b.high) << 4;
}

#endif
