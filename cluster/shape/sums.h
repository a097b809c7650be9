/* cluster/shape/sums.h: sums over the surface of a cluster. */
#ifndef FCT_CLUSTER_SUMS_H
#define FCT_CLUSTER_SUMS_H

#include <stdint.h>

#include "base/math/vec.h"
#include "base/variant.h"

/* 20 doubles per cluster, so that four clusters transpose as 4 x 4 blocks. moment: D of (8.14), sum of A n
 * n^T. vector: -e of (8.14), sum of A n. center: b / c (8.3) and covariance: Z (8.10), both weighted by
 * `weight`; the covariance is about the centre. */
typedef struct fct_sums {
    double area, weight, moment[6], covariance[6];
    v3 vector, center;
} fct_sums;

/* The sums of four triangles. corners[k][i]: corner k of triangle i, a row of four floats x y z and any
 * fourth. normals[i]: the unit normal in such a row, NaN if the area is 0. */
#define fct_sums_four FCT_KERNEL(fct_sums_four)
FCT_DECLARE_KERNEL(void, fct_sums_four,
                   (const float *const corners[3][4], fct_sums *out, float (*normals)[4]));
#define fct_sums_face FCT_KERNEL(fct_sums_face)
FCT_DECLARE_KERNEL(void, fct_sums_face, (const float *positions, const uint32_t triangle[3], fct_sums *out));
#define fct_sums_join FCT_KERNEL(fct_sums_join)
FCT_DECLARE_KERNEL(void, fct_sums_join, (const fct_sums *a, const fct_sums *b, fct_sums *out));

#endif
