/* cluster/shape/extents.h: extents of points along three axes. */
#ifndef FCT_CLUSTER_EXTENTS_H
#define FCT_CLUSTER_EXTENTS_H

#include <stddef.h>

#include "base/math/vec.h"
#include "base/variant.h"

typedef struct fct_points {
    const float *x, *y, *z;
} fct_points;

/* Least and greatest product of points with each of three axes. */
typedef struct fct_extents {
    double low[3], high[3];
} fct_extents;

static inline fct_extents fct_extents_none(void) {
    return (fct_extents){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

/* Widens the extents to points [begin, end). */
#define fct_extents_add FCT_KERNEL(fct_extents_add)
FCT_DECLARE_KERNEL(void, fct_extents_add,
                   (fct_extents * extents, fct_points points, size_t begin, size_t end,
                    const float axes[3][3]));

#endif
