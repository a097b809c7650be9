/* simplify/refit/measure.c: see measure.h. Chunks of samples are summed in parallel, and then in their order.
 */
#include "simplify/refit/measure.h"

#include "base/parallel.h"

enum { CHUNK = 4096 /* samples per parallel task */ };

typedef struct part {
    double distance2, farthest2, weight, channels2[SIMPLIFY_MAX_CHANNELS], channel_weight;
} part;

typedef struct measure {
    const fct_refit *r;
    part *parts; /* per chunk */
} measure;

static void add_channels(const fct_refit *r, size_t sample, const double b[3], part *out) {
    const fct_simplifier *s = r->s;
    const fct_landing *at = &r->landings[sample];
    double weight = r->samples[sample].weight;
    uint32_t corners[3] = {0}, count = find_sample_corners(r, sample, corners);
    out->channel_weight += weight;
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        double rest = 0;
        for (uint32_t k = 0; k < count; ++k) rest += find_input_value(s, &s->channels[i], corners[k]) / count;
        for (size_t k = 0; k < 3; ++k) {
            uint32_t w = s->wedge_parents[s->corner_wedges[3 * (size_t)at->face + k]];
            rest -= b[k] * s->attributes[(size_t)s->channel_count * w + i];
        }
        out->channels2[i] += weight * rest * rest;
    }
}

static void measure_samples(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    const measure *m = user;
    const fct_refit *r = m->r;
    const fct_simplifier *s = r->s;
    part *out = &m->parts[chunk];
    for (size_t i = begin; i < end; ++i) {
        const fct_landing *at = &r->landings[i];
        if (at->face == FCT_NONE) continue;
        v3 rest = r->samples[i].at;
        const double b[3] = {1 - (double)at->u - at->v, at->u, at->v};
        for (size_t k = 0; k < 3; ++k)
            rest = v3_mad(rest, -b[k], point_position(s, s->triangles[3 * (size_t)at->face + k]));
        double weight = r->samples[i].weight, distance2 = v3_norm2(rest);
        out->distance2 += weight * distance2, out->weight += weight;
        out->farthest2 = fct_max(out->farthest2, distance2);
        if (at->attributes) add_channels(r, i, b, out);
    }
}

fct_result fct_refit_measure(const fct_refit *r, size_t samples, fct_fit *out) {
    const fct_simplifier *s = r->s;
    size_t chunks = fct_chunk_count(samples, CHUNK);
    measure m = {r, fct_allocate_zero(s->env, chunks, sizeof *m.parts)};
    if (!m.parts) return fct_fail_memory(s->env, "the error of the result");
    fct_parallel_for(s->env, samples, CHUNK, measure_samples, &m);
    part all = {0};
    for (size_t c = 0; c < chunks; ++c) {
        const part *p = &m.parts[c];
        all.distance2 += p->distance2, all.weight += p->weight, all.channel_weight += p->channel_weight;
        all.farthest2 = fct_max(all.farthest2, p->farthest2);
        for (uint32_t i = 0; i < s->channel_count; ++i) all.channels2[i] += p->channels2[i];
    }
    fct_release(s->env, m.parts);
    *out =
        (fct_fit){.distance2 = all.weight > 0 ? all.distance2 / all.weight : 0, .farthest2 = all.farthest2};
    for (uint32_t i = 0; i < s->channel_count && all.channel_weight > 0; ++i)
        out->channels2[i] = all.channels2[i] / all.channel_weight;
    return FCT_OK;
}
