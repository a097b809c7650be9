/* simplify/handle/handle.c: creates the handle (facetree/simplifier.h), and writes its mesh. */
#include "simplify/handle/handle.h"

#include "mesh/mesh.h"
#include "simplify/contract.h"
#include "simplify/handle/history.h"
#include "simplify/levels.h"
#include "simplify/options.h"
#include "simplify/simplifier.h"
#include "simplify/topology/pinch.h"

fct_result fct_handle_open(const fct_env *env, const fct_simplify_def *def, fct_simplifier **out) {
    fct_simplifier *s = fct_allocate_zero(env, 1, sizeof *s);
    *out = NULL;
    if (!s) return fct_fail_memory(env, "the simplifier");
    s->env = env, s->mesh = &s->sorted.mesh, s->def = &s->own;
    s->own = s->given = *def;
    s->last_error = INFINITY;
    s->history = fct_allocate_zero(env, 1, sizeof *s->history);
    if (s->history) {
        *out = s;
        return FCT_OK;
    }
    fct_simplifier_destroy(s);
    return fct_fail_memory(env, "the simplifier");
}

/* Sorts the mesh; the copy owns the names of its materials. */
static fct_result copy_sorted(fct_simplifier *s, const fct_mesh *mesh) {
    fct_result result = fct_simplify_sort(s->env, mesh, s->given.locks, &s->sorted);
    if (result != FCT_OK) return result;
    s->sorted.mesh.material_names = NULL;
    if (!s->given.keep_topology) result = fct_simplify_split_pinches(s->env, &s->sorted);
    if (result != FCT_OK) return result;
    s->own.locks = s->sorted.locks;
    s->given.locks = NULL;
    return fct_names_copy(s->env, mesh->material_names, mesh->material_count, &s->sorted.mesh.material_names);
}

fct_result fct_handle_create(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                             fct_simplifier **out) {
    *out = NULL;
    fct_simplifier *s;
    fct_result result = fct_simplify_check(env, mesh, def);
    if (result == FCT_OK) result = fct_handle_open(env, def, &s);
    if (result != FCT_OK) return result;
    result = copy_sorted(s, mesh);
    if (result == FCT_OK) result = fct_simplifier_fill(s);
    if (result == FCT_OK)
        *out = s;
    else
        fct_simplifier_destroy(s);
    return result;
}

fct_result fct_simplifier_create(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                                 fct_simplifier **out) {
    *out = NULL;
    fct_result result = fct_simplify_check_size(env, def);
    if (result != FCT_OK) return result;
    if (def->pair_distance > 0)
        return fct_fail(env, FCT_ERROR_DATA, "pair_distance is %g: a state holds no pairs, expected 0",
                        def->pair_distance);
    return fct_handle_create(env, mesh, def, out);
}

uint32_t fct_simplifier_faces(const fct_simplifier *s) {
    return s->live_faces;
}

uint32_t fct_simplifier_input_faces(const fct_simplifier *s) {
    return s->mesh->face_count;
}

/* A larger max_error allows edges again that were too expensive. */
static void allow_edges(fct_simplifier *s) {
    for (uint32_t e = 0; e < s->edge_count; ++e)
        if (s->edges[e].state == EDGE_OVER_BOUND)
            s->edges[e].state = EDGE_QUEUED, s->edges[e].ends_only = false;
}

fct_result fct_handle_contract(fct_simplifier *s, uint32_t target_faces, double max_error, fct_stop *stop) {
    fct_result result = fct_simplifier_scratch(s);
    if (result != FCT_OK) return result;
    if (max_error > s->last_error) allow_edges(s);
    s->own.target_faces = target_faces, s->own.max_error = s->last_error = max_error;
    return fct_simplify_contract(s, stop);
}

fct_result fct_simplifier_mesh(fct_simplifier *s, bool refit, fct_mesh *out, fct_simplify_stats *stats) {
    fct_simplify_stats found = {0};
    *out = (fct_mesh){0};
    if (!refit) s->own.refit_passes = 0;
    fct_result result = fct_simplify_write(s, out, stats ? &found : NULL);
    s->own.refit_passes = s->given.refit_passes;
    if (result != FCT_OK) {
        fct_mesh_release(s->env, out);
        return result;
    }
    if (!stats) return FCT_OK;
    found.faces_before = s->mesh->face_count, found.faces_after = out->face_count;
    found.stopped_because = stats->stopped_because;
    found.max_cost = sqrt(s->max_error2) * s->extent;
    found.seconds_init = stats->seconds_init, found.seconds_contract = stats->seconds_contract;
    *stats = found;
    return FCT_OK;
}
