/* scene/read/mtl.c: see mtl.h. */
#include "scene/read/mtl.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "mesh/mesh.h"
#include "scene/read/libraries.h"

/* A material that is being read. */
typedef struct reading {
    char *name; /* NULL before the first newmtl */
    fct_material material;
    fct_paint paint; /* its factor: Kd as it is written */
    bool has_factor; /* Kd is there */
    char *texture;   /* path of map_Kd, or NULL */
    bool repeated, clamped, grey, dark, textured, transparent;
} reading;

static const fct_material standard = {.reflectance = {.7f, .7f, .7f}};

fct_result fct_mtl_create(fct_scene *scene, fct_mtl *out) {
    *out = (fct_mtl){.scene = scene, .ids = json_object(), .used_names = json_object()};
    return out->ids && out->used_names ? FCT_OK : fct_fail_memory(scene->env, "names");
}

void fct_mtl_release(fct_mtl *mtl) {
    json_decref(mtl->ids);
    json_decref(mtl->used_names);
    *mtl = (fct_mtl){0};
}

fct_result fct_mtl_choose_name(const fct_env *env, json_t *used, const char *name, char *out, size_t size) {
    size_t length = strlen(name), number = 1;
    if (length >= size) length = size - 1;
    memcpy(out, name, length);
    out[length] = 0;
    while (length < strlen(name) || json_object_get(used, out)) {
        char tail[24];
        size_t digits = (size_t)snprintf(tail, sizeof tail, "~%zu", number + json_object_size(used));
        if (length + digits >= size) length = size - 1 - digits;
        while (length && ((unsigned char)name[length] & 0xc0) == 0x80) --length; /* a whole letter of UTF-8 */
        strcpy(out + length, tail);
        if (!json_object_get(used, out)) break;
        ++number;
    }
    if (json_object_set_new_nocheck(used, out, json_true())) return fct_fail_memory(env, "names");
    return FCT_OK;
}

uint32_t fct_mtl_find(const fct_mtl *mtl, const char *name) {
    json_t *id = json_object_get(mtl->ids, name);
    return id ? (uint32_t)json_integer_value(id) : FCT_NONE;
}

/* Adds the material to the scene under a name that the scene can hold. */
static fct_result add_material(fct_mtl *mtl, const char *name, fct_material *material, const fct_paint *paint,
                               uint32_t *id) {
    const fct_env *env = mtl->scene->env;
    fct_result result = fct_mtl_choose_name(env, mtl->used_names, name[0] ? name : "(none)", material->name,
                                            sizeof material->name);
    if (result == FCT_OK) result = fct_scene_add_material(mtl->scene, material, id);
    if (result == FCT_OK && !env->no_textures) result = fct_scene_paint_material(mtl->scene, *id, paint);
    if (result == FCT_OK && json_object_set_new_nocheck(mtl->ids, name, json_integer(*id)))
        result = fct_fail_memory(env, "names");
    return result;
}

fct_result fct_mtl_add_grey(fct_mtl *mtl, const char *name, uint32_t *id) {
    fct_material grey = standard;
    fct_paint paint = fct_paint_default();
    memcpy(paint.factor, grey.reflectance, sizeof paint.factor);
    paint.vertex_colors = true;
    return add_material(mtl, name, &grey, &paint, id);
}

static bool at_line_end(fct_text *t) {
    return fct_text_at_line_end(t) || *t->p == '#';
}

/* Reads one to three numbers. Missing ones are those before. */
static fct_result read_numbers(fct_text *t, const char *what, float out[3]) {
    for (int c = 0; c < 3; ++c) {
        fct_result result = fct_text_float(t, what, out + c);
        if (result != FCT_OK) return result;
        if (c == 0 && at_line_end(t)) {
            out[1] = out[2] = out[0];
            return FCT_OK;
        }
    }
    return at_line_end(t) ? FCT_OK : fct_text_expected(t, "the end of the line");
}

/* CIE XYZ to linear RGB with the primaries and the white of sRGB (IEC 61966-2-1). */
static void convert_xyz(float color[3]) {
    static const double rows[3][3] = {{3.2404542, -1.5371385, -.4985314},
                                      {-.9692660, 1.8760108, .0415560},
                                      {.0556434, -.2040259, 1.0572252}};
    double x = (double)color[0], y = (double)color[1], z = (double)color[2];
    for (int c = 0; c < 3; ++c) color[c] = (float)(rows[c][0] * x + rows[c][1] * y + rows[c][2] * z);
}

/* Reads "r g b", "xyz x y z" or "spectral FILE". *spectral: the color is unchanged. An xyz color may lie
 * outside the RGB gamut; then it is moved to >= 0. */
static fct_result read_color(reading *m, fct_text *t, const char *what, float color[3], bool *spectral) {
    fct_text ahead = *t;
    size_t length;
    const char *word = fct_text_word(&ahead, &length);
    bool xyz = fct_text_word_is_any_case(word, length, "xyz");
    *spectral = fct_text_word_is_any_case(word, length, "spectral");
    if (*spectral) return FCT_OK;
    if (xyz) *t = ahead;
    fct_result result = read_numbers(t, what, color);
    if (result != FCT_OK || !xyz) return result;
    convert_xyz(color);
    for (int c = 0; c < 3; ++c) {
        m->clamped |= color[c] < 0;
        color[c] = color[c] < 0 ? 0 : color[c];
    }
    return FCT_OK;
}

