/* mesh/glb/write.c: writes glTF 2.0 binary: one mesh, one primitive per material, shared vertices.
 *
 * A coloured mesh is unlit (KHR_materials_unlit). COLOR_0 holds the exposed, clamped, linear colours as
 * normalized shorts; _RADIOSITY holds the unchanged colours. In glTF, texture coordinates belong to vertices,
 * so a vertex whose corners have different ones is repeated after the last vertex. All data are little endian
 * and aligned to four bytes. The JSON is made first, because its length comes before it in the file.
 */
#define _GNU_SOURCE
#include "mesh/glb/write.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/env.h"
#include "base/math/vec.h"
#include "mesh/mesh.h"

/* The vertices in the file, and the corners' indices into them. */
typedef struct layout {
    uint32_t vertex_count;
    uint32_t *origins; /* mesh vertex of each file vertex, NULL: the same */
    float *texcoords;  /* vertex_count x 2, or NULL */
    uint32_t *corners; /* 3 x face_count, NULL: the triangles of the mesh */
    uint32_t *order;   /* faces sorted by material, NULL: mesh order */
    uint32_t *firsts;  /* material_count + 1 places in `order`, NULL: one material */
} layout;

enum { LONGEST_CHAIN = 64 };

/* Returns the copy of `vertex` that has these texture coordinates, or appends one. The search stops after
 * LONGEST_CHAIN copies, so that it takes constant time; it may then append a copy that already exists. */
static uint32_t place_corner(const float *uv, uint32_t vertex, layout *l, uint32_t *next,
                             unsigned char *used) {
    uint32_t at = vertex;
    if (!used[vertex]) {
        used[vertex] = 1;
        memcpy(l->texcoords + 2 * (size_t)vertex, uv, 2 * sizeof(float));
        return vertex;
    }
    for (int steps = 0; at != FCT_NONE && steps < LONGEST_CHAIN; ++steps, at = next[at])
        if (!memcmp(l->texcoords + 2 * (size_t)at, uv, 2 * sizeof(float))) return at;
    uint32_t added = l->vertex_count++;
    memcpy(l->texcoords + 2 * (size_t)added, uv, 2 * sizeof(float));
    l->origins[added] = vertex;
    next[added] = next[vertex];
    next[vertex] = added;
    return added;
}

