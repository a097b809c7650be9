/* mesh/glb/export.c: see export.h. Source: glTF 2.0 specification, chapters 3.6, 3.7 and 4. */
#define _GNU_SOURCE
#include "mesh/glb/write/export.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/env.h"
#include "base/math/vec.h"

/* ---- JSON ---- */

typedef struct array {
    const char *attribute, *type, *more;
    int component;
    size_t size; /* of an element */
    bool there;
} array;

enum { FIXED = 9, ARRAYS = FIXED + FCT_GLB_EXTRAS, LIGHTS = 4 };

/* The float lights of a geometry, in the order of their attributes; NULL: absent. */
static void list_lights(const fct_glb_geometry *g, const float *out[LIGHTS]) {
    out[0] = g->light, out[1] = g->mesh->irradiance, out[2] = g->mesh->direct, out[3] = g->mesh->indirect;
}

/* The attributes of a geometry, in the order of their views. */
static void list_arrays(const fct_glb_geometry *g, array out[ARRAYS]) {
    const fct_mesh *m = g->mesh;
    const float *lights[LIGHTS];
    list_lights(g, lights);
    static const char *const types[5] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    const char *color = g->color_name ? g->color_name : "COLOR_0";
    const array arrays[FIXED] = {{"POSITION", "VEC3", "", 5126, 12, true},
                                 {"NORMAL", "VEC3", "", 5126, 12, m->normals != NULL},
                                 {color, "VEC4", ",\"normalized\":true", 5123, 8, m->colors != NULL},
                                 {g->light_name, "VEC3", "", 5126, 12, lights[0] != NULL},
                                 {"_IRRADIANCE", "VEC3", "", 5126, 12, lights[1] != NULL},
                                 {"_DIRECT", "VEC3", "", 5126, 12, lights[2] != NULL},
                                 {"_INDIRECT", "VEC3", "", 5126, 12, lights[3] != NULL},
                                 {"_ERROR", "SCALAR", "", 5126, 4, m->error != NULL},
                                 {"TEXCOORD_0", "VEC2", "", 5126, 8, g->layout.texcoords != NULL}};
    memcpy(out, arrays, sizeof arrays);
    for (size_t i = 0; i < FCT_GLB_EXTRAS; ++i) {
        const bool there = i < g->extra_count;
        const fct_glb_extra *e = there ? g->extras + i : NULL;
        out[FIXED + i] = there ? (array){e->name, types[e->width], "", 5126, 4 * (size_t)e->width, true}
                               : (array){"", "", "", 0, 0, false};
    }
}

static size_t count_arrays(const fct_glb_geometry *g) {
    array arrays[ARRAYS];
    size_t count = 0;
    list_arrays(g, arrays);
    for (int i = 0; i < ARRAYS; ++i) count += arrays[i].there;
    return count;
}

static uint32_t count_materials(const fct_glb_geometry *g) {
    return g->layout.firsts ? g->mesh->material_count : 1;
}

uint32_t fct_glb_primitive_faces(const fct_glb_geometry *g, uint32_t material) {
    const uint32_t *firsts = g->layout.firsts;
    return firsts ? firsts[material + 1] - firsts[material] : g->mesh->face_count;
}

size_t fct_glb_number(const fct_glb_content *content) {
    size_t accessor = 0, view = 0;
    for (size_t i = 0; i < content->geometry_count; ++i) {
        fct_glb_geometry *g = content->geometries + i;
        g->accessor = accessor, g->view = view;
        accessor += count_arrays(g);
        view += count_arrays(g) + (g->mesh->face_count > 0);
        for (uint32_t m = 0; m < count_materials(g); ++m) accessor += fct_glb_primitive_faces(g, m) > 0;
    }
    return view;
}

