/* scene/read/json/instances.c: instances of scene.json: their transforms and their materials. */
#include "scene/read/json/instances.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/math/elementary.h"
#include "scene/read/json/models.h"
#include "scene/transform.h"

static fct_result read_rotation(fct_document *d, const json_t *value, double quaternion[4]) {
    static const char *const keys[] = {"axis", "degrees", NULL};
    fct_result result;
    if (json_is_array(value)) {
        result = fct_json_numbers(&d->json, value, 4, quaternion);
    } else {
        float axis[3];
        double degrees;
        result = fct_json_check_object(&d->json, value, keys);
        if (result == FCT_OK) result = fct_document_read_vector(d, value, "axis", true, axis);
        if (result != FCT_OK) return result;
        size_t before = fct_json_enter(&d->json, "degrees");
        result = fct_json_number(&d->json, json_object_get(value, "degrees"), &degrees);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, before);
        v3 unit = v3_unit(v3_load(axis));
        if (!(v3_norm(unit) > 0)) return fct_json_fail(&d->json, "the axis has no length");
        double half = degrees * (3.14159265358979323846 / 360);
        quaternion[0] = fct_sin(half) * unit.x, quaternion[1] = fct_sin(half) * unit.y;
        quaternion[2] = fct_sin(half) * unit.z, quaternion[3] = fct_cos(half);
    }
    if (result != FCT_OK) return result;
    double square = 0;
    for (int k = 0; k < 4; ++k) square += quaternion[k] * quaternion[k];
    if (!(square > 1e-60)) return fct_json_fail(&d->json, "the quaternion has no length");
    for (int k = 0; k < 4; ++k) quaternion[k] /= sqrt(square);
    return FCT_OK;
}

static fct_result read_composed_transform(fct_document *d, const json_t *instance, double out[12]) {
    double translate[3] = {0, 0, 0}, quaternion[4] = {0, 0, 0, 1}, scale[3] = {1, 1, 1};
    const json_t *value;
    fct_result result = FCT_OK;
    size_t before = d->json.length;
    if ((value = json_object_get(instance, "translate"))) {
        fct_json_enter(&d->json, "translate");
        result = fct_json_numbers(&d->json, value, 3, translate);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, before);
    }
    if ((value = json_object_get(instance, "rotate"))) {
        fct_json_enter(&d->json, "rotate");
        result = read_rotation(d, value, quaternion);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, before);
    }
    if ((value = json_object_get(instance, "scale"))) {
        fct_json_enter(&d->json, "scale");
        result = fct_json_spread(&d->json, value, 3, scale);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, before);
    }
    fct_transform_compose(translate, quaternion, scale, out);
    return FCT_OK;
}

static fct_result read_matrix_transform(fct_document *d, const json_t *value, double out[12]) {
    double m[16];
    fct_result result = fct_json_numbers(&d->json, value, 16, m);
    if (result != FCT_OK) return result;
    for (int j = 0; j < 4; ++j)
        if (m[4 * j + 3] != (j == 3))
            return fct_json_fail(
                &d->json,
                "expected 16 numbers by columns with the last row 0 0 0 1, found %g %g %g %g "
                "(transposed?)",
                m[3], m[7], m[11], m[15]);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j) out[4 * i + j] = m[4 * j + i];
    return FCT_OK;
}

static fct_result read_transform(fct_document *d, const json_t *instance, float out[12]) {
    const json_t *matrix = json_object_get(instance, "transform");
    bool parts = json_object_get(instance, "translate") || json_object_get(instance, "rotate") ||
                 json_object_get(instance, "scale");
    double m[12];
    fct_instance probe;
    fct_result result;
    size_t before = d->json.length;
    if (matrix && parts)
        return fct_json_fail(&d->json, "expected \"transform\" or translate, rotate and scale, found both");
    if (matrix) fct_json_enter(&d->json, "transform");
    result = matrix ? read_matrix_transform(d, matrix, m) : read_composed_transform(d, instance, m);
    if (result != FCT_OK) return result;
    for (int k = 0; k < 12; ++k) out[k] = (float)m[k];
    fct_transform_kind kind = fct_transform_set(out, &probe, m);
    if (kind != FCT_TRANSFORM_GOOD)
        return fct_json_fail(&d->json, kind == FCT_TRANSFORM_SINGULAR
                                           ? "the transform is singular"
                                           : "the transform holds numbers that do not fit a float");
    fct_json_leave(&d->json, before);
    return FCT_OK;
}