static fct_result read_reflectance(reading *m, fct_text *t) {
    float *color = m->paint.factor;
    bool spectral;
    fct_result result = read_color(m, t, "a reflectance", color, &spectral);
    if (result != FCT_OK) return result;
    m->grey = spectral;
    if (spectral) memcpy(color, standard.reflectance, 3 * sizeof(float));
    for (int c = 0; c < 3; ++c)
        if (color[c] < 0) return fct_text_fail(t, "expected Kd >= 0, found %g", (double)color[c]);
    m->has_factor = color[0] > 0 || color[1] > 0 || color[2] > 0;
    return FCT_OK;
}

static fct_result read_emission(reading *m, fct_text *t) {
    float *color = m->material.emission;
    fct_result result = read_color(m, t, "an emission", color, &m->dark);
    if (result != FCT_OK) return result;
    if (m->dark) color[0] = color[1] = color[2] = 0;
    for (int c = 0; c < 3; ++c)
        if (color[c] < 0) return fct_text_fail(t, "expected Ke >= 0, found %g", (double)color[c]);
    return FCT_OK;
}

/* Takes up to three numbers after an option of a texture. */
static void take_numbers(fct_text *t, float out[3]) {
    for (int c = 0; c < 3; ++c) {
        fct_text ahead = *t;
        double value;
        if (!fct_text_double(&ahead, &value) || !isfinite((float)value)) return;
        out[c] = (float)value;
        *t = ahead;
    }
}

/* Reads an option of a texture. Options that change no colour or are rare are left out with their values. */
static void read_option(fct_text *t, const char *option, size_t length, fct_paint *paint, float scale[3],
                        float offset[3]) {
    static const char *const words[] = {"-blendu", "-blendv", "-cc", "-imfchan", "-type"};
    float unused[3];
    if (fct_text_word_is(option, length, "-s")) {
        take_numbers(t, scale);
    } else if (fct_text_word_is(option, length, "-o")) {
        take_numbers(t, offset);
    } else if (fct_text_word_is(option, length, "-clamp")) {
        const char *value = fct_text_word(t, &length);
        if (fct_text_word_is(value, length, "on")) paint->wrap[0] = paint->wrap[1] = FCT_WRAP_CLAMP;
    } else {
        bool word = false;
        for (size_t k = 0; k < FCT_LENGTH(words); ++k) word |= fct_text_word_is(option, length, words[k]);
        if (word)
            fct_text_word(t, &length);
        else
            take_numbers(t, unused);
    }
}

/* Reads map_Kd: options, then the name of a file, which may contain blanks. */
static fct_result read_texture(fct_mtl *mtl, reading *m, const char *base, fct_text *t) {
    const fct_env *env = mtl->scene->env;
    float scale[3] = {1, 1, 1}, offset[3] = {0, 0, 0};
    size_t length;
    for (;;) {
        fct_text ahead = *t;
        const char *word = fct_text_word(&ahead, &length);
        if (length < 2 || *word != '-') break;
        *t = ahead;
        read_option(t, word, length, &m->paint, scale, offset);
    }
    const char *name = fct_text_rest(t, &length);
    if (!length || m->texture || env->no_textures || m->repeated) return FCT_OK;
    /* Texture coordinates of models count v from the top, these numbers from the bottom. */
    const float transform[6] = {scale[0], 0, offset[0], 0, scale[1], 1 - scale[1] - offset[1]};
    memcpy(m->paint.transform, transform, sizeof transform);
    fct_result result = fct_libraries_find(env, base, name, length, &m->texture);
    if (result != FCT_OK || m->texture) return result;
    char shown[FCT_TEXT_SHOWN], reason[FCT_TEXT_SHOWN + 16];
    fct_text_show(name, length, shown);
    snprintf(reason, sizeof reason, "no file \"%s\"", shown);
    fct_textures_lose(&mtl->loss, reason);
    return FCT_OK;
}

/* Notes what the solver does not know: textures of Ke, and transparency. */
static void note_other(reading *m, fct_text *t, const char *word, size_t length) {
    double value;
    bool map = length > 4 && fct_text_begins_any_case(word, length, "map_");
    m->textured |= map && fct_text_word_is_any_case(word + 4, length - 4, "ke");
    m->transparent |= map && fct_text_word_is_any_case(word + 4, length - 4, "d");
    if (fct_text_word_is(word, length, "d")) m->transparent |= fct_text_double(t, &value) && value < 1;
    if (fct_text_word_is(word, length, "Tr")) m->transparent |= fct_text_double(t, &value) && value > 0;
}

static void count_material(fct_mtl_tally *tally, bool present, const char *name) {
    if (present && !tally->count++) fct_text_show(name, strlen(name), tally->first);
}

