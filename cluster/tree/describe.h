/* cluster/tree/describe.h: what the description of small clusters and that of large ones have in common. */
#ifndef FCT_CLUSTER_DESCRIBE_H
#define FCT_CLUSTER_DESCRIBE_H

#include "base/variant.h"
#include "cluster/shape/octet.h"
#include "cluster/tree/tree.h"

/* Faces of a cluster that is described at one go with all that is in it. */
enum { FCT_BLOCK = 1024, FCT_SPAN = 64 };

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

/* A cone of normals; the axis is 0 where there is none. */
typedef struct fct_cap {
    float axis[3], angle;
} fct_cap;

/* All of a tree: clusters above blocks in preorder, and blocks (subtrees' roots, single leaves too) by place.
 */
typedef struct fct_outline {
    fct_upper *upper;
    uint32_t upper_count;
    uint32_t *blocks, block_count; /* node ids */
    fct_sums *sums;                /* of blocks */
    fct_cap *caps;                 /* of blocks */
    uint32_t *introduced;          /* per FCT_SPAN places: vertices used by faces before them */
} fct_outline;

/* How many vertices are used by faces before a place; they are the first of the tree's order. */
#define fct_vertices_before FCT_KERNEL(fct_vertices_before)
FCT_DECLARE_KERNEL(uint32_t, fct_vertices_before,
                   (const fct_tree *tree, const fct_outline *outline, size_t place));

/* One cluster alone, which is in all lanes of the rows: all but cost and links. The normals are rows of four
 * floats. */
#define fct_points_describe FCT_KERNEL(fct_points_describe)
FCT_DECLARE_KERNEL(void, fct_points_describe,
                   (const fct_octet_row *points, uint32_t point_count, const float *normals,
                    uint32_t normal_count, const fct_sums *sums, fct_cluster *out));

/* Describes the upper clusters of a tree whose blocks are done. Errors: MEMORY, CANCELLED. */
#define fct_tree_describe_upper FCT_KERNEL(fct_tree_describe_upper)
FCT_DECLARE_KERNEL(fct_result, fct_tree_describe_upper, (fct_tree * tree, fct_outline *outline));

#endif
