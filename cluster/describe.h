/* cluster/describe.h: what the description of small clusters and that of large ones have in common. */
#ifndef FCT_CLUSTER_DESCRIBE_H
#define FCT_CLUSTER_DESCRIBE_H

#include "cluster/box.h"
#include "cluster/tree.h"

enum { FCT_BLOCK = 512 }; /* faces of a cluster that is described at one go with all that is in it */

/* Sums over a cluster's surface; centre and covariance about it by `weight`. */
typedef struct fct_sums {
    double area, weight, moment[6], covariance[6];
    v3 vector, center;
} fct_sums;

/* A cluster of more than FCT_BLOCK faces. */
typedef struct fct_upper {
    uint32_t id;
    uint32_t parts[2];    /* children: index of an upper cluster, or FCT_IS_BLOCK + index of a block */
    uint32_t first_block; /* its blocks are consecutive */
    uint32_t block_count;
    float rotation[4]; /* of its own frame */
    fct_sums sums;
} fct_upper;

#define FCT_IS_BLOCK 0x80000000u

/* All of a tree: clusters above blocks in preorder, and blocks (subtrees' roots, single leaves too) by place.
 */
typedef struct fct_outline {
    fct_upper *upper;
    uint32_t upper_count;
    uint32_t *blocks, block_count; /* node ids */
    fct_sums *sums;                /* of blocks */
} fct_outline;

void fct_sums_face(const float *positions, const uint32_t triangle[3], fct_sums *out);
void fct_sums_join(const fct_sums *a, const fct_sums *b, fct_sums *out);

/* Writes area, moment, centroid and plane, from the eigenvectors of the covariance, which become the frame
 * (u, v, normal). Returns about the radius of the cluster, 1 where it has none. */
double fct_sums_store(const fct_sums *sums, v3 frame[3], fct_cluster *out);

/* All but cost and links, from the sums, corners and normals of faces [first, end) of a stream. */
void fct_faces_describe(fct_points corners, fct_points normals, const fct_sums *sums, size_t first,
                        size_t end, fct_cluster *out);

/* Describes the upper clusters of a tree whose blocks are done. Errors: MEMORY, CANCELLED. */
fct_result fct_tree_describe_upper(fct_tree *tree, fct_outline *outline);

#endif
