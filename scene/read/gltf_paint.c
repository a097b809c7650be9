/* scene/read/gltf_paint.c: see gltf_paint.h. Source: glTF 2.0 specification, chapters 3.8 and 3.9, and
 * KHR_texture_transform.
 */
#include "scene/read/gltf_paint.h"

#include <stdio.h>

#include "base/math/elementary.h"
#include "mesh/glb/document/buffer.h"
#include "mesh/glb/nodes.h"

fct_result fct_gltf_paints_create(fct_scene *scene, fct_glb *glb, fct_gltf_paints *out) {
    const size_t images = fct_glb_count(glb, "images");
    *out = (fct_gltf_paints){.scene = scene, .glb = glb};
    const fct_array arrays[] = {FCT_ARRAY_ZERO(out->sets, fct_glb_count(glb, "materials")),
                                FCT_ARRAY(out->textures, images), FCT_ARRAY_ZERO(out->lost, images)};
    fct_result result = fct_allocate_all(scene->env, arrays, FCT_LENGTH(arrays), "textures");
    for (size_t i = 0; result == FCT_OK && i < images; ++i) out->textures[i] = FCT_NONE;
    return result;
}

void fct_gltf_paints_release(fct_gltf_paints *paints) {
    if (!paints->scene) return;
    fct_release(paints->scene->env, paints->sets);
    fct_release(paints->scene->env, paints->textures);
    fct_release(paints->scene->env, paints->lost);
}

/* ---- Images ---- */

static fct_result decode_image(fct_gltf_paints *p, json_t *image, int64_t index, uint32_t *id) {
    const fct_env *env = p->scene->env;
    const json_t *uri = json_object_get(image, "uri");
    fct_glb_buffer buffer = {0};
    const fct_glb_view *view;
    int64_t number;
    char name[200];
    fct_result result;
    snprintf(name, sizeof name, "%.150s: images[%lld]", p->glb->source->name, (long long)index);
    if (json_is_string(uri)) {
        result = fct_glb_open_uri(p->glb, uri, &buffer);
    } else {
        result = fct_glb_index(p->glb, image, "bufferView", &number);
        if (result == FCT_OK) result = fct_glb_view_of(p->glb, number, &view);
        if (result == FCT_OK) buffer.data = view->data, buffer.size = view->size;
    }
    if (result == FCT_OK) {
        fct_image pixels;
        result = fct_image_decode(p->glb->source->env, name, buffer.data, buffer.size, &pixels);
        if (result == FCT_OK) result = fct_scene_own_texture(p->scene, name, pixels, id);
    }
    fct_file_close(env, &buffer.file);
    fct_release(env, buffer.own);
    return result;
}

/* The image of a texture, and how it continues beyond its borders. */
static fct_result read_texture(fct_gltf_paints *p, int64_t number, fct_paint *paint) {
    json_t *texture, *image, *sampler;
    int64_t source, sampling;
    fct_result result = fct_glb_item(p->glb, "textures", number, &texture);
    if (result == FCT_OK) result = fct_glb_index(p->glb, texture, "source", &source);
    if (result == FCT_OK && source == FCT_GLB_ABSENT)
        result = fct_glb_fail(p->glb, "textures[%lld] has no PNG or JPEG image", (long long)number);
    if (result == FCT_OK) result = fct_glb_item(p->glb, "images", source, &image);
    if (result == FCT_OK) result = fct_glb_index(p->glb, texture, "sampler", &sampling);
    if (result == FCT_OK && sampling != FCT_GLB_ABSENT) {
        static const char *const keys[] = {"wrapS", "wrapT"};
        result = fct_glb_item(p->glb, "samplers", sampling, &sampler);
        for (int k = 0; k < 2 && result == FCT_OK; ++k) {
            int64_t mode;
            result = fct_glb_index(p->glb, sampler, keys[k], &mode);
            paint->wrap[k] = mode == 33071   ? FCT_WRAP_CLAMP
                             : mode == 33648 ? FCT_WRAP_MIRROR
                                             : FCT_WRAP_REPEAT;
        }
    }
    if (result != FCT_OK) return result;
    if (p->textures[source] == FCT_NONE && !p->lost[source]) {
        result = decode_image(p, image, source, &p->textures[source]);
        p->lost[source] = p->textures[source] == FCT_NONE;
    }
    paint->texture = p->textures[source];
    return result;
}

/* ---- Materials ---- */

/* Image points are T R S (u, v). A positive angle turns the coordinates counterclockwise on an image whose v
 * runs down. */
static fct_result read_transform(fct_gltf_paints *p, json_t *extension, size_t index, float m[6]) {
    const int64_t i = (int64_t)index;
    double offset[2] = {0, 0}, scale[2] = {1, 1};
    fct_result result = fct_glb_numbers(p->glb, extension, "materials", i, "offset", 2, offset);
    if (result == FCT_OK) result = fct_glb_numbers(p->glb, extension, "materials", i, "scale", 2, scale);
    if (result != FCT_OK) return result;
    const double angle = json_number_value(json_object_get(extension, "rotation")), s = fct_sin(angle),
                 c = fct_cos(angle);
    m[0] = (float)(c * scale[0]), m[1] = (float)(s * scale[1]), m[2] = (float)offset[0];
    m[3] = (float)(-s * scale[0]), m[4] = (float)(c * scale[1]), m[5] = (float)offset[1];
    return FCT_OK;
}

/* Reads a textureInfo. */
static fct_result read_info(fct_gltf_paints *p, json_t *info, size_t index, fct_paint *paint) {
    json_t *extension = fct_glb_extension(info, "KHR_texture_transform");
    int64_t number, set, other = FCT_GLB_ABSENT;
    fct_result result = fct_glb_index(p->glb, info, "index", &number);
    if (result == FCT_OK) result = fct_glb_index(p->glb, info, "texCoord", &set);
    if (result == FCT_OK && extension) {
        result = read_transform(p, extension, index, paint->transform);
        if (result == FCT_OK) result = fct_glb_index(p->glb, extension, "texCoord", &other);
    }
    if (result == FCT_OK) result = read_texture(p, number, paint);
    if (result != FCT_OK) return result;
    if (other != FCT_GLB_ABSENT) set = other;
    p->sets[index] = set > 0 && set < UINT32_MAX ? (uint32_t)set : 0;
    return FCT_OK;
}

fct_result fct_gltf_paint(fct_gltf_paints *p, json_t *material, size_t index, const double factor[3],
                          uint32_t id) {
    json_t *info = json_object_get(json_object_get(material, "pbrMetallicRoughness"), "baseColorTexture");
    fct_paint paint = fct_paint_default(), plain;
    for (int c = 0; c < 3; ++c) paint.factor[c] = (float)factor[c];
    paint.vertex_colors = true;
    plain = paint;
    if (info) {
        fct_texture_quiet quiet;
        const fct_source *outer = p->glb->source;
        fct_source inner = *outer;
        fct_textures_begin_quiet(&quiet, p->scene->env, &p->loss);
        inner.env = &quiet.env;
        p->glb->source = &inner;
        fct_result result = read_info(p, info, index, &paint);
        p->glb->source = outer;
        if (result != FCT_OK || paint.texture == FCT_NONE) paint = plain;
        result = fct_textures_forgive(&quiet, result);
        if (result != FCT_OK) return result;
    }
    return fct_scene_paint_material(p->scene, id, &paint);
}
