/* cluster/shape/octet.h: eight clusters described side by side, a lane each. */
#ifndef FCT_CLUSTER_OCTET_H
#define FCT_CLUSTER_OCTET_H

#include <stdint.h>

#include "base/variant.h"
#include "cluster/shape/sums.h"
#include "facetree/cluster.h"

/* What is written of a cluster: its record's words up to the box, turned on their side. */
enum { FCT_OCTET_WORDS = 28 };
typedef struct fct_octet {
    float words[FCT_OCTET_WORDS][8];
    double frame[3][3][8]; /* u, v, normal: by coordinate and lane */
    float shrink[8];       /* one over about the cluster's radius */
} fct_octet;

/* A point of each cluster. A cluster with fewer points than others repeats its own. */
typedef struct fct_octet_row {
    float x[8], y[8], z[8];
} fct_octet_row;

/* One point for all of them. */
static inline void fct_octet_row_fill(fct_octet_row *row, const float point[3]) {
    for (int i = 0; i < 8; ++i) row->x[i] = point[0], row->y[i] = point[1], row->z[i] = point[2];
}

/* The unit normals of each cluster: `counts` of `normals`, rows of four floats, from row `firsts` on. */
typedef struct fct_octet_normals {
    const float *normals;
    uint32_t firsts[8], counts[8];
} fct_octet_normals;

/* Area, moment, centroid, plane and frame. */
#define fct_octet_sum FCT_KERNEL(fct_octet_sum)
FCT_DECLARE_KERNEL(void, fct_octet_sum, (fct_octet * octet, const fct_sums *const sums[8]));
/* The cone, after the sums. */
#define fct_octet_cone FCT_KERNEL(fct_octet_cone)
FCT_DECLARE_KERNEL(void, fct_octet_cone, (fct_octet * octet, const fct_octet_normals *normals));
/* The rotation of the frame, which is turned about its normal so that the box of at most 64 of the points has
 * the least area. */
#define fct_octet_turn FCT_KERNEL(fct_octet_turn)
FCT_DECLARE_KERNEL(void, fct_octet_turn, (fct_octet * octet, const fct_octet_row *points, uint32_t count));
/* The box for the rotation. Where it would leave the range of a float it is that of the world's axes. */
#define fct_octet_fit FCT_KERNEL(fct_octet_fit)
FCT_DECLARE_KERNEL(void, fct_octet_fit, (fct_octet * octet, const fct_octet_row *points, uint32_t count));
/* Writes the words of a lane. */
#define fct_octet_store FCT_KERNEL(fct_octet_store)
FCT_DECLARE_KERNEL(void, fct_octet_store, (const fct_octet *octet, uint32_t lane, fct_cluster *out));
#define fct_octet_store_all FCT_KERNEL(fct_octet_store_all)
FCT_DECLARE_KERNEL(void, fct_octet_store_all, (const fct_octet *octet, fct_cluster *const out[8]));

#endif
