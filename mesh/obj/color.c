/* mesh/obj/color.c: see color.h.
 *
 * Every component becomes linear as a float of sRGB when it is read, in double. If the file turns out to hold
 * bytes, the table of the 256 linear values finds the byte of each component again.
 */
#include "mesh/obj/color.h"

#include <math.h>
#include <string.h>

#include "mesh/color.h"

static void note_component(fct_obj_range *range, double value) {
    range->over_one |= value > 1;
    range->no_byte |= !(value >= 0 && value <= 255 && value == floor(value));
}

static float decode_component(fct_obj_colors *c, fct_obj_range *range, double value) {
    float linear = isfinite(value) ? fct_linear_from_srgb(value) : NAN;
    note_component(range, value);
    c->not_finite += !isfinite(linear);
    return linear;
}

static fct_result allocate_values(const fct_env *env, fct_obj_colors *c, size_t v, size_t total) {
    c->values = fct_allocate(env, total, 3 * sizeof(float));
    if (!c->values) return fct_fail_memory(env, "vertex colours");
    for (size_t i = 0; i < v; ++i) c->values[3 * i] = NAN;
    return FCT_OK;
}

static fct_result allocate_seventh(const fct_env *env, fct_obj_colors *c, size_t total) {
    c->seventh = fct_allocate(env, total, sizeof(float));
    if (!c->seventh) return fct_fail_memory(env, "vertex colours");
    for (size_t i = 0; i < total; ++i) c->seventh[i] = NAN;
    c->weighted = c->opaque = true;
    return FCT_OK;
}

fct_result fct_obj_set_color(const fct_env *env, fct_obj_colors *c, size_t v, size_t total,
                             const double *numbers, size_t count) {
    fct_result result = FCT_OK;
    if (count < 3) {
        ++c->without;
        if (c->values) c->values[3 * v] = NAN;
        return FCT_OK;
    }
    if (!c->values) result = allocate_values(env, c, v, total);
    if (result == FCT_OK && count == 4 && !c->seventh) result = allocate_seventh(env, c, total);
    if (result != FCT_OK) return result;
    for (size_t k = 0; k < 3; ++k) c->values[3 * v + k] = decode_component(c, &c->rgb, numbers[k]);
    if (count == 4) {
        c->seventh[v] = decode_component(c, &c->last, numbers[3]);
        c->weighted &= numbers[0] == 1;
        c->opaque &= numbers[3] == 1 || numbers[3] == 255;
    }
    return FCT_OK;
}

/* Seven numbers have two meanings. */
static void drop_seventh(const fct_env *env, const char *name, fct_obj_colors *c, size_t vertex_count) {
    bool weights = c->weighted && !c->opaque;
    for (size_t v = 0; weights && v < vertex_count; ++v) {
        float *color = c->values + 3 * v;
        if (!isnan(c->seventh[v])) color[0] = color[1], color[1] = color[2], color[2] = c->seventh[v];
    }
    if (weights) {
        c->rgb.over_one |= c->last.over_one;
        c->rgb.no_byte |= c->last.no_byte;
    } else if (c->weighted) {
        fct_note(env, FCT_MESSAGE_WARNING,
                 "%s: vertices of 7 numbers are read as x y z r g b a, but x y z w r g b is possible too",
                 name);
    } else if (!c->opaque) {
        fct_note(env, FCT_MESSAGE_WARNING, "%s: the alpha of vertex colours is left out", name);
    }
}

/* The components are whole numbers up to 255, decoded as floats of sRGB. */
static void decode_bytes(float *values, size_t count) {
    float whole[256], bytes[256];
    for (int i = 0; i < 256; ++i) {
        whole[i] = fct_linear_from_srgb(i);
        bytes[i] = fct_linear_from_srgb(i / 255.0);
    }
    for (size_t i = 0; i < count; ++i) {
        unsigned k = 0;
        for (unsigned step = 128; step; step /= 2) k += values[i] >= whole[k + step] ? step : 0;
        if (!isnan(values[i])) values[i] = bytes[k];
    }
}

void fct_obj_finish_colors(const fct_env *env, const char *name, fct_obj_colors *c, fct_soup *soup) {
    size_t count = soup->vertex_count;
    if (c->not_finite) {
        fct_note(env, FCT_MESSAGE_WARNING,
                 "%s: vertex colours are left out, because %zu components are not finite", name,
                 c->not_finite);
    } else if (c->values) {
        if (c->seventh) drop_seventh(env, name, c, count);
        if (c->rgb.over_one && !c->rgb.no_byte) decode_bytes(c->values, 3 * count);
        for (size_t v = 0; v < count; ++v)
            if (isnan(c->values[3 * v])) c->values[3 * v] = c->values[3 * v + 1] = c->values[3 * v + 2] = 1;
        if (c->without)
            fct_note(env, FCT_MESSAGE_WARNING, "%s: %zu vertices have no colour and get white", name,
                     c->without);
        soup->colors = c->values;
        c->values = NULL;
    }
    fct_obj_release_colors(env, c);
}

void fct_obj_release_colors(const fct_env *env, fct_obj_colors *c) {
    fct_release(env, c->values);
    fct_release(env, c->seventh);
    *c = (fct_obj_colors){0};
}
