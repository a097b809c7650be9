/* simplify/simplify.c: the public function: checks the input and runs the phases.
 *
 * 1. Create: points, wedges, edges and quadrics (simplifier.c).
 * 2. Contract edges until a stop (contract.c).
 * 3. Refit the remaining points (refit.c).
 * 4. Write the output mesh (output.c).
 */
#include "simplify/contract.h"
#include "simplify/output.h"
#include "simplify/refit.h"
#include "simplify/simplifier.h"

fct_simplify_def fct_simplify_def_default(void) {
    return (fct_simplify_def){
        .size = sizeof(fct_simplify_def),
        .max_error = INFINITY,
        .placement = FCT_PLACE_OPTIMAL,
        .color_weight = FCT_WEIGHT_AUTO,
        .texcoord_weight = .1,
        .normal_weight = .01,
        .boundary_weight = 3,
        .feature_threshold = .1,
        .regularization = 1e-9,
        .refit_passes = 2,
        .check_foldover = true,
    };
}

static bool is_weight(double value) {
    return value >= 0 && value < INFINITY;
}

static fct_result check_input(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def) {
    if (def->size != sizeof *def)
        return fct_fail(env, FCT_ERROR_DATA,
                        "fct_simplify_def has size %u, expected %zu: fill it with fct_simplify_def_default",
                        def->size, sizeof *def);
    if (!(def->max_error >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "max_error is %g, expected at least 0", def->max_error);
    const struct {
        const char *name;
        double value;
    } weights[] = {{"color_weight", def->color_weight},
                   {"texcoord_weight", def->texcoord_weight},
                   {"normal_weight", def->normal_weight},
                   {"boundary_weight", def->boundary_weight},
                   {"regularization", def->regularization}};
    for (size_t i = def->color_weight == FCT_WEIGHT_AUTO; i < sizeof weights / sizeof *weights; ++i)
        if (!is_weight(weights[i].value))
            return fct_fail(env, FCT_ERROR_DATA, "%s is %g, expected a finite number of at least 0",
                            weights[i].name, weights[i].value);
    if ((unsigned)def->weighting > FCT_WEIGHT_UNIFORM)
        return fct_fail(env, FCT_ERROR_DATA, "weighting is %d, expected a fct_weighting",
                        (int)def->weighting);
    if (!(def->feature_threshold >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "feature_threshold is %g, expected at least 0",
                        def->feature_threshold);
    if (mesh->face_count > UINT32_MAX / 3)
        return fct_fail(env, FCT_ERROR_MEMORY, "%u faces, expected at most %u", mesh->face_count,
                        UINT32_MAX / 3);
    return fct_mesh_validate(env, mesh);
}

fct_result fct_simplify(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def, fct_mesh *out,
                        fct_simplify_stats *stats) {
    *out = (fct_mesh){0};
    fct_result result = check_input(env, mesh, def);
    if (result != FCT_OK) return result;
    double start = fct_seconds();
    fct_simplifier *s;
    result = fct_simplifier_create(env, mesh, def, &s);
    if (result != FCT_OK) return result;
    double ready = fct_seconds();
    fct_stop stop;
    result = fct_simplify_contract(s, &stop);
    double contracted = fct_seconds();
    /* Subset placement promises vertices of the input, so nothing may move. */
    bool refit = s->live_faces < s->face_count && def->placement != FCT_PLACE_SUBSET && def->refit_passes > 0;
    if (result == FCT_OK && refit) result = fct_simplify_refit(s);
    if (result == FCT_OK) result = fct_simplify_output(s, out);
    if (result != FCT_OK) fct_mesh_release(env, out);
    if (result == FCT_OK && stats)
        *stats = (fct_simplify_stats){.faces_before = mesh->face_count,
                                      .faces_after = out->face_count,
                                      .stopped_because = stop,
                                      .max_cost = sqrt(s->max_error2) * s->extent,
                                      .seconds_init = ready - start,
                                      .seconds_contract = contracted - ready,
                                      .seconds_refit = fct_seconds() - contracted};
    fct_simplifier_destroy(s);
    return result;
}
