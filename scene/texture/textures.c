/* scene/texture/textures.c: the textures of a scene, and the materials that they paint. */
#include <assert.h>
#include <math.h>
#include <string.h>

#include "base/io/file.h"
#include "scene/scene.h"
#include "scene/texture/pyramid.h"

fct_paint fct_paint_default(void) {
    return (fct_paint){
        .size = sizeof(fct_paint), .factor = {1, 1, 1}, .texture = FCT_NONE, .transform = {1, 0, 0, 0, 1, 0}};
}

uint32_t fct_scene_find_texture(const fct_scene *scene, const char *name) {
    for (uint32_t t = 0; t < scene->texture_count; ++t)
        if (!strcmp(scene->textures[t].name, name)) return t;
    return FCT_NONE;
}

fct_result fct_scene_own_texture(fct_scene *scene, const char *name, fct_image image, uint32_t *id) {
    const fct_env *env = scene->env;
    const size_t length = strlen(name) + 1, needed = (size_t)scene->texture_count + 1;
    char *copy = NULL;
    fct_result result =
        fct_grow(env, (void **)&scene->textures, &scene->texture_capacity, needed, sizeof *scene->textures);
    if (result == FCT_OK)
        result =
            fct_grow(env, (void **)&scene->images, &scene->image_capacity, needed, sizeof *scene->images);
    if (result == FCT_OK && !(copy = fct_allocate(env, length, 1)))
        result = fct_fail_memory(env, "a texture");
    if (result != FCT_OK) {
        fct_release(env, image.pixels);
        return result;
    }
    memcpy(copy, name, length);
    *id = scene->texture_count++;
    scene->images[*id] = image;
    scene->textures[*id] = (fct_texture){copy, image.width, image.height, image.pixels};
    return FCT_OK;
}

fct_result fct_scene_add_texture(fct_scene *scene, const fct_texture *texture, uint32_t *id) {
    assert(!scene->committed);
    const size_t row = 3 * (size_t)texture->width;
    fct_image image = {texture->width, texture->height, NULL};
    *id = FCT_NONE;
    if (!texture->width || !texture->height)
        return fct_fail(scene->env, FCT_ERROR_DATA, "texture \"%s\" has no pixels", texture->name);
    image.pixels = fct_allocate(scene->env, texture->height, row);
    if (!image.pixels) return fct_fail_memory(scene->env, "a texture");
    memcpy(image.pixels, texture->pixels, texture->height * row);
    return fct_scene_own_texture(scene, texture->name, image, id);
}

fct_result fct_scene_read_texture(fct_scene *scene, const char *path, uint32_t *id) {
    assert(!scene->committed);
    const fct_env *env = scene->env;
    fct_file file;
    fct_image image;
    *id = fct_scene_find_texture(scene, path);
    if (*id != FCT_NONE) return FCT_OK;
    fct_result result = fct_file_open(env, path, &file);
    if (result != FCT_OK) return result;
    result = fct_image_decode(env, path, file.data, file.size, &image);
    fct_file_close(env, &file);
    return result == FCT_OK ? fct_scene_own_texture(scene, path, image, id) : result;
}

static fct_result add_pyramid(fct_scene *scene, uint32_t texture, const float factor[3], bool clamped) {
    const fct_env *env = scene->env;
    fct_result result = fct_grow(env, (void **)&scene->pyramids, &scene->pyramid_capacity,
                                 (size_t)scene->pyramid_count + 1, sizeof *scene->pyramids);
    if (result != FCT_OK) return result;
    fct_pyramid *pyramid = fct_allocate(env, 1, sizeof *pyramid);
    if (!pyramid) return fct_fail_memory(env, "a texture");
    result = fct_pyramid_build(env, &scene->images[texture], factor, clamped, pyramid);
    pyramid->texture = texture;
    if (result == FCT_OK) {
        scene->pyramids[scene->pyramid_count++] = pyramid;
        return FCT_OK;
    }
    fct_pyramid_release(env, pyramid);
    fct_release(env, pyramid);
    return result;
}