/* Places a split model. The material of a part comes from the map, else from its "*", else it is the scene's
 * material of the same name. */
static fct_result place_by_map(fct_document *d, const fct_document_model *model, json_t *map,
                               const char *name, const float transform[12]) {
    const fct_env *env = d->json.env;
    uint32_t *materials = fct_allocate(env, model->split.count, sizeof *materials);
    if (!materials) return fct_fail_memory(env, "an instance");
    fct_result result = FCT_OK;
    for (uint32_t k = 0; result == FCT_OK && k < model->split.count; ++k) {
        const char *part = model->part_names[k];
        const char *key = json_object_get(map, part) ? part : "*";
        const json_t *value = json_object_get(map, key), *same = json_object_get(d->material_ids, part);
        if (value) {
            size_t before = fct_json_enter(&d->json, "materials");
            fct_json_enter(&d->json, key);
            result = fct_document_get_id(d, "material", d->material_ids, value, materials + k);
            if (result == FCT_OK) fct_json_leave(&d->json, before);
        } else if (same) {
            materials[k] = (uint32_t)json_integer_value(same);
        } else {
            char clean[64];
            result = fct_json_fail(&d->json, "no material for \"%s\" of model \"%s\"",
                                   fct_json_clean(part, clean), model->name);
        }
    }
    if (result == FCT_OK)
        result =
            fct_scene_place(d->scene, name, model->split.first, model->split.count, materials, transform);
    fct_release(env, materials);
    return result;
}

static fct_result check_material_map(fct_document *d, const fct_document_model *model, json_t *map) {
    const char *key;
    json_t *value;
    size_t before = fct_json_enter(&d->json, "materials");
    if (!json_is_object(map))
        return fct_json_expected(&d->json, "an object from the mesh's materials to the scene's", map);
    json_object_foreach(map, key, value) {
        bool known = strcmp(key, "*") == 0;
        for (uint32_t k = 0; k < model->split.count && !known; ++k)
            known = strcmp(key, model->part_names[k]) == 0;
        char clean[64];
        if (!known)
            return fct_json_fail(&d->json, "model \"%s\" has no faces of material \"%s\"", model->name,
                                 fct_json_clean(key, clean));
    }
    fct_json_leave(&d->json, before);
    return FCT_OK;
}

/* Reads face_materials, one name per polygon of the file, into one label per face. */
static fct_result read_face_materials(fct_document *d, const json_t *value, const fct_mesh *mesh,
                                      uint32_t *labels) {
    uint32_t polygons = mesh->face_count;
    if (mesh->source_faces) polygons = mesh->source_count;
    if (!json_is_array(value) || json_array_size(value) != polygons) {
        char expected[64];
        snprintf(expected, sizeof expected, "an array of %u materials, one per face", polygons);
        return fct_json_expected(&d->json, expected, value);
    }
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        uint32_t polygon = mesh->source_faces ? mesh->source_faces[f] : f;
        size_t before = fct_json_enter_index(&d->json, polygon);
        fct_result result =
            fct_document_get_id(d, "material", d->material_ids, json_array_get(value, polygon), labels + f);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, before);
    }
    return FCT_OK;
}

