/* scene/read/gltf_pack.c: packs a .gltf and its buffers into one GLB, so that one reader serves both formats.
 *
 * A buffer is a file beside the .gltf, or a data URI in base64. The packer concatenates the buffers and moves
 * the offsets of the buffer views. A false byteLength cannot make it allocate more than the buffers hold.
 */
#include "scene/read/gltf_pack.h"

#include <string.h>

#include "base/io/file.h"
#include "scene/read/json/json.h"
#include "scene/read/path.h"

typedef struct packer {
    fct_json json;
    const char *base;
    json_t *root;
    unsigned char *bytes; /* all buffers, each at a multiple of 8 */
    size_t count, capacity;
    size_t *starts, *sizes; /* per buffer */
    size_t buffer_count;
} packer;

static fct_result append_bytes(packer *p, const void *data, size_t size) {
    if (size > INT32_MAX || p->count + size > INT32_MAX)
        return fct_json_fail(&p->json, "the buffers hold more than 2 GB");
    fct_result result =
        fct_grow(p->json.env, (void **)&p->bytes, &p->capacity, p->count + size + 8, sizeof *p->bytes);
    if (result != FCT_OK) return result;
    memcpy(p->bytes + p->count, data, size);
    p->count += size;
    return FCT_OK;
}

static int base64_digit(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

static fct_result append_base64(packer *p, const char *text) {
    uint32_t bits = 0;
    int held = 0;
    size_t length = strlen(text);
    fct_result result = FCT_OK;
    while (length > 0 && text[length - 1] == '=') --length;
    for (size_t k = 0; k < length && result == FCT_OK; ++k) {
        int digit = base64_digit(text[k]);
        if (digit < 0) return fct_json_fail(&p->json, "the data is not base64");
        bits = bits << 6 | (uint32_t)digit;
        held += 6;
        if (held < 8) continue;
        held -= 8;
        unsigned char byte = (unsigned char)(bits >> held);
        result = append_bytes(p, &byte, 1);
    }
    return result;
}

static int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

static fct_result append_file(packer *p, const char *uri) {
    char *path = fct_path_join(p->json.env, p->base, uri);
    if (!path) return FCT_ERROR_MEMORY;
    char *to = path + (uri[0] == '/' ? 0 : strlen(p->base));
    for (const char *from = to; *from || *to; ++to) { /* decodes %20 and other escapes */
        bool coded = from[0] == '%' && hex_digit(from[1]) >= 0 && hex_digit(from[2]) >= 0;
        *to = coded ? (char)(16 * hex_digit(from[1]) + hex_digit(from[2])) : *from;
        if (!*from) break;
        from += coded ? 3 : 1;
    }
    fct_file file;
    fct_result result = fct_file_open(p->json.env, path, &file);
    if (result == FCT_OK) {
        result = append_bytes(p, file.data, file.size);
        fct_file_close(p->json.env, &file);
    }
    fct_release(p->json.env, path);
    return result;
}

static fct_result append_buffer(packer *p, const json_t *buffer, size_t index) {
    const json_t *length = json_object_get(buffer, "byteLength");
    const char *uri = json_string_value(json_object_get(buffer, "uri")), *comma;
    if (!uri) return fct_json_expected(&p->json, "a buffer with a uri", buffer);
    if (!json_is_integer(length) || json_integer_value(length) < 0)
        return fct_json_fail(&p->json, "expected a whole number >= 0 as byteLength");
    static const unsigned char zeros[8];
    fct_result result = append_bytes(p, zeros, (8 - p->count % 8) % 8);
    if (result != FCT_OK) return result;
    p->starts[index] = p->count;
    if (strncmp(uri, "data:", 5) == 0) {
        comma = strchr(uri, ',');
        if (!comma || comma - uri < 12 || strncmp(comma - 7, ";base64", 7) != 0)
            return fct_json_fail(&p->json, "expected a data URI in base64");
        result = append_base64(p, comma + 1);
    } else {
        result = append_file(p, uri);
    }
    p->sizes[index] = p->count - p->starts[index];
    if (result == FCT_OK && (uint64_t)json_integer_value(length) > p->sizes[index])
        result = fct_json_fail(&p->json, "byteLength is %lld, but there are %zu bytes",
                               (long long)json_integer_value(length), p->sizes[index]);
    return result;
}

static fct_result append_buffers(packer *p) {
    json_t *buffers = json_object_get(p->root, "buffers");
    p->buffer_count = json_array_size(buffers);
    p->starts = fct_allocate(p->json.env, p->buffer_count, sizeof *p->starts);
    p->sizes = fct_allocate(p->json.env, p->buffer_count, sizeof *p->sizes);
    if (!p->starts || !p->sizes) return fct_fail_memory(p->json.env, "buffers");
    size_t before = fct_json_enter(&p->json, "buffers");
    for (size_t k = 0; k < p->buffer_count; ++k) {
        size_t inside = fct_json_enter_index(&p->json, k);
        fct_result result = append_buffer(p, json_array_get(buffers, k), k);
        if (result != FCT_OK) return result;
        fct_json_leave(&p->json, inside);
    }
    fct_json_leave(&p->json, before);
    return FCT_OK;
}

/* Checks that each view lies within its buffer, and moves it to its place in the packed buffer. */
static fct_result move_views(packer *p) {
    json_t *views = json_object_get(p->root, "bufferViews"), *view;
    size_t k, before = fct_json_enter(&p->json, "bufferViews");
    json_array_foreach(views, k, view) {
        size_t inside = fct_json_enter_index(&p->json, k);
        json_t *buffer = json_object_get(view, "buffer"), *offset = json_object_get(view, "byteOffset"),
               *length = json_object_get(view, "byteLength");
        json_int_t b = json_integer_value(buffer), begin = json_integer_value(offset),
                   size = json_integer_value(length);
        if (!json_is_integer(buffer) || b < 0 || (uint64_t)b >= p->buffer_count)
            return fct_json_fail(&p->json, "its buffer does not exist");
        if (begin < 0 || size < 0 || (uint64_t)begin > p->sizes[b] ||
            (uint64_t)size > p->sizes[b] - (uint64_t)begin)
            return fct_json_fail(&p->json, "it extends beyond its buffer");
        if (json_object_set_new(view, "buffer", json_integer(0)) ||
            json_object_set_new(view, "byteOffset", json_integer(begin + (json_int_t)p->starts[b])))
            return fct_fail_memory(p->json.env, "buffer views");
        fct_json_leave(&p->json, inside);
    }
    fct_json_leave(&p->json, before);
    json_t *one = json_pack("[{s:I}]", "byteLength", (json_int_t)p->count);
    return json_object_set_new(p->root, "buffers", one) ? fct_fail_memory(p->json.env, "buffers") : FCT_OK;
}

static void put_32(unsigned char *to, size_t value) {
    for (int k = 0; k < 4; ++k) to[k] = (unsigned char)(value >> 8 * k);
}

static fct_result assemble_glb(packer *p, unsigned char **out, size_t *size) {
    size_t text_size = json_dumpb(p->root, NULL, 0, JSON_COMPACT), padded = (text_size + 3) & ~(size_t)3,
           binary = (p->count + 3) & ~(size_t)3;
    if (text_size == 0 || padded > INT32_MAX) return fct_fail_memory(p->json.env, "a glTF document");
    *size = 20 + padded + (binary ? 8 + binary : 0);
    unsigned char *to = *out = fct_allocate_zero(p->json.env, *size, 1);
    if (!to) return fct_fail_memory(p->json.env, "a glTF document");
    memcpy(to, "glTF", 4);
    put_32(to + 4, 2);
    put_32(to + 8, *size);
    put_32(to + 12, padded);
    memcpy(to + 16, "JSON", 4);
    memset(to + 20, ' ', padded);
    json_dumpb(p->root, (char *)to + 20, padded, JSON_COMPACT);
    if (binary) {
        put_32(to + 20 + padded, binary);
        memcpy(to + 24 + padded, "BIN", 4);
        memcpy(to + 28 + padded, p->bytes, p->count);
    }
    return FCT_OK;
}

fct_result fct_gltf_pack(const fct_env *env, const char *name, const char *text, size_t size,
                         const char *base, unsigned char **out, size_t *out_size) {
    packer p = {.json = {.env = env, .file = name}, .base = base};
    *out = NULL;
    fct_result result = fct_json_parse(&p.json, text, size, &p.root);
    if (result == FCT_OK && !json_is_object(p.root)) result = fct_json_expected(&p.json, "an object", p.root);
    if (result == FCT_OK) result = append_buffers(&p);
    if (result == FCT_OK) result = move_views(&p);
    if (result == FCT_OK) result = assemble_glb(&p, out, out_size);
    json_decref(p.root);
    fct_release(env, p.bytes);
    fct_release(env, p.starts);
    fct_release(env, p.sizes);
    return result;
}
