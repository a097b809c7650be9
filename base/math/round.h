/* base/math/round.h: rounding to float that the compiler keeps.
 *
 * After vectorisation, gcc 12 replaces doubles that are converted to float and back by the unrounded doubles,
 * at -O2 and for every instruction set. A bound that is computed from such a value does not hold for the
 * float that is stored. Code that reads a rounded value back calls these functions, or d8_round in a kernel.
 */
#ifndef FCT_BASE_ROUND_H
#define FCT_BASE_ROUND_H

#include "base/math/vec.h"

/* The compiler must assume that this changes the variable or array. */
#if defined(__GNUC__)
#define FCT_KEEP_STORED(variable) __asm__ volatile("" : "+m"(variable))
#else
#error "needs a way to keep a store: gcc and clang have asm"
#endif

static inline double fct_round(double value) {
    float rounded = (float)value;
    FCT_KEEP_STORED(rounded);
    return (double)rounded;
}
/* Each coordinate as the nearest float. */
static inline v3 v3_round(v3 a) {
    float rounded[3];
    v3_store(rounded, a);
    FCT_KEEP_STORED(rounded);
    return v3_load(rounded);
}

#endif
