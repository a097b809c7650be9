/* mesh/ply/write.c: writes every array of an fct_mesh as PLY. The reader restores the same bits.
 *
 *   vertex: x y z [nx ny nz] [red green blue] [radiosity_r radiosity_g radiosity_b] [irradiance_r ...]
 *           [direct_r ...] [indirect_r ...] [error]
 *   face:   vertex_indices [texcoord, six floats] [red green blue radiosity_r ...] [material_index]
 *           [source_face] [source_uv, six floats]
 *
 * red, green and blue are bytes for viewers (exposed, clamped, sRGB). radiosity_* are the linear floats.
 * Positions are floats, or doubles if the mesh has an origin.
 * Lines "comment facetree material NAME" hold the names of the materials.
 */
#include "mesh/ply/write.h"

#include <string.h>

#include "base/env.h"
#include "mesh/color.h"
#include "mesh/mesh.h"

enum { ROWS = 4096, ROW_SIZE = 128, LIGHTS = 4 };

/* The float lights of the vertices; NULL: absent. */
static void list_lights(const fct_sink *sink, const float *out[LIGHTS]) {
    const fct_mesh *m = sink->mesh;
    out[0] = sink->radiosity, out[1] = m->irradiance, out[2] = m->direct, out[3] = m->indirect;
}

static void print_properties(FILE *stream, const char *prefix) {
    for (const char *c = "rgb"; *c; ++c) fprintf(stream, "property float %s_%c\n", prefix, *c);
}

static bool writes_sources(const fct_sink *sink) {
    return sink->def->sources && sink->mesh->source_faces && sink->mesh->source_uv;
}

static void write_header(const fct_sink *sink, FILE *stream) {
    const fct_mesh *m = sink->mesh;
    fprintf(stream, "ply\nformat %s 1.0\ncomment Facetree %s\n",
            sink->def->ascii ? "ascii" : "binary_little_endian", fct_version());
    for (uint32_t i = 0; m->material_names && i < m->material_count; ++i)
        fprintf(stream, "comment facetree material %s\n", m->material_names[i]);
    const char *type = fct_mesh_has_origin(m) ? "double" : "float";
    fprintf(stream, "element vertex %u\nproperty %s x\nproperty %s y\nproperty %s z\n", m->vertex_count, type,
            type, type);
    if (m->normals) fprintf(stream, "property float nx\nproperty float ny\nproperty float nz\n");
    static const char colors[] = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    static const char *const names[LIGHTS] = {"radiosity", "irradiance", "direct", "indirect"};
    const float *lights[LIGHTS];
    list_lights(sink, lights);
    if (m->colors) fputs(colors, stream);
    for (int i = 0; i < LIGHTS; ++i)
        if (lights[i]) print_properties(stream, names[i]);
    if (m->error) fprintf(stream, "property float error\n");
    fprintf(stream, "element face %u\nproperty list uchar int vertex_indices\n", m->face_count);
    if (m->texcoords) fprintf(stream, "property list uchar float texcoord\n");
    if (m->face_colors) {
        fputs(colors, stream);
        print_properties(stream, names[0]);
    }
    if (m->materials) fprintf(stream, "property int material_index\n");
    if (writes_sources(sink))
        fprintf(stream, "property int source_face\nproperty list uchar float source_uv\n");
    fprintf(stream, "end_header\n");
}

static unsigned char *put_32(unsigned char *p, uint32_t x) {
    p[0] = (unsigned char)x, p[1] = (unsigned char)(x >> 8);
    p[2] = (unsigned char)(x >> 16), p[3] = (unsigned char)(x >> 24);
    return p + 4;
}

static unsigned char *put_floats(unsigned char *p, const float *values, int count) {
    for (int i = 0; i < count; ++i) {
        uint32_t bits;
        memcpy(&bits, values + i, sizeof bits);
        p = put_32(p, bits);
    }
    return p;
}

static unsigned char *put_position(unsigned char *p, const fct_mesh *m, size_t v) {
    if (!fct_mesh_has_origin(m)) return put_floats(p, m->positions + 3 * v, 3);
    for (int k = 0; k < 3; ++k) {
        double x = m->origin[k] + (double)m->positions[3 * v + (size_t)k];
        uint64_t bits;
        memcpy(&bits, &x, sizeof bits);
        p = put_32(put_32(p, (uint32_t)bits), (uint32_t)(bits >> 32));
    }
    return p;
}

static void convert_color(const fct_sink *sink, const float *color, unsigned char bytes[3]) {
    for (int k = 0; k < 3; ++k) bytes[k] = fct_srgb_byte((double)color[k] * (double)sink->def->exposure);
}

static unsigned char *put_color(unsigned char *p, const fct_sink *sink, const float *color) {
    convert_color(sink, color, p);
    return put_floats(p + 3, color, 3);
}

static unsigned char *put_vertex(unsigned char *p, const fct_sink *sink, size_t v) {
    const fct_mesh *m = sink->mesh;
    p = put_position(p, m, v);
    if (m->normals) p = put_floats(p, m->normals + 3 * v, 3);
    if (m->colors) {
        convert_color(sink, m->colors + 3 * v, p);
        p += 3;
    }
    const float *lights[LIGHTS];
    list_lights(sink, lights);
    for (int i = 0; i < LIGHTS; ++i)
        if (lights[i]) p = put_floats(p, lights[i] + 3 * v, 3);
    return m->error ? put_floats(p, m->error + v, 1) : p;
}

