/* scene/scene.c: builds a scene: materials, models split by material, objects. The commit that makes it
 * immutable is in commit.c, queries are in rays.c and closest.c, the hierarchy over instances is in volume.c.
 */
#include "scene/scene.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "base/math/origin.h"
#include "facetree/dual.h"
#include "scene/transform.h"
#include "scene/winding.h"

fct_result fct_scene_create(const fct_env *env, fct_backend backend, fct_scene **out) {
    *out = NULL;
    fct_scene *scene = fct_allocate_zero(env, 1, sizeof *scene);
    if (!scene) return fct_fail_memory(env, "a scene");
    scene->env = env;
    scene->backend = backend;
    scene->patches = FCT_SCENE_PATCHES;
    *out = scene;
    return FCT_OK;
}

static void release_model(const fct_env *env, fct_scene_model *model) {
    if (model->bvh) fct_bvh_destroy(model->bvh);
    if (model->points) fct_bvh_destroy(model->points);
    if (model->coarse_bvh) fct_bvh_destroy(model->coarse_bvh);
    fct_coarse_release(env, &model->coarse);
    if (model->tree) fct_tree_destroy(model->tree);
    fct_release(env, model->source_faces);
    fct_release(env, model->source_vertices);
    fct_release(env, model->loose_vertices);
    fct_release(env, model->loose_positions);
    fct_release(env, model->attributes.texcoords);
    fct_release(env, model->attributes.normals);
    fct_release(env, model->attributes.corner_normals);
    fct_release(env, model->attributes.face_colors);
}

void fct_scene_destroy(fct_scene *scene) {
    if (!scene) return;
    const fct_env *env = scene->env;
    if (scene->coarse) {
        fct_release(env, scene->coarse->models);
        fct_release(env, scene->coarse->frames);
        fct_release(env, scene->coarse);
    }
    for (uint32_t m = 0; m < scene->model_count; ++m) release_model(env, scene->own + m);
    for (uint32_t g = 0; g < scene->light_group_count; ++g) fct_release(env, scene->light_groups[g]);
    fct_scene_release_textures(scene);
    void *arrays[] = {scene->materials, scene->paints,  scene->models,       scene->own,     scene->instances,
                      scene->frames,    scene->objects, scene->light_groups, scene->volumes, scene->nodes};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i) fct_release(env, arrays[i]);
    fct_release(env, scene);
}

static fct_result copy_name(const fct_env *env, const char *what, const char *name, char *to, size_t size) {
    size_t length = strlen(name);
    if (length >= size)
        return fct_fail(env, FCT_ERROR_DATA, "%s name \"%.40s...\" has %zu bytes, expected at most %zu", what,
                        name, length, size - 1);
    memcpy(to, name, length + 1);
    return FCT_OK;
}

/* ---- Materials ---- */

fct_result fct_scene_add_material(fct_scene *scene, const fct_material *material, uint32_t *id) {
    assert(!scene->committed);
    const fct_env *env = scene->env;
    *id = FCT_NONE;
    if (!memchr(material->name, 0, sizeof material->name))
        return fct_fail(env, FCT_ERROR_DATA, "a material's name has no terminating zero");
    for (int c = 0; c < 3; ++c) {
        float r = material->reflectance[c], e = material->emission[c];
        if (!(r >= 0 && r < 1))
            return fct_fail(env, FCT_ERROR_DATA, "material \"%s\": reflectance[%d] is %g, expected [0, 1)",
                            material->name, c, (double)r);
        if (!(e >= 0 && isfinite(e)))
            return fct_fail(env, FCT_ERROR_DATA,
                            "material \"%s\": emission[%d] is %g, expected a finite number >= 0",
                            material->name, c, (double)e);
    }
    fct_result result = fct_grow(env, (void **)&scene->materials, &scene->material_capacity,
                                 (size_t)scene->material_count + 1, sizeof *scene->materials);
    if (result == FCT_OK)
        result = fct_grow(env, (void **)&scene->paints, &scene->paint_capacity,
                          (size_t)scene->material_count + 1, sizeof *scene->paints);
    if (result != FCT_OK) return result;
    *id = scene->material_count++;
    scene->materials[*id] = *material;
    scene->paints[*id] = (fct_scene_paint){.pyramid = FCT_NONE};
    return FCT_OK;
}

