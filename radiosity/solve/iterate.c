/* radiosity/solve/iterate.c: see iterate.h. */
#include "radiosity/solve/iterate.h"

typedef struct sweep {
    const fct_sweep_def *def;
    double *changes, *norms; /* per chunk */
} sweep;

static void gather_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    sweep *s = user;
    (void)thread;
    fct_change sum = {0, 0};
    s->def->gather(s->def->user, begin, end, &sum);
    s->changes[chunk] = sum.change2;
    s->norms[chunk] = sum.norm2;
}

static double largest_reflectance(const fct_scene_view *view) {
    double most = 0;
    for (uint32_t k = 0; k < view->material_count; ++k)
        for (int c = 0; c < 3; ++c) most = fct_max(most, view->materials[k].reflectance[c]);
    return most;
}

fct_result fct_iterate(const fct_elements *set, const fct_sweep_def *def, fct_sweep_result *out) {
    size_t chunks = fct_chunk_count(def->count, def->grain);
    *out = (fct_sweep_result){.change = 1};
    double *sums = fct_allocate(set->env, 2 * chunks, sizeof *sums);
    if (!sums) return fct_fail_memory(set->env, "the iteration");
    double rho = largest_reflectance(&set->view);
    double bound = rho > 0 ? def->tolerance * (1 - rho) / rho : HUGE_VAL;
    sweep s = {.def = def, .changes = sums, .norms = sums + chunks};
    fct_result result = FCT_OK;
    while (out->sweeps < def->most && !out->converged && result == FCT_OK) {
        fct_parallel_for(set->env, def->count, def->grain, gather_chunk, &s);
        def->publish(def->user);
        double norm = fct_sum(s.norms, chunks);
        out->change = norm > 0 ? sqrt(fct_sum(s.changes, chunks) / norm) : 0;
        out->converged = out->change <= bound;
        if (!out->converged && def->phase)
            result = fct_progress(set->env, def->phase, out->sweeps / (double)def->most);
        ++out->sweeps;
    }
    fct_release(set->env, sums);
    return result;
}
