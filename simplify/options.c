/* simplify/options.c: see options.h. */
#include "simplify/options.h"

#include <math.h>

#include "base/env.h"

enum { MOST_PASSES = 100 };

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

/* Squares of weights, times those of coordinates, must be finite and not vanish. */
static bool is_weight(double value) {
    return value == 0 || (value >= 1e-12 && value <= 1e12);
}

fct_result fct_simplify_check_size(const fct_env *env, const fct_simplify_def *def) {
    if (def->size == sizeof *def) return FCT_OK;
    return fct_fail(env, FCT_ERROR_DATA,
                    "fct_simplify_def has size %u, expected %zu: fill it with fct_simplify_def_default",
                    def->size, sizeof *def);
}

fct_result fct_simplify_check(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def) {
    fct_result result = fct_simplify_check_size(env, def);
    if (result != FCT_OK) return result;
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
            return fct_fail(env, FCT_ERROR_DATA, "%s is %g, expected 0 or a number from 1e-12 to 1e12",
                            weights[i].name, weights[i].value);
    if (!(def->pair_distance >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "pair_distance is %g, expected at least 0", def->pair_distance);
    if (def->pair_distance > 0 && def->keep_topology)
        return fct_fail(env, FCT_ERROR_DATA,
                        "pair_distance is %g with keep_topology, expected one of them: pairs join bodies",
                        def->pair_distance);
    if ((unsigned)def->primitive > FCT_PRIMITIVE_FACE)
        return fct_fail(env, FCT_ERROR_DATA, "primitive is %d, expected a fct_primitive",
                        (int)def->primitive);
    if (def->pair_distance > 0 && def->primitive == FCT_PRIMITIVE_FACE)
        return fct_fail(env, FCT_ERROR_DATA,
                        "pair_distance is %g with contractions of faces, expected one of them",
                        def->pair_distance);
    if ((unsigned)def->placement > FCT_PLACE_SUBSET)
        return fct_fail(env, FCT_ERROR_DATA, "placement is %d, expected a fct_placement",
                        (int)def->placement);
    if ((unsigned)def->weighting > FCT_WEIGHT_UNIFORM)
        return fct_fail(env, FCT_ERROR_DATA, "weighting is %d, expected a fct_weighting",
                        (int)def->weighting);
    if (!(def->feature_threshold >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "feature_threshold is %g, expected at least 0",
                        def->feature_threshold);
    if (def->refit_passes > MOST_PASSES)
        return fct_fail(env, FCT_ERROR_DATA, "refit_passes is %u, expected at most %d", def->refit_passes,
                        MOST_PASSES);
    if (mesh->face_count > UINT32_MAX / 3)
        return fct_fail(env, FCT_ERROR_MEMORY, "%u faces, expected at most %u", mesh->face_count,
                        UINT32_MAX / 3);
    return fct_mesh_validate(env, mesh);
}
