/* base/math/eigen.h: eigenvalues and eigenvectors of symmetric 3x3 matrices, in closed form. */
#ifndef FCT_BASE_EIGEN_H
#define FCT_BASE_EIGEN_H

#include "base/math/vec.h"
#include "base/variant.h"
#ifdef FCT_KERNEL_FILE
#include "base/math/simd_d8.h"
#endif

/* m = xx xy xz yy yz zz. Ascending eigenvalues and unit eigenvectors, a right-handed frame, for any finite m,
 * whatever its scale.
 *
 * Equal eigenvalues: the vectors span the right space and are otherwise arbitrary, but a function of m alone.
 * A diagonal matrix, so zero and multiples of the identity too, gives the coordinate axes, those of equal
 * value in the order x, y, z. */
#define fct_eigen3 FCT_KERNEL(fct_eigen3)
FCT_DECLARE_KERNEL(void, fct_eigen3, (const double m[6], double values[3], v3 vectors[3]));

/* The same for eight matrices side by side. A lane's result does not depend on the other lanes. vectors[i][k]
 * is coordinate k of vector i. values may be NULL. For kernel files: d8 differs between the variants. */
#ifdef FCT_KERNEL_FILE
#define fct_eigen3_eight FCT_KERNEL(fct_eigen3_eight)
void fct_eigen3_eight(const d8 m[6], d8 values[3], d8 vectors[3][3]);
#endif

#endif
