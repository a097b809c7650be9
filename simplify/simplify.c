/* simplify/simplify.c: the public function: checks the input and runs the phases.
 *
 * 1. Sort the input along a curve (topology/curve.c).
 * 2. Create points, wedges, edges and quadrics (simplifier.c).
 * 3. Contract edges until a stop (contract.c, sweep.c).
 * 4. If asked for, build the progressive mesh of the log (log.c, progressive/build.c).
 * 5. Refit the remaining points (refit.c).
 * 6. Write the output mesh (output.c).
 */
#include "simplify/contract.h"
#include "simplify/log.h"
#include "simplify/output.h"
#include "simplify/progressive/build.h"
#include "simplify/refit/refit.h"
#include "simplify/simplifier.h"
#include "simplify/topology/curve.h"

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
            return fct_fail(env, FCT_ERROR_DATA, "%s is %g, expected 0 or a number from 1e-12 to 1e12",
                            weights[i].name, weights[i].value);
    if (!(def->pair_distance >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "pair_distance is %g, expected at least 0", def->pair_distance);
    if (def->pair_distance > 0 && def->keep_topology)
        return fct_fail(env, FCT_ERROR_DATA,
                        "pair_distance is %g with keep_topology, expected one of them: pairs join bodies",
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
    if (mesh->face_count > UINT32_MAX / 3)
        return fct_fail(env, FCT_ERROR_MEMORY, "%u faces, expected at most %u", mesh->face_count,
                        UINT32_MAX / 3);
    return fct_mesh_validate(env, mesh);
}

/* The measured errors in the units of the input. */
static void report_fit(const fct_simplifier *s, const fct_fit *fit, fct_simplify_stats *stats) {
    stats->distance_rms = sqrt(fit->distance2) * s->extent;
    stats->distance_max = sqrt(fit->farthest2) * s->extent;
    double sums[3] = {0};
    for (uint32_t i = 0; i < s->channel_count; ++i)
        sums[s->channels[i].source] += fit->channels2[i] / (s->channels[i].factor * s->channels[i].factor);
    stats->color_rms = sqrt(sums[CHANNEL_COLOR] / 3);
    stats->normal_rms = sqrt(sums[CHANNEL_NORMAL]);
    stats->texcoord_rms = sqrt(sums[CHANNEL_TEXCOORD]);
}

/* Contracts a mesh, and builds its progressive mesh if that is not NULL. */
static fct_result run_contractions(fct_simplifier *s, fct_stop *stop, fct_progressive **progressive) {
    fct_result result = progressive ? fct_log_create(s) : FCT_OK;
    if (result == FCT_OK) result = fct_simplify_contract(s, stop);
    if (result == FCT_OK && progressive) result = fct_progressive_build(s, progressive);
    fct_log_destroy(s->env, s->log);
    s->log = NULL;
    return result;
}

/* What the refit changes. */
typedef struct kept {
    v3 *positions;
    uint32_t *sources;
    double *attributes;
} kept;

static void exchange(fct_simplifier *s, kept *k, bool restore) {
    for (uint32_t p = 0; p < s->point_count; ++p) {
        fct_point *point = point_at(s, p);
        if (restore)
            point->at = k->positions[p], point->source = k->sources[p];
        else
            k->positions[p] = point->at, k->sources[p] = point->source;
    }
    size_t bytes = (size_t)s->wedge_count * s->channel_count * sizeof(double);
    if (s->channel_count)
        memcpy(restore ? s->attributes : k->attributes, restore ? k->attributes : s->attributes, bytes);
}

/* Contracts, refits and writes a sorted mesh. keep: room for what the refit changes, which is then undone;
 * NULL: the refit stays. */
static fct_result run_simplifier(fct_simplifier *s, const uint32_t *places, fct_mesh *out, bool measure,
                                 fct_simplify_stats *stats, fct_progressive **progressive, kept *keep) {
    double start = fct_seconds();
    fct_fit fit = {0};
    fct_result result = run_contractions(s, &stats->stopped_because, progressive);
    double contracted = fct_seconds();
    stats->seconds_contract = contracted - start;
    bool changed = s->live_faces < s->face_count;
    if (result == FCT_OK && keep) exchange(s, keep, false);
    if (result == FCT_OK && changed) result = fct_simplify_refit(s, measure ? &fit : NULL);
    if (result == FCT_OK) result = fct_simplify_output(s, places, out);
    if (result == FCT_OK && keep) exchange(s, keep, true);
    stats->seconds_refit = fct_seconds() - contracted;
    stats->faces_after = out->face_count;
    stats->max_cost = sqrt(s->max_error2) * s->extent;
    stats->pairs_found = s->edge_count - s->first_pair, stats->pairs_joined = s->pairs_joined;
    report_fit(s, &fit, stats);
    return result;
}

/* The results that one run makes. */
typedef struct wanted {
    const uint32_t *target_faces;
    uint32_t count;
    fct_mesh *out;
    fct_simplify_stats *stats;     /* may be NULL */
    fct_progressive **progressive; /* NULL: none; only with one result */
} wanted;

/* Each level begins where the contractions of the level before ended, without its refit. */
static fct_result run_levels(fct_simplifier *s, fct_simplify_def *def, const uint32_t *places,
                             const wanted *w, const fct_simplify_stats *start) {
    kept k;
    bool several = w->count > 1;
    const fct_array arrays[] = {
        FCT_ARRAY_IF(several, k.positions, s->point_count), FCT_ARRAY_IF(several, k.sources, s->point_count),
        FCT_ARRAY_IF(several, k.attributes, (size_t)s->wedge_count * s->channel_count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "levels");
    for (uint32_t i = 0; i < w->count && result == FCT_OK; ++i) {
        fct_simplify_stats found = *start;
        def->target_faces = w->target_faces[i];
        result = run_simplifier(s, places, &w->out[i], w->stats != NULL, &found, w->progressive,
                                several ? &k : NULL);
        if (result == FCT_OK && w->stats) w->stats[i] = found;
    }
    fct_release_all(s->env, arrays, FCT_LENGTH(arrays));
    return result;
}

static fct_result simplify(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                           const wanted *w) {
    for (uint32_t i = 0; i < w->count; ++i) w->out[i] = (fct_mesh){0};
    fct_result result = check_input(env, mesh, def);
    if (result != FCT_OK) return result;
    double start = fct_seconds();
    fct_simplify_stats found = {.faces_before = mesh->face_count};
    fct_sorted sorted;
    result = fct_simplify_sort(env, mesh, def->locks, &sorted);
    if (result != FCT_OK) return result;
    fct_simplify_def own = *def;
    own.locks = sorted.locks;
    own.target_faces = w->target_faces[0];
    fct_simplifier *s;
    result = fct_simplifier_create(env, &sorted.mesh, &own, &s);
    found.seconds_init = fct_seconds() - start;
    if (result == FCT_OK) result = run_levels(s, &own, sorted.places, w, &found);
    fct_simplifier_destroy(s);
    fct_simplify_release_sorted(env, &sorted);
    for (uint32_t i = 0; i < w->count && result != FCT_OK; ++i) fct_mesh_release(env, &w->out[i]);
    return result;
}

fct_result fct_simplify(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def, fct_mesh *out,
                        fct_simplify_stats *stats) {
    const wanted w = {&def->target_faces, 1, out, stats, NULL};
    return simplify(env, mesh, def, &w);
}

fct_result fct_simplify_levels(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                               const uint32_t *target_faces, uint32_t count, fct_mesh *out,
                               fct_simplify_stats *stats) {
    const wanted w = {target_faces, count, out, stats, NULL};
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
    const wanted w = {&def->target_faces, 1, out, stats, progressive};
    fct_result result = simplify(env, mesh, def, &w);
    if (result == FCT_OK) return FCT_OK;
    fct_progressive_destroy(*progressive);
    *progressive = NULL;
    return result;
}
