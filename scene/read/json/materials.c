/* scene/read/json/materials.c: light groups and materials of scene.json. */
#include "scene/read/json/materials.h"

#include <math.h>
#include <string.h>

#include "scene/read/path.h"
#include "scene/read/textures.h"

static fct_result read_light_groups(fct_document *d) {
    json_t *groups = json_object_get(d->root, "light_groups");
    if (!groups) return FCT_OK;
    size_t before = fct_json_enter(&d->json, "light_groups");
    if (!json_is_array(groups)) return fct_json_expected(&d->json, "an array of names", groups);
    for (size_t k = 0; k < json_array_size(groups); ++k) {
        const char *name;
        uint32_t id;
        size_t inside = fct_json_enter_index(&d->json, k);
        fct_result result = fct_json_string(&d->json, json_array_get(groups, k), 64, &name);
        if (result != FCT_OK) return result;
        if (json_object_get(d->group_ids, name)) return fct_json_fail(&d->json, "the name exists already");
        result = fct_scene_add_light_group(d->scene, name, &id);
        if (result == FCT_OK) result = fct_document_set_id(d, d->group_ids, name, id);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, inside);
    }
    fct_json_leave(&d->json, before);
    return FCT_OK;
}

static fct_result read_rgb(fct_document *d, const json_t *object, const char *key, double upper,
                           float out[3]) {
    const json_t *value = json_object_get(object, key);
    double rgb[3];
    if (!value) return FCT_OK;
    size_t before = fct_json_enter(&d->json, key);
    fct_result result = fct_json_spread(&d->json, value, 3, rgb);
    for (int c = 0; result == FCT_OK && c < 3; ++c) {
        out[c] = (float)rgb[c];
        if (rgb[c] < 0)
            result = fct_json_fail(&d->json, "expected numbers >= 0, found %g", rgb[c]);
        else if (!(out[c] < upper))
            result = fct_json_fail(&d->json, "expected numbers below %g, found %g", upper, rgb[c]);
    }
    if (result == FCT_OK) fct_json_leave(&d->json, before);
    return result;
}

/* Reads a boolean member; absent: false. */
static fct_result read_flag(fct_document *d, const json_t *object, const char *key, bool *out) {
    const json_t *value = json_object_get(object, key);
    *out = json_is_true(value);
    if (!value) return FCT_OK;
    size_t before = fct_json_enter(&d->json, key);
    if (!json_is_boolean(value)) return fct_json_expected(&d->json, "true or false", value);
    fct_json_leave(&d->json, before);
    return FCT_OK;
}

/* Reads `texture`, a file relative to the scene file. */
static fct_result read_texture(fct_document *d, const json_t *object, uint32_t *texture) {
    const fct_env *env = d->json.env;
    const json_t *value = json_object_get(object, "texture");
    const char *file;
    if (!value) return FCT_OK;
    size_t before = fct_json_enter(&d->json, "texture");
    fct_result result = fct_json_string(&d->json, value, 4096, &file);
    if (result != FCT_OK) return result;
    if (env->no_textures) {
        fct_json_leave(&d->json, before);
        return FCT_OK;
    }
    char *path = fct_path_join(env, d->base, file);
    if (!path) return FCT_ERROR_MEMORY;
    result = fct_scene_read_texture(d->scene, path, texture);
    fct_release(env, path);
    if (result == FCT_ERROR_INPUT) return fct_json_fail(&d->json, "cannot read \"%s\"", file);
    if (result == FCT_OK) fct_json_leave(&d->json, before);
    return result;
}

/* Reads `reflectance`, `texture` and `vertex_colors`. */
static fct_result read_paint(fct_document *d, const json_t *object, fct_material *material,
                             fct_paint *paint) {
    fct_result result = read_texture(d, object, &paint->texture);
    if (result == FCT_OK) result = read_flag(d, object, "vertex_colors", &paint->vertex_colors);
    if (result != FCT_OK) return result;
    const bool painted = json_object_get(object, "texture") || paint->vertex_colors;
    for (int c = 0; c < 3; ++c) paint->factor[c] = painted ? 1 : .7f;
    result = read_rgb(d, object, "reflectance", painted ? nextafter(1, 2) : 1, paint->factor);
    for (int c = 0; c < 3; ++c)
        material->reflectance[c] =
            painted ? fminf(paint->factor[c], FCT_SCENE_MOST_REFLECTANCE) : paint->factor[c];
    d->textured |= paint->texture != FCT_NONE;
    d->colored |= paint->vertex_colors && !d->json.env->no_textures;
    return result;
}

/* Adds a material, and paints it if it has a texture or vertex colours. */
static fct_result add_material(fct_document *d, const fct_material *material, const fct_paint *paint,
                               uint32_t *id) {
    fct_result result = fct_scene_add_material(d->scene, material, id);
    if (result != FCT_OK || d->json.env->no_textures) return result;
    if (paint->texture == FCT_NONE && !paint->vertex_colors) return FCT_OK;
    result = fct_scene_paint_material(d->scene, *id, paint);
    if (result == FCT_OK) d->clamped += fct_textures_clamp(d->scene, *id);
    return result;
}

static fct_result read_material(fct_document *d, const char *name, json_t *value) {
    static const char *const keys[] = {"name",     "reflectance", "texture",     "vertex_colors",
                                       "emission", "two_sided",   "light_group", NULL};
    fct_material material = {.name = ""};
    fct_paint paint = fct_paint_default();
    uint32_t id;
    fct_result result = fct_json_check_object(&d->json, value, keys);
    if (result != FCT_OK) return result;
    strcpy(material.name, name); /* fct_document_read_table passes at most 63 bytes */
    result = read_paint(d, value, &material, &paint);
    if (result == FCT_OK) result = read_rgb(d, value, "emission", INFINITY, material.emission);
    if (result == FCT_OK) result = read_flag(d, value, "two_sided", &material.two_sided);
    if (result != FCT_OK) return result;
    json_t *group = json_object_get(value, "light_group");
    if (group) {
        size_t before = fct_json_enter(&d->json, "light_group");
        result = fct_document_get_id(d, "light group", d->group_ids, group, &material.light_group);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, before);
    }
    result = add_material(d, &material, &paint, &id);
    return result == FCT_OK ? fct_document_set_id(d, d->material_ids, name, id) : result;
}

fct_result fct_document_read_materials(fct_document *d) {
    fct_result result = read_light_groups(d);
    if (result == FCT_OK) result = fct_document_read_table(d, "materials", d->material_ids, read_material);
    if (result == FCT_OK && d->clamped)
        fct_note(d->json.env, FCT_MESSAGE_WARNING,
                 "%s: %zu textures reflect more than %g; such texels are reduced to %g", d->json.file,
                 d->clamped, (double)FCT_SCENE_MOST_REFLECTANCE, (double)FCT_SCENE_MOST_REFLECTANCE);
    return result;
}
