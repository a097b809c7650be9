/* scene/read/scene_json.c: scene.json, as docs/scene.md describes it.
 *
 * Models are opened at their first use and shared by all their instances: once as a whole for instances of
 * one material, once cut by the mesh's own materials for instances that map these. Only face_materials cuts a
 * model for one instance alone. Every error says where in the document it is.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "scene/read/json.h"
#include "scene/read/load.h"
#include "scene/transform.h"

typedef struct model_entry {
    const char *name; /* in the document */
    char *path;
    bool whole_there, split_there;
    uint32_t whole; /* model */
    fct_scene_parts split;
    char **part_names; /* split.count: the mesh's names of the parts' materials */
} model_entry;

typedef struct reader {
    fct_json json;
    fct_scene *scene;
    const char *base;
    json_t *document;
    json_t *material_ids, *group_ids, *model_ids, *instance_names; /* name -> number */
    model_entry *models;
    size_t model_count;
} reader;

/* ---- Named things: {"name": value, ...} or [{"name": ..., ...}, ...] ---- */

typedef fct_result read_named(reader *r, const char *name, json_t *value);

static fct_result set_id(reader *r, json_t *ids, const char *name, uint32_t id) {
    if (json_object_set_new(ids, name, json_integer(id))) return fct_fail_memory(r->json.env, "a name");
    return FCT_OK;
}

static fct_result get_id(reader *r, const char *what, json_t *ids, const json_t *value, uint32_t *id) {
    const char *name;
    char clean[64];
    *id = 0;
    fct_result result = fct_json_string(&r->json, value, 4096, &name);
    if (result != FCT_OK) return result;
    json_t *found = json_object_get(ids, name);
    if (!found) return fct_json_fail(&r->json, "there is no %s \"%s\"", what, fct_json_clean(name, clean));
    *id = (uint32_t)json_integer_value(found);
    return FCT_OK;
}

static fct_result each_element(reader *r, json_t *array, json_t *ids, read_named *read) {
    for (size_t k = 0; k < json_array_size(array); ++k) {
        json_t *value = json_array_get(array, k);
        size_t before = fct_json_enter_index(&r->json, k);
        if (!json_is_object(value)) return fct_json_expected(&r->json, "an object with a name", value);
        const char *name = NULL;
        size_t inside = fct_json_enter(&r->json, "name");
        fct_result result = fct_json_string(&r->json, json_object_get(value, "name"), 64, &name);
        char clean[64];
        if (result == FCT_OK && json_object_get(ids, name))
            result = fct_json_fail(&r->json, "\"%s\" is there already", fct_json_clean(name, clean));
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, inside);
        result = read(r, name, value);
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, before);
    }
    return FCT_OK;
}

static fct_result each_named(reader *r, const char *key, json_t *ids, read_named *read) {
    json_t *table = json_object_get(r->document, key), *value;
    const char *name;
    fct_result result;
    size_t before = fct_json_enter(&r->json, key);
    if (json_is_array(table)) {
        result = each_element(r, table, ids, read);
        if (result == FCT_OK) fct_json_leave(&r->json, before);
        return result;
    }
    if (!json_is_object(table)) return fct_json_expected(&r->json, "an object or an array", table);
    json_object_foreach(table, name, value) {
        size_t inside = fct_json_enter(&r->json, name);
        if (!name[0] || strlen(name) > 63) return fct_json_fail(&r->json, "expected a name of 1 to 63 bytes");
        result = read(r, name, value);
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, inside);
    }
    fct_json_leave(&r->json, before);
    return FCT_OK;
}

/* ---- Light groups, materials, camera ---- */