static unsigned char *put_face(unsigned char *p, const fct_sink *sink, size_t f) {
    const fct_mesh *m = sink->mesh;
    *p++ = 3;
    for (int k = 0; k < 3; ++k) p = put_32(p, m->triangles[3 * f + k]);
    if (m->texcoords) {
        *p++ = 6;
        p = put_floats(p, m->texcoords + 6 * f, 6);
    }
    if (m->face_colors) p = put_color(p, sink, m->face_colors + 3 * f);
    if (m->materials) p = put_32(p, m->materials[f]);
    if (writes_sources(sink)) {
        p = put_32(p, m->source_faces[f]);
        *p++ = 6;
        p = put_floats(p, m->source_uv + 6 * f, 6);
    }
    return p;
}

static fct_result write_rows(const fct_sink *sink, FILE *stream, unsigned char *buffer, size_t count,
                             unsigned char *(*put)(unsigned char *, const fct_sink *, size_t)) {
    unsigned char *p = buffer;
    for (size_t i = 0; i < count; ++i) {
        p = put(p, sink, i);
        if ((size_t)(p - buffer) < (size_t)ROWS * ROW_SIZE - ROW_SIZE) continue;
        fwrite(buffer, 1, (size_t)(p - buffer), stream);
        p = buffer;
        fct_result result = fct_progress(sink->env, "write", (double)i / (double)count);
        if (result != FCT_OK) return result;
    }
    fwrite(buffer, 1, (size_t)(p - buffer), stream);
    return FCT_OK;
}

static fct_result write_binary(const fct_sink *sink, FILE *stream) {
    unsigned char *buffer = fct_allocate(sink->env, ROWS, ROW_SIZE);
    if (!buffer) return fct_fail_memory(sink->env, "a buffer");
    fct_result result = write_rows(sink, stream, buffer, sink->mesh->vertex_count, put_vertex);
    if (result == FCT_OK) result = write_rows(sink, stream, buffer, sink->mesh->face_count, put_face);
    fct_release(sink->env, buffer);
    return result;
}

static void print_floats(FILE *stream, const char *before, const float *values, int count) {
    for (int i = 0; i < count; ++i) fprintf(stream, "%s%.9g", i ? " " : before, (double)values[i]);
}

static void print_position(FILE *stream, const fct_mesh *m, size_t v) {
    if (!fct_mesh_has_origin(m)) {
        print_floats(stream, "", m->positions + 3 * v, 3);
        return;
    }
    for (size_t k = 0; k < 3; ++k)
        fprintf(stream, "%s%.17g", k ? " " : "", m->origin[k] + (double)m->positions[3 * v + k]);
}

static void print_bytes(const fct_sink *sink, FILE *stream, const float *color) {
    unsigned char bytes[3];
    convert_color(sink, color, bytes);
    fprintf(stream, " %u %u %u", bytes[0], bytes[1], bytes[2]);
}

static void print_face(const fct_sink *sink, FILE *stream, size_t f) {
    const fct_mesh *m = sink->mesh;
    const uint32_t *t = m->triangles + 3 * f;
    fprintf(stream, "3 %u %u %u", t[0], t[1], t[2]);
    if (m->texcoords) print_floats(stream, " 6 ", m->texcoords + 6 * f, 6);
    if (m->face_colors) {
        print_bytes(sink, stream, m->face_colors + 3 * f);
        print_floats(stream, " ", m->face_colors + 3 * f, 3);
    }
    if (m->materials) fprintf(stream, " %u", m->materials[f]);
    if (writes_sources(sink)) {
        fprintf(stream, " %u", m->source_faces[f]);
        print_floats(stream, " 6 ", m->source_uv + 6 * f, 6);
    }
    fputc('\n', stream);
}

static fct_result write_ascii(const fct_sink *sink, FILE *stream) {
    const fct_mesh *m = sink->mesh;
    const float *lights[LIGHTS];
    list_lights(sink, lights);
    for (size_t v = 0; v < m->vertex_count; ++v) {
        print_position(stream, m, v);
        if (m->normals) print_floats(stream, " ", m->normals + 3 * v, 3);
        if (m->colors) print_bytes(sink, stream, m->colors + 3 * v);
        for (int i = 0; i < LIGHTS; ++i)
            if (lights[i]) print_floats(stream, " ", lights[i] + 3 * v, 3);
        if (m->error) print_floats(stream, " ", m->error + v, 1);
        fputc('\n', stream);
    }
    for (size_t f = 0; f < m->face_count; ++f) print_face(sink, stream, f);
    return FCT_OK;
}

fct_result fct_write_ply(const fct_sink *sink, FILE *stream) {
    for (uint32_t i = 0; sink->mesh->material_names && i < sink->mesh->material_count; ++i)
        if (strpbrk(sink->mesh->material_names[i], "\r\n"))
            return fct_fail(sink->env, FCT_ERROR_DATA, "%s: material %u has a line end in its name",
                            sink->name, i);
    write_header(sink, stream);
    return sink->def->ascii ? write_ascii(sink, stream) : write_binary(sink, stream);
}
