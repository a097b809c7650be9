/* mesh/text/write.c: OBJ, OFF and STL. */
#include "mesh/text/write.h"

#include <math.h>
#include <string.h>

#include "base/env.h"
#include "base/math/vec.h"
#include "mesh/color.h"
#include "mesh/mesh.h"

static void print_floats(FILE *stream, const float *values, int count) {
    for (int i = 0; i < count; ++i) fprintf(stream, " %.9g", (double)values[i]);
}

/* OBJ readers take colours for sRGB. Nine digits of sRGB return the same linear float, except for 31 floats
 * at the joint of the two formulas, which change by a millionth. */
static void print_srgb(FILE *stream, const float *linear) {
    for (int k = 0; k < 3; ++k) fprintf(stream, " %.9g", fct_srgb_from_linear((double)linear[k]));
}

/* Positions relative to an origin need the digits of a double. */
static void print_position(FILE *stream, const fct_mesh *m, size_t v) {
    const float *p = m->positions + 3 * v;
    if (!fct_mesh_has_origin(m)) {
        print_floats(stream, p, 3);
        return;
    }
    for (int k = 0; k < 3; ++k) fprintf(stream, " %.17g", m->origin[k] + (double)p[k]);
}

/* OBJ: v x y z [r g b], vt per corner, vn per vertex, usemtl where the material changes. */
static void write_obj_faces(const fct_mesh *m, FILE *stream) {
    uint32_t material = FCT_NONE;
    for (size_t f = 0; f < m->face_count; ++f) {
        if (m->materials && m->materials[f] != material) {
            material = m->materials[f];
            if (m->material_names)
                fprintf(stream, "usemtl %s\n", m->material_names[material]);
            else
                fprintf(stream, "usemtl material_%u\n", material);
        }
        fputc('f', stream);
        for (int k = 0; k < 3; ++k) {
            unsigned v = m->triangles[3 * f + k] + 1;
            unsigned long vt = 3 * (unsigned long)f + (unsigned long)k + 1;
            if (m->texcoords && m->normals)
                fprintf(stream, " %u/%lu/%u", v, vt, v);
            else if (m->texcoords)
                fprintf(stream, " %u/%lu", v, vt);
            else if (m->normals)
                fprintf(stream, " %u//%u", v, v);
            else
                fprintf(stream, " %u", v);
        }
        fputc('\n', stream);
    }
}

fct_result fct_write_obj(const fct_sink *sink, FILE *stream) {
    const fct_mesh *m = sink->mesh;
    for (uint32_t i = 0; m->material_names && i < m->material_count; ++i)
        if (strpbrk(m->material_names[i], "\r\n"))
            return fct_fail(sink->env, FCT_ERROR_DATA, "%s: material %u has a line end in its name",
                            sink->name, i);
    fct_note_left_out(sink, FCT_MESH_FACE_COLORS | FCT_MESH_LIGHTS);
    fprintf(stream, "# Facetree %s\n", fct_version());
    for (size_t v = 0; v < m->vertex_count; ++v) {
        fputc('v', stream);
        print_position(stream, m, v);
        if (m->colors) print_srgb(stream, m->colors + 3 * v);
        fputc('\n', stream);
    }
    for (size_t i = 0; m->texcoords && i < 3 * (size_t)m->face_count; ++i)
        fprintf(stream, "vt %.9g %.9g\n", (double)m->texcoords[2 * i], (double)m->texcoords[2 * i + 1]);
    for (size_t v = 0; m->normals && v < m->vertex_count; ++v) {
        fputs("vn", stream);
        print_floats(stream, m->normals + 3 * v, 3);
        fputc('\n', stream);
    }
    write_obj_faces(m, stream);
    return fct_progress(sink->env, "write", 1);
}

/* Prints a float with a point or an exponent, because OFF readers take integers for sRGB bytes. */
static void print_component(FILE *stream, float value) {
    char text[32];
    snprintf(text, sizeof text, "%.9g", (double)value);
    fprintf(stream, " %s%s", text, strpbrk(text, ".e") ? "" : ".0");
}

/* Whether a colour is over 1, which OFF readers take for a byte. */
static bool has_bright_color(const fct_mesh *m) {
    for (size_t i = 0; m->colors && i < 3 * (size_t)m->vertex_count; ++i)
        if (m->colors[i] > 1) return true;
    for (size_t i = 0; m->face_colors && i < 3 * (size_t)m->face_count; ++i)
        if (m->face_colors[i] > 1) return true;
    return false;
}

