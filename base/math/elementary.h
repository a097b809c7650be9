/* base/math/elementary.h: elementary functions with the same result on every processor.
 *
 * The C library picks its sine, arc cosine or power by the processor, and the versions with fused
 * multiply-add differ from the others in the last bit. These functions use additions, multiplications,
 * divisions and square roots only, which IEEE 754 defines exactly. Errors are at most 4 units in the last
 * place within the stated ranges.
 */
#ifndef FCT_BASE_ELEMENTARY_H
#define FCT_BASE_ELEMENTARY_H

/* The absolute error is below 1e-15 for |x| <= 1e5, and 1e-16 |x| beyond. */
double fct_sin(double x);
double fct_cos(double x);
/* Both, with one reduction of the angle. */
void fct_sine_cosine(double x, double *sine, double *cosine);

/* In [-pi, pi]; 0 if both are 0. Neither may be infinite. */
double fct_atan2(double y, double x);

/* |x| <= 1. Near 1 the arc cosine keeps the digits that x holds. */
double fct_asin(double x);
double fct_acos(double x);

/* x > 0, normal. Exact for powers of two. */
double fct_log2(double x);
/* |x| <= 1000 */
double fct_exp2(double x);

/* x^(1/n) for x >= 0, zero or normal, and n = 3 or 5. */
double fct_root(double x, int n);

#endif
