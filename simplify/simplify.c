/* simplify/simplify.c: the public functions without a handle: run the phases.
 *
 * 1. Sort the input along a curve (topology/curve.c).
 * 2. Create points, wedges, edges and quadrics (simplifier.c).
 * 3. For each level (levels.c):
 *    - contract edges until a stop (contract.c, sweep.c);
 *    - if asked for, build the progressive mesh of the log (log.c, progressive/build.c);
 *    - refit the remaining points (refit.c);
 *    - write the output mesh (output.c).
 */
#include "simplify/handle/handle.h"
#include "simplify/levels.h"
#include "simplify/options.h"

static fct_result simplify(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                           const fct_wanted *w) {
    double start = fct_seconds();
    fct_simplify_stats found = {.faces_before = mesh->face_count};
    fct_simplifier *s;
    for (uint32_t i = 0; i < w->count; ++i) w->out[i] = (fct_mesh){0};
    fct_result result = fct_simplify_check_size(env, def);
    if (result != FCT_OK) return result;
    fct_simplify_def first = *def;
    first.target_faces = w->target_faces[0];
    result = fct_handle_create(env, mesh, &first, &s);
    if (result != FCT_OK) return result;
    found.seconds_init = fct_seconds() - start;
    result = fct_simplify_run(s, w, &found);
    fct_simplifier_destroy(s);
    for (uint32_t i = 0; i < w->count && result != FCT_OK; ++i) fct_mesh_release(env, &w->out[i]);
    return result;
}

fct_result fct_simplify(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def, fct_mesh *out,
                        fct_simplify_stats *stats) {
    const fct_wanted w = {&def->target_faces, 1, out, stats, NULL};
    return simplify(env, mesh, def, &w);
}

fct_result fct_simplify_levels(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                               const uint32_t *target_faces, uint32_t count, fct_mesh *out,
                               fct_simplify_stats *stats) {
    const fct_wanted w = {target_faces, count, out, stats, NULL};
    for (uint32_t i = 0; i < count; ++i) out[i] = (fct_mesh){0};
    if (count == 0) return fct_fail(env, FCT_ERROR_DATA, "0 levels, expected at least 1");
    for (uint32_t i = 1; i < count; ++i)
        if (target_faces[i] >= target_faces[i - 1])
            return fct_fail(env, FCT_ERROR_DATA,
                            "level %u has %u faces, expected fewer than the %u of level %u", i + 1,
                            target_faces[i], target_faces[i - 1], i);
    return simplify(env, mesh, def, &w);
}

fct_result fct_simplify_progressive(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                                    fct_mesh *out, fct_simplify_stats *stats, fct_progressive **progressive) {
    *progressive = NULL;
    const fct_wanted w = {&def->target_faces, 1, out, stats, progressive};
    fct_result result = simplify(env, mesh, def, &w);
    if (result == FCT_OK) return FCT_OK;
    fct_progressive_destroy(*progressive);
    *progressive = NULL;
    return result;
}
