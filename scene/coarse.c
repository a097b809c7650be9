/* scene/coarse.c: see coarse.h. */
#include "scene/coarse.h"

#include <string.h>

/* A model becomes coarse if it has more faces than this multiple of its patches. */
#define LARGE 2

/* Whether a model may become coarse; see coarse.h. Models without instances stay as they are. */
static void find_fit_models(const fct_scene *scene, bool *fit) {
    memset(fit, false, scene->model_count * sizeof *fit);
    for (uint32_t i = 0; i < scene->instance_count; ++i) fit[scene->instances[i].model] = true;
    for (uint32_t i = 0; i < scene->instance_count; ++i) {
        const fct_instance *in = &scene->instances[i];
        if (scene->frames[i].emits || scene->paints[in->material].painted || !(in->uniform_scale > 0))
            fit[in->model] = false;
    }
}

/* Patches per model: an even share over the large models. */
static uint32_t choose_share(const fct_scene *scene, const bool *fit) {
    const uint32_t all = scene->patches;
    uint32_t share = all / (scene->model_count < all ? scene->model_count : all), large = 0;
    for (uint32_t m = 0; m < scene->model_count; ++m)
        large += fit[m] && fct_tree_get(scene->own[m].tree).face_count / LARGE > share;
    return large == 0 ? all : large < all ? all / large : 1;
}

static fct_result coarsen_model(const fct_env *env, fct_scene_model *own, uint32_t patches) {
    fct_result result = fct_tree_coarsen(env, own->tree, patches, &own->coarse);
    if (result == FCT_OK) result = fct_bvh_create(env, own->coarse.tree, FCT_BACKEND_OBB, &own->coarse_bvh);
    fct_file_advise(&own->tree->file, 0, own->tree->file.size, FCT_FILE_UNUSED);
    return result;
}

fct_result fct_scene_coarsen_models(fct_scene *scene) {
    bool *fit = fct_allocate(scene->env, scene->model_count, sizeof *fit);
    if (!fit) return fct_fail_memory(scene->env, "coarse models");
    find_fit_models(scene, fit);
    const uint32_t share = choose_share(scene, fit);
    fct_result result = FCT_OK;
    for (uint32_t m = 0; m < scene->model_count && result == FCT_OK; ++m) {
        const fct_tree_view view = fct_tree_get(scene->own[m].tree);
        const uint32_t patches = share > view.root_count ? share : view.root_count;
        if (fit[m] && view.face_count / LARGE > patches)
            result = coarsen_model(scene->env, scene->own + m, patches);
    }
    fct_release(scene->env, fit);
    return result;
}

fct_result fct_scene_share_coarse(fct_scene *scene) {
    bool any = false;
    for (uint32_t m = 0; m < scene->model_count; ++m) any |= scene->own[m].coarse.tree != NULL;
    if (!any) return FCT_OK;
    fct_scene *coarse = fct_allocate(scene->env, 1, sizeof *coarse);
    if (!coarse) return fct_fail_memory(scene->env, "a coarse scene");
    *coarse = *scene;
    coarse->is_coarse = true;
    const fct_array arrays[] = {FCT_ARRAY(coarse->models, scene->model_count),
                                FCT_ARRAY(coarse->frames, scene->instance_count)};
    fct_result result = fct_allocate_all(scene->env, arrays, FCT_LENGTH(arrays), "a coarse scene");
    if (result != FCT_OK) {
        fct_release(scene->env, coarse);
        return result;
    }
    memcpy(coarse->models, scene->models, scene->model_count * sizeof *scene->models);
    memcpy(coarse->frames, scene->frames, scene->instance_count * sizeof *scene->frames);
    for (uint32_t m = 0; m < scene->model_count; ++m) {
        if (!scene->own[m].coarse.tree) continue;
        coarse->models[m].tree = scene->own[m].coarse.tree;
        coarse->models[m].bvh = scene->own[m].coarse_bvh;
    }
    for (uint32_t i = 0; i < scene->instance_count; ++i)
        coarse->frames[i].bvh = coarse->models[scene->instances[i].model].bvh;
    scene->coarse = coarse;
    return FCT_OK;
}

fct_result fct_scene_complete(const fct_scene *scene) {
    fct_scene *whole = (fct_scene *)(uintptr_t)scene;
    for (uint32_t m = 0; m < scene->model_count; ++m) {
        fct_scene_model *own = whole->own + m;
        if (own->bvh) continue;
        fct_result result = fct_bvh_create(scene->env, own->tree, FCT_BACKEND_OBB, &own->bvh);
        if (result != FCT_OK) return result;
        whole->models[m].bvh = own->bvh;
    }
    for (uint32_t i = 0; i < scene->instance_count; ++i)
        if (!scene->frames[i].bvh) whole->frames[i].bvh = scene->own[scene->instances[i].model].bvh;
    return FCT_OK;
}

const fct_scene *fct_scene_coarse(const fct_scene *scene) {
    return scene->coarse ? scene->coarse : scene;
}

const fct_coarse *fct_scene_coarse_model(const fct_scene *scene, uint32_t model) {
    const fct_coarse *coarse = &scene->own[model].coarse;
    return scene->is_coarse && coarse->tree ? coarse : NULL;
}
