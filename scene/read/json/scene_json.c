/* scene/read/json/scene_json.c: scene.json, as docs/scene.md describes it. */
#include "scene/read/json/scene_json.h"

#include <string.h>

#include "base/io/json.h"
#include "base/math/vec.h"
#include "scene/read/json/instances.h"
#include "scene/read/json/materials.h"
#include "scene/read/json/models.h"

static fct_result read_camera(fct_document *d) {
    static const char *const keys[] = {"position", "target", "up", "vertical_fov", NULL};
    json_t *value = json_object_get(d->root, "camera"), *angle;
    fct_camera camera = {.up = {0, 1, 0}, .vertical_fov = 45};
    double fov = camera.vertical_fov;
    if (!value) return FCT_OK;
    size_t before = fct_json_enter(&d->json, "camera");
    fct_result result = fct_json_check_object(&d->json, value, keys);
    if (result == FCT_OK) result = fct_document_read_vector(d, value, "position", true, camera.position);
    if (result == FCT_OK) result = fct_document_read_vector(d, value, "target", true, camera.target);
    if (result == FCT_OK) result = fct_document_read_vector(d, value, "up", false, camera.up);
    if (result != FCT_OK) return result;
    if ((angle = json_object_get(value, "vertical_fov"))) {
        size_t inside = fct_json_enter(&d->json, "vertical_fov");
        result = fct_json_number(&d->json, angle, &fov);
        if (result != FCT_OK) return result;
        if (!(fov > 0 && fov < 180)) return fct_json_expected(&d->json, "degrees between 0 and 180", angle);
        fct_json_leave(&d->json, inside);
    }
    camera.vertical_fov = (float)fov;
    v3 view = v3_unit(v3_sub(v3_load(camera.target), v3_load(camera.position)));
    if (!(v3_norm(view) > 0)) return fct_json_fail(&d->json, "position and target are the same point");
    if (!(v3_norm(v3_cross(view, v3_unit(v3_load(camera.up)))) > 1e-6))
        return fct_json_fail(&d->json, "up is zero or runs along the view");
    fct_scene_set_camera(d->scene, &camera);
    fct_json_leave(&d->json, before);
    return FCT_OK;
}

/* A material that asks for the vertex colours of a model without colours of its surface gets none. */
static void note_colorless(const fct_document *d) {
    const fct_scene *scene = d->scene;
    size_t count = 0;
    const char *first = "";
    for (uint32_t i = 0; i < scene->instance_count; ++i) {
        const fct_instance *in = &scene->instances[i];
        const fct_scene_model *own = &scene->own[in->model];
        if (!scene->paints[in->material].def.vertex_colors) continue;
        if (fct_tree_get(own->tree).colors && !own->colors_are_light) continue;
        if (!count++) first = in->name;
    }
    if (count)
        fct_note(
            d->json.env, FCT_MESSAGE_WARNING,
            "%s: %zu instances have vertex_colors, but their model has no colours of its surface (\"%s\" "
            "first); radiosity, and the colours of hierarchy files, are none",
            d->json.file, count, first);
}

static fct_result read_scene_members(fct_document *d) {
    static const char *const keys[] = {"description", "models",       "materials", "instances",
                                       "camera",      "light_groups", NULL};
    fct_result result = fct_json_check_object(&d->json, d->root, keys);
    if (result != FCT_OK) return result;
    result = fct_document_read_materials(d);
    if (result == FCT_OK) result = fct_document_read_models(d);
    if (result == FCT_OK) result = read_camera(d);
    if (result == FCT_OK) result = fct_document_read_instances(d);
    if (result == FCT_OK) note_colorless(d);
    return result;
}

static void release_document(fct_document *d) {
    fct_document_release_models(d);
    json_t *values[] = {d->root, d->material_ids, d->group_ids, d->model_ids, d->instance_names};
    for (size_t k = 0; k < sizeof values / sizeof *values; ++k) json_decref(values[k]);
}

fct_result fct_scene_read_json(fct_scene *scene, const char *name, const char *text, size_t size,
                               const char *base) {
    fct_document d = {.json = {.env = scene->env, .file = name}, .scene = scene, .base = base};
    d.material_ids = json_object(), d.group_ids = json_object();
    d.model_ids = json_object(), d.instance_names = json_object();
    fct_result result = FCT_OK;
    if (!d.material_ids || !d.group_ids || !d.model_ids || !d.instance_names)
        result = fct_fail_memory(scene->env, "names");
    const size_t mark = size >= 3 && !memcmp(text, "\xef\xbb\xbf", 3) ? 3 : 0;
    if (result == FCT_OK)
        result = fct_json_load(scene->env, name, text + mark, size - mark, JSON_REJECT_DUPLICATES, &d.root);
    if (result == FCT_OK) result = read_scene_members(&d);
    release_document(&d);
    return result;
}