fct_result fct_scene_add_light_group(fct_scene *scene, const char *name, uint32_t *id) {
    assert(!scene->committed);
    *id = FCT_NONE;
    fct_result result = fct_grow(scene->env, (void **)&scene->light_groups, &scene->light_group_capacity,
                                 (size_t)scene->light_group_count + 1, sizeof *scene->light_groups);
    if (result != FCT_OK) return result;
    size_t length = strlen(name) + 1;
    char *copy = fct_allocate(scene->env, length, 1);
    if (!copy) return fct_fail_memory(scene->env, "a light group");
    memcpy(copy, name, length);
    *id = scene->light_group_count++;
    scene->light_groups[*id] = copy;
    return FCT_OK;
}

/* ---- Local origins ---- */

/* Coordinates so many times larger than their bounding box have few digits left, and get a local origin. */
#define FAR_AWAY 512

void fct_scene_choose_origin(const double lower[3], const double upper[3], double origin[3]) {
    fct_extent extent = {.any = true, .fine = true};
    double largest = 0, side = 0;
    for (int c = 0; c < 3; ++c) {
        extent.lower[c] = lower[c], extent.upper[c] = upper[c], origin[c] = 0;
        largest = fmax(largest, fmax(fabs(lower[c]), fabs(upper[c])));
        side = fmax(side, upper[c] - lower[c]);
    }
    if (largest > FAR_AWAY * side) fct_extent_origin(&extent, origin);
}

/* Moves a mesh to a local origin if it is far from its own one. *moved: its positions are a copy, which the
 * caller releases. Errors: MEMORY. */
static fct_result center_mesh(const fct_env *env, fct_mesh *mesh, double origin[3], bool *moved) {
    double lower[3], upper[3], away[3];
    size_t count = 3 * (size_t)mesh->vertex_count;
    for (int c = 0; c < 3; ++c) lower[c] = INFINITY, upper[c] = -INFINITY, origin[c] = mesh->origin[c];
    for (size_t i = 0; i < count; ++i) {
        double x = mesh->positions[i];
        lower[i % 3] = x < lower[i % 3] ? x : lower[i % 3],
                  upper[i % 3] = x > upper[i % 3] ? x : upper[i % 3];
    }
    fct_scene_choose_origin(lower, upper, away);
    *moved = away[0] != 0 || away[1] != 0 || away[2] != 0;
    if (!*moved) return FCT_OK;
    float *positions = fct_allocate(env, count, sizeof *positions);
    if (!positions) return fct_fail_memory(env, "a model");
    for (size_t i = 0; i < count; ++i) positions[i] = (float)(mesh->positions[i] - away[i % 3]);
    for (int c = 0; c < 3; ++c) origin[c] += away[c];
    mesh->positions = positions;
    return FCT_OK;
}

/* ---- Models ---- */

/* A tree with more roots is built again from its mesh: opening a model opens all its roots, and the links
 * between roots grow with the square of their number. */
#define MOST_ROOTS 64

