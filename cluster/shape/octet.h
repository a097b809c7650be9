/* cluster/shape/octet.h: describes eight clusters at once, one per lane. */
#ifndef FCT_CLUSTER_OCTET_H
#define FCT_CLUSTER_OCTET_H

#include <stdint.h>

#include "base/variant.h"
#include "cluster/shape/sums.h"
#include "facetree/cluster.h"

/* The words of fct_cluster before its cost. */
enum { FCT_OCTET_WORDS = 28 };
typedef struct fct_octet {
    float words[FCT_OCTET_WORDS][8];
    double frame[3][3][8]; /* axes u, v, normal; per coordinate and lane */
    float shrink[8];       /* 1 / radius of the cluster, roughly */
} fct_octet;

/* One point of each cluster. A cluster with fewer points than the others repeats some. */
typedef struct fct_octet_row {
    float x[8], y[8], z[8];
} fct_octet_row;

/* Sets all eight points. */
static inline void fct_octet_row_fill(fct_octet_row *row, const float point[3]) {
    for (int i = 0; i < 8; ++i) row->x[i] = point[0], row->y[i] = point[1], row->z[i] = point[2];
}

/* Cluster i has the unit normals in rows firsts[i] to firsts[i] + counts[i] - 1 of `normals` (rows of 4
 * floats). */
typedef struct fct_octet_normals {
    const float *normals;
    uint32_t firsts[8], counts[8];
} fct_octet_normals;

/* Sets area, area vector, moment, centroid, plane and frame. */
#define fct_octet_sum FCT_KERNEL(fct_octet_sum)
FCT_DECLARE_KERNEL(void, fct_octet_sum, (fct_octet * octet, const fct_sums *const sums[8]));
/* Sets the cone, after fct_octet_sum. */
#define fct_octet_cone FCT_KERNEL(fct_octet_cone)
FCT_DECLARE_KERNEL(void, fct_octet_cone, (fct_octet * octet, const fct_octet_normals *normals));
/* Sets the rotation: the frame, turned about its normal by the one of eight angles that gives the least box
 * area for at most 64 of the points. */
#define fct_octet_turn FCT_KERNEL(fct_octet_turn)
FCT_DECLARE_KERNEL(void, fct_octet_turn, (fct_octet * octet, const fct_octet_row *points, uint32_t count));
/* Sets the box for the rotation; with the world's axes if a number would leave the range of a float. */
#define fct_octet_fit FCT_KERNEL(fct_octet_fit)
FCT_DECLARE_KERNEL(void, fct_octet_fit, (fct_octet * octet, const fct_octet_row *points, uint32_t count));
/* Writes the words of one lane, or of all. */
#define fct_octet_store FCT_KERNEL(fct_octet_store)
FCT_DECLARE_KERNEL(void, fct_octet_store, (const fct_octet *octet, uint32_t lane, fct_cluster *out));
#define fct_octet_store_all FCT_KERNEL(fct_octet_store_all)
FCT_DECLARE_KERNEL(void, fct_octet_store_all, (const fct_octet *octet, fct_cluster *const out[8]));

#endif
