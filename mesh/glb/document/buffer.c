/* mesh/glb/document/buffer.c: see buffer.h.
 *
 * Buffers and views are opened when something uses them. The bytes that are present count: a false byteLength
 * of a buffer is no error as long as every used view lies within the bytes. Sources: glTF 2.0 specification,
 * chapter 3.6.1; EXT_meshopt_compression.
 */
#include "mesh/glb/document/buffer.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "base/io/beside.h"
#ifdef FCT_HAS_MESHOPT
#include <meshoptimizer.h>
#endif

/* ---- URIs ---- */

static int base64_digit(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

static int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* Decodes %20 and other escapes in place. Returns the length. */
static size_t decode_escapes(char *text) {
    char *to = text;
    for (const char *from = text; *from; ++to) {
        bool coded = from[0] == '%' && hex_digit(from[1]) >= 0 && hex_digit(from[2]) >= 0;
        *to = coded ? (char)(16 * hex_digit(from[1]) + hex_digit(from[2])) : *from;
        from += coded ? 3 : 1;
    }
    *to = 0;
    return (size_t)(to - text);
}

/* Decodes base64. Blanks and line ends are skipped, and = ends the data. */
static fct_result decode_base64(const fct_glb *glb, char *text, fct_glb_buffer *out) {
    size_t length = decode_escapes(text);
    uint32_t bits = 0;
    int held = 0;
    out->own = fct_allocate(glb->source->env, length / 4 * 3 + 3, 1);
    if (!out->own) return fct_fail_memory(glb->source->env, "a buffer");
    for (size_t k = 0; k < length && text[k] != '='; ++k) {
        if (strchr(" \t\r\n", text[k]) && text[k]) continue;
        int digit = base64_digit(text[k]);
        if (digit < 0) return fct_glb_fail(glb, "the data URI of a buffer is not base64");
        bits = bits << 6 | (uint32_t)digit;
        held += 6;
        if (held < 8) continue;
        held -= 8;
        out->own[out->size++] = (unsigned char)(bits >> held);
    }
    out->data = out->own;
    return FCT_OK;
}

/* Whether the URI has a scheme, such as http: or file:. */
static bool has_scheme(const char *uri) {
    size_t length = strcspn(uri, ":/?#");
    return length > 1 && uri[length] == ':';
}

/* Whether the file exists. `whole` has room for the folder and the path. */
static bool is_beside(const fct_glb *glb, const char *path, char *whole) {
    size_t head = path[0] == '/' || !glb->source->folder ? 0 : strlen(glb->source->folder);
    if (head) memcpy(whole, glb->source->folder, head);
    memcpy(whole + head, path, strlen(path) + 1);
    return access(whole, F_OK) == 0;
}

/* Opens the file of a URI: with its escapes decoded; else, if no such file exists, as it is written, or with
 * / for each \. `path` is a copy of the URI. */
static fct_result open_file(const fct_glb *glb, const char *uri, char *path, char *whole,
                            fct_glb_buffer *out) {
    const fct_source *source = glb->source;
    if (has_scheme(uri))
        return fct_glb_fail(glb, "the buffer \"%s\" is neither a data URI nor a file in its folder", uri);
    size_t length = decode_escapes(path);
    if (strlen(path) != length) return fct_glb_fail(glb, "the name of a buffer has a zero byte");
    if (!is_beside(glb, path, whole)) {
        if (is_beside(glb, uri, whole))
            strcpy(path, uri);
        else if (strchr(path, '\\'))
            for (char *c = path; *c; ++c)
                if (*c == '\\') *c = '/';
    }
    fct_result result = fct_file_open_beside(source->env, source->name, source->folder, path, &out->file);
    out->data = out->file.data;
    out->size = out->file.size;
    return result;
}

fct_result fct_glb_open_uri(const fct_glb *glb, const json_t *value, fct_glb_buffer *out) {
    const fct_env *env = glb->source->env;
    const char *uri = json_string_value(value), *comma = strchr(uri, ',');
    size_t length = json_string_length(value), folder = glb->source->folder ? strlen(glb->source->folder) : 0;
    bool data = !strncasecmp(uri, "data:", 5);
    if (strlen(uri) != length) return fct_glb_fail(glb, "the name of a buffer has a zero byte");
    if (data && (!comma || comma - uri < 12 || strncasecmp(comma - 7, ";base64", 7) != 0))
        return fct_glb_fail(glb, "the data URI of a buffer is not base64");
    char *copy = fct_allocate(env, 2 * (length + 1) + folder, 1);
    if (!copy) return fct_fail_memory(env, "a buffer");
    memcpy(copy, uri, length + 1);
    fct_result result = data ? decode_base64(glb, copy + (comma + 1 - uri), out)
                             : open_file(glb, uri, copy, copy + length + 1, out);
    fct_release(env, copy);
    return result;
}

/* ---- Buffers ---- */

static fct_result open_buffer(fct_glb *glb, int64_t index, const fct_glb_buffer **out) {
    json_t *object;
    fct_result result = fct_glb_item(glb, "buffers", index, &object);
    if (result != FCT_OK) return result;
    fct_glb_buffer *buffer = glb->buffers + index;
    json_t *uri = json_object_get(object, "uri");
    *out = buffer;
    if (buffer->open) return FCT_OK;
    if (json_is_string(uri)) {
        result = fct_glb_open_uri(glb, uri, buffer);
        glb->byte_count += buffer->size;
    } else if (glb->binary) {
        buffer->data = glb->binary, buffer->size = glb->binary_size;
    } else {
        result = fct_glb_fail(glb, "buffers[%lld] has neither a uri nor a BIN chunk", (long long)index);
    }
    buffer->open = result == FCT_OK;
    return result;
}

/* Finds the bytes [byteOffset, byteOffset + byteLength) that `object` names: a view or its extension. */
static fct_result find_bytes(fct_glb *glb, json_t *object, int64_t view, fct_glb_view *out) {
    int64_t number, offset, length, stride;
    const fct_glb_buffer *buffer;
    fct_result result = fct_glb_index(glb, object, "buffer", &number);
    if (result == FCT_OK) result = fct_glb_index(glb, object, "byteOffset", &offset);
    if (result == FCT_OK) result = fct_glb_index(glb, object, "byteLength", &length);
    if (result == FCT_OK) result = fct_glb_index(glb, object, "byteStride", &stride);
    if (result == FCT_OK) result = open_buffer(glb, number, &buffer);
    if (result != FCT_OK) return result;
    if (offset < 0) offset = 0;
    if (length < 0 || (uint64_t)offset > buffer->size || (uint64_t)length > buffer->size - (uint64_t)offset)
        return fct_glb_fail(glb, "bufferViews[%lld] reaches beyond buffers[%lld], which has %zu bytes",
                            (long long)view, (long long)number, buffer->size);
    out->data = buffer->data + offset;
    out->size = (size_t)length;
    out->stride = stride > 0 ? (size_t)stride : 0;
    return FCT_OK;
}

/* ---- EXT_meshopt_compression ---- */

#ifdef FCT_HAS_MESHOPT
/* Compressed bytes shrink to no less than this: a vertex block spends 2 bits per 16 bytes, an index block one
 * byte per three indices of four bytes. A larger count is a lie, and is refused before memory is allocated.
 */
enum { MOST_EXPANSION = 64 };

static int decode_elements(const char *mode, unsigned char *to, size_t count, size_t stride,
                           const fct_glb_view *from) {
    if (!strcmp(mode, "ATTRIBUTES"))
        return stride % 4 || stride > 256
                   ? -1
                   : meshopt_decodeVertexBuffer(to, count, stride, from->data, from->size);
    if (stride != 2 && stride != 4) return -1;
    if (!strcmp(mode, "TRIANGLES"))
        return count % 3 ? -1 : meshopt_decodeIndexBuffer(to, count, stride, from->data, from->size);
    return !strcmp(mode, "INDICES") ? meshopt_decodeIndexSequence(to, count, stride, from->data, from->size)
                                    : -1;
}

/* False if the filter does not exist or does not fit the stride. */
static bool apply_filter(const char *filter, unsigned char *data, size_t count, size_t stride) {
    if (!filter || !strcmp(filter, "NONE")) return true;
    if (!strcmp(filter, "OCTAHEDRAL") && (stride == 4 || stride == 8))
        meshopt_decodeFilterOct(data, count, stride);
    else if (!strcmp(filter, "QUATERNION") && stride == 8)
        meshopt_decodeFilterQuat(data, count, stride);
    else if (!strcmp(filter, "EXPONENTIAL") && stride % 4 == 0)
        meshopt_decodeFilterExp(data, count, stride);
    else
        return false;
    return true;
}

static fct_result decompress_view(fct_glb *glb, json_t *extension, int64_t index, fct_glb_view *view) {
    const char *mode = json_string_value(json_object_get(extension, "mode")),
               *filter = json_string_value(json_object_get(extension, "filter"));
    fct_glb_view packed;
    int64_t count, stride;
    fct_result result = fct_glb_index(glb, extension, "count", &count);
    if (result == FCT_OK) result = fct_glb_index(glb, extension, "byteStride", &stride);
    if (result == FCT_OK) result = find_bytes(glb, extension, index, &packed);
    if (result != FCT_OK) return result;
    if (!mode || count < 0 || stride < 1 || stride > 256 ||
        (uint64_t)count > (MOST_EXPANSION * (uint64_t)packed.size + 4096) / (uint64_t)stride)
        return fct_glb_fail(glb, "bufferViews[%lld]: its compressed data cannot hold its count",
                            (long long)index);
    size_t elements = (size_t)count;
    view->own = fct_allocate_zero(glb->source->env, elements, (size_t)stride);
    if (!view->own) return fct_fail_memory(glb->source->env, "a buffer view");
    if (elements && (decode_elements(mode, view->own, elements, (size_t)stride, &packed) ||
                     !apply_filter(filter, view->own, elements, (size_t)stride)))
        return fct_glb_fail(glb, "bufferViews[%lld]: its compressed data is damaged", (long long)index);
    view->data = view->own;
    view->size = elements * (size_t)stride;
    view->stride = !strcmp(mode, "ATTRIBUTES") ? (size_t)stride : 0;
    return FCT_OK;
}
#endif

static fct_result open_view(fct_glb *glb, json_t *object, int64_t index, fct_glb_view *view) {
#ifdef FCT_HAS_MESHOPT
    json_t *extension = fct_glb_extension(object, "EXT_meshopt_compression");
    if (extension) return decompress_view(glb, extension, index, view);
#endif
    return find_bytes(glb, object, index, view);
}

fct_result fct_glb_view_of(fct_glb *glb, int64_t index, const fct_glb_view **out) {
    json_t *object;
    fct_result result = fct_glb_item(glb, "bufferViews", index, &object);
    if (result != FCT_OK) return result;
    fct_glb_view *view = glb->views + index;
    if (!view->open) result = open_view(glb, object, index, view);
    view->open = result == FCT_OK;
    *out = view;
    return result;
}