static fct_result read_groups(reader *r) {
    json_t *groups = json_object_get(r->document, "light_groups");
    if (!groups) return FCT_OK;
    size_t before = fct_json_enter(&r->json, "light_groups");
    if (!json_is_array(groups)) return fct_json_expected(&r->json, "an array of names", groups);
    for (size_t k = 0; k < json_array_size(groups); ++k) {
        const char *name;
        uint32_t id;
        size_t inside = fct_json_enter_index(&r->json, k);
        fct_result result = fct_json_string(&r->json, json_array_get(groups, k), 64, &name);
        if (result != FCT_OK) return result;
        if (json_object_get(r->group_ids, name)) return fct_json_fail(&r->json, "the name is there already");
        result = fct_scene_add_light_group(r->scene, name, &id);
        if (result == FCT_OK) result = set_id(r, r->group_ids, name, id);
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, inside);
    }
    fct_json_leave(&r->json, before);
    return FCT_OK;
}

static fct_result read_rgb(reader *r, const json_t *object, const char *key, double upper, float out[3]) {
    const json_t *value = json_object_get(object, key);
    double rgb[3];
    if (!value) return FCT_OK;
    size_t before = fct_json_enter(&r->json, key);
    fct_result result = fct_json_spread(&r->json, value, 3, rgb);
    for (int c = 0; result == FCT_OK && c < 3; ++c) {
        out[c] = (float)rgb[c];
        if (rgb[c] < 0)
            result = fct_json_fail(&r->json, "expected numbers >= 0, found %g", rgb[c]);
        else if (!(out[c] < upper))
            result = fct_json_fail(&r->json, "expected numbers below %g, found %g", upper, rgb[c]);
    }
    if (result == FCT_OK) fct_json_leave(&r->json, before);
    return result;
}

static fct_result read_material(reader *r, const char *name, json_t *value) {
    static const char *const keys[] = {"name", "reflectance", "emission", "two_sided", "light_group", NULL};
    fct_material material = {.reflectance = {.7f, .7f, .7f}};
    uint32_t id;
    fct_result result = fct_json_check_object(&r->json, value, keys);
    if (result != FCT_OK) return result;
    strcpy(material.name, name); /* both callers let at most 63 bytes through */
    result = read_rgb(r, value, "reflectance", 1, material.reflectance);
    if (result == FCT_OK) result = read_rgb(r, value, "emission", INFINITY, material.emission);
    if (result != FCT_OK) return result;
    json_t *two_sided = json_object_get(value, "two_sided"), *group = json_object_get(value, "light_group");
    if (two_sided) {
        size_t before = fct_json_enter(&r->json, "two_sided");
        if (!json_is_boolean(two_sided)) return fct_json_expected(&r->json, "true or false", two_sided);
        fct_json_leave(&r->json, before);
        material.two_sided = json_is_true(two_sided);
    }
    if (group) {
        size_t before = fct_json_enter(&r->json, "light_group");
        result = get_id(r, "light group", r->group_ids, group, &material.light_group);
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, before);
    }
    result = fct_scene_add_material(r->scene, &material, &id);
    return result == FCT_OK ? set_id(r, r->material_ids, name, id) : result;
}

static fct_result read_vector(reader *r, const json_t *object, const char *key, bool required, float out[3]) {
    const json_t *value = json_object_get(object, key);
    double numbers[3];
    if (!value && !required) return FCT_OK;
    size_t before = fct_json_enter(&r->json, key);
    fct_result result = fct_json_numbers(&r->json, value, 3, numbers);
    if (result != FCT_OK) return result;
    for (int c = 0; c < 3; ++c) out[c] = (float)numbers[c];
    fct_json_leave(&r->json, before);
    return FCT_OK;
}

