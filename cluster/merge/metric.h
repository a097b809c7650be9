/* cluster/merge/metric.h: what merging two clusters costs.
 *
 * Everything is measured on the model moved to the origin and scaled to a bounding-box diagonal of 1. A
 * record holds sums over a cluster in floats, centred on the cluster's own centroid: the raw form A - b b^T /
 * c (8.11) loses its digits in floats, the centred one keeps them. Records are combined, never subtracted.
 */
#ifndef FCT_CLUSTER_METRIC_H
#define FCT_CLUSTER_METRIC_H

#include "base/math/vec.h"
#include "base/variant.h"
#include "facetree/cluster.h"

typedef struct fct_record {
    float covariance[6]; /* sum over the fit measure of (x - centroid)(x - centroid)^T */
    float centroid[3];   /* of the fit measure */
    uint32_t count;      /* of faces */
    float vector[3];     /* S = sum A_k n_k */
    float area;          /* sum A_k */
    float perimeter;
    float fit; /* area times the mean squared distance to the cluster's plane */
} fct_record;

/* What the direction error of the MEAN cost needs; in double, for its terms cancel (8.13). */
typedef struct fct_direction {
    double moment[6]; /* sum A_k n_k n_k^T */
    double vector[3], area;
} fct_direction;

typedef struct fct_metric {
    fct_cluster_cost cost;
    fct_fit_measure measure;
    float fit_weight, direction_weight, shape_weight;
    v3 origin;    /* of the unit model, in the mesh's coordinates */
    double scale; /* mesh unit to unit model */
} fct_metric;

/* Weights below zero in def become the defaults of its cost. */
#define fct_metric_make FCT_KERNEL(fct_metric_make)
FCT_DECLARE_KERNEL(fct_metric, fct_metric_make, (const fct_tree_def *def, const fct_bounds *bounds));

/* Two clusters, by their records' numbers, and the border they share (unit model). */
typedef struct fct_pair {
    uint32_t a, b;
    float shared;
} fct_pair;

enum { FCT_LANES = 8 }; /* pairs or triangles worked on at once */

/* The records of count <= FCT_LANES triangles; perimeters in the unit model. */
#define fct_metric_faces FCT_KERNEL(fct_metric_faces)
FCT_DECLARE_KERNEL(void, fct_metric_faces,
                   (const fct_metric *metric, const float *positions, const uint32_t *triangles,
                    const float *perimeters, uint32_t count, fct_record *records));
/* What MEAN needs of one triangle besides. */
#define fct_metric_direction FCT_KERNEL(fct_metric_direction)
FCT_DECLARE_KERNEL(void, fct_metric_direction,
                   (const fct_metric *metric, const float *positions, const uint32_t triangle[3],
                    fct_direction *direction));

/* Costs of merging count <= FCT_LANES pairs. The same for (a, b) as for (b, a) but for rounding. directions
 * only for MEAN. A NaN is never returned. */
#define fct_metric_costs FCT_KERNEL(fct_metric_costs)
FCT_DECLARE_KERNEL(void, fct_metric_costs,
                   (const fct_metric *metric, const fct_record *records, const fct_direction *directions,
                    const fct_pair *pairs, uint32_t count, float *costs));

/* In each of count <= FCT_LANES pairs of different clusters, a becomes the union. */
#define fct_metric_merges FCT_KERNEL(fct_metric_merges)
FCT_DECLARE_KERNEL(void, fct_metric_merges,
                   (const fct_metric *metric, fct_record *records, fct_direction *directions,
                    const fct_pair *pairs, uint32_t count));

#endif