/* Sets the paint's texture and factor, and the reflectance. */
static fct_result finish_paint(fct_mtl *mtl, reading *m) {
    fct_result result = FCT_OK;
    if (m->texture) result = fct_textures_open(mtl->scene, m->texture, &mtl->loss, &m->paint.texture);
    const bool textured = m->paint.texture != FCT_NONE;
    for (int c = 0; c < 3; ++c) {
        if (textured && !m->has_factor) m->paint.factor[c] = 1;
        if (!textured) m->clamped |= m->paint.factor[c] > FCT_SCENE_MOST_REFLECTANCE;
        m->material.reflectance[c] = fminf(m->paint.factor[c], FCT_SCENE_MOST_REFLECTANCE);
    }
    return result;
}

/* Adds the material that ends here, if there is one. */
static fct_result end_material(fct_mtl *mtl, reading *m) {
    uint32_t id;
    if (!m->name) return FCT_OK;
    count_material(&mtl->repeated, m->repeated, m->name);
    if (m->repeated) return FCT_OK;
    fct_result result = finish_paint(mtl, m);
    if (result == FCT_OK) result = add_material(mtl, m->name, &m->material, &m->paint, &id);
    if (result != FCT_OK) return result;
    m->clamped |= fct_textures_clamp(mtl->scene, id);
    count_material(&mtl->clamped, m->clamped, m->name);
    count_material(&mtl->grey, m->grey, m->name);
    count_material(&mtl->dark, m->dark, m->name);
    count_material(&mtl->textured, m->textured, m->name);
    count_material(&mtl->transparent, m->transparent, m->name);
    return FCT_OK;
}

static fct_result begin_material(fct_mtl *mtl, reading *m, fct_text *t) {
    const fct_env *env = mtl->scene->env;
    size_t length;
    const char *name = fct_text_rest(t, &length);
    if (memchr(name, 0, length)) return fct_text_fail(t, "a material's name has a zero byte");
    fct_release(env, m->name);
    fct_release(env, m->texture);
    *m = (reading){
        .name = fct_copy_text(env, name, length), .material = standard, .paint = fct_paint_default()};
    memcpy(m->paint.factor, standard.reflectance, sizeof m->paint.factor);
    m->paint.vertex_colors = true;
    if (!m->name) return fct_fail_memory(env, "names");
    m->repeated = fct_mtl_find(mtl, m->name) != FCT_NONE;
    return FCT_OK;
}

static fct_result read_statement(fct_mtl *mtl, reading *m, const char *base, fct_text *t) {
    size_t length;
    const char *word = fct_text_word(t, &length);
    bool reflectance = fct_text_word_is(word, length, "Kd"), emission = fct_text_word_is(word, length, "Ke");
    if (fct_text_word_is(word, length, "newmtl")) {
        fct_result result = end_material(mtl, m);
        return result == FCT_OK ? begin_material(mtl, m, t) : result;
    }
    if ((reflectance || emission) && !m->name) return fct_text_fail(t, "expected newmtl before %.2s", word);
    if (reflectance) return read_reflectance(m, t);
    if (emission) return read_emission(m, t);
    if (m->name && fct_text_word_is_any_case(word, length, "map_kd")) return read_texture(mtl, m, base, t);
    note_other(m, t, word, length);
    return FCT_OK;
}

fct_result fct_mtl_read(fct_mtl *mtl, const char *base, fct_text *t) {
    reading m = {0};
    fct_result result = FCT_OK;
    while (result == FCT_OK && fct_text_skip_lines(t, '#')) {
        result = read_statement(mtl, &m, base, t);
        if (result == FCT_OK) fct_text_next_line(t);
    }
    if (result == FCT_OK) result = end_material(mtl, &m);
    fct_release(mtl->scene->env, m.name);
    fct_release(mtl->scene->env, m.texture);
    return result;
}

void fct_mtl_send_notes(const fct_mtl *mtl, const char *name) {
    const struct {
        const fct_mtl_tally *tally;
        fct_severity severity;
        const char *text;
    } kinds[] = {
        {&mtl->repeated, FCT_MESSAGE_NOTE, "are defined again; the first definition stays"},
        {&mtl->clamped, FCT_MESSAGE_WARNING,
         "have colours out of range, which are clamped: Kd to 0 to .9, Ke to >= 0"},
        {&mtl->grey, FCT_MESSAGE_WARNING, "have a spectral Kd and become grey"},
        {&mtl->dark, FCT_MESSAGE_WARNING, "have a spectral Ke and emit no light"},
        {&mtl->textured, FCT_MESSAGE_WARNING, "have a texture of their emission, which is left out"},
        {&mtl->transparent, FCT_MESSAGE_WARNING, "are transparent and become opaque"},
    };
    for (size_t k = 0; k < FCT_LENGTH(kinds); ++k)
        if (kinds[k].tally->count)
            fct_note(mtl->scene->env, kinds[k].severity, "%s: %zu materials %s (\"%s\" first)", name,
                     kinds[k].tally->count, kinds[k].text, kinds[k].tally->first);
}
