/* base/math/expansion.h: exact sums of doubles as expansions (Shewchuk 1997).
 *
 * An expansion is a list of doubles in order of magnitude whose bits do not overlap. Its value is their sum,
 * and its last term that is not zero has the sign of the value. Nothing may overflow or vanish.
 */
#ifndef FCT_BASE_EXPANSION_H
#define FCT_BASE_EXPANSION_H

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { FCT_EXPANSION_TERMS = 96 };

/* Start with count 0. */
typedef struct fct_expansion {
    double term[FCT_EXPANSION_TERMS];
    int count;
} fct_expansion;

/* Adds a double: Grow-Expansion (figure 6 of the paper). */
static inline void fct_expansion_add(fct_expansion *e, double x) {
    int kept = 0;
    for (int i = 0; i < e->count; ++i) {
        double sum = x + e->term[i], part = sum - x;
        double rest = (x - (sum - part)) + (e->term[i] - part);
        if (rest != 0) e->term[kept++] = rest;
        x = sum;
    }
    if (x != 0) e->term[kept++] = x;
    e->count = kept;
}

/* The product of a and b is *product + the result, exactly: fma rounds once. */
static inline double fct_product_rest(double a, double b, double *product) {
    *product = a * b;
    return fma(a, b, -*product);
}

/* Adds a b c. */
static inline void fct_expansion_add_product(fct_expansion *e, double a, double b, double c) {
    double product, high, low, rest = fct_product_rest(a, b, &product);
    low = fct_product_rest(product, c, &high);
    fct_expansion_add(e, low), fct_expansion_add(e, high);
    low = fct_product_rest(rest, c, &high);
    fct_expansion_add(e, low), fct_expansion_add(e, high);
}

/* 1, 0 or -1. */
static inline int fct_expansion_sign(const fct_expansion *e) {
    if (e->count == 0) return 0;
    return e->term[e->count - 1] > 0 ? 1 : -1;
}

#endif