static fct_result split_vertices(const fct_sink *sink, layout *l) {
    const fct_env *env = sink->env;
    const fct_mesh *m = sink->mesh;
    size_t most = (size_t)m->vertex_count + 3 * (size_t)m->face_count;
    if (most >= FCT_NONE) return fct_fail(env, FCT_ERROR_DATA, "%s: too many vertices for GLB", sink->name);
    l->vertex_count = m->vertex_count;
    uint32_t *next;
    unsigned char *used;
    const fct_array arrays[] = {FCT_ARRAY(l->origins, most), FCT_ARRAY_ZERO(l->texcoords, 2 * most),
                                FCT_ARRAY(l->corners, 3 * (size_t)m->face_count), FCT_ARRAY(next, most),
                                FCT_ARRAY_ZERO(used, m->vertex_count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "texture coordinates");
    if (result == FCT_OK) {
        for (uint32_t v = 0; v < m->vertex_count; ++v) l->origins[v] = v, next[v] = FCT_NONE;
        for (size_t i = 0; i < 3 * (size_t)m->face_count; ++i)
            l->corners[i] = place_corner(m->texcoords + 2 * i, m->triangles[i], l, next, used);
    }
    fct_release(env, next);
    fct_release(env, used);
    return result;
}

/* Counting sort of the faces by material. */
static fct_result order_faces(const fct_sink *sink, layout *l) {
    const fct_mesh *m = sink->mesh;
    const fct_array arrays[] = {FCT_ARRAY(l->order, m->face_count),
                                FCT_ARRAY_ZERO(l->firsts, (size_t)m->material_count + 2)};
    fct_result result = fct_allocate_all(sink->env, arrays, FCT_LENGTH(arrays), "materials");
    if (result != FCT_OK) return result;
    /* While faces are placed, firsts[i + 1] is the next place of material i. It ends as the first of i + 1.
     */
    for (uint32_t f = 0; f < m->face_count; ++f) ++l->firsts[m->materials[f] + 2];
    for (uint32_t i = 2; i <= m->material_count; ++i) l->firsts[i] += l->firsts[i - 1];
    for (uint32_t f = 0; f < m->face_count; ++f) l->order[l->firsts[m->materials[f] + 1]++] = f;
    return FCT_OK;
}

/* Prints a JSON string. Bytes that are not UTF-8 are read as Latin-1. */
static void print_string(FILE *json, const char *text) {
    const unsigned char *p = (const unsigned char *)text;
    fputc('"', json);
    while (*p) {
        int length = *p < 0x80                 ? 1
                     : *p >= 0xc2 && *p < 0xe0 ? 2
                     : *p >= 0xe0 && *p < 0xf0 ? 3
                     : *p >= 0xf0 && *p < 0xf5 ? 4
                                               : 0;
        for (int k = 1; k < length; ++k)
            if ((p[k] & 0xc0) != 0x80) length = 0;
        if (length == 3 && ((*p == 0xe0 && p[1] < 0xa0) || (*p == 0xed && p[1] > 0x9f))) length = 0;
        if (length == 4 && ((*p == 0xf0 && p[1] < 0x90) || (*p == 0xf4 && p[1] > 0x8f))) length = 0;
        if (length == 0 || *p < ' ' || *p == '"' || *p == '\\') {
            fprintf(json, "\\u%04x", *p++);
            continue;
        }
        fwrite(p, 1, (size_t)length, json);
        p += length;
    }
    fputc('"', json);
}

static void print_materials(const fct_sink *sink, FILE *json) {
    const fct_mesh *m = sink->mesh;
    uint32_t count = m->materials && m->material_count ? m->material_count : 1;
    if (m->colors) fprintf(json, ",\"extensionsUsed\":[\"KHR_materials_unlit\"]");
    fprintf(json, ",\"materials\":[");
    for (uint32_t i = 0; i < count; ++i) {
        fprintf(json, "%s{", i ? "," : "");
        if (m->materials && m->material_names) {
            fprintf(json, "\"name\":");
            print_string(json, m->material_names[i]);
            fputc(',', json);
        }
        fprintf(
            json,
            "%s\"pbrMetallicRoughness\":{\"metallicFactor\":0,\"roughnessFactor\":1},\"doubleSided\":true}",
            m->colors ? "\"extensions\":{\"KHR_materials_unlit\":{}}," : "");
    }
    fprintf(json, "]");
}

/* glTF demands the exact bounds of the positions. 17 digits print every float exactly. */
static void print_bounds(const fct_sink *sink, FILE *json) {
    const fct_mesh *m = sink->mesh;
    float lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * (size_t)m->vertex_count; ++i) {
        lower[i % 3] = fminf(lower[i % 3], m->positions[i]);
        upper[i % 3] = fmaxf(upper[i % 3], m->positions[i]);
    }
    fprintf(json, ",\"min\":[%.17g,%.17g,%.17g],\"max\":[%.17g,%.17g,%.17g]", (double)lower[0],
            (double)lower[1], (double)lower[2], (double)upper[0], (double)upper[1], (double)upper[2]);
}

typedef struct array {
    const char *attribute, *type, *more;
    int component;
    size_t size; /* of an element */
    bool there;
} array;

static void print_attributes(const array *arrays, size_t count, FILE *json) {
    int view = 0;
    for (size_t i = 0; i < count; ++i)
        if (arrays[i].there) fprintf(json, "%s\"%s\":%d", view ? "," : "", arrays[i].attribute, view), ++view;
}

static void print_primitives(const fct_sink *sink, const layout *l, const array *arrays, size_t count,
                             int views, FILE *json) {
    const fct_mesh *m = sink->mesh;
    if (!m->face_count) {
        fprintf(json, "{\"mode\":0,\"material\":0,\"attributes\":{");
        print_attributes(arrays, count, json);
        fprintf(json, "}}");
        return;
    }
    int accessor = views;
    for (uint32_t i = 0; i < (l->firsts ? m->material_count : 1); ++i) {
        if (l->firsts && l->firsts[i] == l->firsts[i + 1]) continue;
        fprintf(json, "%s{\"material\":%u,\"indices\":%d,\"attributes\":{", accessor > views ? "," : "", i,
                accessor);
        print_attributes(arrays, count, json);
        fprintf(json, "}}");
        ++accessor;
    }
}

