/* scene/commit.c: makes a scene immutable: ray structures, its origin, bounds, hierarchies over the
 * instances.
 */
#include <assert.h>
#include <string.h>

#include "base/math/elementary.h"
#include "base/math/round.h"
#include "scene/coarse.h"
#include "scene/transform.h"

/* Of models without a coarse form, if there are coarse forms. */
static fct_result build_ray_structures(fct_scene *scene) {
    const fct_env *env = scene->env;
    for (uint32_t m = 0; m < scene->model_count; ++m) {
        fct_scene_model *own = scene->own + m;
        if (own->coarse.tree) continue;
        fct_result result = fct_bvh_create(env, own->tree, scene->backend, &own->bvh);
        if (result == FCT_OK && scene->backend == FCT_BACKEND_EMBREE)
            result = fct_bvh_create(env, own->tree, FCT_BACKEND_OBB, &own->points);
        if (result != FCT_OK) return result;
        scene->models[m].bvh = own->bvh;
    }
    return FCT_OK;
}

/* Chooses the scene's origin and makes transforms and camera relative to it. */
static fct_result move_to_origin(fct_scene *scene) {
    double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = 0; i < scene->instance_count; ++i) {
        const float *m = scene->instances[i].to_world;
        const fct_scene_model *own = &scene->own[scene->instances[i].model];
        fct_bounds b = fct_scene_model_bounds(own->tree, own->bvh);
        for (int c = 0; c < 3; ++c) {
            double middle = scene->frames[i].at[c], half = 0;
            for (int k = 0; k < 3; ++k) {
                middle += (double)m[4 * c + k] * (.5 * ((double)b.lower[k] + b.upper[k]));
                half += fabs((double)m[4 * c + k]) * (.5 * ((double)b.upper[k] - b.lower[k]));
            }
            lower[c] = fmin(lower[c], middle - half), upper[c] = fmax(upper[c], middle + half);
        }
    }
    fct_scene_choose_origin(lower, upper, scene->origin);
    for (uint32_t i = 0; i < scene->instance_count; ++i) {
        float m[12];
        memcpy(m, scene->instances[i].to_world, sizeof m);
        for (int c = 0; c < 3; ++c) m[4 * c + 3] = (float)(scene->frames[i].at[c] - scene->origin[c]);
        fct_result result = fct_scene_set_transform(scene->env, scene->instances[i].name, m,
                                                    &scene->instances[i], &scene->frames[i]);
        if (result != FCT_OK) return result;
    }
    for (int c = 0; c < 3; ++c) {
        scene->camera.position[c] = (float)(scene->camera.position[c] - scene->origin[c]);
        scene->camera.target[c] = (float)(scene->camera.target[c] - scene->origin[c]);
    }
    return FCT_OK;
}

static fct_result bound_instances(fct_scene *scene, fct_bounds *bounds) {
    for (uint32_t i = 0; i < scene->instance_count; ++i) {
        fct_instance *instance = scene->instances + i;
        const fct_scene_model *own = scene->own + instance->model;
        fct_bounds model = fct_scene_model_bounds(own->tree, own->bvh);
        fct_result result =
            fct_transform_bounds(scene->env, own->tree, &model, instance->to_world, &instance->bounds);
        if (result != FCT_OK) return result;
        for (int c = 0; c < 3; ++c)
            if (!isfinite(instance->bounds.lower[c]) || !isfinite(instance->bounds.upper[c]))
                return fct_fail(scene->env, FCT_ERROR_DATA, "instance \"%s\": its bounds do not fit a float",
                                instance->name);
        bounds[i] = instance->bounds;
        scene->frames[i].bvh = own->bvh;
        scene->face_count += fct_tree_get(own->tree).face_count;
    }
    return FCT_OK;
}

/* Default camera: from the front right, a little above (y is up). The sphere around the bounds fills the
 * view. */
static void set_default_camera(fct_scene *scene) {
    double square = 0;
    v3 toward = v3_unit(v3_make(.45, .35, .85));
    for (int c = 0; c < 3; ++c) {
        double size = (double)scene->bounds.upper[c] - scene->bounds.lower[c];
        scene->camera.target[c] =
            (float)fct_round(.5 * ((double)scene->bounds.upper[c] + scene->bounds.lower[c]));
        square += size * size;
    }
    double radius = fmax(.5 * sqrt(square), 1e-30);
    scene->camera.vertical_fov = 40;
    double distance = radius / fct_sin(20 * 3.14159265358979323846 / 180); /* half of the angle */
    v3_store(scene->camera.position, v3_mad(v3_load(scene->camera.target), distance, toward));
    scene->camera.up[1] = 1;
}

static fct_result check_light_groups(fct_scene *scene) {
    uint32_t id;
    if (scene->light_group_count == 0) {
        fct_result result = fct_scene_add_light_group(scene, "all", &id);
        if (result != FCT_OK) return result;
    }
    for (uint32_t m = 0; m < scene->material_count; ++m)
        if (scene->materials[m].light_group >= scene->light_group_count)
            return fct_fail(
                scene->env, FCT_ERROR_DATA, "material \"%s\" has light group %u, expected one below %u",
                scene->materials[m].name, scene->materials[m].light_group, scene->light_group_count);
    return FCT_OK;
}

fct_result fct_scene_commit(fct_scene *scene) {
    assert(!scene->committed);
    const fct_env *env = scene->env;
    if (scene->instance_count == 0) return fct_fail(env, FCT_ERROR_DATA, "the scene has no instances");
    fct_result result = check_light_groups(scene);
    if (result == FCT_OK && scene->backend == FCT_BACKEND_MULTIRES) result = fct_scene_coarsen_models(scene);
    if (result == FCT_OK) result = build_ray_structures(scene);
    if (result == FCT_OK) result = move_to_origin(scene);
    if (result != FCT_OK) return result;
    fct_bounds *bounds = fct_allocate(env, scene->instance_count, sizeof *bounds);
    scene->volumes = fct_allocate(env, 2 * (size_t)scene->instance_count - 1, sizeof *scene->volumes);
    if (!bounds || !scene->volumes) {
        fct_release(env, bounds);
        return fct_fail_memory(env, "the volumes of a scene");
    }
    result = bound_instances(scene, bounds);
    if (result == FCT_OK)
        result = fct_scene_build_volumes(env, scene->instance_count, bounds, scene->volumes);
    if (result == FCT_OK)
        result = fct_scene_build_nodes(env, scene->instance_count, scene->volumes, &scene->nodes);
    fct_release(env, bounds);
    if (result != FCT_OK) return result;
    fct_scene_note_bare_textures(scene);
    scene->bounds = scene->volumes[0].bounds;
    if (!scene->camera.given) set_default_camera(scene);
    scene->committed = true;
    return fct_scene_share_coarse(scene);
}