static fct_result read_camera(reader *r) {
    static const char *const keys[] = {"position", "target", "up", "vertical_fov", NULL};
    json_t *value = json_object_get(r->document, "camera"), *angle;
    fct_camera camera = {.up = {0, 1, 0}, .vertical_fov = 45};
    double fov = camera.vertical_fov;
    if (!value) return FCT_OK;
    size_t before = fct_json_enter(&r->json, "camera");
    fct_result result = fct_json_check_object(&r->json, value, keys);
    if (result == FCT_OK) result = read_vector(r, value, "position", true, camera.position);
    if (result == FCT_OK) result = read_vector(r, value, "target", true, camera.target);
    if (result == FCT_OK) result = read_vector(r, value, "up", false, camera.up);
    if (result != FCT_OK) return result;
    if ((angle = json_object_get(value, "vertical_fov"))) {
        size_t inside = fct_json_enter(&r->json, "vertical_fov");
        result = fct_json_number(&r->json, angle, &fov);
        if (result != FCT_OK) return result;
        if (!(fov > 0 && fov < 180)) return fct_json_expected(&r->json, "degrees between 0 and 180", angle);
        fct_json_leave(&r->json, inside);
    }
    camera.vertical_fov = (float)fov;
    v3 view = v3_unit(v3_sub(v3_load(camera.target), v3_load(camera.position)));
    if (!(v3_norm(view) > 0)) return fct_json_fail(&r->json, "position and target are the same point");
    if (!(v3_norm(v3_cross(view, v3_unit(v3_load(camera.up)))) > 1e-6))
        return fct_json_fail(&r->json, "up is zero or runs along the view");
    fct_scene_set_camera(r->scene, &camera);
    fct_json_leave(&r->json, before);
    return FCT_OK;
}

/* ---- Models ---- */

static fct_result read_model(reader *r, const char *name, json_t *value) {
    static const char *const keys[] = {"name", "file", NULL};
    const char *file;
    size_t before = r->json.length;
    if (json_is_object(value)) {
        fct_result result = fct_json_check_object(&r->json, value, keys);
        if (result != FCT_OK) return result;
        value = json_object_get(value, "file");
        fct_json_enter(&r->json, "file");
    }
    fct_result result = fct_json_string(&r->json, value, 4096, &file);
    if (result != FCT_OK) return result;
    fct_json_leave(&r->json, before);
    model_entry *entry = r->models + r->model_count;
    *entry = (model_entry){.name = name};
    entry->path = fct_path_join(r->json.env, r->base, file);
    if (!entry->path) return FCT_ERROR_MEMORY;
    return set_id(r, r->model_ids, name, (uint32_t)r->model_count++);
}

/* What the model's file lacks is said by whoever reads it; this adds where the scene asks for it. */
static fct_result open_model(reader *r, const model_entry *entry, bool want_mesh, fct_model_file *file) {
    fct_result result = fct_model_open(r->json.env, entry->path, want_mesh, file);
    if (result == FCT_ERROR_INPUT)
        fct_fail(r->json.env, result, "%s: %s: model \"%s\": cannot read \"%s\"", r->json.file, r->json.path,
                 entry->name, entry->path);
    return result;
}

static fct_result need_whole(reader *r, model_entry *entry) {
    if (entry->whole_there) return FCT_OK;
    fct_model_file file;
    fct_scene_parts parts = {0};
    fct_result result = open_model(r, entry, false, &file);
    if (result != FCT_OK) return result;
    fct_tree *tree = file.tree;
    file.tree = NULL;
    result = fct_scene_split(r->scene, entry->name, tree ? NULL : &file.mesh, tree, NULL, 1, &parts);
    entry->whole = parts.first;
    entry->whole_there = result == FCT_OK;
    fct_release(r->json.env, parts.labels);
    fct_model_close(r->json.env, &file);
    return result;
}

static fct_result name_parts(reader *r, model_entry *entry, const fct_mesh *mesh) {
    const fct_env *env = r->json.env;
    entry->part_names = fct_allocate_zero(env, entry->split.count, sizeof *entry->part_names);
    if (!entry->part_names) return fct_fail_memory(env, "names of materials");
    for (uint32_t k = 0; k < entry->split.count; ++k) {
        uint32_t label = entry->split.labels[k];
        char number[16];
        snprintf(number, sizeof number, "%u", label);
        const char *name =
            mesh->material_names && label < mesh->material_count ? mesh->material_names[label] : number;
        entry->part_names[k] = fct_allocate(env, strlen(name) + 1, 1);
        if (!entry->part_names[k]) return fct_fail_memory(env, "names of materials");
        strcpy(entry->part_names[k], name);
    }
    return FCT_OK;
}