static fct_result add_model(fct_scene *scene, const char *name, fct_scene_model *own) {
    const fct_env *env = scene->env;
    fct_model model = {.tree = own->tree,
                       .source_faces = own->source_faces,
                       .source_vertices = own->source_vertices,
                       .source_face_count = fct_tree_get(own->tree).face_count,
                       .source_vertex_count = fct_tree_get(own->tree).vertex_count,
                       .texcoords = own->attributes.texcoords,
                       .normals = own->attributes.normals,
                       .corner_normals = own->attributes.corner_normals,
                       .face_colors = own->attributes.face_colors,
                       .inward = fct_tree_get(own->tree).inward};
    fct_result result = copy_name(env, "model", name, model.name, sizeof model.name);
    uint32_t depth = fct_tree_get(own->tree).depth;
    if (result == FCT_OK && depth > FCT_SCENE_TREE_DEPTH)
        result = fct_fail(env, FCT_ERROR_DATA, "model \"%s\": its tree has depth %u, expected at most %d",
                          name, depth, FCT_SCENE_TREE_DEPTH);
    if (result == FCT_OK)
        result = fct_grow(env, (void **)&scene->models, &scene->model_capacity,
                          (size_t)scene->model_count + 1, sizeof *scene->models);
    if (result == FCT_OK)
        result = fct_grow(env, (void **)&scene->own, &scene->own_capacity, (size_t)scene->model_count + 1,
                          sizeof *scene->own);
    if (result != FCT_OK) {
        release_model(env, own);
        return result;
    }
    scene->models[scene->model_count] = model;
    scene->own[scene->model_count++] = *own;
    return FCT_OK;
}

/* Adds a model of the listed faces, or of the whole mesh if `faces` is NULL. weld: of fct_tree_def. */
static fct_result add_model_of_faces(fct_scene *scene, const char *name, const fct_mesh *mesh,
                                     uint32_t *faces, uint32_t count, bool weld) {
    const fct_env *env = scene->env;
    fct_scene_model own = {0};
    fct_mesh part = {0};
    fct_result result = FCT_OK;
    if (faces) {
        own.source_faces = fct_allocate(env, count, sizeof *faces);
        if (!own.source_faces) return fct_fail_memory(env, "a part of a model");
        memcpy(own.source_faces, faces, count * sizeof *faces);
        result = fct_mesh_extract(env, mesh, faces, count, &part, &own.source_vertices);
    }
    fct_mesh plain = faces ? part : *mesh;
    plain.materials = NULL, plain.material_names = NULL, plain.material_count = 0;
    fct_tree_def def = fct_tree_def_default();
    def.weld = weld;
    bool moved = false;
    if (result == FCT_OK) result = center_mesh(env, &plain, own.origin, &moved);
    if (result == FCT_OK) result = fct_tree_build(env, &plain, &def, NULL, &own.tree);
    if (result == FCT_OK) result = fct_attributes_copy(env, &plain, own.tree, &own.attributes);
    if (moved) fct_release(env, plain.positions);
    if (faces) fct_mesh_release(env, &part);
    if (result != FCT_OK) {
        release_model(env, &own);
        return result;
    }
    return add_model(scene, name, &own);
}

/* Adds a model of a given tree, with the attributes of `from` if that is not NULL. Destroys the tree after a
 * failure. */
static fct_result add_model_of_tree(fct_scene *scene, const char *name, const fct_mesh *from,
                                    fct_tree *tree) {
    const fct_env *env = scene->env;
    fct_scene_model own = {.tree = tree};
    memcpy(own.origin, fct_tree_get(tree).origin, sizeof own.origin);
    if (fct_tree_get(tree).root_count <= MOST_ROOTS) {
        fct_result result = from ? fct_attributes_copy(env, from, tree, &own.attributes) : FCT_OK;
        if (result == FCT_OK) return add_model(scene, name, &own);
        release_model(env, &own);
        return result;
    }
    bool weld = fct_tree_get(tree).def.weld;
    fct_mesh copy = {0};
    fct_result result = from ? FCT_OK : fct_tree_mesh(env, tree, &copy);
    fct_tree_destroy(tree);
    if (result != FCT_OK) return result;
    if (!from) from = &copy;
    result = add_model_of_faces(scene, name, from, NULL, from->face_count, weld);
    fct_mesh_release(env, &copy);
    return result;
}

