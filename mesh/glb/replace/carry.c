/* mesh/glb/replace/carry.c: see carry.h. */
#include "mesh/glb/replace/carry.h"

#include <stdio.h>
#include <string.h>

#include "mesh/glb/document/buffer.h"

static fct_result fail_json(const fct_gltf *d) {
    return fct_fail_memory(d->env, "the JSON of a glTF file");
}

void fct_gltf_remove_extension(json_t *object, const char *name) {
    json_t *extensions = json_object_get(object, "extensions");
    json_object_del(extensions, name);
    if (extensions && json_object_size(extensions) == 0) json_object_del(object, "extensions");
}

/* Removes from a root's list of names those that stand for encodings of geometry. */
static void remove_encodings(json_t *root, const char *list) {
    static const char *const names[] = {"KHR_mesh_quantization", "EXT_meshopt_compression",
                                        "KHR_draco_mesh_compression", "EXT_mesh_gpu_instancing"};
    json_t *array = json_object_get(root, list);
    for (size_t i = json_array_size(array); i-- > 0;) {
        const char *name = json_string_value(json_array_get(array, i));
        for (size_t k = 0; name && k < FCT_LENGTH(names); ++k)
            if (!strcmp(name, names[k])) {
                json_array_remove(array, i);
                break;
            }
    }
    if (array && json_array_size(array) == 0) json_object_del(root, list);
}

/* Removes from the nodes what only animations, skins and instances of the old geometry use. */
static void clean_nodes(json_t *root) {
    json_t *node;
    size_t i;
    json_array_foreach(json_object_get(root, "nodes"), i, node) {
        json_object_del(node, "skin");
        json_object_del(node, "weights");
        fct_gltf_remove_extension(node, "EXT_mesh_gpu_instancing");
    }
}

fct_result fct_gltf_copy_root(const fct_gltf *d, json_t **root) {
    static const char *const lost[] = {"accessors", "bufferViews", "buffers",
                                       "meshes",    "animations",  "skins"};
    char generator[64];
    snprintf(generator, sizeof generator, "Facetree %s", fct_version());
    json_t *copy = *root = json_deep_copy(d->glb.root);
    if (!copy) return fail_json(d);
    for (size_t k = 0; k < FCT_LENGTH(lost); ++k) json_object_del(copy, lost[k]);
    remove_encodings(copy, "extensionsUsed");
    remove_encodings(copy, "extensionsRequired");
    clean_nodes(copy);
    if (!json_is_object(json_object_get(copy, "asset")))
        json_object_set_new(copy, "asset", json_pack("{s:s}", "version", "2.0"));
    if (!json_object_set_new(json_object_get(copy, "asset"), "generator", json_string(generator)))
        return FCT_OK;
    json_decref(copy);
    *root = NULL;
    return fail_json(d);
}

/* Finds the bytes of an image. *found is false, after a warning, if its file cannot be read. */
static fct_result open_image(fct_gltf *d, json_t *image, fct_glb_buffer *buffer, fct_glb_blob *blob,
                             bool *found) {
    int64_t view;
    const fct_glb_view *bytes;
    json_t *uri = json_object_get(image, "uri");
    fct_result result = fct_glb_index(&d->glb, image, "bufferView", &view);
    *found = false;
    if (result != FCT_OK || (view == FCT_GLB_ABSENT && !json_is_string(uri))) return result;
    if (view != FCT_GLB_ABSENT) {
        result = fct_glb_view_of(&d->glb, view, &bytes);
        if (result == FCT_OK) *blob = (fct_glb_blob){bytes->data, bytes->size};
    } else {
        result = fct_glb_open_uri(&d->glb, uri, buffer);
        *blob = (fct_glb_blob){buffer->data, buffer->size};
        if (result == FCT_ERROR_INPUT || result == FCT_ERROR_DATA) {
            fct_glb_warn(&d->glb, "the image \"%.200s\" cannot be read, and the output names it as a file",
                         json_string_value(uri));
            return FCT_OK;
        }
    }
    *found = result == FCT_OK;
    return result;
}

/* image/png and others by the first bytes, or NULL. */
static const char *find_image_type(const fct_glb_blob *blob) {
    static const struct {
        const char *start, *type;
        size_t size;
    } kinds[] = {{"\x89PNG", "image/png", 4},
                 {"\xff\xd8\xff", "image/jpeg", 3},
                 {"RIFF", "image/webp", 4},
                 {"\xabKTX 20", "image/ktx2", 7}};
    for (size_t k = 0; k < FCT_LENGTH(kinds); ++k)
        if (blob->size >= kinds[k].size && !memcmp(blob->data, kinds[k].start, kinds[k].size))
            return kinds[k].type;
    return NULL;
}

fct_result fct_gltf_store_images(fct_gltf *d, json_t *root, size_t view, fct_gltf_images *out) {
    json_t *images = json_object_get(root, "images"), *image;
    size_t i;
    *out = (fct_gltf_images){.buffer_count = json_array_size(images)};
    const fct_array arrays[] = {FCT_ARRAY_ZERO(out->buffers, out->buffer_count),
                                FCT_ARRAY_ZERO(out->blobs, out->buffer_count)};
    fct_result result = fct_allocate_all(d->env, arrays, FCT_LENGTH(arrays), "the images of a glTF file");
    json_array_foreach(images, i, image) {
        fct_glb_blob *blob = out->blobs + out->count;
        bool found;
        if (result == FCT_OK) result = open_image(d, image, out->buffers + i, blob, &found);
        if (result != FCT_OK) return result;
        if (!found) continue;
        const char *type = find_image_type(blob);
        json_object_del(image, "uri");
        if (json_object_set_new(image, "bufferView", json_integer((json_int_t)(view + out->count))) ||
            (type && !json_object_get(image, "mimeType") &&
             json_object_set_new(image, "mimeType", json_string(type))))
            return fail_json(d);
        ++out->count;
    }
    return result;
}

void fct_gltf_release_images(const fct_env *env, fct_gltf_images *images) {
    for (size_t k = 0; images->buffers && k < images->buffer_count; ++k) {
        fct_file_close(env, &images->buffers[k].file);
        fct_release(env, images->buffers[k].own);
    }
    fct_release(env, images->buffers);
    fct_release(env, images->blobs);
    *images = (fct_gltf_images){0};
}

/* Text that goes to a stream, except for its last byte. */
typedef struct held_text {
    FILE *stream;
    size_t length;
    char last;
} held_text;

static int hold_last_byte(const char *bytes, size_t size, void *user) {
    held_text *t = user;
    if (!size) return 0;
    if (t->length) fputc(t->last, t->stream);
    fwrite(bytes, 1, size - 1, t->stream);
    t->last = bytes[size - 1];
    t->length += size;
    return 0;
}

bool fct_gltf_print_open(const json_t *object, FILE *json, bool *failed) {
    held_text text = {.stream = json};
    *failed |=
        !object || json_dump_callback(object, hold_last_byte, &text, JSON_COMPACT | JSON_REAL_PRECISION(17));
    return text.length > 2;
}
