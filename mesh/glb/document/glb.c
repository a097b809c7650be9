/* mesh/glb/document/glb.c: see glb.h. Source: glTF 2.0 specification, chapters 3.2, 3.12 and 4. */
#include "mesh/glb/document/glb.h"

#include <stdarg.h>
#include <string.h>

#include "base/io/json.h"

static uint32_t little_32(const unsigned char *p) {
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

fct_result fct_glb_fail(const fct_glb *glb, const char *format, ...) {
    char text[512];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    return fct_fail(glb->source->env, FCT_ERROR_DATA, "%s: %s", glb->source->name, text);
}

void fct_glb_warn(const fct_glb *glb, const char *format, ...) {
    char text[512];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    fct_note(glb->source->env, FCT_MESSAGE_WARNING, "%s: %s", glb->source->name, text);
}

/* Skips a byte order mark, and drops zero bytes that pad the end. */
static void trim_text(const char **text, size_t *size) {
    if (*size >= 3 && !memcmp(*text, "\xef\xbb\xbf", 3)) *text += 3, *size -= 3;
    while (*size && !(*text)[*size - 1]) --*size;
}

static fct_result parse_json(fct_glb *glb, const char *text, size_t size) {
    trim_text(&text, &size);
    fct_result result =
        fct_json_load(glb->source->env, glb->source->name, text, size, JSON_ALLOW_NUL, &glb->root);
    if (result != FCT_OK || json_is_object(glb->root)) return result;
    return fct_glb_fail(glb, "its JSON is no object");
}

static fct_result fail_version(const fct_glb *glb, const char *found) {
    return fct_glb_fail(glb, "found glTF %s, expected glTF 2.0; convert the file first", found);
}

/* The lists of glTF 1.0 are objects. */
static bool has_lists_of_version_1(const fct_glb *glb) {
    static const char *const lists[] = {"accessors", "bufferViews", "buffers", "meshes", "nodes", "scenes"};
    for (size_t i = 0; i < sizeof lists / sizeof *lists; ++i)
        if (json_is_object(json_object_get(glb->root, lists[i]))) return true;
    return false;
}

/* A file without a version is read as 2.0. Later versions 2.x are read if minVersion permits. */
static fct_result check_version(const fct_glb *glb) {
    json_t *asset = json_object_get(glb->root, "asset");
    const char *least = json_string_value(json_object_get(asset, "minVersion"));
    json_t *version = json_object_get(asset, "version");
    const char *text = json_string_value(version);
    char number[32];
    if (json_is_number(version)) snprintf(number, sizeof number, "%.1f", json_number_value(version));
    if (json_is_number(version)) text = number;
    if (text && strcmp(text, "2") != 0 && strncmp(text, "2.", 2) != 0) return fail_version(glb, text);
    if (least && strcmp(least, "2") != 0 && strcmp(least, "2.0") != 0) return fail_version(glb, least);
    return has_lists_of_version_1(glb) ? fail_version(glb, "1.0") : FCT_OK;
}

bool fct_glb_supports(const char *extension) {
    static const char *const names[] = {"KHR_mesh_quantization", "KHR_materials_emissive_strength",
                                        "KHR_materials_unlit", "KHR_texture_transform",
#ifdef FCT_HAS_MESHOPT
                                        "EXT_meshopt_compression"
#endif
    };
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        if (!strcmp(extension, names[i])) return true;
    return false;
}

static fct_result check_extensions(const fct_glb *glb) {
    json_t *required = json_object_get(glb->root, "extensionsRequired"), *item;
    size_t i;
    json_array_foreach(required, i, item) {
        const char *name = json_string_value(item);
        if (name && fct_glb_supports(name)) continue;
        return fct_glb_fail(glb, "the required extension %s is not supported%s", name ? name : "(not a name)",
                            name && !strcmp(name, "EXT_meshopt_compression")
                                ? ", because this build has no libmeshoptimizer"
                                : "");
    }
    return FCT_OK;
}

/* Finds the chunks of a GLB. They decide where the file ends; the length in its head is only compared. */
static fct_result find_chunks(fct_glb *glb, const char **text, size_t *text_size) {
    const unsigned char *p = glb->source->data;
    size_t size = glb->source->size;
    if (size < 8) return fct_glb_fail(glb, "the file ends after %zu bytes", size);
    if (little_32(p + 4) == 1) return fail_version(glb, "1.0");
    if (little_32(p + 4) != 2) return fct_glb_fail(glb, "found GLB version %u, expected 2", little_32(p + 4));
    if (size < 20) return fct_glb_fail(glb, "the file ends after %zu bytes", size);
    size_t left = size - 20, said = little_32(p + 8);
    *text = (const char *)p + 20, *text_size = little_32(p + 12);
    if (memcmp(p + 16, "JSON", 4) || *text_size > left)
        return fct_glb_fail(glb, "the first chunk is no JSON, or longer than the file");
    left -= *text_size;
    const unsigned char *next = p + 20 + *text_size;
    if (left >= 8 && !memcmp(next + 4, "BIN", 4)) {
        glb->binary_size = little_32(next);
        glb->binary = next + 8;
        if (glb->binary_size > left - 8)
            return fct_glb_fail(glb, "the BIN chunk has %zu bytes, but %zu remain", glb->binary_size,
                                left - 8);
    }
    if (said < size) fct_glb_warn(glb, "%zu bytes after the end of the GLB are left out", size - said);
    if (said > size) fct_glb_warn(glb, "its head says %zu bytes, but the file has %zu", said, size);
    return FCT_OK;
}

static fct_result allocate_lists(fct_glb *glb) {
    glb->buffer_count = fct_glb_count(glb, "buffers");
    glb->view_count = fct_glb_count(glb, "bufferViews");
    glb->array_count = fct_glb_count(glb, "accessors");
    const fct_array lists[] = {FCT_ARRAY_ZERO(glb->buffers, glb->buffer_count),
                               FCT_ARRAY_ZERO(glb->views, glb->view_count),
                               FCT_ARRAY_ZERO(glb->arrays, glb->array_count)};
    return fct_allocate_all(glb->source->env, lists, FCT_LENGTH(lists), "a glTF document");
}

fct_result fct_glb_open(const fct_source *source, fct_glb *out) {
    *out = (fct_glb){.source = source, .byte_count = source->size};
    const char *text = source->data;
    size_t size = source->size;
    fct_result result = FCT_OK;
    if (size >= 4 && !memcmp(text, "glTF", 4)) result = find_chunks(out, &text, &size);
    if (result == FCT_OK) result = parse_json(out, text, size);
    if (result == FCT_OK) result = check_version(out);
    if (result == FCT_OK) result = check_extensions(out);
    return result == FCT_OK ? allocate_lists(out) : result;
}

void fct_glb_close(fct_glb *glb) {
    const fct_env *env = glb->source->env;
    for (size_t i = 0; glb->buffers && i < glb->buffer_count; ++i) {
        fct_file_close(env, &glb->buffers[i].file);
        fct_release(env, glb->buffers[i].own);
    }
    for (size_t i = 0; glb->views && i < glb->view_count; ++i) fct_release(env, glb->views[i].own);
    for (size_t i = 0; glb->arrays && i < glb->array_count; ++i) fct_release(env, glb->arrays[i].own);
    fct_release(env, glb->buffers);
    fct_release(env, glb->views);
    fct_release(env, glb->arrays);
    json_decref(glb->root);
    *glb = (fct_glb){.source = glb->source};
}

size_t fct_glb_count(const fct_glb *glb, const char *name) {
    return json_array_size(json_object_get(glb->root, name));
}

fct_result fct_glb_item(const fct_glb *glb, const char *name, int64_t index, json_t **out) {
    *out = index < 0 ? NULL : json_array_get(json_object_get(glb->root, name), (size_t)index);
    if (json_is_object(*out)) return FCT_OK;
    return fct_glb_fail(glb, "%s[%lld] does not exist", name, (long long)index);
}

fct_result fct_glb_index(const fct_glb *glb, json_t *object, const char *key, int64_t *out) {
    json_t *value = json_object_get(object, key);
    *out = FCT_GLB_ABSENT;
    if (!value) return FCT_OK;
    if (!json_is_integer(value) || json_integer_value(value) < 0)
        return fct_glb_fail(glb, "'%s' is no whole number from 0", key);
    *out = json_integer_value(value);
    return FCT_OK;
}

json_t *fct_glb_extension(json_t *object, const char *name) {
    return json_object_get(json_object_get(object, "extensions"), name);
}
