/* cluster/tree/build.c: fct_tree_build.
 *
 * 1. Join vertices of equal position (dual/weld.c), and sort the mesh, if its faces or vertices are in no
 * order (locality.c).
 * 2. Build the dual graph and contract it (section 8.2; cluster/merge).
 * 3. Number the nodes, place the faces, copy the mesh (order.c).
 * 4. Describe every node (describe/).
 */
#include "cluster/tree/build.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "base/pool.h"
#include "cluster/merge/graft.h"
#include "cluster/merge/greedy.h"
#include "cluster/merge/join.h"
#include "cluster/merge/rounds/rounds.h"
#include "cluster/tree/check/edges.h"
#include "cluster/tree/check/verify.h"
#include "cluster/tree/describe/describe.h"
#include "cluster/tree/locality.h"
#include "cluster/tree/order.h"
#include "facetree/dual.h"

fct_tree_def fct_tree_def_default(void) {
    return (fct_tree_def){.size = sizeof(fct_tree_def),
                          .method = FCT_CLUSTER_ROUNDS,
                          .cost = FCT_COST_INCREMENT,
                          .fit_measure = FCT_FIT_AREA,
                          .fit_weight = -1,
                          .direction_weight = -1,
                          .shape_weight = -1,
                          .root_count = 1,
                          .weld = true,
                          .max_cost = INFINITY};
}

/* Contracts edges under the lower limit of height, then under the higher one (cluster/merge/work.h). */
static fct_result contract_edges(fct_work *work, fct_cluster_method method, bool across) {
    work->steep = false;
    fct_result result =
        method == FCT_CLUSTER_ROUNDS ? fct_work_rounds(work, across) : fct_work_greedy(work, across);
    work->steep = true;
    return result == FCT_OK ? fct_work_greedy(work, across) : result;
}

static fct_result contract_mesh(fct_work *work, const fct_mesh *mesh, fct_cluster_method method) {
    fct_result result = FCT_OK;
    if (mesh->materials) result = contract_edges(work, method, false);
    work->phase_ends[0] = work->merge_count;
    if (result == FCT_OK) result = contract_edges(work, method, true);
    if (result == FCT_OK) result = fct_work_graft(work, mesh);
    return result;
}

/* Contracts the mesh. If the limit of height leaves neighbours unmerged (a hub with thousands of spikes),
 * starts again and merges by size. */
static fct_result make_parts(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def,
                             fct_work *work) {
    fct_result result = contract_mesh(work, mesh, def->method);
    if (result != FCT_OK || work->stranded == 0) return result;
    fct_work_release(work);
    result = fct_work_create(env, mesh, def, work);
    if (result != FCT_OK) return result;
    work->balanced = true;
    return contract_mesh(work, mesh, FCT_CLUSTER_GREEDY);
}

/* The options with the default weights filled in. */
static fct_tree_def resolve_def(const fct_tree_def *def, const fct_metric *metric) {
    fct_tree_def used = *def;
    used.fit_weight = metric->fit_weight;
    used.direction_weight = metric->direction_weight;
    used.shape_weight = metric->shape_weight;
    used.source = NULL;
    return used;
}

static fct_result copy_source(const fct_env *env, const fct_tree_def *def, fct_tree *tree) {
    tree->view.source_hash = def->source_hash;
    if (!def->source) return FCT_OK;
    size_t size = strlen(def->source) + 1;
    tree->source = fct_allocate(env, size, 1);
    if (!tree->source) return fct_fail_memory(env, "the tree");
    memcpy(tree->source, def->source, size);
    tree->view.source = tree->source;
    return FCT_OK;
}

/* Sets the counts of edges and components. The clusters that contraction along all edges leaves are the
 * components; otherwise the edges are counted anew. */
static fct_result take_counts(const fct_env *env, const fct_edge_counts *counts, bool complete,
                              fct_tree *tree) {
    fct_edge_counts all = *counts;
    fct_result result = complete ? FCT_OK : fct_tree_count_edges(env, &tree->view, FCT_EDGE_PORTION, &all);
    tree->view.boundary_edges = all.boundary, tree->view.nonmanifold_edges = all.nonmanifold;
    tree->view.component_count = all.components;
    return result;
}

/* Everything up to the face order. `env` allocates what the tree keeps, `pool` the rest. */
static fct_result build_links(const fct_env *env, const fct_env *pool, const fct_mesh *mesh,
                              const fct_tree_def *def, double *dual, fct_tree *tree) {
    fct_work work;
    fct_result result = fct_work_create(pool, mesh, def, &work);
    if (result != FCT_OK) return result;
    *dual = fct_seconds();
    result = make_parts(pool, mesh, def, &work);
    work.phase_ends[1] = work.merge_count;
    const fct_edge_counts counts = {work.boundary_edges, work.nonmanifold_edges,
                                    mesh->face_count - work.merge_count};
    const bool complete = work.stranded == 0 && (work.edge_count == 0 || !mesh->materials);
    if (result == FCT_OK) result = fct_work_join(&work, mesh);
    work.phase_ends[2] = work.merge_count;
    if (result == FCT_OK) {
        tree->view.def = resolve_def(def, &work.metric);
        result = fct_tree_order(&work, mesh, def, tree);
    }
    fct_work_release(&work);
    if (result == FCT_OK) result = copy_source(env, def, tree);
    if (result == FCT_OK) fct_tree_measure_bounds(tree);
    if (result == FCT_OK) result = take_counts(env, &counts, complete, tree);
    return result;
}

