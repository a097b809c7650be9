/* mesh/glb/glb.c: see glb.h. Source: glTF 2.0 specification, chapters 3.6 and 4. */
#include "mesh/glb/glb.h"

#include <string.h>

#include "base/io/json.h"

static uint32_t little_32(const unsigned char *p) {
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static fct_result fail_glb(const fct_glb *glb, const char *what) {
    return fct_fail(glb->source->env, FCT_ERROR_DATA, "%s: %s", glb->source->name, what);
}

static fct_result parse_json(fct_glb *glb, const char *text, size_t size) {
    json_error_t error;
    fct_result result = fct_json_check_memory(glb->source->env, glb->source->name, text, size);
    if (result != FCT_OK) return result;
    glb->root = json_loadb(text, size, JSON_ALLOW_NUL, &error);
    if (glb->root) return json_is_object(glb->root) ? FCT_OK : fail_glb(glb, "its JSON is no object");
    if (json_error_code(&error) == json_error_out_of_memory)
        return fct_fail_memory(glb->source->env, "the JSON of a GLB file");
    return fct_fail(glb->source->env, FCT_ERROR_DATA, "%s: JSON line %d column %d: %s", glb->source->name,
                    error.line, error.column, error.text);
}

/* Accepts only extensions that do not change how this reader must interpret positions, attributes and nodes.
 */
static fct_result check_extensions(const fct_glb *glb) {
    json_t *required = json_object_get(glb->root, "extensionsRequired"), *item;
    size_t i;
    json_array_foreach(required, i, item) {
        const char *name = json_string_value(item);
        if (name && (!strncmp(name, "KHR_materials_", 14) || !strcmp(name, "KHR_texture_transform") ||
                     !strcmp(name, "KHR_mesh_quantization") || !strcmp(name, "KHR_texture_basisu") ||
                     !strcmp(name, "KHR_lights_punctual")))
            continue;
        return fct_fail(glb->source->env, FCT_ERROR_DATA, "%s: the required extension %s is not supported",
                        glb->source->name, name ? name : "(not a name)");
    }
    return FCT_OK;
}

fct_result fct_glb_open(const fct_source *source, fct_glb *out) {
    *out = (fct_glb){.source = source};
    const unsigned char *p = source->data;
    if (source->size < 20 || memcmp(p, "glTF", 4))
        return fail_glb(out, "no GLB file: it does not begin with glTF");
    if (little_32(p + 4) != 2) return fail_glb(out, "only version 2 of glTF is read");
    if (little_32(p + 8) != source->size)
        return fct_fail(source->env, FCT_ERROR_DATA, "%s: its head says %u bytes, but the file has %zu",
                        source->name, little_32(p + 8), source->size);
    size_t json_size = little_32(p + 12), left = source->size - 20;
    if (memcmp(p + 16, "JSON", 4) || json_size > left)
        return fail_glb(out, "the first chunk is no JSON, or longer than the file");
    left -= json_size;
    const unsigned char *next = p + 20 + json_size;
    if (left >= 8 && !memcmp(next + 4, "BIN", 4)) {
        out->binary_size = little_32(next);
        out->binary = next + 8;
        if (out->binary_size > left - 8) return fail_glb(out, "the BIN chunk is longer than the file");
    }
    fct_result result = parse_json(out, (const char *)p + 20, json_size);
    return result == FCT_OK ? check_extensions(out) : result;
}

void fct_glb_close(fct_glb *glb) {
    json_decref(glb->root);
    glb->root = NULL;
}

fct_result fct_glb_item(const fct_glb *glb, const char *name, int64_t index, json_t **out) {
    *out = index < 0 ? NULL : json_array_get(json_object_get(glb->root, name), (size_t)index);
    if (json_is_object(*out)) return FCT_OK;
    return fct_fail(glb->source->env, FCT_ERROR_DATA, "%s: %s %lld is not there", glb->source->name, name,
                    (long long)index);
}

fct_result fct_glb_index(const fct_glb *glb, json_t *object, const char *key, int64_t *out) {
    json_t *value = json_object_get(object, key);
    *out = FCT_GLB_ABSENT;
    if (!value) return FCT_OK;
    if (!json_is_integer(value) || json_integer_value(value) < 0)
        return fct_fail(glb->source->env, FCT_ERROR_DATA, "%s: '%s' is no whole number from 0",
                        glb->source->name, key);
    *out = json_integer_value(value);
    return FCT_OK;
}

static int component_size(int64_t component) {
    switch (component) {
    case 5120:
    case 5121:
        return 1;
    case 5122:
    case 5123:
        return 2;
    case 5125:
    case 5126:
        return 4;
    default:
        return 0;
    }
}

static int count_components(const char *type) {
    static const char *const names[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    for (int i = 0; type && i < 4; ++i)
        if (!strcmp(type, names[i])) return i + 1;
    return 0;
}

/* Finds the bytes of a buffer view. Only buffer 0, the BIN chunk, is supported. */
static fct_result find_view(const fct_glb *glb, int64_t index, const unsigned char **data, size_t *size,
                            int64_t *stride) {
    json_t *view, *buffer;
    int64_t number, offset, length;
    fct_result result = fct_glb_item(glb, "bufferViews", index, &view);
    if (result == FCT_OK) result = fct_glb_index(glb, view, "buffer", &number);
    if (result == FCT_OK) result = fct_glb_index(glb, view, "byteOffset", &offset);
    if (result == FCT_OK) result = fct_glb_index(glb, view, "byteLength", &length);
    if (result == FCT_OK) result = fct_glb_index(glb, view, "byteStride", stride);
    if (result == FCT_OK) result = fct_glb_item(glb, "buffers", number, &buffer);
    if (result != FCT_OK) return result;
    if (number || json_object_get(buffer, "uri") || !glb->binary)
        return fail_glb(glb, "a buffer outside the file, which is not read");
    if (offset < 0) offset = 0;
    if (length < 0 || (uint64_t)offset > glb->binary_size ||
        (uint64_t)length > glb->binary_size - (uint64_t)offset)
        return fct_fail(glb->source->env, FCT_ERROR_DATA, "%s: bufferViews %lld reaches beyond the BIN chunk",
                        glb->source->name, (long long)index);
    *data = glb->binary + offset;
    *size = (size_t)length;
    return FCT_OK;
}

fct_result fct_glb_array_of(const fct_glb *glb, int64_t index, int least, int most, fct_glb_array *out) {
    json_t *accessor;
    int64_t view, offset, component, count, stride = 0;
    size_t size = 0;
    fct_result result = fct_glb_item(glb, "accessors", index, &accessor);
    if (result == FCT_OK) result = fct_glb_index(glb, accessor, "bufferView", &view);
    if (result == FCT_OK) result = fct_glb_index(glb, accessor, "byteOffset", &offset);
    if (result == FCT_OK) result = fct_glb_index(glb, accessor, "componentType", &component);
    if (result == FCT_OK) result = fct_glb_index(glb, accessor, "count", &count);
    if (result != FCT_OK) return result;
    int width = count_components(json_string_value(json_object_get(accessor, "type")));
    if (!component_size(component) || width < least || width > most || count < 0)
        return fct_fail(glb->source->env, FCT_ERROR_DATA, "%s: accessor %lld is not of the type expected",
                        glb->source->name, (long long)index);
    if (json_object_get(accessor, "sparse") || view == FCT_GLB_ABSENT)
        return fct_fail(glb->source->env, FCT_ERROR_DATA, "%s: accessor %lld is sparse, which is not read",
                        glb->source->name, (long long)index);
    result = find_view(glb, view, &out->data, &size, &stride);
    if (result != FCT_OK) return result;
    uint64_t element = (uint64_t)width * (uint64_t)component_size(component);
    uint64_t step = stride > 0 ? (uint64_t)stride : element, begin = offset > 0 ? (uint64_t)offset : 0;
    if (step < element || step > 252 || begin > size ||
        (count && (element > size - begin || (uint64_t)(count - 1) > (size - begin - element) / step)))
        return fct_fail(glb->source->env, FCT_ERROR_DATA, "%s: accessor %lld reaches beyond its bufferView",
                        glb->source->name, (long long)index);
    out->data += begin;
    out->stride = (size_t)step;
    out->count = (size_t)count;
    out->component = (int)component;
    out->width = width;
    out->normalized = json_is_true(json_object_get(accessor, "normalized"));
    return FCT_OK;
}

double fct_glb_value(const fct_glb_array *array, size_t i, int k) {
    const unsigned char *p = array->data + i * array->stride + k * component_size(array->component);
    double value = 0, range = 1;
    uint16_t half = (uint16_t)p[0];
    if (array->component > 5121) half = (uint16_t)(p[0] | p[1] << 8);
    float number;
    uint32_t bits;
    switch (array->component) {
    case 5120:
        value = (int8_t)p[0], range = 127;
        break;
    case 5121:
        value = p[0], range = 255;
        break;
    case 5122:
        value = (int16_t)half, range = 32767;
        break;
    case 5123:
        value = half, range = 65535;
        break;
    case 5125:
        return little_32(p);
    default:
        bits = little_32(p);
        memcpy(&number, &bits, sizeof number);
        return (double)number;
    }
    if (!array->normalized) return value;
    return value / range < -1 ? -1 : value / range;
}