/* The mesh of a file that was opened, hierarchy or not, in input order. */
static fct_result mesh_of(reader *r, fct_model_file *file) {
    return file->tree ? fct_tree_mesh(r->json.env, file->tree, &file->mesh) : FCT_OK;
}

static fct_result need_split(reader *r, model_entry *entry) {
    if (entry->split_there) return FCT_OK;
    fct_model_file file;
    fct_result result = open_model(r, entry, false, &file);
    if (result != FCT_OK) return result;
    result = mesh_of(r, &file);
    if (result == FCT_OK && !file.mesh.materials)
        result =
            fct_json_fail(&r->json,
                          "expected \"material\" or \"face_materials\", for the file of model \"%s\" names "
                          "no materials",
                          entry->name);
    uint32_t label_count = file.mesh.material_count;
    for (uint32_t f = 0; result == FCT_OK && f < file.mesh.face_count; ++f)
        if (file.mesh.materials[f] >= label_count) label_count = file.mesh.materials[f] + 1;
    if (result == FCT_OK)
        result = fct_scene_split(r->scene, entry->name, &file.mesh, NULL, file.mesh.materials, label_count,
                                 &entry->split);
    entry->split_there = result == FCT_OK;
    if (result == FCT_OK) result = name_parts(r, entry, &file.mesh);
    fct_model_close(r->json.env, &file);
    return result;
}

/* ---- Instances ---- */

static fct_result read_rotation(reader *r, const json_t *value, double quaternion[4]) {
    static const char *const keys[] = {"axis", "degrees", NULL};
    fct_result result;
    if (json_is_array(value)) {
        result = fct_json_numbers(&r->json, value, 4, quaternion);
    } else {
        float axis[3];
        double degrees;
        result = fct_json_check_object(&r->json, value, keys);
        if (result == FCT_OK) result = read_vector(r, value, "axis", true, axis);
        if (result != FCT_OK) return result;
        size_t before = fct_json_enter(&r->json, "degrees");
        result = fct_json_number(&r->json, json_object_get(value, "degrees"), &degrees);
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, before);
        v3 unit = v3_unit(v3_load(axis));
        if (!(v3_norm(unit) > 0)) return fct_json_fail(&r->json, "the axis has no length");
        double half = degrees * (3.14159265358979323846 / 360);
        quaternion[0] = sin(half) * unit.x, quaternion[1] = sin(half) * unit.y;
        quaternion[2] = sin(half) * unit.z, quaternion[3] = cos(half);
    }
    if (result != FCT_OK) return result;
    double square = 0;
    for (int k = 0; k < 4; ++k) square += quaternion[k] * quaternion[k];
    if (!(square > 1e-60)) return fct_json_fail(&r->json, "the quaternion has no length");
    for (int k = 0; k < 4; ++k) quaternion[k] /= sqrt(square);
    return FCT_OK;
}

static fct_result read_parts_of_transform(reader *r, const json_t *instance, double out[12]) {
    double translate[3] = {0, 0, 0}, quaternion[4] = {0, 0, 0, 1}, scale[3] = {1, 1, 1};
    const json_t *value;
    fct_result result = FCT_OK;
    size_t before = r->json.length;
    if ((value = json_object_get(instance, "translate"))) {
        fct_json_enter(&r->json, "translate");
        result = fct_json_numbers(&r->json, value, 3, translate);
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, before);
    }
    if ((value = json_object_get(instance, "rotate"))) {
        fct_json_enter(&r->json, "rotate");
        result = read_rotation(r, value, quaternion);
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, before);
    }
    if ((value = json_object_get(instance, "scale"))) {
        fct_json_enter(&r->json, "scale");
        result = fct_json_spread(&r->json, value, 3, scale);
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, before);
    }
    fct_transform_compose(translate, quaternion, scale, out);
    return FCT_OK;
}