/* Replaces the triangles of welded vertices by those of the mesh. The vertices that others replace come last
 * in the tree's order, so `triangles` need not be in order of first use. */
static fct_result restore_triangles(const fct_env *env, const fct_mesh *mesh, fct_tree *tree) {
    uint32_t *numbers = fct_allocate(env, mesh->vertex_count, sizeof *numbers);
    if (!numbers) return fct_fail_memory(env, "the tree");
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) numbers[tree->vertex_ids[v]] = v;
    for (size_t place = 0; place < mesh->face_count; ++place)
        for (size_t k = 0; k < 3; ++k)
            tree->triangles[3 * place + k] = numbers[mesh->triangles[3 * (size_t)tree->face_ids[place] + k]];
    fct_release(env, numbers);
    return FCT_OK;
}

/* The contraction works in the memory that later holds the records, because the first touch of a page is slow
 * (docs/notes/clustering.md). */
static fct_result build_tree(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def,
                             fct_tree_stats *stats, fct_tree *tree) {
    double start = fct_seconds(), dual = start;
    fct_pool pool;
    tree->clusters = fct_allocate(env, mesh->face_count, sizeof *tree->clusters);
    if (!tree->clusters) return fct_fail_memory(env, "the tree");
    fct_pool_create(env, tree->clusters, (size_t)mesh->face_count * sizeof *tree->clusters, &pool);
    fct_weld weld = {0};
    fct_result result = def->weld ? fct_weld_build(&pool.env, mesh, &weld) : FCT_OK;
    const bool joined = weld.triangles != NULL;
    fct_mesh welded = *mesh;
    fct_local_mesh local = {0};
    if (joined) welded.triangles = weld.triangles;
    if (result == FCT_OK) result = fct_local_mesh_create(&pool.env, &welded, weld.joined, &local);
    if (result == FCT_OK) result = build_links(env, &pool.env, &local.mesh, def, &dual, tree);
    if (result == FCT_OK) fct_local_mesh_restore(env, &local, tree->face_ids, tree->vertex_ids);
    fct_local_mesh_release(&pool.env, &local);
    fct_weld_release(&pool.env, &weld);
    double contracted = fct_seconds();
    if (result == FCT_OK) result = fct_tree_describe(tree);
    if (result == FCT_OK && joined) result = restore_triangles(env, mesh, tree);
    if (result == FCT_OK) tree->view.inward = fct_tree_is_inward(&tree->view);
    if (stats) *stats = (fct_tree_stats){dual - start, contracted - dual, fct_seconds() - contracted};
    return result;
}

fct_result fct_tree_check_def(const fct_env *env, const fct_tree_def *def) {
    if (def->size != sizeof *def)
        return fct_fail(env, FCT_ERROR_DATA, "fct_tree_def has size %u, this library's is %zu", def->size,
                        sizeof *def);
    const double weights[3] = {def->fit_weight, def->direction_weight, def->shape_weight};
    for (int k = 0; k < 3; ++k)
        if (!(weights[k] <= 1e30))
            return fct_fail(env, FCT_ERROR_DATA, "a weight of %g, expected at most 1e30", weights[k]);
    if (isnan(def->max_cost)) return fct_fail(env, FCT_ERROR_DATA, "the largest cost is no number");
    return FCT_OK;
}

fct_result fct_tree_build(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def,
                          fct_tree_stats *stats, fct_tree **out) {
    *out = NULL;
    fct_tree_def options = def ? *def : fct_tree_def_default();
    fct_result result = fct_tree_check_def(env, &options);
    if (result != FCT_OK) return result;
    if (mesh->face_count == 0) return fct_fail(env, FCT_ERROR_DATA, "a mesh without faces has no tree");
    result = fct_mesh_validate(env, mesh);
    if (result != FCT_OK) return result;
    fct_tree *tree = fct_tree_new(env);
    if (!tree) return fct_fail_memory(env, "the tree");
    result = build_tree(env, mesh, &options, stats, tree);
#ifndef NDEBUG
    if (result == FCT_OK) result = fct_tree_verify_contents(env, tree);
    assert(result != FCT_ERROR_DATA);
#endif
    if (result == FCT_OK)
        *out = tree;
    else
        fct_tree_destroy(tree);
    return result;
}
