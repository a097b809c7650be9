/* scene/read/json/materials.c: light groups and materials of scene.json. */
#include "scene/read/json/materials.h"

#include <math.h>
#include <string.h>

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

static fct_result read_material(fct_document *d, const char *name, json_t *value) {
    static const char *const keys[] = {"name", "reflectance", "emission", "two_sided", "light_group", NULL};
    fct_material material = {.reflectance = {.7f, .7f, .7f}};
    uint32_t id;
    fct_result result = fct_json_check_object(&d->json, value, keys);
    if (result != FCT_OK) return result;
    strcpy(material.name, name); /* fct_document_read_table passes at most 63 bytes */
    result = read_rgb(d, value, "reflectance", 1, material.reflectance);
    if (result == FCT_OK) result = read_rgb(d, value, "emission", INFINITY, material.emission);
    if (result != FCT_OK) return result;
    json_t *two_sided = json_object_get(value, "two_sided"), *group = json_object_get(value, "light_group");
    if (two_sided) {
        size_t before = fct_json_enter(&d->json, "two_sided");
        if (!json_is_boolean(two_sided)) return fct_json_expected(&d->json, "true or false", two_sided);
        fct_json_leave(&d->json, before);
        material.two_sided = json_is_true(two_sided);
    }
    if (group) {
        size_t before = fct_json_enter(&d->json, "light_group");
        result = fct_document_get_id(d, "light group", d->group_ids, group, &material.light_group);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, before);
    }
    result = fct_scene_add_material(d->scene, &material, &id);
    return result == FCT_OK ? fct_document_set_id(d, d->material_ids, name, id) : result;
}

fct_result fct_document_read_materials(fct_document *d) {
    fct_result result = read_light_groups(d);
    return result == FCT_OK ? fct_document_read_table(d, "materials", d->material_ids, read_material)
                            : result;
}