static fct_result read_matrix(reader *r, const json_t *value, double out[12]) {
    double m[16];
    fct_result result = fct_json_numbers(&r->json, value, 16, m);
    if (result != FCT_OK) return result;
    for (int j = 0; j < 4; ++j)
        if (m[4 * j + 3] != (j == 3))
            return fct_json_fail(
                &r->json,
                "expected 16 numbers by columns with the last row 0 0 0 1, found %g %g %g %g "
                "(transposed?)",
                m[3], m[7], m[11], m[15]);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j) out[4 * i + j] = m[4 * j + i];
    return FCT_OK;
}

static fct_result read_transform(reader *r, const json_t *instance, float out[12]) {
    const json_t *matrix = json_object_get(instance, "transform");
    bool parts = json_object_get(instance, "translate") || json_object_get(instance, "rotate") ||
                 json_object_get(instance, "scale");
    double m[12];
    fct_instance probe;
    fct_result result;
    size_t before = r->json.length;
    if (matrix && parts)
        return fct_json_fail(&r->json, "expected \"transform\" or translate, rotate and scale, found both");
    if (matrix) fct_json_enter(&r->json, "transform");
    result = matrix ? read_matrix(r, matrix, m) : read_parts_of_transform(r, instance, m);
    if (result != FCT_OK) return result;
    for (int k = 0; k < 12; ++k) out[k] = (float)m[k];
    fct_transform_kind kind = fct_transform_set(out, &probe, m);
    if (kind != FCT_TRANSFORM_GOOD)
        return fct_json_fail(&r->json, kind == FCT_TRANSFORM_SINGULAR
                                           ? "the transform is singular"
                                           : "the transform holds numbers that fit no float");
    fct_json_leave(&r->json, before);
    return FCT_OK;
}

/* A material for each part: from the map, from its "*", or the scene's material of the same name. */
static fct_result place_split(reader *r, const model_entry *entry, json_t *map, const char *name,
                              const float transform[12]) {
    const fct_env *env = r->json.env;
    uint32_t *materials = fct_allocate(env, entry->split.count, sizeof *materials);
    if (!materials) return fct_fail_memory(env, "an instance");
    fct_result result = FCT_OK;
    for (uint32_t k = 0; result == FCT_OK && k < entry->split.count; ++k) {
        const char *part = entry->part_names[k];
        const char *key = json_object_get(map, part) ? part : "*";
        const json_t *value = json_object_get(map, key), *same = json_object_get(r->material_ids, part);
        if (value) {
            size_t before = fct_json_enter(&r->json, "materials");
            fct_json_enter(&r->json, key);
            result = get_id(r, "material", r->material_ids, value, materials + k);
            if (result == FCT_OK) fct_json_leave(&r->json, before);
        } else if (same) {
            materials[k] = (uint32_t)json_integer_value(same);
        } else {
            char clean[64];
            result = fct_json_fail(&r->json, "no material for \"%s\" of model \"%s\"",
                                   fct_json_clean(part, clean), entry->name);
        }
    }
    if (result == FCT_OK)
        result =
            fct_scene_place(r->scene, name, entry->split.first, entry->split.count, materials, transform);
    fct_release(env, materials);
    return result;
}

static fct_result check_map(reader *r, const model_entry *entry, json_t *map) {
    const char *key;
    json_t *value;
    size_t before = fct_json_enter(&r->json, "materials");
    if (!json_is_object(map))
        return fct_json_expected(&r->json, "an object from the mesh's materials to the scene's", map);
    json_object_foreach(map, key, value) {
        bool known = strcmp(key, "*") == 0;
        for (uint32_t k = 0; k < entry->split.count && !known; ++k)
            known = strcmp(key, entry->part_names[k]) == 0;
        char clean[64];
        if (!known)
            return fct_json_fail(&r->json, "model \"%s\" has no faces of material \"%s\"", entry->name,
                                 fct_json_clean(key, clean));
    }
    fct_json_leave(&r->json, before);
    return FCT_OK;
}