void fct_scene_sort_faces(const uint32_t *labels, uint32_t face_count, uint32_t label_count, uint32_t *starts,
                          uint32_t *faces) {
    memset(starts, 0, ((size_t)label_count + 1) * sizeof *starts);
    for (uint32_t f = 0; f < face_count; ++f) ++starts[labels[f] + 1];
    for (uint32_t k = 0; k < label_count; ++k) starts[k + 1] += starts[k];
    for (uint32_t f = 0; f < face_count; ++f) faces[starts[labels[f]]++] = f;
    for (uint32_t k = label_count; k > 0; --k) starts[k] = starts[k - 1];
    starts[0] = 0;
}

static fct_result split_by_label(fct_scene *scene, const char *name, const fct_mesh *mesh,
                                 const uint32_t *labels, uint32_t label_count, fct_scene_parts *parts) {
    const fct_env *env = scene->env;
    fct_result result = FCT_OK;
    uint32_t *starts = fct_allocate(env, (size_t)label_count + 1, sizeof *starts);
    uint32_t *faces = fct_allocate(env, mesh->face_count, sizeof *faces), bodies = 0;
    uint8_t *inward = fct_allocate(env, mesh->face_count, sizeof *inward);
    if (!starts || !faces || !inward) {
        result = fct_fail_memory(env, "a model's parts");
        goto done;
    }
    fct_scene_sort_faces(labels, mesh->face_count, label_count, starts, faces);
    uint32_t used = 0;
    for (uint32_t k = 0; k < label_count; ++k) used += starts[k + 1] > starts[k];
    parts->labels = fct_allocate(env, used, sizeof *parts->labels);
    if (!parts->labels) {
        result = fct_fail_memory(env, "a model's parts");
        goto done;
    }
    if (used > 1) result = fct_inward_find(env, mesh, &bodies, inward); /* the parts alone are open */
    for (uint32_t k = 0; k < label_count && result == FCT_OK; ++k) {
        uint32_t count = starts[k + 1] - starts[k];
        if (count == 0) continue;
        result =
            add_model_of_faces(scene, name, mesh, used > 1 ? faces + starts[k] : NULL, count, !env->no_weld);
        if (result != FCT_OK) break;
        parts->labels[parts->count++] = k;
        if (bodies > 0 && inward[faces[starts[k]]]) scene->models[scene->model_count - 1].inward = true;
    }
    if (result == FCT_OK && used > 1) result = fct_scene_note_loose(scene, parts->first, mesh);
done:
    fct_release(env, inward);
    fct_release(env, starts);
    fct_release(env, faces);
    return result;
}

/* With env->flip_inward a given tree is replaced by its mesh, and the mesh is turned. */
static fct_result split_turned(fct_scene *scene, const char *name, const fct_mesh *mesh, fct_tree *tree,
                               const uint32_t *labels, uint32_t label_count, fct_scene_parts *parts) {
    const fct_env *env = scene->env;
    fct_mesh own = {0}, turned = {0};
    bool weld = tree ? fct_tree_get(tree).def.weld : !env->no_weld;
    fct_result result = mesh ? FCT_OK : fct_tree_mesh(env, tree, &own);
    fct_tree_destroy(tree);
    if (result == FCT_OK) result = fct_scene_turn(env, mesh ? mesh : &own, &turned);
    if (result == FCT_OK)
        result = labels ? split_by_label(scene, name, &turned, labels, label_count, parts)
                        : add_model_of_faces(scene, name, &turned, NULL, turned.face_count, weld);
    fct_scene_release_turned(env, &turned);
    fct_mesh_release(env, &own);
    return result;
}