static fct_result place_by_face(fct_document *d, const fct_document_model *model, const json_t *value,
                                const char *name, const float transform[12]) {
    const fct_env *env = d->json.env;
    fct_model_file file;
    fct_scene_parts parts = {0};
    uint32_t *labels = NULL;
    fct_result result = fct_document_open_model(d, model, true, &file);
    if (result != FCT_OK) return result;
    result = fct_document_need_mesh(d, &file);
    if (result != FCT_OK) goto done;
    labels = fct_allocate(env, file.mesh.face_count, sizeof *labels);
    if (!labels) {
        result = fct_fail_memory(env, "face materials");
        goto done;
    }
    size_t before = fct_json_enter(&d->json, "face_materials");
    result = read_face_materials(d, value, &file.mesh, labels);
    if (result != FCT_OK) goto done;
    fct_json_leave(&d->json, before);
    result =
        fct_scene_split(d->scene, model->name, &file.mesh, NULL, labels, d->scene->material_count, &parts);
    fct_document_mark_light(d, &file, &parts);
    if (result == FCT_OK)
        result = fct_scene_place(d->scene, name, parts.first, parts.count, parts.labels, transform);
done:
    fct_release(env, parts.labels);
    fct_release(env, labels);
    fct_model_close(env, &file);
    return result;
}

/* The given name, or that of the model, with a number if it is taken. */
static fct_result read_instance_name(fct_document *d, const json_t *instance, const fct_document_model *model,
                                     char out[128]) {
    const json_t *value = json_object_get(instance, "name");
    if (value) {
        const char *name;
        size_t before = fct_json_enter(&d->json, "name");
        fct_result result = fct_json_string(&d->json, value, 128, &name);
        if (result != FCT_OK) return result;
        if (json_object_get(d->instance_names, name))
            return fct_json_fail(&d->json, "the name exists already");
        fct_json_leave(&d->json, before);
        strcpy(out, name);
    } else {
        snprintf(out, 128, "%s", model->name);
        for (unsigned k = d->scene->object_count; json_object_get(d->instance_names, out); ++k)
            snprintf(out, 128, "%s.%u", model->name, k);
    }
    return fct_document_set_id(d, d->instance_names, out, 0);
}

static fct_result read_instance(fct_document *d, json_t *value) {
    static const char *const keys[] = {"name",      "model",     "material", "materials", "face_materials",
                                       "transform", "translate", "rotate",   "scale",     NULL};
    char name[128];
    float transform[12];
    uint32_t id, material;
    fct_result result = fct_json_check_object(&d->json, value, keys);
    if (result != FCT_OK) return result;
    size_t before = fct_json_enter(&d->json, "model");
    result = fct_document_get_id(d, "model", d->model_ids, json_object_get(value, "model"), &id);
    if (result != FCT_OK) return result;
    fct_json_leave(&d->json, before);
    fct_document_model *model = d->models + id;
    result = read_instance_name(d, value, model, name);
    if (result == FCT_OK) result = read_transform(d, value, transform);
    if (result != FCT_OK) return result;
    json_t *one = json_object_get(value, "material"), *map = json_object_get(value, "materials"),
           *faces = json_object_get(value, "face_materials");
    if ((one != NULL) + (map != NULL) + (faces != NULL) > 1)
        return fct_json_fail(&d->json,
                             "expected one of material, materials and face_materials, found several");
    if (one) {
        fct_json_enter(&d->json, "material");
        result = fct_document_get_id(d, "material", d->material_ids, one, &material);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, before);
        result = fct_document_need_whole(d, model);
        if (result != FCT_OK) return result;
        return fct_scene_place(d->scene, name, model->whole, 1, &material, transform);
    }
    if (faces) return place_by_face(d, model, faces, name, transform);
    result = fct_document_need_split(d, model);
    if (result == FCT_OK && map) result = check_material_map(d, model, map);
    return result == FCT_OK ? place_by_map(d, model, map, name, transform) : result;
}

fct_result fct_document_read_instances(fct_document *d) {
    json_t *instances = json_object_get(d->root, "instances");
    size_t before = fct_json_enter(&d->json, "instances");
    if (!json_is_array(instances)) return fct_json_expected(&d->json, "an array of objects", instances);
    if (json_array_size(instances) == 0) return fct_json_fail(&d->json, "expected at least one instance");
    for (size_t k = 0; k < json_array_size(instances); ++k) {
        size_t inside = fct_json_enter_index(&d->json, k);
        fct_result result = read_instance(d, json_array_get(instances, k));
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, inside);
        result = fct_progress(d->json.env, "models", (double)(k + 1) / (double)json_array_size(instances));
        if (result != FCT_OK) return result;
    }
    fct_json_leave(&d->json, before);
    return FCT_OK;
}
