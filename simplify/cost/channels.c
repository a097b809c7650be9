/* simplify/cost/channels.c: see channels.h. Cost: linear in vertices and corners. */
#include "simplify/cost/channels.h"

#include <stdlib.h>

/* Colours count by the range of the middle 96 %: one bright lamp must not hide the shadows on the walls. But
 * the range is at least a twentieth of the full one. */
#define COLOR_TAIL  50  /* each tail holds at most one value in 50 */
#define LEAST_RANGE .05 /* of the full range */

/* The automatic weight of colours for n faces is COLOR_LENGTHS / sqrt(n), at most MOST_COLOR: it falls with
 * the lengths of the edges. Measured on the museum, the Cornell box and painted models: docs/notes. */
#define COLOR_LENGTHS 2.
#define MOST_COLOR    .1

/* Normals have components from -1 to 1: a factor of 1/2 gives them a range of 1. */
#define NORMAL_FACTOR .5

/* The array that holds a channel, its number of items, and the floats from one item to the next. */
static const float *find_channel_values(const fct_mesh *mesh, const fct_channel *channel, size_t *count,
                                        uint32_t *stride) {
    bool texcoord = channel->source == CHANNEL_TEXCOORD;
    *stride = texcoord ? 2 : stream_width(channel->stream);
    *count = texcoord ? 3 * (size_t)mesh->face_count : mesh->vertex_count;
    return texcoord ? mesh->texcoords : stream_values(mesh, channel->stream);
}

static void add_channels(fct_simplifier *s, int source, uint32_t stream, double factor) {
    for (uint32_t i = 0; i < (source == CHANNEL_TEXCOORD ? 2 : stream_width(stream)); ++i) {
        fct_channel *channel = &s->channels[s->channel_count++];
        *channel = (fct_channel){.component = i, .factor = factor, .lower = INFINITY, .upper = -INFINITY};
        channel->source = source, channel->stream = stream;
        size_t count;
        uint32_t stride;
        const float *values = find_channel_values(s->mesh, channel, &count, &stride);
        for (size_t k = 0; k < count; ++k) {
            double value = factor * values[stride * k + i];
            channel->lower = fct_min(channel->lower, value), channel->upper = fct_max(channel->upper, value);
        }
        if (count == 0) channel->lower = channel->upper = 0;
        channel->unit =
            source == CHANNEL_COLOR || source == CHANNEL_LIGHT ? 1 : channel->upper - channel->lower;
    }
}

static void find_full_range(const float *values, size_t count, double *lower, double *upper) {
    *lower = INFINITY, *upper = -INFINITY;
    for (size_t i = 0; i < count; ++i)
        *lower = fct_min(*lower, values[i]), *upper = fct_max(*upper, values[i]);
    if (count == 0) *lower = *upper = 0;
}

/* The range from the 2nd to the 98th percentile, by a histogram of 1,024 cells over the full range. */
static double find_color_range(const float *values, size_t count) {
    enum { CELLS = 1024 };
    double lower, upper;
    find_full_range(values, count, &lower, &upper);
    double range = upper - lower;
    if (!(range > 0)) return 0;
    size_t cells[CELLS] = {0};
    for (size_t i = 0; i < count; ++i) {
        int cell = (int)((values[i] - lower) / range * CELLS);
        ++cells[cell < CELLS ? cell : CELLS - 1];
    }
    size_t below = 0, first = 0, last = CELLS;
    while (first < CELLS && (below + cells[first]) * COLOR_TAIL <= count) below += cells[first++];
    size_t above = 0;
    while (last > first && (above + cells[last - 1]) * COLOR_TAIL <= count) above += cells[--last];
    return range * fct_max((double)(last - first) / CELLS, LEAST_RANGE);
}

/* The larger range of u and v, so that both keep one scale. */
static double find_texcoord_range(const float *values, size_t corners) {
    double range = 0;
    for (size_t k = 0; k < 2; ++k) {
        double lower = INFINITY, upper = -INFINITY;
        for (size_t c = 0; c < corners; ++c)
            lower = fct_min(lower, values[2 * c + k]), upper = fct_max(upper, values[2 * c + k]);
        if (corners) range = fct_max(range, upper - lower);
    }
    return range;
}

/* The factor of colours or light without a weight. */
static double find_color_factor(const fct_mesh *mesh, uint32_t stream) {
    double range =
        find_color_range(stream_values(mesh, stream), (size_t)stream_width(stream) * mesh->vertex_count);
    return 1 / (range > 0 ? range : 1);
}

void fct_simplify_channels(fct_simplifier *s) {
    const fct_mesh *mesh = s->mesh;
    const fct_simplify_def *def = s->def;
    for (int steering = 1; steering >= 0; --steering) {
        if (mesh->colors && (def->color_weight != 0) == steering)
            add_channels(s, CHANNEL_COLOR, STREAM_COLORS, find_color_factor(mesh, STREAM_COLORS));
        if (mesh->texcoords && (def->texcoord_weight > 0) == steering) {
            double range = find_texcoord_range(mesh->texcoords, 3 * (size_t)mesh->face_count);
            add_channels(s, CHANNEL_TEXCOORD, STREAM_COUNT,
                         (steering ? def->texcoord_weight : 1) / (range > 0 ? range : 1));
        }
        if (mesh->normals && (def->normal_weight > 0) == steering)
            add_channels(s, CHANNEL_NORMAL, STREAM_NORMALS,
                         NORMAL_FACTOR * (steering ? def->normal_weight : 1));
        if (steering) s->steering = s->channel_count;
    }
    for (uint32_t i = STREAM_IRRADIANCE; i < STREAM_COUNT; ++i)
        if (stream_values(mesh, i)) add_channels(s, CHANNEL_LIGHT, i, find_color_factor(mesh, i));
}

/* The weight of colours. max_error allows about extent / max_error faces. */
static double find_color_weight(const fct_simplifier *s) {
    const fct_simplify_def *def = s->def;
    if (def->color_weight != FCT_WEIGHT_AUTO) return def->color_weight;
    double faces = fct_max(def->target_faces, s->extent / def->max_error);
    faces = fct_max(fct_min(faces, s->mesh->face_count), 1);
    return fct_min(COLOR_LENGTHS / sqrt(faces), MOST_COLOR);
}

static void weigh_colors(fct_simplifier *s) {
    double weight = find_color_weight(s);
    for (uint32_t i = 0; i < s->steering; ++i) {
        fct_channel *channel = &s->channels[i];
        if (channel->source == CHANNEL_COLOR)
            channel->factor *= weight, channel->unit *= weight, channel->lower *= weight,
                channel->upper *= weight;
    }
}

fct_result fct_simplify_attributes(fct_simplifier *s) {
    if (!s->channel_count) return FCT_OK;
    weigh_colors(s);
    s->attributes = fct_allocate_zero(s->env, s->wedge_count, s->channel_count * sizeof *s->attributes);
    if (!s->attributes) return fct_fail_memory(s->env, "attributes");
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        const fct_channel *channel = &s->channels[i];
        size_t count;
        uint32_t stride;
        const float *values = find_channel_values(s->mesh, channel, &count, &stride);
        for (size_t c = 0; c < 3 * (size_t)s->mesh->face_count; ++c) {
            size_t item = channel->source == CHANNEL_TEXCOORD ? c : s->mesh->triangles[c];
            s->attributes[(size_t)s->channel_count * s->corner_wedges[c] + i] =
                channel->factor * values[stride * item + channel->component];
        }
    }
    return FCT_OK;
}