static void print_accessors(const fct_sink *sink, const layout *l, const array *arrays, size_t count,
                            FILE *json) {
    const fct_mesh *m = sink->mesh;
    int view = 0;
    for (size_t i = 0; i < count; ++i) {
        if (!arrays[i].there) continue;
        fprintf(json, "%s{\"bufferView\":%d,\"componentType\":%d,\"count\":%u,\"type\":\"%s\"%s",
                view ? "," : "", view, arrays[i].component, l->vertex_count, arrays[i].type, arrays[i].more);
        if (!view) print_bounds(sink, json);
        fprintf(json, "}");
        ++view;
    }
    for (uint32_t i = 0; m->face_count && i < (l->firsts ? m->material_count : 1); ++i) {
        uint32_t first = l->firsts ? l->firsts[i] : 0, end = l->firsts ? l->firsts[i + 1] : m->face_count;
        if (first < end)
            fprintf(json,
                    ",{\"bufferView\":%d,\"byteOffset\":%llu,\"componentType\":5125,\"count\":%llu,\"type\":"
                    "\"SCALAR\"}",
                    view, 12 * (unsigned long long)first, 3 * (unsigned long long)(end - first));
    }
}

static size_t print_views(const fct_mesh *m, const layout *l, const array *arrays, size_t count, FILE *json) {
    size_t offset = 0;
    for (size_t i = 0; i < count; ++i) {
        if (!arrays[i].there) continue;
        size_t size = arrays[i].size * l->vertex_count;
        fprintf(json, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,\"target\":34962}",
                offset ? "," : "", offset, size);
        offset += size;
    }
    size_t indices = 12 * (size_t)m->face_count;
    if (indices)
        fprintf(json, ",{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,\"target\":34963}", offset,
                indices);
    return offset + indices;
}

/* Returns the size of the binary chunk. */
static size_t print_json(const fct_sink *sink, const layout *l, FILE *json) {
    const fct_mesh *m = sink->mesh;
    const array arrays[] = {{"POSITION", "VEC3", "", 5126, 12, true},
                            {"NORMAL", "VEC3", "", 5126, 12, m->normals != NULL},
                            {"COLOR_0", "VEC4", ",\"normalized\":true", 5123, 8, m->colors != NULL},
                            {"_RADIOSITY", "VEC3", "", 5126, 12, m->colors != NULL},
                            {"TEXCOORD_0", "VEC2", "", 5126, 8, l->texcoords != NULL}};
    size_t count = sizeof arrays / sizeof *arrays, size = 0;
    int views = 0;
    for (size_t i = 0; i < count; ++i) views += arrays[i].there;
    fprintf(json, "{\"asset\":{\"version\":\"2.0\",\"generator\":\"Facetree %s\"}", fct_version());
    if (!m->vertex_count) {
        fprintf(json, "}");
        return 0;
    }
    print_materials(sink, json);
    fprintf(json, ",\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0");
    if (fct_mesh_has_origin(m))
        fprintf(json, ",\"translation\":[%.17g,%.17g,%.17g]", m->origin[0], m->origin[1], m->origin[2]);
    fprintf(json, "}],\"meshes\":[{\"primitives\":[");
    print_primitives(sink, l, arrays, count, views, json);
    fprintf(json, "]}],\"accessors\":[");
    print_accessors(sink, l, arrays, count, json);
    fprintf(json, "],\"bufferViews\":[");
    size = print_views(m, l, arrays, count, json);
    fprintf(json, "],\"buffers\":[{\"byteLength\":%zu}]}", size);
    return size;
}

static void write_16(FILE *stream, unsigned x) {
    unsigned char bytes[2] = {(unsigned char)x, (unsigned char)(x >> 8)};
    fwrite(bytes, 1, 2, stream);
}

static void write_32(FILE *stream, uint32_t x) {
    unsigned char bytes[4] = {(unsigned char)x, (unsigned char)(x >> 8), (unsigned char)(x >> 16),
                              (unsigned char)(x >> 24)};
    fwrite(bytes, 1, 4, stream);
}

static void write_floats(FILE *stream, const float *values, int count) {
    for (int i = 0; i < count; ++i) {
        uint32_t bits;
        memcpy(&bits, values + i, sizeof bits);
        write_32(stream, bits);
    }
}

static size_t find_origin(const layout *l, uint32_t i) {
    return l->origins ? l->origins[i] : i;
}

/* glTF demands unit normals. A zero normal becomes (0, 0, 1). */
static void write_normals(const fct_mesh *m, const layout *l, FILE *stream) {
    for (uint32_t i = 0; i < l->vertex_count; ++i) {
        v3 n = v3_unit(v3_load(m->normals + 3 * find_origin(l, i)));
        float values[3];
        v3_store(values, v3_norm2(n) > 0 ? n : v3_make(0, 0, 1));
        write_floats(stream, values, 3);
    }
}

