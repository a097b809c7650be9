/* simplify/simplifier.c: see simplifier.h. Cost: linear in the corners. */
#include "simplify/simplifier.h"

#include "simplify/cost/channels.h"
#include "simplify/cost/constraint.h"
#include "simplify/cost/fundamental.h"
#include "simplify/handle/history.h"
#include "simplify/log.h"
#include "simplify/pairs/candidates.h"
#include "simplify/topology/topology.h"

fct_result fct_simplifier_scratch(fct_simplifier *s) {
    uint32_t count = fct_env_threads(s->env);
    if (count <= s->scratch_count) return FCT_OK;
    fct_scratch *more = fct_allocate(s->env, count, sizeof *more);
    if (!more) return fct_fail_memory(s->env, "scratch of threads");
    fct_release(s->env, s->scratches);
    s->scratches = more, s->scratch_count = count;
    use_scratch(s, s->scratches);
    return FCT_OK;
}

fct_result fct_simplifier_fill(fct_simplifier *s) {
    fct_simplify_channels(s);
    fct_result result = fct_simplify_topology(s);
    if (result == FCT_OK) result = fct_simplify_attributes(s);
    if (result == FCT_OK) result = fct_simplify_quadrics(s);
    if (result == FCT_OK) result = fct_simplify_constraints(s);
    if (result == FCT_OK) result = fct_simplify_pairs(s);
    if (result != FCT_OK) return result;
    s->refused = fct_allocate_zero(s->env, s->point_count, sizeof *s->refused);
    s->side_marks = fct_allocate_zero(s->env, s->point_count, sizeof *s->side_marks);
    if (!s->refused || !s->side_marks) return fct_fail_memory(s->env, "marks of points");
    result = fct_simplifier_scratch(s);
    if (result != FCT_OK) return result;
    if (!s->def->keep_topology) return FCT_OK;
    s->link_marks = fct_allocate_zero(s->env, s->point_count, sizeof *s->link_marks);
    return s->link_marks ? FCT_OK : fct_fail_memory(s->env, "marks of points");
}

void fct_simplifier_destroy(fct_simplifier *s) {
    if (!s) return;
    void *arrays[] = {s->point_of,
                      s->points,
                      s->point_parents,
                      s->first_wedges,
                      s->triangles,
                      s->next_corners,
                      s->side_edges,
                      s->corner_wedges,
                      s->edges,
                      s->edge_flags,
                      s->quadrics,
                      s->attributes,
                      s->wedge_parents,
                      s->next_wedges,
                      s->wedge_uses,
                      s->wedge_classes,
                      s->link_marks,
                      s->side_marks,
                      s->refused,
                      s->constraint_of,
                      s->constraints,
                      s->lines,
                      s->scratches,
                      s->paint,
                      s->weights,
                      s->pins,
                      s->marks,
                      s->sorted.places,
                      s->sorted.vertex_places,
                      s->sorted.locks,
                      s->sorted.copies,
                      s->first_pairs,
                      s->last_pairs,
                      s->next_pairs,
                      s->solids,
                      s->walled};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i) fct_release(s->env, arrays[i]);
    fct_log_destroy(s->env, s->log);
    fct_mesh_release(s->env, &s->sorted.mesh);
    fct_history_destroy(s->env, s->history);
    fct_release(s->env, s);
}

fct_result fct_simplifier_build(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                                fct_simplifier **out) {
    *out = NULL;
    fct_simplifier *s = fct_allocate_zero(env, 1, sizeof *s);
    if (!s) return fct_fail_memory(env, "the simplifier");
    s->env = env, s->mesh = mesh, s->def = def;
    fct_result result = fct_simplifier_fill(s);
    if (result == FCT_OK)
        *out = s;
    else
        fct_simplifier_destroy(s);
    return result;
}
