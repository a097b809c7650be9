/* cluster/octet.h: eight clusters described side by side, a lane each. */
#ifndef FCT_CLUSTER_OCTET_H
#define FCT_CLUSTER_OCTET_H

#include <stdint.h>

#include "cluster/sums.h"
#include "facetree/cluster.h"

/* What is written of a cluster: its record's words up to the box, turned on their side. */
enum { FCT_OCTET_WORDS = 28 };
typedef struct fct_octet {
    float words[FCT_OCTET_WORDS][8];
    double frame[3][3][8]; /* u, v, normal: by coordinate and lane */
    float shrink[8];       /* one over about the cluster's radius */
} fct_octet;

/* The points of each cluster: lists of where they are in `points`, rows of four floats, x y z and one more.
 * All lists are as long as the longest, shorter ones being filled up with points of their own. */
typedef struct fct_octet_points {
    const float *points;
    const uint32_t *lists[8];
    uint32_t counts[8], longest; /* at least 1 */
} fct_octet_points;

/* The unit normals of each cluster: `counts` of `normals`, rows of four floats, from row `firsts` on. */
typedef struct fct_octet_normals {
    const float *normals;
    uint32_t firsts[8], counts[8];
} fct_octet_normals;

/* Area, moment, centroid, plane and frame. */
void fct_octet_sum(fct_octet *octet, const fct_sums *const sums[8]);
/* The cone, after the sums. */
void fct_octet_cone(fct_octet *octet, const fct_octet_normals *normals);
/* The rotation of the frame, which is turned about its normal so that the box of at most 64 points has the
 * least area. */
void fct_octet_turn(fct_octet *octet, const fct_octet_points *points);
/* The box for the rotation. Where it would leave the range of a float it is that of the world's axes. */
void fct_octet_fit(fct_octet *octet, const fct_octet_points *points);
/* Writes the words of a lane. */
void fct_octet_store(const fct_octet *octet, uint32_t lane, fct_cluster *out);
void fct_octet_store_all(const fct_octet *octet, fct_cluster *const out[8]);

#endif
