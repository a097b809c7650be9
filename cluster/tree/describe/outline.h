/* cluster/tree/describe/outline.h: the blocks of a tree and the larger clusters above them.
 *
 *                  upper                 clusters of more than FCT_BLOCK faces, in preorder
 *                 /     \
 *            upper       block 2         subtrees of at most FCT_BLOCK faces, in order of places;
 *           /     \                      a block is also a single leaf
 *     block 0     block 1
 */
#ifndef FCT_CLUSTER_OUTLINE_H
#define FCT_CLUSTER_OUTLINE_H

#include "cluster/shape/sums.h"
#include "cluster/tree/tree.h"

enum {
    FCT_BLOCK = 1024, /* largest number of faces of a block: its points and sums stay in the cache */
    FCT_SPAN = 64     /* places per entry of `introduced` */
};

/* A cluster of more than FCT_BLOCK faces. */
typedef struct fct_upper {
    uint32_t id;
    uint32_t parts[2];    /* children: index of an upper cluster, or FCT_IS_BLOCK | index of a block */
    uint32_t first_block; /* its blocks are [first_block, first_block + block_count) */
    uint32_t block_count;
    float rotation[4]; /* of its principal frame */
    fct_sums sums;
} fct_upper;

#define FCT_IS_BLOCK 0x80000000u

/* A cone around all normals of a block; the axis is 0 where S is 0. */
typedef struct fct_cap {
    float axis[3], angle;
} fct_cap;

typedef struct fct_outline {
    fct_upper *upper;
    uint32_t upper_count;
    uint32_t *blocks, block_count; /* node ids of the roots of blocks */
    fct_sums *sums;                /* per block */
    fct_cap *caps;                 /* per block */
    uint32_t *introduced;          /* per FCT_SPAN places: the number of vertices that earlier faces use */
} fct_outline;

/* Lists upper clusters and blocks of a tree that has links; sums, caps and rotations stay unset. On failure
 * *out needs no release. Errors: MEMORY. */
fct_result fct_outline_create(const fct_env *env, const fct_tree *tree, fct_outline *out);
void fct_outline_release(const fct_env *env, fct_outline *outline);

/* The number of vertices that faces before a place use. Vertices are in order of first use, so these are the
 * vertices below that number. O(FCT_SPAN). */
uint32_t fct_vertices_before(const fct_tree *tree, const fct_outline *outline, size_t place);

#endif
