/* simplify/levels.c: see levels.h. The refit changes positions and attributes, so a level keeps those of the
 * contractions and restores them after its output. Cost of that: linear in points and wedges.
 */
#include "simplify/levels.h"

#include <string.h>

#include "simplify/contract.h"
#include "simplify/log.h"
#include "simplify/output.h"
#include "simplify/progressive/build.h"
#include "simplify/refit/refit.h"

/* The measured errors in the units of the input. */
static void report_fit(const fct_simplifier *s, const fct_fit *fit, fct_simplify_stats *stats) {
    stats->distance_rms = sqrt(fit->distance2) * s->extent;
    stats->distance_max = sqrt(fit->farthest2) * s->extent;
    double sums[CHANNEL_SOURCES] = {0};
    for (uint32_t i = 0; i < s->channel_count; ++i)
        sums[s->channels[i].source] += fit->channels2[i] / (s->channels[i].factor * s->channels[i].factor);
    stats->color_rms = sqrt(sums[CHANNEL_COLOR] / 3);
    stats->normal_rms = sqrt(sums[CHANNEL_NORMAL]);
    stats->texcoord_rms = sqrt(sums[CHANNEL_TEXCOORD]);
    stats->lost_area = fit->lost;
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

/* Refits and writes the mesh. keep: room for what the refit changes, which is then undone; NULL: the refit
 * stays. */
static fct_result write_refitted(fct_simplifier *s, fct_mesh *out, bool measure, fct_simplify_stats *stats,
                                 kept *keep) {
    double start = fct_seconds();
    fct_fit fit = {0};
    fct_result result = FCT_OK;
    bool changed = s->live_faces < s->face_count;
    if (keep) exchange(s, keep, false);
    if (changed) result = fct_simplify_refit(s, measure ? &fit : NULL);
    if (result == FCT_OK) result = fct_simplify_output(s, s->sorted.places, out);
    if (keep) exchange(s, keep, true);
    stats->seconds_refit = fct_seconds() - start;
    report_fit(s, &fit, stats);
    return result;
}

/* Contracts, refits and writes a level. */
static fct_result run_level(fct_simplifier *s, fct_mesh *out, bool measure, fct_simplify_stats *stats,
                            fct_progressive **progressive, kept *keep) {
    double start = fct_seconds();
    fct_result result = run_contractions(s, &stats->stopped_because, progressive);
    stats->seconds_contract = fct_seconds() - start;
    if (result == FCT_OK) result = write_refitted(s, out, measure, stats, keep);
    stats->faces_after = out->face_count;
    stats->max_cost = sqrt(s->max_error2) * s->extent;
    stats->pairs_found = s->edge_count - s->first_pair, stats->pairs_joined = s->pairs_joined;
    return result;
}

static fct_result allocate_kept(const fct_simplifier *s, kept *k) {
    const fct_array arrays[] = {FCT_ARRAY(k->positions, s->point_count),
                                FCT_ARRAY(k->sources, s->point_count),
                                FCT_ARRAY(k->attributes, (size_t)s->wedge_count * s->channel_count)};
    return fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "a copy of the positions");
}

static void release_kept(const fct_env *env, kept *k) {
    fct_release(env, k->positions);
    fct_release(env, k->sources);
    fct_release(env, k->attributes);
}

fct_result fct_simplify_write(fct_simplifier *s, fct_mesh *out, fct_simplify_stats *stats) {
    kept k;
    fct_simplify_stats unused;
    fct_result result = allocate_kept(s, &k);
    if (result != FCT_OK) return result;
    result = write_refitted(s, out, stats != NULL, stats ? stats : &unused, &k);
    release_kept(s->env, &k);
    return result;
}

fct_result fct_simplify_run(fct_simplifier *s, const fct_wanted *w, const fct_simplify_stats *start) {
    kept k = {0};
    bool several = w->count > 1;
    fct_result result = several ? allocate_kept(s, &k) : FCT_OK;
    for (uint32_t i = 0; i < w->count && result == FCT_OK; ++i) {
        fct_simplify_stats found = *start;
        s->own.target_faces = w->target_faces[i];
        result = run_level(s, &w->out[i], w->stats != NULL, &found, w->progressive, several ? &k : NULL);
        if (result == FCT_OK && w->stats) w->stats[i] = found;
    }
    release_kept(s->env, &k);
    return result;
}
