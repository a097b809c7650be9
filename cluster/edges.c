/* cluster/edges.c: what the dual graph of a tree's mesh says of it: edges with one face, with three or more,
 * and how many parts edges connect. O(F log F); a build knows all this already and only verifying asks. */
#include "cluster/tree.h"
#include "facetree/dual.h"

static uint32_t find_part(uint32_t *parents, uint32_t face) {
    while (parents[face] != face) face = parents[face] = parents[parents[face]];
    return face;
}

static uint32_t count_parts(const fct_dual *dual, uint32_t *parents) {
    uint32_t parts = dual->face_count;
    for (uint32_t f = 0; f < dual->face_count; ++f) parents[f] = f;
    for (size_t e = 0; e < dual->edge_count; ++e) {
        uint32_t a = find_part(parents, dual->edges[2 * e]), b = find_part(parents, dual->edges[2 * e + 1]);
        if (a == b) continue;
        parents[a < b ? b : a] = a < b ? a : b;
        --parts;
    }
    return parts;
}

fct_result fct_tree_count_edges(const fct_env *env, const fct_tree_view *view, fct_edge_counts *out) {
    const fct_mesh mesh = {.vertex_count = view->vertex_count,
                           .face_count = view->face_count,
                           .positions = (float *)view->positions,
                           .triangles = (uint32_t *)view->triangles};
    fct_dual dual;
    fct_result result = fct_dual_build(env, &mesh, &dual);
    if (result != FCT_OK) return result;
    uint32_t *parents = fct_allocate(env, view->face_count, sizeof *parents);
    if (parents)
        *out = (fct_edge_counts){dual.boundary_edges, dual.nonmanifold_edges, count_parts(&dual, parents)};
    else
        result = fct_fail_memory(env, "counting edges");
    fct_release(env, parents);
    fct_dual_release(env, &dual);
    return result;
}
