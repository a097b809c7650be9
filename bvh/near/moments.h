/* bvh/near/moments.h: the far field of the winding number: moments of the surface per child of a node.
 *
 * The winding number of a surface about q is the integral of n.(x - q) / (4 pi |x - q|^3) over its area.
 * About a centre c, with d = c - q, R = |d| and e = d / R (Barill, Dickson, Schmidt, Levin, Jacobson 2018, in
 * harmonic form: the kernel is a gradient of 1 / R, so only traceless symmetric tensors count):
 *
 *     4 pi w = N.e / R^2 - 3 Q(e, e) / R^3 + 15/2 S(e, e, e) / R^4 + ...
 *
 * N is the integral of n, and Q and S are the traceless symmetric parts of the integrals of n (x - c) and
 * n (x - c) (x - c).
 */
#ifndef FCT_BVH_MOMENTS_H
#define FCT_BVH_MOMENTS_H

#include "bvh/model.h"

/* Eight children, in scaled space. */
typedef struct fct_moment_node {
    float center[3][8];
    float radius2[8];       /* no vertex is farther from the centre, squared */
    float dipole[3][8];     /* N */
    float quadrupole[5][8]; /* Q: xx yy xy xz yz; zz = -xx - yy */
    float octupole[7][8];   /* S: xxx yyy xxy xyy xxz yyz xyz; the others follow from the three traces */
    uint32_t child[8];      /* a leaf's reference, or the number of a moment node */
    uint32_t present;       /* bit i: child i exists; absent children have no moments */
    uint32_t unused[7];
} fct_moment_node;

/* Fills bvh->moments and bvh->moment_bytes from the packed nodes. If the model is one leaf, there are no
 * moments. Errors: MEMORY. */
fct_result fct_moments_build(fct_bvh *bvh);

#endif