/* Face labels for face_materials: one name per polygon of the file. */
static fct_result read_face_materials(reader *r, const json_t *value, const fct_mesh *mesh,
                                      uint32_t *labels) {
    uint32_t polygons = mesh->face_count;
    if (mesh->source_faces && mesh->face_count) polygons = mesh->source_faces[mesh->face_count - 1] + 1;
    if (!json_is_array(value) || json_array_size(value) != polygons) {
        char expected[64];
        snprintf(expected, sizeof expected, "an array of %u materials, one per face", polygons);
        return fct_json_expected(&r->json, expected, value);
    }
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        uint32_t polygon = mesh->source_faces ? mesh->source_faces[f] : f;
        size_t before = fct_json_enter_index(&r->json, polygon);
        fct_result result =
            get_id(r, "material", r->material_ids, json_array_get(value, polygon), labels + f);
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, before);
    }
    return FCT_OK;
}

static fct_result place_by_face(reader *r, const model_entry *entry, const json_t *value, const char *name,
                                const float transform[12]) {
    const fct_env *env = r->json.env;
    fct_model_file file;
    fct_scene_parts parts = {0};
    uint32_t *labels = NULL;
    fct_result result = open_model(r, entry, true, &file);
    if (result != FCT_OK) return result;
    result = mesh_of(r, &file);
    if (result != FCT_OK) goto done;
    labels = fct_allocate(env, file.mesh.face_count, sizeof *labels);
    if (!labels) {
        result = fct_fail_memory(env, "face materials");
        goto done;
    }
    size_t before = fct_json_enter(&r->json, "face_materials");
    result = read_face_materials(r, value, &file.mesh, labels);
    if (result != FCT_OK) goto done;
    fct_json_leave(&r->json, before);
    result =
        fct_scene_split(r->scene, entry->name, &file.mesh, NULL, labels, r->scene->material_count, &parts);
    if (result == FCT_OK)
        result = fct_scene_place(r->scene, name, parts.first, parts.count, parts.labels, transform);
done:
    fct_release(env, parts.labels);
    fct_release(env, labels);
    fct_model_close(env, &file);
    return result;
}

/* The given name, or the model's, numbered from its second instance on. */
static fct_result read_instance_name(reader *r, const json_t *instance, const model_entry *entry,
                                     char out[128]) {
    const json_t *value = json_object_get(instance, "name");
    if (value) {
        const char *name;
        size_t before = fct_json_enter(&r->json, "name");
        fct_result result = fct_json_string(&r->json, value, 128, &name);
        if (result != FCT_OK) return result;
        if (json_object_get(r->instance_names, name))
            return fct_json_fail(&r->json, "the name is there already");
        fct_json_leave(&r->json, before);
        strcpy(out, name);
    } else {
        snprintf(out, 128, "%s", entry->name);
        for (unsigned k = r->scene->object_count; json_object_get(r->instance_names, out); ++k)
            snprintf(out, 128, "%s.%u", entry->name, k);
    }
    return set_id(r, r->instance_names, out, 0);
}

