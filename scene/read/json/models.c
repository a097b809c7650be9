/* scene/read/json/models.c: models of scene.json.
 *
 * The first instance that needs a model opens its file, and all instances share it. A model is added to the
 * scene at most twice: whole, for instances with one material, and split by the mesh's materials, for
 * instances that map these.
 */
#include "scene/read/json/models.h"

#include <stdio.h>
#include <string.h>

#include "scene/read/path.h"

static fct_result read_model(fct_document *d, const char *name, json_t *value) {
    static const char *const keys[] = {"name", "file", NULL};
    const char *file;
    size_t before = d->json.length;
    if (json_is_object(value)) {
        fct_result result = fct_json_check_object(&d->json, value, keys);
        if (result != FCT_OK) return result;
        value = json_object_get(value, "file");
        fct_json_enter(&d->json, "file");
    }
    fct_result result = fct_json_string(&d->json, value, 4096, &file);
    if (result != FCT_OK) return result;
    fct_json_leave(&d->json, before);
    fct_document_model *model = d->models + d->model_count;
    *model = (fct_document_model){.name = name};
    model->path = fct_path_join(d->json.env, d->base, file);
    if (!model->path) return FCT_ERROR_MEMORY;
    return fct_document_set_id(d, d->model_ids, name, (uint32_t)d->model_count++);
}

fct_result fct_document_open_model(fct_document *d, const fct_document_model *model, bool want_mesh,
                                   fct_model_file *file) {
    fct_result result = fct_model_open(d->json.env, model->path, want_mesh, d->textured || d->colored, file);
    if (result == FCT_ERROR_INPUT)
        fct_fail(d->json.env, result, "%s: %s: model \"%s\": cannot read \"%s\"", d->json.file, d->json.path,
                 model->name, model->path);
    return result;
}

fct_result fct_document_need_whole(fct_document *d, fct_document_model *model) {
    if (model->whole_there) return FCT_OK;
    fct_model_file file;
    fct_scene_parts parts = {0};
    fct_result result = fct_document_open_model(d, model, false, &file);
    if (result != FCT_OK) return result;
    fct_tree *tree = file.tree;
    file.tree = NULL;
    const bool meshed = file.mesh.face_count > 0;
    result = fct_scene_split(d->scene, model->name, meshed ? &file.mesh : NULL, tree, NULL, 1, &parts);
    fct_document_mark_light(d, &file, &parts);
    model->whole = parts.first;
    model->whole_there = result == FCT_OK;
    fct_release(d->json.env, parts.labels);
    fct_model_close(d->json.env, &file);
    return result;
}

/* Copies the names of the parts' materials; a mesh without names has numbers. */
static fct_result name_model_parts(fct_document *d, fct_document_model *model, const fct_mesh *mesh) {
    const fct_env *env = d->json.env;
    model->part_names = fct_allocate_zero(env, model->split.count, sizeof *model->part_names);
    if (!model->part_names) return fct_fail_memory(env, "names of materials");
    for (uint32_t k = 0; k < model->split.count; ++k) {
        uint32_t label = model->split.labels[k];
        char number[16];
        snprintf(number, sizeof number, "%u", label);
        const char *name =
            mesh->material_names && label < mesh->material_count ? mesh->material_names[label] : number;
        model->part_names[k] = fct_allocate(env, strlen(name) + 1, 1);
        if (!model->part_names[k]) return fct_fail_memory(env, "names of materials");
        strcpy(model->part_names[k], name);
    }
    return FCT_OK;
}

fct_result fct_document_need_mesh(fct_document *d, fct_model_file *file) {
    return file->mesh.face_count ? FCT_OK : fct_tree_mesh(d->json.env, file->tree, &file->mesh);
}

void fct_document_mark_light(fct_document *d, const fct_model_file *file, const fct_scene_parts *parts) {
    for (uint32_t k = 0; k < parts->count; ++k)
        d->scene->own[parts->first + k].colors_are_light = file->light;
}

fct_result fct_document_need_split(fct_document *d, fct_document_model *model) {
    if (model->split_there) return FCT_OK;
    fct_model_file file;
    fct_result result = fct_document_open_model(d, model, false, &file);
    if (result != FCT_OK) return result;
    result = fct_document_need_mesh(d, &file);
    if (result == FCT_OK && !file.mesh.materials)
        result =
            fct_json_fail(&d->json,
                          "expected \"material\" or \"face_materials\", because the file of model \"%s\" "
                          "names no materials",
                          model->name);
    uint32_t label_count = file.mesh.material_count;
    for (uint32_t f = 0; result == FCT_OK && f < file.mesh.face_count; ++f)
        if (file.mesh.materials[f] >= label_count) label_count = file.mesh.materials[f] + 1;
    if (result == FCT_OK)
        result = fct_scene_split(d->scene, model->name, &file.mesh, NULL, file.mesh.materials, label_count,
                                 &model->split);
    fct_document_mark_light(d, &file, &model->split);
    model->split_there = result == FCT_OK;
    if (result == FCT_OK) result = name_model_parts(d, model, &file.mesh);
    fct_model_close(d->json.env, &file);
    return result;
}

fct_result fct_document_read_models(fct_document *d) {
    json_t *models = json_object_get(d->root, "models");
    size_t count = json_is_array(models) ? json_array_size(models) : json_object_size(models);
    d->models = fct_allocate(d->json.env, count, sizeof *d->models);
    if (!d->models) return fct_fail_memory(d->json.env, "models");
    return fct_document_read_table(d, "models", d->model_ids, read_model);
}

void fct_document_release_models(fct_document *d) {
    const fct_env *env = d->json.env;
    for (size_t m = 0; m < d->model_count; ++m) {
        fct_document_model *model = d->models + m;
        for (uint32_t k = 0; model->part_names && k < model->split.count; ++k)
            fct_release(env, model->part_names[k]);
        fct_release(env, model->part_names);
        fct_release(env, model->split.labels);
        fct_release(env, model->path);
    }
    fct_release(env, d->models);
}