void fct_glb_print_attributes(const fct_glb_geometry *g, FILE *json) {
    array arrays[ARRAYS];
    size_t accessor = g->accessor;
    list_arrays(g, arrays);
    fprintf(json, "\"attributes\":{");
    for (int i = 0; i < ARRAYS; ++i)
        if (arrays[i].there)
            fprintf(json, "%s\"%s\":%zu", accessor > g->accessor ? "," : "", arrays[i].attribute, accessor),
                ++accessor;
    fprintf(json, "}");
}

void fct_glb_print_primitive(const fct_glb_geometry *g, uint32_t material, FILE *json) {
    size_t accessor = g->accessor + count_arrays(g);
    for (uint32_t m = 0; m < material; ++m) accessor += fct_glb_primitive_faces(g, m) > 0;
    fprintf(json, "\"indices\":%zu,", accessor);
    fct_glb_print_attributes(g, json);
}

/* glTF demands the exact bounds of the positions. 17 digits print every float exactly. */
static void print_bounds(const fct_mesh *m, FILE *json) {
    float lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * (size_t)m->vertex_count; ++i) {
        lower[i % 3] = fminf(lower[i % 3], m->positions[i]);
        upper[i % 3] = fmaxf(upper[i % 3], m->positions[i]);
    }
    fprintf(json, ",\"min\":[%.17g,%.17g,%.17g],\"max\":[%.17g,%.17g,%.17g]", (double)lower[0],
            (double)lower[1], (double)lower[2], (double)upper[0], (double)upper[1], (double)upper[2]);
}

static void print_accessors(const fct_glb_geometry *g, FILE *json) {
    array arrays[ARRAYS];
    size_t view = g->view;
    list_arrays(g, arrays);
    for (int i = 0; i < ARRAYS; ++i) {
        if (!arrays[i].there) continue;
        fprintf(json, "%s{\"bufferView\":%zu,\"componentType\":%d,\"count\":%u,\"type\":\"%s\"%s",
                view ? "," : "", view, arrays[i].component, g->layout.vertex_count, arrays[i].type,
                arrays[i].more);
        if (view == g->view) print_bounds(g->mesh, json);
        fprintf(json, "}");
        ++view;
    }
    unsigned long long first = 0;
    for (uint32_t m = 0; m < count_materials(g); ++m) {
        uint32_t faces = fct_glb_primitive_faces(g, m);
        if (!faces) continue;
        fprintf(json,
                ",{\"bufferView\":%zu,\"byteOffset\":%llu,\"componentType\":5125,\"count\":%llu,\"type\":"
                "\"SCALAR\"}",
                view, 12 * first, 3 * (unsigned long long)faces);
        first += faces;
    }
}

