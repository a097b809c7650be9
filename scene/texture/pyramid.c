/* scene/texture/pyramid.c: see pyramid.h. */
#include "scene/texture/pyramid.h"

#include <math.h>
#include <string.h>

#include "base/math/elementary.h"
#include "mesh/color.h"
#include "scene/scene.h"

/* ---- Levels ---- */

/* The texels of a finer level that a coarser one covers along an axis, and how much of each. A coarser level
 * has at least a third of the size, so at most four texels touch one of its own. */
typedef struct cover {
    uint32_t first, count;
    double share[4];
} cover;

static cover cover_texels(uint32_t i, uint32_t coarse, uint32_t fine) {
    const double from = (double)i * fine / coarse, to = (i + 1.) * fine / coarse;
    cover c = {.first = (uint32_t)from};
    for (uint32_t k = c.first; k < fine && c.count < 4; ++k) {
        const double share = fmin(to, k + 1.) - fmax(from, k);
        if (share <= 0) break;
        c.share[c.count++] = share / (to - from);
    }
    return c;
}

static double load_texel(const fct_pyramid *p, uint32_t level, uint32_t x, uint32_t y, int channel) {
    const fct_pyramid_level *l = &p->levels[level];
    const size_t at = 3 * ((size_t)y * l->width + x) + (size_t)channel;
    return level ? l->texels[at] * (1 / 65535.) : p->table[channel][p->pixels[at]];
}

static void fill_level(fct_pyramid *p, uint32_t level) {
    const fct_pyramid_level *l = &p->levels[level], *finer = l - 1;
    uint16_t *to = l->texels;
    for (uint32_t y = 0; y < l->height; ++y) {
        const cover rows = cover_texels(y, l->height, finer->height);
        for (uint32_t x = 0; x < l->width; ++x) {
            const cover columns = cover_texels(x, l->width, finer->width);
            for (int c = 0; c < 3; ++c) {
                double sum = 0;
                for (uint32_t j = 0; j < rows.count; ++j)
                    for (uint32_t i = 0; i < columns.count; ++i)
                        sum += rows.share[j] * columns.share[i] *
                               load_texel(p, level - 1, columns.first + i, rows.first + j, c);
                *to++ = (uint16_t)(65535 * sum + .5);
            }
        }
    }
}

/* What the bytes of the image reflect. */
static void fill_table(fct_pyramid *p) {
    for (int c = 0; c < 3; ++c)
        for (int byte = 0; byte < 256; ++byte) {
            const float value = p->factor[c] * fct_linear_from_srgb(byte / 255.);
            p->table[c][byte] = p->clamped ? fminf(value, FCT_SCENE_MOST_REFLECTANCE) : value;
        }
}

bool fct_pyramid_would_clamp(const fct_image *image, const float factor[3]) {
    const size_t count = 3 * (size_t)image->width * image->height;
    uint8_t most[3] = {0, 0, 0};
    bool clamps = false;
    for (size_t i = 0; i < count; ++i)
        if (image->pixels[i] > most[i % 3]) most[i % 3] = image->pixels[i];
    for (int c = 0; c < 3; ++c)
        clamps |= factor[c] * fct_linear_from_srgb(most[c] / 255.) > FCT_SCENE_MOST_REFLECTANCE;
    return clamps;
}

fct_result fct_pyramid_build(const fct_env *env, const fct_image *image, const float factor[3], bool clamped,
                             fct_pyramid *out) {
    *out = (fct_pyramid){.pixels = image->pixels, .clamped = clamped, .level_count = 1};
    memcpy(out->factor, factor, sizeof out->factor);
    out->levels[0] = (fct_pyramid_level){image->width, image->height, NULL};
    fill_table(out);
    for (uint32_t k = 1; out->levels[k - 1].width > 1 || out->levels[k - 1].height > 1; ++k) {
        fct_pyramid_level *l = &out->levels[k];
        l->width = l[-1].width / 2 > 0 ? l[-1].width / 2 : 1;
        l->height = l[-1].height / 2 > 0 ? l[-1].height / 2 : 1;
        l->texels = fct_allocate(env, (size_t)l->width * l->height, 3 * sizeof *l->texels);
        if (!l->texels) return fct_fail_memory(env, "a texture");
        out->level_count = k + 1;
        fill_level(out, k);
    }
    return FCT_OK;
}

void fct_pyramid_release(const fct_env *env, fct_pyramid *pyramid) {
    for (uint32_t k = 0; k < pyramid->level_count; ++k) fct_release(env, pyramid->levels[k].texels);
    *pyramid = (fct_pyramid){0};
}

/* ---- Lookups ---- */

/* Moves a coordinate into [0, 1]. */
static double wrap_coordinate(fct_wrap wrap, double x) {
    if (wrap == FCT_WRAP_CLAMP) return x < 0 ? 0 : x > 1 ? 1 : x;
    if (wrap == FCT_WRAP_REPEAT) return x - floor(x);
    const double period = x - 2 * floor(x / 2);
    return period > 1 ? 2 - period : period;
}

/* The two texels around x in [0, 1], and the weight of the second. */
static double find_neighbours(fct_wrap wrap, double x, uint32_t size, uint32_t at[2]) {
    const double place = x * size - .5, whole = floor(place);
    const bool repeats = wrap == FCT_WRAP_REPEAT;
    at[0] = whole < 0 ? (repeats ? size - 1 : 0) : (uint32_t)whole;
    at[1] = whole + 1 >= size ? (repeats ? 0 : size - 1) : (uint32_t)(whole + 1);
    if (at[0] > size - 1) at[0] = size - 1;
    return place - whole;
}

static void sample_level(const fct_pyramid *p, uint32_t level, const fct_wrap wrap[2], const double uv[2],
                         double weight, double out[3]) {
    uint32_t x[2], y[2];
    const double s = find_neighbours(wrap[0], uv[0], p->levels[level].width, x),
                 t = find_neighbours(wrap[1], uv[1], p->levels[level].height, y);
    for (int c = 0; c < 3; ++c)
        out[c] +=
            weight *
            ((1 - t) *
                 ((1 - s) * load_texel(p, level, x[0], y[0], c) + s * load_texel(p, level, x[1], y[0], c)) +
             t * ((1 - s) * load_texel(p, level, x[0], y[1], c) + s * load_texel(p, level, x[1], y[1], c)));
}

double fct_pyramid_level_of(const fct_pyramid *pyramid, double width) {
    return width > 1 ? fmin(fct_log2(fmin(width, 1e9)), pyramid->level_count - 1) : 0;
}

void fct_pyramid_sample(const fct_pyramid *pyramid, const fct_wrap wrap[2], const double point[2],
                        double level, double out[3]) {
    const double uv[2] = {wrap_coordinate(wrap[0], point[0]), wrap_coordinate(wrap[1], point[1])};
    const uint32_t below = (uint32_t)level;
    const double share = level - below;
    out[0] = out[1] = out[2] = 0;
    sample_level(pyramid, below, wrap, uv, 1 - share, out);
    if (share > 0) sample_level(pyramid, below + 1, wrap, uv, share, out);
}
