/* mesh/glb/document/accessor.c: see accessor.h. Source: glTF 2.0 specification, chapter 3.6.2. */
#include "mesh/glb/document/accessor.h"

#include <string.h>

#include "mesh/glb/document/buffer.h"

static uint32_t little_32(const unsigned char *p) {
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
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

/* Sets data and stride of an array of elements within a view. `what` names it in messages. */
static fct_result find_elements(fct_glb *glb, json_t *object, const char *what, int64_t index,
                                fct_glb_array *out) {
    int64_t number, offset;
    const fct_glb_view *view;
    fct_result result = fct_glb_index(glb, object, "bufferView", &number);
    if (result == FCT_OK) result = fct_glb_index(glb, object, "byteOffset", &offset);
    if (result == FCT_OK) result = fct_glb_view_of(glb, number, &view);
    if (result != FCT_OK) return result;
    uint64_t element = (uint64_t)out->width * (uint64_t)component_size(out->component);
    uint64_t step = view->stride ? view->stride : element, begin = offset > 0 ? (uint64_t)offset : 0;
    if (step < element || begin > view->size ||
        (out->count &&
         (element > view->size - begin || (out->count - 1) > (view->size - begin - element) / step)))
        return fct_glb_fail(glb, "accessors[%lld]%s reaches beyond its bufferView", (long long)index, what);
    out->data = view->data + begin;
    out->stride = (size_t)step;
    return FCT_OK;
}

/* Replaces the elements that `sparse` lists. */
static fct_result replace_elements(fct_glb *glb, json_t *sparse, int64_t index, fct_glb_array *array) {
    int64_t count, component;
    json_t *places = json_object_get(sparse, "indices"), *values = json_object_get(sparse, "values");
    fct_result result = fct_glb_index(glb, sparse, "count", &count);
    if (result == FCT_OK) result = fct_glb_index(glb, places, "componentType", &component);
    if (result != FCT_OK) return result;
    if (count < 0 || (component != 5121 && component != 5123 && component != 5125))
        return fct_glb_fail(glb, "accessors[%lld].sparse has no count, or indices of another type",
                            (long long)index);
    fct_glb_array from = {.count = (size_t)count, .component = (int)component, .width = 1}, to = *array;
    to.count = (size_t)count;
    result = find_elements(glb, places, ".sparse.indices", index, &from);
    if (result == FCT_OK) result = find_elements(glb, values, ".sparse.values", index, &to);
    for (size_t i = 0; result == FCT_OK && i < from.count; ++i) {
        double place = fct_glb_value(&from, i, 0);
        if (place >= (double)array->count)
            return fct_glb_fail(glb, "accessors[%lld].sparse replaces element %.0f of %zu", (long long)index,
                                place, array->count);
        memcpy(array->own + (size_t)place * array->stride, to.data + i * to.stride, array->stride);
    }
    return result;
}

/* Copies the elements, or zeros if the accessor has no view, and replaces those of `sparse`. A short file
 * could ask for many large accessors, so all of them together are limited by the bytes of the file. */
static fct_result assemble_elements(fct_glb *glb, json_t *accessor, int64_t index, bool has_view,
                                    fct_glb_array *array) {
    json_t *sparse = json_object_get(accessor, "sparse");
    size_t element = (size_t)array->width * (size_t)component_size(array->component);
    uint64_t limit = 64 * (uint64_t)glb->byte_count + 4096;
    if (array->count > limit - glb->dense_count)
        return fct_glb_fail(glb, "accessors[%lld] has %zu elements that the file does not hold",
                            (long long)index, array->count);
    glb->dense_count += array->count;
    array->own = fct_allocate_zero(glb->source->env, array->count, element);
    if (!array->own) return fct_fail_memory(glb->source->env, "an accessor");
    for (size_t i = 0; has_view && i < array->count; ++i)
        memcpy(array->own + i * element, array->data + i * array->stride, element);
    array->data = array->own;
    array->stride = element;
    return sparse ? replace_elements(glb, sparse, index, array) : FCT_OK;
}

static fct_result open_array(fct_glb *glb, json_t *accessor, int64_t index, fct_glb_array *array) {
    int64_t view, component, count;
    fct_result result = fct_glb_index(glb, accessor, "bufferView", &view);
    if (result == FCT_OK) result = fct_glb_index(glb, accessor, "componentType", &component);
    if (result == FCT_OK) result = fct_glb_index(glb, accessor, "count", &count);
    if (result != FCT_OK) return result;
    array->width = count_components(json_string_value(json_object_get(accessor, "type")));
    if (!component_size(component) || !array->width || count < 0)
        return fct_glb_fail(glb, "accessors[%lld] is not of the type expected", (long long)index);
    array->count = (size_t)count;
    array->component = (int)component;
    array->normalized = json_is_true(json_object_get(accessor, "normalized"));
    bool has_view = view != FCT_GLB_ABSENT;
    if (has_view) result = find_elements(glb, accessor, "", index, array);
    if (result == FCT_OK && (!has_view || json_object_get(accessor, "sparse")))
        result = assemble_elements(glb, accessor, index, has_view, array);
    return result;
}

fct_result fct_glb_array_of(fct_glb *glb, int64_t index, int least, int most, const fct_glb_array **out) {
    json_t *accessor;
    fct_result result = fct_glb_item(glb, "accessors", index, &accessor);
    if (result != FCT_OK) return result;
    fct_glb_array *array = glb->arrays + index;
    if (!array->open) result = open_array(glb, accessor, index, array);
    array->open = result == FCT_OK;
    *out = array;
    if (result == FCT_OK && (array->width < least || array->width > most))
        return fct_glb_fail(glb, "accessors[%lld] is not of the type expected", (long long)index);
    return result;
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