/* Prints a view of `size` bytes at *offset, and moves *offset behind it. target: 0 if it is no attribute. */
static void print_view(size_t size, int target, size_t *offset, FILE *json) {
    fprintf(json, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu", *offset ? "," : "", *offset, size);
    if (target) fprintf(json, ",\"target\":%d", target);
    fprintf(json, "}");
    *offset += (size + 3) & ~(size_t)3;
}

static void print_views(const fct_glb_geometry *g, size_t *offset, FILE *json) {
    array arrays[ARRAYS];
    list_arrays(g, arrays);
    for (int i = 0; i < ARRAYS; ++i)
        if (arrays[i].there) print_view(arrays[i].size * g->layout.vertex_count, 34962, offset, json);
    if (g->mesh->face_count) print_view(12 * (size_t)g->mesh->face_count, 34963, offset, json);
}

size_t fct_glb_print_content(const fct_glb_content *content, FILE *json) {
    size_t size = 0;
    if (content->geometry_count) {
        fprintf(json, ",\"accessors\":[");
        for (size_t i = 0; i < content->geometry_count; ++i) print_accessors(content->geometries + i, json);
        fprintf(json, "]");
    }
    if (!content->geometry_count && !content->blob_count) return 0;
    fprintf(json, ",\"bufferViews\":[");
    for (size_t i = 0; i < content->geometry_count; ++i) print_views(content->geometries + i, &size, json);
    for (size_t i = 0; i < content->blob_count; ++i) print_view(content->blobs[i].size, 0, &size, json);
    fprintf(json, "],\"buffers\":[{\"byteLength\":%zu}]", size);
    return size;
}

/* ---- Bytes ---- */

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

static size_t find_origin(const fct_glb_layout *l, uint32_t i) {
    return l->origins ? l->origins[i] : i;
}

/* glTF demands unit normals. A zero normal becomes (0, 0, 1). */
static void write_normals(const fct_mesh *m, const fct_glb_layout *l, FILE *stream) {
    for (uint32_t i = 0; i < l->vertex_count; ++i) {
        v3 n = v3_unit(v3_load(m->normals + 3 * find_origin(l, i)));
        float values[3];
        v3_store(values, v3_norm2(n) > 0 ? n : v3_make(0, 0, 1));
        write_floats(stream, values, 3);
    }
}

static void write_colors(const fct_sink *sink, const fct_mesh *m, const fct_glb_layout *l, FILE *stream) {
    for (uint32_t i = 0; i < l->vertex_count; ++i) {
        for (int k = 0; k < 3; ++k) {
            double x = (double)m->colors[3 * find_origin(l, i) + k] * (double)sink->def->exposure;
            write_16(stream, (unsigned)(65535 * (x < 0 ? 0 : x < 1 ? x : 1) + .5));
        }
        write_16(stream, 65535);
    }
}

static void write_geometry(const fct_sink *sink, const fct_glb_geometry *g, FILE *stream) {
    const fct_mesh *m = g->mesh;
    const fct_glb_layout *l = &g->layout;
    for (uint32_t i = 0; i < l->vertex_count; ++i)
        write_floats(stream, m->positions + 3 * find_origin(l, i), 3);
    if (m->normals) write_normals(m, l, stream);
    if (m->colors) write_colors(sink, m, l, stream);
    const float *lights[LIGHTS];
    list_lights(g, lights);
    for (int k = 0; k < LIGHTS; ++k)
        for (uint32_t i = 0; lights[k] && i < l->vertex_count; ++i)
            write_floats(stream, lights[k] + 3 * find_origin(l, i), 3);
    for (uint32_t i = 0; m->error && i < l->vertex_count; ++i)
        write_floats(stream, m->error + find_origin(l, i), 1);
    if (l->texcoords)
        for (uint32_t i = 0; i < l->vertex_count; ++i) write_floats(stream, l->texcoords + 2 * (size_t)i, 2);
    for (size_t k = 0; k < g->extra_count; ++k)
        for (uint32_t i = 0; i < l->vertex_count; ++i) {
            const fct_glb_extra *e = g->extras + k;
            write_floats(stream, e->values + (size_t)e->width * find_origin(l, i), e->width);
        }
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

static void write_content(const fct_sink *sink, const fct_glb_content *content, FILE *stream) {
    for (size_t i = 0; i < content->geometry_count; ++i)
        write_geometry(sink, content->geometries + i, stream);
    for (size_t i = 0; i < content->blob_count; ++i) {
        size_t size = content->blobs[i].size;
        fwrite(content->blobs[i].data, 1, size, stream);
        fwrite("\0\0\0", 1, -size & 3, stream);
    }
}

fct_result fct_glb_write_file(const fct_sink *sink, const fct_glb_content *content,
                              size_t (*print)(void *user, FILE *json), void *user, FILE *stream) {
    growing_text text = {.env = sink->env};
    FILE *json = fopencookie(&text, "w", (cookie_io_functions_t){.write = append_text});
    if (!json) return fct_fail_memory(sink->env, "the JSON of a GLB file");
    size_t binary = print(user, json);
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
            write_content(sink, content, stream);
        }
    }
    fct_release(sink->env, text.bytes);
    return result;
}