fct_result fct_scene_split(fct_scene *scene, const char *name, const fct_mesh *mesh, fct_tree *tree,
                           const uint32_t *labels, uint32_t label_count, fct_scene_parts *parts) {
    const fct_env *env = scene->env;
    *parts = (fct_scene_parts){.first = scene->model_count};
    fct_result result = FCT_OK;
    if (labels) {
        result = env->flip_inward ? split_turned(scene, name, mesh, NULL, labels, label_count, parts)
                                  : split_by_label(scene, name, mesh, labels, label_count, parts);
    } else {
        parts->labels = fct_allocate_zero(env, 1, sizeof *parts->labels);
        if (!parts->labels) {
            if (tree) fct_tree_destroy(tree);
            return fct_fail_memory(env, "a model");
        }
        result = env->flip_inward ? split_turned(scene, name, mesh, tree, NULL, 0, parts)
                 : tree           ? add_model_of_tree(scene, name, mesh, tree)
                        : add_model_of_faces(scene, name, mesh, NULL, mesh->face_count, !env->no_weld);
        parts->count = 1;
    }
    if (result != FCT_OK) {
        while (scene->model_count > parts->first) release_model(env, scene->own + --scene->model_count);
        fct_release(env, parts->labels);
        *parts = (fct_scene_parts){0};
    }
    return result;
}

/* ---- Instances ---- */

fct_result fct_scene_set_transform(const fct_env *env, const char *name, const float transform[12],
                                   fct_instance *instance, fct_scene_frame *frame) {
    const float *m = transform ? transform : fct_transform_identity;
    switch (fct_transform_set(m, instance, frame->to_model)) {
    case FCT_TRANSFORM_NOT_FINITE:
        return fct_fail(env, FCT_ERROR_DATA,
                        "instance \"%s\": the transform holds a number that is not finite", name);
    case FCT_TRANSFORM_SINGULAR:
        return fct_fail(env, FCT_ERROR_DATA, "instance \"%s\": the transform is singular", name);
    case FCT_TRANSFORM_GOOD:
        break;
    }
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) frame->linear[3 * i + j] = (float)frame->to_model[4 * i + j];
    frame->identity = memcmp(m, fct_transform_identity, sizeof fct_transform_identity) == 0;
    fct_mapped_frame_make(instance->to_world, &frame->mapped);
    return FCT_OK;
}

static bool emits_light(const fct_material *m) {
    return m->emission[0] > 0 || m->emission[1] > 0 || m->emission[2] > 0;
}

void fct_scene_make_two_sided(fct_scene *scene) {
    for (uint32_t m = 0; m < scene->material_count; ++m)
        if (!emits_light(&scene->materials[m])) scene->materials[m].two_sided = true;
}

fct_result fct_scene_place(fct_scene *scene, const char *name, uint32_t first, uint32_t count,
                           const uint32_t *materials, const float transform[12]) {
    assert(!scene->committed);
    const fct_env *env = scene->env;
    fct_instance instance = {.object = scene->object_count};
    fct_scene_frame frame = {0};
    fct_result result = copy_name(env, "instance", name, instance.name, sizeof instance.name);
    if (result == FCT_OK) result = fct_scene_set_transform(env, name, transform, &instance, &frame);
    size_t needed = (size_t)scene->instance_count + count;
    if (result == FCT_OK && needed > INT32_MAX / 2)
        result = fct_fail(env, FCT_ERROR_DATA, "the scene has more than 2^30 instances");
    if (result == FCT_OK)
        result = fct_grow(env, (void **)&scene->instances, &scene->instance_capacity, needed,
                          sizeof *scene->instances);
    if (result == FCT_OK)
        result =
            fct_grow(env, (void **)&scene->frames, &scene->frame_capacity, needed, sizeof *scene->frames);
    if (result == FCT_OK)
        result = fct_grow(env, (void **)&scene->objects, &scene->object_capacity,
                          (size_t)scene->object_count + 1, sizeof *scene->objects);
    if (result != FCT_OK) return result;
    scene->objects[scene->object_count++] = (fct_scene_object){scene->instance_count, count, -1, -1};
    for (uint32_t k = 0; k < count; ++k) {
        assert(materials[k] < scene->material_count);
        instance.model = first + k;
        instance.material = materials[k];
        const fct_material *m = scene->materials + materials[k];
        frame.emits = emits_light(m);
        const double *o = scene->own[first + k].origin;
        for (int c = 0; c < 3; ++c)
            frame.at[c] = (double)instance.to_world[4 * c + 3] + instance.to_world[4 * c] * o[0] +
                          instance.to_world[4 * c + 1] * o[1] + instance.to_world[4 * c + 2] * o[2];
        frame.two_sided = m->two_sided;
        scene->instances[scene->instance_count] = instance;
        scene->frames[scene->instance_count++] = frame;
    }
    return FCT_OK;
}

