/* mesh/color.h: sRGB and linear light (IEC 61966-2-1). Converting a byte to linear and back returns the byte.
 * The formulas also serve for values over 1.
 */
#ifndef FCT_MESH_COLOR_H
#define FCT_MESH_COLOR_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/math/elementary.h"

static inline float fct_linear_from_srgb(double s) {
    if (s <= .04045) return (float)(s / 12.92);
    double x = (s + .055) / 1.055, root = fct_root(x, 5);
    return (float)(x * x * (root * root)); /* x^2.4 */
}

static inline double fct_srgb_from_linear(double x) {
    if (x <= .0031308) return 12.92 * x;
    double power = sqrt(sqrt(fct_root(x * x * x * (x * x), 3))); /* x^(1/2.4) = x^(5/12) */
    return 1.055 * power - .055;
}

/* The range of the components of a file's float colours. Begin with zero. */
typedef struct fct_color_range {
    float lowest, highest;
    bool fraction; /* a component is no whole number */
} fct_color_range;

static inline void fct_color_range_add(fct_color_range *range, float component) {
    if (component < range->lowest) range->lowest = component;
    if (component > range->highest) range->highest = component;
    range->fraction = range->fraction || component != floorf(component);
}

/* Whether the components are sRGB from 0 to 255: all lie in that range, and one is over 1. A fraction below 2
 * is a bright float. */
static inline bool fct_color_range_is_bytes(const fct_color_range *range) {
    bool over = range->highest > 1 && (!range->fraction || range->highest >= 2);
    return over && range->highest <= 255 && range->lowest >= 0;
}

/* The nearest sRGB byte of a linear value, which is clamped to [0, 1]. */
static inline uint8_t fct_srgb_byte(double linear) {
    double x = linear < 0 ? 0 : linear < 1 ? linear : 1;
    return (uint8_t)(255 * fct_srgb_from_linear(x) + .5);
}

#endif
