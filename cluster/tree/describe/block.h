/* cluster/tree/describe/block.h: records of all nodes of a block. */
#ifndef FCT_CLUSTER_BLOCK_H
#define FCT_CLUSTER_BLOCK_H

#include "base/variant.h"
#include "cluster/shape/octet.h"
#include "cluster/tree/describe/outline.h"

enum { FCT_BLOCK_CORNERS = 3 * FCT_BLOCK, FCT_BLOCK_SLOTS = 4096 };

/* Room for one block, 0.9 MB; one per thread. Vertices have numbers within the block: first those that
 * the block is the first to use (a run of the tree's order), then the older ones. */
typedef struct fct_block_scratch {
    uint32_t order[FCT_BLOCK]; /* ids of the inner nodes, level by level */
    fct_node_link links[FCT_BLOCK];
    const fct_sums *parts[FCT_BLOCK][2]; /* sums of the two children */
    fct_sums leaves[FCT_BLOCK + 4], nodes[FCT_BLOCK];
    float points[4 * FCT_BLOCK_CORNERS]; /* rows x, y, z, 0 by number of vertex */
    float normals[FCT_BLOCK + 4][4];
    uint32_t at[FCT_BLOCK_CORNERS + 8];     /* per corner: index of its point in `points` */
    uint32_t before[FCT_BLOCK_CORNERS + 8]; /* per corner: 1 + the previous corner at its vertex, or 0 */
    uint32_t last[FCT_BLOCK_CORNERS];       /* per vertex: 1 + its latest corner so far, or 0 */
    uint32_t old[FCT_BLOCK_CORNERS];        /* per number: the id of an older vertex */
    uint16_t slots[FCT_BLOCK_SLOTS]; /* hash table of the numbers of older vertices; UINT16_MAX: free */
    uint16_t by_size[FCT_BLOCK];     /* nodes, largest first */
    uint32_t lists[8][FCT_BLOCK_CORNERS + 8]; /* of eight nodes: indices of their points */
    fct_octet_row rows[FCT_BLOCK_CORNERS];    /* the points of eight nodes, a lane each */
} fct_block_scratch;

/* Writes the records of the block's inner nodes, and its sums and cap in the outline. */
#define fct_block_describe FCT_KERNEL(fct_block_describe)
FCT_DECLARE_KERNEL(void, fct_block_describe,
                   (const fct_tree *tree, fct_outline *outline, size_t block, fct_block_scratch *scratch));

#endif