/* OFF, COFF, NOFF or CNOFF; colours as linear floats. The comment `# facetree linear` says so if a reader
 * would take them for bytes. */
fct_result fct_write_off(const fct_sink *sink, FILE *stream) {
    const fct_mesh *m = sink->mesh;
    fct_note_left_out(sink, FCT_MESH_TEXCOORDS | FCT_MESH_MATERIALS | FCT_MESH_LIGHTS);
    fprintf(stream, "%s%sOFF\n%s%u %u 0\n", m->colors ? "C" : "", m->normals ? "N" : "",
            has_bright_color(m) ? "# facetree linear\n" : "", m->vertex_count, m->face_count);
    for (size_t v = 0; v < m->vertex_count; ++v) {
        print_position(stream, m, v);
        if (m->normals) print_floats(stream, m->normals + 3 * v, 3);
        for (int k = 0; m->colors && k < 3; ++k) print_component(stream, m->colors[3 * v + k]);
        fprintf(stream, m->colors ? " 1.0\n" : "\n");
    }
    for (size_t f = 0; f < m->face_count; ++f) {
        const uint32_t *t = m->triangles + 3 * f;
        fprintf(stream, "3 %u %u %u", t[0], t[1], t[2]);
        for (int k = 0; m->face_colors && k < 3; ++k) print_component(stream, m->face_colors[3 * f + k]);
        fputc('\n', stream);
    }
    return fct_progress(sink->env, "write", 1);
}

static void compute_facet_normal(const fct_mesh *m, size_t f, float normal[3]) {
    const uint32_t *t = m->triangles + 3 * f;
    v3 p = v3_load(m->positions + 3 * (size_t)t[0]);
    v3 a = v3_sub(v3_load(m->positions + 3 * (size_t)t[1]), p);
    v3 b = v3_sub(v3_load(m->positions + 3 * (size_t)t[2]), p);
    v3_store(normal, v3_unit(v3_cross(a, b)));
}

static void put_32(unsigned char *p, uint32_t x) {
    p[0] = (unsigned char)x, p[1] = (unsigned char)(x >> 8);
    p[2] = (unsigned char)(x >> 16), p[3] = (unsigned char)(x >> 24);
}

static void write_stl_facet(const fct_mesh *m, size_t f, bool ascii, FILE *stream) {
    float values[12];
    bool origin = fct_mesh_has_origin(m); /* without one, -0 stays -0 */
    compute_facet_normal(m, f, values);
    if (ascii) {
        fputs("facet normal", stream);
        print_floats(stream, values, 3);
        fputs("\nouter loop\n", stream);
        for (int c = 0; c < 3; ++c) {
            fputs("vertex", stream);
            print_position(stream, m, m->triangles[3 * f + c]);
            fputc('\n', stream);
        }
        fprintf(stream, "endloop\nendfacet\n");
        return;
    }
    for (size_t i = 0; i < 9; ++i) {
        size_t place = 3 * (size_t)m->triangles[3 * f + i / 3] + i % 3;
        float relative = m->positions[place];
        values[3 + i] = origin ? (float)(m->origin[i % 3] + (double)relative) : relative;
    }
    unsigned char record[50] = {0};
    for (int k = 0; k < 12; ++k) {
        uint32_t bits;
        memcpy(&bits, values + k, sizeof bits);
        put_32(record + 4 * k, bits);
    }
    fwrite(record, sizeof record, 1, stream);
}

/* The header of a binary file must not begin with "solid", because readers take that for text. */
fct_result fct_write_stl(const fct_sink *sink, FILE *stream) {
    const fct_mesh *m = sink->mesh;
    fct_note_left_out(sink, FCT_MESH_LIGHTS | FCT_MESH_COLORS | FCT_MESH_NORMALS | FCT_MESH_TEXCOORDS |
                                FCT_MESH_FACE_COLORS | FCT_MESH_MATERIALS);
    if (!sink->def->ascii) fct_warn_of_origin(sink);
    if (sink->def->ascii) {
        fprintf(stream, "solid facetree\n");
    } else {
        unsigned char head[84] = "binary STL, Facetree";
        put_32(head + 80, m->face_count);
        fwrite(head, sizeof head, 1, stream);
    }
    for (size_t f = 0; f < m->face_count; ++f) write_stl_facet(m, f, sink->def->ascii, stream);
    if (sink->def->ascii) fprintf(stream, "endsolid facetree\n");
    return fct_progress(sink->env, "write", 1);
}