/* Finds the pyramid of a paint, or adds it. */
static fct_result need_pyramid(fct_scene *scene, fct_scene_paint *paint) {
    static const float one[3] = {1, 1, 1};
    const uint32_t texture = paint->def.texture;
    const bool clamped = fct_pyramid_would_clamp(&scene->images[texture], paint->def.factor);
    const float *factor = clamped ? paint->def.factor : one;
    memcpy(paint->scale, clamped ? one : paint->def.factor, sizeof paint->scale);
    for (uint32_t k = 0; k < scene->pyramid_count; ++k) {
        const fct_pyramid *p = scene->pyramids[k];
        if (p->texture != texture || p->clamped != clamped ||
            memcmp(p->factor, factor, sizeof p->factor) != 0)
            continue;
        paint->pyramid = k;
        return FCT_OK;
    }
    fct_result result = add_pyramid(scene, texture, factor, clamped);
    if (result == FCT_OK) paint->pyramid = scene->pyramid_count - 1;
    return result;
}

static fct_result check_paint(const fct_scene *scene, const char *name, const fct_paint *paint) {
    const fct_env *env = scene->env;
    assert(paint->size == sizeof *paint);
    for (int c = 0; c < 3; ++c)
        if (!(paint->factor[c] >= 0 && isfinite(paint->factor[c])))
            return fct_fail(env, FCT_ERROR_DATA,
                            "material \"%s\": factor[%d] is %g, expected a finite number >= 0", name, c,
                            (double)paint->factor[c]);
    for (int k = 0; k < 6; ++k)
        if (!isfinite(paint->transform[k]))
            return fct_fail(env, FCT_ERROR_DATA,
                            "material \"%s\": the transform of its texture is not finite", name);
    if (paint->texture != FCT_NONE && paint->texture >= scene->texture_count)
        return fct_fail(env, FCT_ERROR_DATA, "material \"%s\" has texture %u, expected one below %u", name,
                        paint->texture, scene->texture_count);
    return FCT_OK;
}

fct_result fct_scene_paint_material(fct_scene *scene, uint32_t material, const fct_paint *paint) {
    assert(!scene->committed && material < scene->material_count && !scene->paints[material].painted);
    fct_scene_paint made = {.def = *paint, .pyramid = FCT_NONE};
    fct_result result = check_paint(scene, scene->materials[material].name, paint);
    if (result == FCT_OK && paint->texture != FCT_NONE) result = need_pyramid(scene, &made);
    if (result != FCT_OK) return result;
    made.painted = paint->texture != FCT_NONE || paint->vertex_colors;
    scene->paints[material] = made;
    for (int c = 0; c < 3; ++c)
        scene->materials[material].reflectance[c] = fminf(paint->factor[c], FCT_SCENE_MOST_REFLECTANCE);
    return FCT_OK;
}

void fct_scene_note_bare_textures(const fct_scene *scene) {
    uint32_t count = 0, first = 0;
    for (uint32_t i = scene->instance_count; i-- > 0;) {
        const fct_instance *in = &scene->instances[i];
        if (scene->paints[in->material].pyramid == FCT_NONE || scene->models[in->model].texcoords) continue;
        ++count, first = i;
    }
    if (count)
        fct_note(scene->env, FCT_MESSAGE_WARNING,
                 "%u instances have a texture but no texture coordinates; they take the factor alone (\"%s\" "
                 "first)",
                 count, scene->instances[first].name);
}

void fct_scene_release_textures(fct_scene *scene) {
    const fct_env *env = scene->env;
    for (uint32_t p = 0; p < scene->pyramid_count; ++p) {
        fct_pyramid_release(env, scene->pyramids[p]);
        fct_release(env, scene->pyramids[p]);
    }
    for (uint32_t t = 0; t < scene->texture_count; ++t) {
        fct_release(env, (void *)scene->textures[t].name);
        fct_release(env, scene->images[t].pixels);
    }
    void *arrays[] = {scene->pyramids, scene->textures, scene->images};
    for (size_t k = 0; k < FCT_LENGTH(arrays); ++k) fct_release(env, arrays[k]);
}
