/* cluster/merge/mean.h: the dissertation's cost of a merge (8.18), the reference, in double throughout. */
#ifndef FCT_CLUSTER_MEAN_H
#define FCT_CLUSTER_MEAN_H

#include "cluster/merge/metric.h"

/* The sums of a cluster that the cost MEAN needs, in the unit model. */
typedef struct fct_mean_record {
    double covariance[6]; /* Z (8.6) about the centroid: over corners, or integrated over the surface */
    v3 centroid;          /* of the same measure: b / c (8.3) */
    double weight;        /* k of (8.1): the number of corners, or the area */
    double moment[6];     /* sum w_i D_i (8.14) */
    v3 vector;            /* sum w_i n_i, which is minus sum w_i e_i (8.14) */
    double area;          /* w of (8.12) */
    double perimeter;     /* rho of (8.16) */
} fct_mean_record;

void fct_mean_face(const fct_metric *metric, const float *positions, const uint32_t triangle[3],
                   fct_mean_record *out);

/* The length in double of the border between two faces of the dual graph, whose rounded length is
 * `rounded`. */
double fct_mean_border(const fct_metric *metric, const float *positions, const uint32_t a[3],
                       const uint32_t b[3], float rounded);

/* The cost of merging two clusters that share a border of length `shared`. Never NaN. */
double fct_mean_cost(const fct_metric *metric, const fct_mean_record *a, const fct_mean_record *b,
                     double shared);

/* Turns *a into the record of the union. */
void fct_mean_merge(fct_mean_record *a, const fct_mean_record *b, double shared);

#endif
