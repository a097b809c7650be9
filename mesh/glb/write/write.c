/* mesh/glb/write.c: writes a mesh as glTF 2.0 binary: one node, one mesh, one primitive per material, shared
 * vertices.
 *
 * A coloured mesh is unlit (KHR_materials_unlit).
 */
#include "mesh/glb/write/write.h"

#include "base/env.h"
#include "mesh/glb/write/export.h"
#include "mesh/glb/write/utf8.h"
#include "mesh/mesh.h"

/* Prints a JSON string. Bytes that are not UTF-8 are read as Latin-1. */
static void print_string(FILE *json, const char *text) {
    const unsigned char *p = (const unsigned char *)text;
    fputc('"', json);
    while (*p) {
        const int length = fct_utf8_length(p);
        if (length == 0 || *p < ' ' || *p == '"' || *p == '\\') {
            fprintf(json, "\\u%04x", *p++);
            continue;
        }
        fwrite(p, 1, (size_t)length, json);
        p += length;
    }
    fputc('"', json);
}

static void print_materials(const fct_mesh *m, FILE *json) {
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

static void print_primitives(const fct_glb_geometry *g, FILE *json) {
    if (!g->mesh->face_count) {
        fprintf(json, "{\"mode\":0,\"material\":0,");
        fct_glb_print_attributes(g, json);
        fprintf(json, "}");
        return;
    }
    bool first = true;
    for (uint32_t i = 0; i < (g->layout.firsts ? g->mesh->material_count : 1); ++i) {
        if (!fct_glb_primitive_faces(g, i)) continue;
        fprintf(json, "%s{\"material\":%u,", first ? "" : ",", i);
        fct_glb_print_primitive(g, i, json);
        fprintf(json, "}");
        first = false;
    }
}

static size_t print_json(void *user, FILE *json) {
    const fct_glb_content *content = user;
    const fct_glb_geometry *g = content->geometries;
    const fct_mesh *m = g->mesh;
    fprintf(json, "{\"asset\":{\"version\":\"2.0\",\"generator\":\"Facetree %s\"}", fct_version());
    if (!m->vertex_count) {
        fprintf(json, "}");
        return 0;
    }
    print_materials(m, json);
    fprintf(json, ",\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0");
    if (fct_mesh_has_origin(m))
        fprintf(json, ",\"translation\":[%.17g,%.17g,%.17g]", m->origin[0], m->origin[1], m->origin[2]);
    fprintf(json, "}],\"meshes\":[{\"primitives\":[");
    print_primitives(g, json);
    fprintf(json, "]}]");
    size_t size = fct_glb_print_content(content, json);
    fprintf(json, "}");
    return size;
}

fct_result fct_write_glb(const fct_sink *sink, FILE *stream) {
    fct_note_left_out(sink, FCT_MESH_FACE_COLORS);
    fct_glb_geometry geometry = {.mesh = sink->mesh, .light = sink->radiosity, .light_name = "_RADIOSITY"};
    fct_glb_content content = {.geometries = &geometry, .geometry_count = 1};
    fct_result result = fct_progress(sink->env, "write", 0);
    if (result == FCT_OK) result = fct_glb_layout_build(sink, &geometry.layout);
    if (result != FCT_OK) return result;
    fct_glb_number(&content);
    result = fct_glb_write_file(sink, &content, print_json, &content, stream);
    fct_glb_layout_release(sink->env, &geometry.layout);
    return result;
}