static fct_result read_instance(reader *r, json_t *value) {
    static const char *const keys[] = {"name",      "model",     "material", "materials", "face_materials",
                                       "transform", "translate", "rotate",   "scale",     NULL};
    char name[128];
    float transform[12];
    uint32_t model, material;
    fct_result result = fct_json_check_object(&r->json, value, keys);
    if (result != FCT_OK) return result;
    size_t before = fct_json_enter(&r->json, "model");
    result = get_id(r, "model", r->model_ids, json_object_get(value, "model"), &model);
    if (result != FCT_OK) return result;
    fct_json_leave(&r->json, before);
    model_entry *entry = r->models + model;
    result = read_instance_name(r, value, entry, name);
    if (result == FCT_OK) result = read_transform(r, value, transform);
    if (result != FCT_OK) return result;
    json_t *one = json_object_get(value, "material"), *map = json_object_get(value, "materials"),
           *faces = json_object_get(value, "face_materials");
    if ((one != NULL) + (map != NULL) + (faces != NULL) > 1)
        return fct_json_fail(&r->json,
                             "expected one of material, materials and face_materials, found several");
    if (one) {
        fct_json_enter(&r->json, "material");
        result = get_id(r, "material", r->material_ids, one, &material);
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, before);
        result = need_whole(r, entry);
        if (result != FCT_OK) return result;
        return fct_scene_place(r->scene, name, entry->whole, 1, &material, transform);
    }
    if (faces) return place_by_face(r, entry, faces, name, transform);
    result = need_split(r, entry);
    if (result == FCT_OK && map) result = check_map(r, entry, map);
    return result == FCT_OK ? place_split(r, entry, map, name, transform) : result;
}

static fct_result read_instances(reader *r) {
    json_t *instances = json_object_get(r->document, "instances");
    size_t before = fct_json_enter(&r->json, "instances");
    if (!json_is_array(instances)) return fct_json_expected(&r->json, "an array of objects", instances);
    if (json_array_size(instances) == 0) return fct_json_fail(&r->json, "expected at least one instance");
    for (size_t k = 0; k < json_array_size(instances); ++k) {
        size_t inside = fct_json_enter_index(&r->json, k);
        fct_result result = read_instance(r, json_array_get(instances, k));
        if (result != FCT_OK) return result;
        fct_json_leave(&r->json, inside);
    }
    fct_json_leave(&r->json, before);
    return FCT_OK;
}

/* ---- The document ---- */

static fct_result read_document(reader *r) {
    static const char *const keys[] = {"description", "models",       "materials", "instances",
                                       "camera",      "light_groups", NULL};
    fct_result result = fct_json_check_object(&r->json, r->document, keys);
    if (result != FCT_OK) return result;
    json_t *models = json_object_get(r->document, "models");
    size_t model_count = json_is_array(models) ? json_array_size(models) : json_object_size(models);
    r->models = fct_allocate(r->json.env, model_count, sizeof *r->models);
    if (!r->models) return fct_fail_memory(r->json.env, "models");
    result = read_groups(r);
    if (result == FCT_OK) result = each_named(r, "materials", r->material_ids, read_material);
    if (result == FCT_OK) result = each_named(r, "models", r->model_ids, read_model);
    if (result == FCT_OK) result = read_camera(r);
    return result == FCT_OK ? read_instances(r) : result;
}

static void close_reader(reader *r) {
    const fct_env *env = r->json.env;
    for (size_t m = 0; m < r->model_count; ++m) {
        model_entry *entry = r->models + m;
        for (uint32_t k = 0; entry->part_names && k < entry->split.count; ++k)
            fct_release(env, entry->part_names[k]);
        fct_release(env, entry->part_names);
        fct_release(env, entry->split.labels);
        fct_release(env, entry->path);
    }
    fct_release(env, r->models);
    json_t *values[] = {r->document, r->material_ids, r->group_ids, r->model_ids, r->instance_names};
    for (size_t k = 0; k < sizeof values / sizeof *values; ++k) json_decref(values[k]);
}

fct_result fct_scene_read_json(fct_scene *scene, const char *name, const char *text, size_t size,
                               const char *base) {
    reader r = {.json = {.env = scene->env, .file = name}, .scene = scene, .base = base};
    r.material_ids = json_object(), r.group_ids = json_object();
    r.model_ids = json_object(), r.instance_names = json_object();
    fct_result result = FCT_OK;
    if (!r.material_ids || !r.group_ids || !r.model_ids || !r.instance_names)
        result = fct_fail_memory(scene->env, "names");
    if (result == FCT_OK) result = fct_json_parse(&r.json, text, size, &r.document);
    if (result == FCT_OK) result = read_document(&r);
    close_reader(&r);
    return result;
}