fct_result fct_scene_add_object(fct_scene *scene, const char *name, const fct_mesh *mesh, fct_tree *tree,
                                const float transform[12], uint32_t material,
                                const uint32_t *face_materials) {
    assert(!scene->committed && (!tree || !face_materials));
    assert(face_materials || material < scene->material_count);
    const fct_env *env = scene->env;
    fct_scene_parts parts = {0};
    fct_instance probe; /* a bad transform is reported before the mesh is clustered */
    fct_scene_frame frame;
    fct_result result = fct_scene_set_transform(env, name, transform, &probe, &frame);
    if (result == FCT_OK && mesh) result = fct_mesh_validate(env, mesh);
    if (result == FCT_OK && !tree && mesh->face_count == 0)
        result = fct_fail(env, FCT_ERROR_DATA, "object \"%s\" has no faces", name);
    for (uint32_t f = 0; result == FCT_OK && face_materials && f < mesh->face_count; ++f)
        if (face_materials[f] >= scene->material_count)
            result =
                fct_fail(env, FCT_ERROR_DATA, "object \"%s\": face %u has material %u, expected one below %u",
                         name, f, face_materials[f], scene->material_count);
    if (result != FCT_OK) {
        if (tree) fct_tree_destroy(tree);
        return result;
    }
    uint32_t count = scene->model_count;
    result = fct_scene_split(scene, name, mesh, tree, face_materials, scene->material_count, &parts);
    if (result != FCT_OK) return result;
    result = fct_scene_place(scene, name, parts.first, parts.count, face_materials ? parts.labels : &material,
                             transform);
    if (result != FCT_OK)
        while (scene->model_count > count) release_model(env, scene->own + --scene->model_count);
    fct_release(env, parts.labels);
    return result;
}

fct_result fct_scene_add_instance(fct_scene *scene, const char *name, uint32_t object,
                                  const float transform[12], uint32_t material) {
    assert(object < scene->object_count);
    fct_scene_object from = scene->objects[object];
    uint32_t *materials = fct_allocate(scene->env, from.count, sizeof *materials);
    if (!materials) return fct_fail_memory(scene->env, "an instance");
    for (uint32_t k = 0; k < from.count; ++k)
        materials[k] = material == FCT_NONE ? scene->instances[from.first + k].material : material;
    fct_result result =
        fct_scene_place(scene, name, scene->instances[from.first].model, from.count, materials, transform);
    fct_release(scene->env, materials);
    return result;
}

void fct_scene_set_camera(fct_scene *scene, const fct_camera *camera) {
    scene->camera = *camera;
    scene->camera.given = true;
}

fct_scene_view fct_scene_get(const fct_scene *scene) {
    const double *origin = scene->origin;
    return (fct_scene_view){.origin = {origin[0], origin[1], origin[2]},
                            .material_count = scene->material_count,
                            .model_count = scene->model_count,
                            .instance_count = scene->instance_count,
                            .volume_count = scene->committed ? 2 * scene->instance_count - 1 : 0,
                            .light_group_count = scene->light_group_count,
                            .object_count = scene->object_count,
                            .texture_count = scene->texture_count,
                            .textures = scene->textures,
                            .materials = scene->materials,
                            .models = scene->models,
                            .instances = scene->instances,
                            .volumes = scene->volumes,
                            .light_groups = (const char *const *)scene->light_groups,
                            .bounds = scene->bounds,
                            .camera = scene->camera,
                            .face_count = scene->face_count};
}
