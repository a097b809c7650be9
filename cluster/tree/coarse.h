/* cluster/tree/coarse.h: a small tree in place of a large one: its upper nodes, over flat patches.
 *
 * The clusters of a cut become patches. A patch is the rectangle in the cluster's plane (cluster.h) that its
 * box covers, two triangles that face along the area vector. It is larger than the cluster's outline, so
 * neighbouring patches overlap; those of bent ground are shrunk (coarse.c), and few rays pass between them. A
 * cluster of one face keeps its triangle. The records of all clusters are those of the large tree, so areas,
 * moments and boxes are exact.
 */
#ifndef FCT_CLUSTER_COARSE_H
#define FCT_CLUSTER_COARSE_H

#include "cluster/tree/tree.h"

typedef struct fct_coarse {
    fct_tree *tree;     /* without colours and materials; valid for rays and for walks down from its roots */
    uint32_t top_count; /* inner nodes below this id are those of the large tree with the same id */
    uint32_t patch_count;
    uint32_t *nodes;   /* patch -> node of the large tree */
    uint32_t *patches; /* place -> patch; ascending */
    float *fill;       /* per patch: area of the cluster's outline over that of the rectangle, at most 1 */
    float *height;     /* per patch: half of the box's extent across the plane; 0 for a triangle */
    uint64_t touched_bytes; /* about: pages of 4 KiB of the large tree's records that were read; 0: no file */
    bool closed;            /* the large tree's mesh has no edge with one face, or with three or more */
} fct_coarse;

/* The coarse tree of the partition of `tree` into patch_count clusters, from root_count to face_count. Reads
 * and checks the nodes down to the cut and no others; `tree` may be unchecked. The result does not refer to
 * it. Errors: DATA (a damaged file), MEMORY. */
fct_result fct_tree_coarsen(const fct_env *env, const fct_tree *tree, uint32_t patch_count, fct_coarse *out);
void fct_coarse_release(const fct_env *env, fct_coarse *coarse);

/* The node of the large tree for a node of the coarse one; for a leaf, that of its patch. */
uint32_t fct_coarse_origin(const fct_coarse *coarse, uint32_t node);

#endif
