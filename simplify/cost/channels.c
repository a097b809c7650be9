/* simplify/cost/channels.c: the attributes of a mesh as coordinates beside the position (Garland 1999, 5.2).
 *
 * Each attribute is scaled to about unit range and then by its weight. The range of colours is that of most
 * of them, from the 2nd to the 98th percentile but at least a twentieth of the whole: one lamp must not hide
 * the shadows on every wall. An attribute of weight 0 rides along without steering.
 */
#include "simplify/state.h"

#include <stdlib.h>

static const float *channel_values(const fct_mesh *mesh, const fct_channel *channel, size_t *count,
                                   uint32_t *stride) {
    *stride = channel->source == CHANNEL_TEXCOORD ? 2 : 3;
    *count = channel->source == CHANNEL_TEXCOORD ? 3 * (size_t)mesh->face_count : mesh->vertex_count;
    return channel->source == CHANNEL_COLOR    ? mesh->colors
           : channel->source == CHANNEL_NORMAL ? mesh->normals
                                               : mesh->texcoords;
}

static void add_channels(fct_simplifier *s, int source, uint32_t components, double factor) {
    for (uint32_t i = 0; i < components; ++i) {
        fct_channel *channel = &s->channels[s->channel_count++];
        *channel = (fct_channel){.component = i, .factor = factor, .lower = INFINITY, .upper = -INFINITY};
        channel->source = source;
        size_t count;
        uint32_t stride;
        const float *values = channel_values(s->mesh, channel, &count, &stride);
        for (size_t k = 0; k < count; ++k) {
            double value = factor * values[stride * k + i];
            channel->lower = fmin(channel->lower, value), channel->upper = fmax(channel->upper, value);
        }
        if (count == 0) channel->lower = channel->upper = 0;
    }
}

static void full_range(const float *values, size_t count, double *lower, double *upper) {
    *lower = INFINITY, *upper = -INFINITY;
    for (size_t i = 0; i < count; ++i) *lower = fmin(*lower, values[i]), *upper = fmax(*upper, values[i]);
    if (count == 0) *lower = *upper = 0;
}

/* The range from the 2nd to the 98th percentile, by a histogram over the full range's 1,024th parts. */
static double color_range(const float *values, size_t count) {
    enum { CELLS = 1024 };
    double lower, upper;
    full_range(values, count, &lower, &upper);
    double range = upper - lower;
    if (!(range > 0)) return 0;
    size_t cells[CELLS] = {0};
    for (size_t i = 0; i < count; ++i) {
        int cell = (int)((values[i] - lower) / range * CELLS);
        ++cells[cell < CELLS ? cell : CELLS - 1];
    }
    size_t below = 0, first = 0, last = CELLS;
    while (first < CELLS && (below + cells[first]) * 50 <= count) below += cells[first++];
    size_t above = 0;
    while (last > first && (above + cells[last - 1]) * 50 <= count) above += cells[--last];
    return range * fmax((double)(last - first) / CELLS, .05);
}

static double texcoord_range(const float *values, size_t corners) {
    double range = 0;
    for (size_t k = 0; k < 2; ++k) {
        double lower = INFINITY, upper = -INFINITY;
        for (size_t c = 0; c < corners; ++c)
            lower = fmin(lower, values[2 * c + k]), upper = fmax(upper, values[2 * c + k]);
        if (corners) range = fmax(range, upper - lower);
    }
    return range;
}

void fct_simplify_channels(fct_simplifier *s) {
    const fct_mesh *mesh = s->mesh;
    const fct_simplify_def *def = s->def;
    for (int steering = 1; steering >= 0; --steering) {
        if (mesh->colors && (def->color_weight > 0) == steering) {
            double range = color_range(mesh->colors, 3 * (size_t)mesh->vertex_count);
            add_channels(s, CHANNEL_COLOR, 3, (steering ? def->color_weight : 1) / (range > 0 ? range : 1));
        }
        if (mesh->texcoords && (def->texcoord_weight > 0) == steering) {
            double range = texcoord_range(mesh->texcoords, 3 * (size_t)mesh->face_count);
            add_channels(s, CHANNEL_TEXCOORD, 2,
                         (steering ? def->texcoord_weight : 1) / (range > 0 ? range : 1));
        }
        if (mesh->normals && (def->normal_weight > 0) == steering)
            add_channels(s, CHANNEL_NORMAL, 3, .5 * (steering ? def->normal_weight : 1));
        if (steering) s->steering = s->channel_count;
    }
}

fct_result fct_simplify_attributes(fct_simplifier *s) {
    if (!s->channel_count) return FCT_OK;
    s->attributes = fct_allocate_zero(s->env, s->wedge_count, s->channel_count * sizeof *s->attributes);
    if (!s->attributes) return fct_fail_memory(s->env, "attributes");
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        const fct_channel *channel = &s->channels[i];
        size_t count;
        uint32_t stride;
        const float *values = channel_values(s->mesh, channel, &count, &stride);
        for (size_t c = 0; c < 3 * (size_t)s->mesh->face_count; ++c) {
            size_t item = channel->source == CHANNEL_TEXCOORD ? c : s->mesh->triangles[c];
            s->attributes[(size_t)s->channel_count * s->corner_wedges[c] + i] =
                channel->factor * values[stride * item + channel->component];
        }
    }
    return FCT_OK;
}
