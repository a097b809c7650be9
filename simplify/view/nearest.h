/* simplify/view/nearest.h: the face of a ring that is nearest to a point. */
#ifndef FCT_SIMPLIFY_VIEW_NEAREST_H
#define FCT_SIMPLIFY_VIEW_NEAREST_H

#include <stdint.h>

#include "base/variant.h"

/* Eight faces: corners[corner][axis][face], scaled so that coordinates are about 1. */
typedef struct fct_octet {
    float corners[3][3][8];
} fct_octet;

/* The number of the nearest face of count octets; the lowest of equal ones. */
#define fct_view_nearest FCT_KERNEL(fct_view_nearest)
FCT_DECLARE_KERNEL(uint32_t, fct_view_nearest,
                   (const fct_octet *octets, uint32_t count, const float point[3]));

#endif
