/* base/math/elementary.c: see elementary.h. Each function reduces its argument to a short interval about a
 * point where it is known, and sums the Taylor series until the next term is below 2^-56 of the sum.
 */
#include "base/math/elementary.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* 1 - z/3! + z^2/5! ..., z = x^2: sin(x) / x for |x| <= pi / 4 */
static double sum_sine(double z) {
    static const double factors[] = {1. / (16 * 17), 1. / (14 * 15), 1. / (12 * 13), 1. / (10 * 11),
                                     1. / (8 * 9),   1. / (6 * 7),   1. / (4 * 5),   1. / (2 * 3)};
    double sum = 1;
    for (int i = 0; i < 8; ++i) sum = 1 - z * factors[i] * sum;
    return sum;
}

/* 1 - z/2! + z^2/4! ...: cos(x) for |x| <= pi / 4 */
static double sum_cosine(double z) {
    static const double factors[] = {1. / (17 * 18), 1. / (15 * 16), 1. / (13 * 14), 1. / (11 * 12),
                                     1. / (9 * 10),  1. / (7 * 8),   1. / (5 * 6),   1. / (3 * 4)};
    double sum = 1;
    for (int i = 0; i < 8; ++i) sum = 1 - z * factors[i] * sum;
    return 1 - 0.5 * z * sum;
}

/* x minus the nearest multiple of pi / 2; *quadrant is the multiple modulo 4. */
static double reduce_angle(double x, int *quadrant) {
    /* pi / 2 in three parts. The first two have 33 bits, so that a product with a multiple below 2^20 is
     * exact. */
    const double first = 0x1.921fb544p+0, second = 0x1.0b4611a6p-34, third = 0x1.3198a2e037073p-69;
    *quadrant = 0;
    if (!(fabs(x) < INFINITY)) return x - x; /* not a number */
    if (fabs(x) > 1e5) x = fmod(x, 6.283185307179586);
    double n = floor(x * 0.63661977236758134 + 0.5);
    *quadrant = (int)((int64_t)n & 3);
    return ((x - n * first) - n * second) - n * third;
}

static double sine_of_quadrant(double x, int quadrant) {
    double z = x * x, value = quadrant & 1 ? sum_cosine(z) : x * sum_sine(z);
    return quadrant & 2 ? -value : value;
}

double fct_sin(double x) {
    int quadrant;
    double rest = reduce_angle(x, &quadrant);
    return sine_of_quadrant(rest, quadrant);
}

double fct_cos(double x) {
    int quadrant;
    double rest = reduce_angle(x, &quadrant);
    return sine_of_quadrant(rest, (quadrant + 1) & 3);
}

void fct_sine_cosine(double x, double *sine, double *cosine) {
    int quadrant;
    double rest = reduce_angle(x, &quadrant);
    *sine = sine_of_quadrant(rest, quadrant);
    *cosine = sine_of_quadrant(rest, (quadrant + 1) & 3);
}

/* t in [0, 1]: atan(t) = atan(c) + atan((t - c) / (1 + t c)) for the nearest c of 0, 1/4, 1/2, 3/4, 1. */
static double arc_tangent(double t) {
    static const double angles[] = {0, 0.24497866312686414, 0.46364760900080615, 0.64350110879328437,
                                    0.78539816339744828};
    int nearest = (int)(4 * t + 0.5);
    double c = 0.25 * nearest, r = (t - c) / (1 + t * c), z = r * r, sum = 1.0 / 19;
    for (int odd = 17; odd > 0; odd -= 2) sum = 1.0 / odd - z * sum;
    return angles[nearest] + r * sum;
}

double fct_atan2(double y, double x) {
    const double half_turn = 3.14159265358979323846;
    double ax = fabs(x), ay = fabs(y), angle;
    if (ax >= ay)
        angle = ax > 0 ? arc_tangent(ay / ax) : 0;
    else
        angle = 0.5 * half_turn - arc_tangent(ax / ay);
    if (x < 0) angle = half_turn - angle;
    return y < 0 ? -angle : angle;
}

double fct_asin(double x) {
    return fct_atan2(x, sqrt((1 - x) * (1 + x)));
}

double fct_acos(double x) {
    return fct_atan2(sqrt((1 - x) * (1 + x)), x);
}

/* ln m = 2 (s + s^3/3 + s^5/5 ...), s = (m - 1) / (m + 1), for the mantissa m in [sqrt(1/2), sqrt(2)) */
double fct_log2(double x) {
    int exponent;
    double m = frexp(x, &exponent);
    if (m < 0.70710678118654752) m *= 2, --exponent;
    double s = (m - 1) / (m + 1), z = s * s, sum = 1.0 / 23;
    for (int odd = 21; odd > 0; odd -= 2) sum = 1.0 / odd + z * sum;
    return exponent + 2.8853900817779268 * s * sum; /* 2 / ln 2 */
}

double fct_exp2(double x) {
    double whole = floor(x + 0.5), t = (x - whole) * 0.69314718055994531, sum = 1;
    for (int i = 15; i > 0; --i) sum = 1 + t / i * sum;
    return ldexp(sum, (int)whole);
}

/* Newton's iteration. The start divides the exponent by n and is within 12 % of the root. */
double fct_root(double x, int n) {
    if (!(x > 0)) return 0;
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    bits = bits / (uint64_t)n + (uint64_t)(n - 1) * (0x3FF0000000000000u / (uint64_t)n);
    double y;
    memcpy(&y, &bits, sizeof y);
    for (int i = 0; i < 6; ++i) {
        double power = n == 3 ? y * y : y * y * (y * y);
        y -= (y - x / power) / n;
    }
    return y;
}