static void write_colors(const fct_sink *sink, const layout *l, FILE *stream) {
    for (uint32_t i = 0; i < l->vertex_count; ++i) {
        for (int k = 0; k < 3; ++k) {
            double x = (double)sink->mesh->colors[3 * find_origin(l, i) + k] * (double)sink->def->exposure;
            write_16(stream, (unsigned)(65535 * (x < 0 ? 0 : x < 1 ? x : 1) + .5));
        }
        write_16(stream, 65535);
    }
}

static void write_binary(const fct_sink *sink, const layout *l, FILE *stream) {
    const fct_mesh *m = sink->mesh;
    for (uint32_t i = 0; i < l->vertex_count; ++i)
        write_floats(stream, m->positions + 3 * find_origin(l, i), 3);
    if (m->normals) write_normals(m, l, stream);
    if (m->colors) {
        write_colors(sink, l, stream);
        for (uint32_t i = 0; i < l->vertex_count; ++i)
            write_floats(stream, m->colors + 3 * find_origin(l, i), 3);
    }
    if (l->texcoords)
        for (uint32_t i = 0; i < l->vertex_count; ++i) write_floats(stream, l->texcoords + 2 * (size_t)i, 2);
    const uint32_t *corners = l->corners ? l->corners : m->triangles;
    for (size_t i = 0; i < m->face_count; ++i)
        for (int k = 0; k < 3; ++k) write_32(stream, corners[3 * (l->order ? l->order[i] : i) + k]);
}

/* Text that grows. open_memstream is no replacement: with glibc 2.36 it drops text without an error when
 * memory is exhausted. */
typedef struct growing_text {
    const fct_env *env;
    char *bytes;
    size_t length, capacity;
} growing_text;

/* The write function of a stream of stdio: 0 is an error. */
static ssize_t append_text(void *user, const char *bytes, size_t size) {
    growing_text *t = user;
    if (fct_grow(t->env, (void **)&t->bytes, &t->capacity, t->length + size, 1) != FCT_OK) return 0;
    memcpy(t->bytes + t->length, bytes, size);
    t->length += size;
    return (ssize_t)size;
}

static fct_result write_chunks(const fct_sink *sink, const layout *l, FILE *stream) {
    growing_text text = {.env = sink->env};
    FILE *json = fopencookie(&text, "w", (cookie_io_functions_t){.write = append_text});
    if (!json) return fct_fail_memory(sink->env, "the JSON of a GLB file");
    size_t binary = print_json(sink, l, json);
    bool failed = ferror(json) != 0;
    failed |= fclose(json) != 0;
    fct_result result = FCT_OK;
    size_t length = text.length, padded = (length + 3) & ~(size_t)3;
    size_t total = 12 + 8 + padded + (binary ? 8 + binary : 0);
    if (failed) {
        result = fct_fail_memory(sink->env, "the JSON of a GLB file");
    } else if (total > UINT32_MAX) {
        result = fct_fail(sink->env, FCT_ERROR_DATA, "%s: GLB files end at 4 GB", sink->name);
    } else {
        fwrite("glTF", 1, 4, stream);
        write_32(stream, 2);
        write_32(stream, (uint32_t)total);
        write_32(stream, (uint32_t)padded);
        fwrite("JSON", 1, 4, stream);
        fwrite(text.bytes, 1, length, stream);
        fwrite("   ", 1, padded - length, stream);
        if (binary) {
            write_32(stream, (uint32_t)binary);
            fwrite("BIN", 1, 4, stream);
            write_binary(sink, l, stream);
        }
    }
    fct_release(sink->env, text.bytes);
    return result;
}

fct_result fct_write_glb(const fct_sink *sink, FILE *stream) {
    const fct_mesh *m = sink->mesh;
    fct_note_left_out(sink, FCT_MESH_FACE_COLORS);
    layout l = {.vertex_count = m->vertex_count};
    fct_result result = fct_progress(sink->env, "write", 0);
    if (result == FCT_OK && m->texcoords) result = split_vertices(sink, &l);
    if (result == FCT_OK && m->materials && m->material_count) result = order_faces(sink, &l);
    if (result == FCT_OK) result = write_chunks(sink, &l, stream);
    fct_release(sink->env, l.origins);
    fct_release(sink->env, l.texcoords);
    fct_release(sink->env, l.corners);
    fct_release(sink->env, l.order);
    fct_release(sink->env, l.firsts);
    return result;
}
