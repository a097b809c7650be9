/* mesh/color.h: sRGB bytes and linear light (IEC 61966-2-1). Byte -> linear -> byte is the identity. */
#ifndef FCT_MESH_COLOR_H
#define FCT_MESH_COLOR_H

#include <math.h>
#include <stdint.h>

static inline float fct_linear_from_srgb(double s) {
    return (float)(s <= .04045 ? s / 12.92 : pow((s + .055) / 1.055, 2.4));
}

/* Clamps to [0, 1] first. */
static inline uint8_t fct_srgb_byte(double linear) {
    double x = linear < 0 ? 0 : linear < 1 ? linear : 1;
    double s = x <= .0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - .055;
    return (uint8_t)(255 * s + .5);
}

#endif
