/* cluster/merge/metric.h: the default cost of a merge, INCREMENT, for many merges at once.
 *
 * All lengths are those of the unit model: the mesh, moved to the origin and scaled to a bounding-box
 * diagonal of 1. A record holds the sums of one cluster in floats. Its covariance is centred on the cluster's
 * centroid, because the raw form A - b b^T / c (8.11) loses its digits in floats. The records of two clusters
 * are added to that of their union; no record is ever subtracted.
 */
#ifndef FCT_CLUSTER_METRIC_H
#define FCT_CLUSTER_METRIC_H

#include "base/math/vec.h"
#include "base/variant.h"
#include "facetree/cluster.h"

typedef struct fct_record {
    float covariance[6]; /* Z (8.6) by the fit measure: xx xy xz yy yz zz */
    float centroid[3];   /* by the fit measure */
    uint32_t count;      /* of faces */
    float vector[3];     /* S = sum A_k n_k */
    float area;          /* sum A_k, w of (8.12) */
    float perimeter;     /* rho of (8.16) */
    float fit;           /* area times E_fit (8.1) for the best plane */
} fct_record;

/* The weights of the cost, and the map to the unit model. */
typedef struct fct_metric {
    fct_cluster_cost cost;
    fct_fit_measure measure;
    double fit_weight, direction_weight, shape_weight; /* a1, a2, a3 of (8.18) */
    v3 origin;                                         /* of the unit model, in the mesh's coordinates */
    double scale;                                      /* from mesh unit to unit model */
} fct_metric;

/* Two clusters, as places in an array of records, and the length of their common border. */
typedef struct fct_pair {
    uint32_t a, b;
    float shared;
} fct_pair;

enum { FCT_LANES = 8 }; /* pairs or triangles in one vector */

/* The records of count <= FCT_LANES triangles (count x 3 vertex ids, count perimeters). */
#define fct_metric_faces FCT_KERNEL(fct_metric_faces)
FCT_DECLARE_KERNEL(void, fct_metric_faces,
                   (const fct_metric *metric, const float *positions, const uint32_t *triangles,
                    const float *perimeters, uint32_t count, fct_record *records));

/* The INCREMENT costs of merges. The more in one call, the faster. Never NaN. Swapping a and b changes
 * rounding only. */
#define fct_metric_costs FCT_KERNEL(fct_metric_costs)
FCT_DECLARE_KERNEL(void, fct_metric_costs,
                   (const fct_metric *metric, const fct_record *records, const fct_pair *pairs,
                    uint32_t count, float *costs));

/* In each of count <= FCT_LANES pairs without a common cluster, record a becomes that of the union. */
#define fct_metric_merges FCT_KERNEL(fct_metric_merges)
FCT_DECLARE_KERNEL(void, fct_metric_merges,
                   (const fct_metric *metric, fct_record *records, const fct_pair *pairs, uint32_t count));

#endif
