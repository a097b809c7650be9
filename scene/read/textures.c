/* scene/read/textures.c: see textures.h. */
#include "scene/read/textures.h"

#include <stdio.h>

#include "base/io/file.h"
#include "scene/texture/pyramid.h"

/* Warnings pass through; the text of an error becomes the loss. */
static void take_message(void *user, fct_severity severity, const char *text) {
    const fct_texture_quiet *quiet = user;
    if (severity != FCT_MESSAGE_ERROR)
        fct_note(quiet->outer, severity, "%s", text);
    else if (!quiet->loss->count)
        snprintf(quiet->loss->first, sizeof quiet->loss->first, "%s", text);
}

void fct_textures_begin_quiet(fct_texture_quiet *quiet, const fct_env *env, fct_texture_loss *loss) {
    *quiet = (fct_texture_quiet){*env, env, loss};
    quiet->env.message = take_message;
    quiet->env.message_user = quiet;
}

fct_result fct_textures_forgive(const fct_texture_quiet *quiet, fct_result result) {
    if (result == FCT_ERROR_MEMORY) return fct_fail_memory(quiet->outer, "a texture");
    if (result != FCT_ERROR_INPUT && result != FCT_ERROR_DATA) return result;
    ++quiet->loss->count;
    return FCT_OK;
}

void fct_textures_lose(fct_texture_loss *loss, const char *reason) {
    if (!loss->count++) snprintf(loss->first, sizeof loss->first, "%s", reason);
}

fct_result fct_textures_decode(fct_scene *scene, const char *name, const unsigned char *data, size_t size,
                               fct_texture_loss *loss, uint32_t *id) {
    fct_texture_quiet quiet;
    fct_image image;
    *id = fct_scene_find_texture(scene, name);
    if (*id != FCT_NONE) return FCT_OK;
    fct_textures_begin_quiet(&quiet, scene->env, loss);
    fct_result result = fct_image_decode(&quiet.env, name, data, size, &image);
    return result == FCT_OK ? fct_scene_own_texture(scene, name, image, id)
                            : fct_textures_forgive(&quiet, result);
}

fct_result fct_textures_open(fct_scene *scene, const char *path, fct_texture_loss *loss, uint32_t *id) {
    fct_texture_quiet quiet;
    fct_file file;
    *id = fct_scene_find_texture(scene, path);
    if (*id != FCT_NONE) return FCT_OK;
    fct_textures_begin_quiet(&quiet, scene->env, loss);
    fct_result result = fct_file_open(&quiet.env, path, &file);
    if (result != FCT_OK) return fct_textures_forgive(&quiet, result);
    result = fct_textures_decode(scene, path, file.data, file.size, loss, id);
    fct_file_close(&quiet.env, &file);
    return result;
}

void fct_textures_report(const fct_env *env, const char *name, const fct_texture_loss *loss) {
    if (loss->count)
        fct_note(env, FCT_MESSAGE_WARNING, "%s: %zu textures cannot be read and are left out (%s)", name,
                 loss->count, loss->first);
}

bool fct_textures_clamp(const fct_scene *scene, uint32_t material) {
    const uint32_t pyramid = scene->paints[material].pyramid;
    return pyramid != FCT_NONE && scene->pyramids[pyramid]->clamped;
}
