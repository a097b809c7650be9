/* cluster/merge/work.h: a clustering in progress: live clusters, the edges between them, and the merges so
 * far.
 *
 * A live cluster occupies the slot of one of its faces. Build ids: f < F is the leaf of face f, F + i is the
 * i-th merge. The children of a merge have smaller build ids than the merge.
 */
#ifndef FCT_CLUSTER_WORK_H
#define FCT_CLUSTER_WORK_H

#include "base/env.h"
#include "base/variant.h"
#include "cluster/merge/mean.h"
#include "dual/lists.h"

typedef fct_pair fct_edge; /* a, b: slots */

typedef struct fct_work {
    const fct_env *env;
    fct_metric metric;
    uint32_t face_count;
    /* per slot */
    fct_record *records;
    fct_mean_record *means;    /* MEAN only */
    uint8_t *heights;          /* of the subtree */
    uint32_t *nodes;           /* build id of the cluster; FCT_NONE: merged into another slot */
    bool steep;                /* heights may use the reserve (fct_height_limit) */
    bool balanced;             /* the greedy loop sorts by the union's faces first, then by cost */
    uint32_t stranded;         /* clusters with neighbours for which grafting found no place */
    const uint32_t *materials; /* of the face of the slot, or NULL */
    /* Per slot, or NULL. Nonzero: the cluster has neighbours in another part of the model, so it never
     * merges. A cluster whose cheapest partner is frozen becomes frozen too. */
    uint8_t *frozen;
    /* per merge, F - 1 of them */
    uint32_t (*children)[2]; /* build ids */
    float *costs;
    uint32_t merge_count;
    uint32_t phase_ends[3]; /* merges within materials, across materials, without a shared edge */
    /* live edges, lengths in the unit model: lists by face before the first contraction, then one array */
    fct_lists lists;
    double *entry_borders; /* MEAN only, per entry of the lists: the shared length */
    fct_edge *edges;
    double *borders; /* MEAN only, per edge: the shared length; NULL: that of the edge is all there is */
    uint32_t edge_count;
    uint32_t boundary_edges, nonmanifold_edges; /* of the mesh */
} fct_work;

/* The largest height of a cluster of n = `count` faces: 3 log2 n - 1, which keeps the joined tree within
 * 3 log2 F (join.c). If `mild`, also at most 2 log2 n + 8; the difference is the reserve. */
uint32_t fct_height_limit(uint32_t count, bool mild);

/* The metric of a build over a model with these bounds. Negative weights of def become the defaults of its
 * cost. */
fct_metric fct_metric_make(const fct_tree_def *def, const fct_bounds *bounds);

/* Records of all faces and the edges of the dual graph. Errors: MEMORY, CANCELLED. */
fct_result fct_work_create(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def, fct_work *out);
/* The same for a piece of a model with these bounds. */
fct_result fct_work_create_within(const fct_env *env, const fct_mesh *mesh, const fct_bounds *bounds,
                                  const fct_tree_def *def, fct_work *out);
void fct_work_release(fct_work *work);
/* Releases everything except the merges. */
void fct_work_release_clusters(fct_work *work);

/* Costs of merging pairs of slots. */
static inline void fct_work_costs(const fct_work *work, const fct_pair *pairs, uint32_t count, float *costs) {
    if (!work->means) {
        fct_metric_costs(&work->metric, work->records, pairs, count, costs);
        return;
    }
    for (uint32_t i = 0; i < count; ++i)
        costs[i] = (float)fct_mean_cost(&work->metric, &work->means[pairs[i].a], &work->means[pairs[i].b],
                                        (double)pairs[i].shared);
}
static inline float fct_work_cost(const fct_work *work, uint32_t a, uint32_t b, float shared) {
    float cost;
    fct_work_costs(work, &(fct_pair){a, b, shared}, 1, &cost);
    return cost;
}
enum { FCT_FREE_HEIGHT = 8 }; /* lower clusters may always merge */
/* Whether the union keeps the height limit. */
bool fct_work_allowed(const fct_work *work, uint32_t a, uint32_t b);
/* Merges the clusters of two slots; slot a holds the union. `shared`: the length of their border. */
void fct_work_merge(fct_work *work, uint32_t a, uint32_t b, double shared, float cost);
/* The same for count <= FCT_LANES pairs without a common slot, as merges number `merge` and on. Several
 * threads may call it; the caller increases merge_count. */
void fct_work_merges(fct_work *work, uint32_t merge, const fct_pair *pairs, const float *costs,
                     uint32_t count);

/* Turns lists, if any, into edges. Errors: MEMORY. */
fct_result fct_work_list_edges(fct_work *work);

#endif
