/* mesh/glb/scene/attributes.c: attributes of a document at the vertices of a lit mesh.
 *
 * Each vertex of the lit mesh takes its values from the first corner that has it: the values at the three
 * vertices of the corner's source face, weighted by source_uv. Other corners of the vertex lie on the same
 * edge of the same vertices, so they give the same values.
 */
#include <stdio.h>
#include <string.h>

#include "base/math/vec.h"
#include "mesh/glb/document/accessor.h"
#include "mesh/glb/primitive.h"
#include "mesh/glb/scene/pieces.h"

/* ---- Spans ---- */

static fct_result count_triangles(fct_glb *glb, const fct_glb_primitive *p, uint64_t vertices,
                                  uint64_t *out) {
    const fct_glb_array *indices;
    uint64_t count = vertices;
    if (p->indices >= 0) {
        fct_result result = fct_glb_array_of(glb, p->indices, 1, 1, &indices);
        if (result != FCT_OK) return result;
        count = indices->count;
    }
    *out = p->mode == 4 ? count / 3 : count < 3 ? 0 : count - 2;
    return FCT_OK;
}

/* Appends the spans of a mesh, in the order and with the numbers of fct_glb_append_mesh. */
static fct_result append_spans(fct_glb_scene *s, int64_t mesh) {
    fct_glb *glb = &s->document->glb;
    json_t *object, *primitive;
    size_t i;
    fct_glb_primitive p, before = {.position = FCT_GLB_ABSENT};
    fct_glb_span span = {.mesh = mesh};
    uint64_t vertex = 0;
    fct_result result = fct_glb_item(glb, "meshes", mesh, &object);
    json_array_foreach(json_object_get(object, "primitives"), i, primitive) {
        const fct_glb_array *positions;
        if (result == FCT_OK) result = fct_glb_read_primitive(glb, primitive, &p);
        if (result != FCT_OK) return result;
        if (p.position == FCT_GLB_ABSENT || (p.mode > 0 && p.mode < 4)) continue;
        if (!fct_glb_share_vertices(&before, &p)) {
            result = fct_glb_array_of(glb, p.position, 3, 3, &positions);
            if (result != FCT_OK) return result;
            span.first_vertex = vertex, span.vertex_count = positions->count;
            vertex += positions->count;
        }
        before = p;
        if (p.mode < 4) continue;
        span.primitive = (int64_t)i;
        result = count_triangles(glb, &p, span.vertex_count, &span.face_count);
        if (result == FCT_OK)
            result =
                fct_grow(s->env, (void **)&s->spans, &s->span_capacity, s->span_count + 1, sizeof *s->spans);
        if (result != FCT_OK) return result;
        s->spans[s->span_count++] = span;
        span.first_face += span.face_count;
    }
    return result;
}

fct_result fct_glb_find_spans(fct_glb_scene *s, int64_t mesh, const fct_glb_span **spans, size_t *count) {
    size_t first = 0;
    while (first < s->span_count && s->spans[first].mesh != mesh) ++first;
    if (first == s->span_count) {
        fct_result result = append_spans(s, mesh);
        if (result != FCT_OK) return result;
    }
    *count = 0;
    while (first + *count < s->span_count && s->spans[first + *count].mesh == mesh) ++*count;
    *spans = s->spans + first;
    return FCT_OK;
}

/* ---- Attributes ---- */

typedef struct filling {
    fct_glb_scene *scene;
    const fct_glb_span *span;
    const uint32_t *sources; /* per vertex of the lit mesh: its first corner */
    const uint32_t *corners;
    const fct_mesh *lit;
} filling;

/* The components of vertex v, width floats. Returns the vertex of the primitive with the largest weight. */
static size_t interpolate(const filling *f, const fct_glb_array *array, size_t v, float *out) {
    const size_t corner = f->sources[v], face = corner / 3;
    const float *uv = f->lit->source_uv + 2 * corner;
    const double weights[3] = {1 - (double)uv[0] - (double)uv[1], uv[0], uv[1]};
    size_t vertices[3], best = 0;
    for (size_t j = 0; j < 3; ++j) {
        vertices[j] = f->corners[3 * face + j] - f->span->first_vertex;
        if (weights[j] > weights[best]) best = j;
    }
    for (int c = 0; c < array->width; ++c) {
        double sum = 0;
        for (size_t j = 0; j < 3; ++j)
            if (weights[j] != 0) sum += weights[j] * fct_glb_value(array, vertices[j], c);
        out[c] = (float)sum;
    }
    return vertices[best];
}

/* glTF demands unit tangents with a sign of 1 or -1. */
static void fix_tangent(const fct_glb_array *array, size_t vertex, float *tangent) {
    const v3 t = v3_unit(v3_load(tangent));
    v3_store(tangent, v3_norm2(t) > 0 ? t : v3_make(1, 0, 0));
    tangent[3] = fct_glb_value(array, vertex, 3) < 0 ? -1 : 1;
}

static bool begins_with(const char *text, const char *start) {
    return !strncmp(text, start, strlen(start));
}

/* True if the attribute is not copied: it is written anew, or belongs to a skin, which is left out. */
static bool is_replaced(const char *name) {
    static const char *const names[] = {"POSITION",    "NORMAL",    "_RADIOSITY", "_DIRECT",
                                        "_IRRADIANCE", "_INDIRECT", "_ERROR"};
    for (size_t i = 0; i < FCT_LENGTH(names); ++i)
        if (!strcmp(name, names[i])) return true;
    return begins_with(name, "JOINTS_") || begins_with(name, "WEIGHTS_");
}

/* The elements of an accessor with one to four components per vertex of the primitive; NULL for others. */
static fct_result find_array(const filling *f, int64_t accessor, const fct_glb_array **out) {
    static const char *const types[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    fct_glb *glb = &f->scene->document->glb;
    json_t *object;
    *out = NULL;
    fct_result result = fct_glb_item(glb, "accessors", accessor, &object);
    const char *type = json_string_value(json_object_get(object, "type"));
    bool known = false;
    for (size_t i = 0; result == FCT_OK && type && i < FCT_LENGTH(types); ++i)
        known |= !strcmp(type, types[i]);
    if (!known) return result;
    result = fct_glb_array_of(glb, accessor, 1, 4, out);
    if (result == FCT_OK && (*out)->count != f->span->vertex_count)
        return fct_glb_fail(glb, "accessors[%lld] has %zu elements, expected %llu, the number of positions",
                            (long long)accessor, (*out)->count, (unsigned long long)f->span->vertex_count);
    return result;
}

static fct_result add_extra(const filling *f, const char *name, const fct_glb_array *array,
                            fct_glb_piece *piece) {
    const size_t count = f->lit->vertex_count, width = (size_t)array->width;
    fct_glb_extra *extra = piece->extras + piece->extra_count;
    *extra = (fct_glb_extra){.width = array->width};
    snprintf(extra->name, sizeof extra->name, "%s", name);
    extra->values = fct_allocate(f->scene->env, count, width * sizeof *extra->values);
    if (!extra->values) return fct_fail_memory(f->scene->env, "the attributes of a glTF file");
    ++piece->extra_count;
    const bool tangent = !strcmp(name, "TANGENT") && width == 4, color = begins_with(name, "COLOR_");
    for (size_t v = 0; v < count; ++v) {
        float *to = extra->values + width * v;
        const size_t vertex = interpolate(f, array, v, to);
        if (tangent) fix_tangent(array, vertex, to);
        for (size_t c = 0; color && c < width; ++c) to[c] = to[c] < 0 ? 0 : to[c] < 1 ? to[c] : 1;
    }
    return FCT_OK;
}

static fct_result add_normals(const filling *f, const fct_glb_array *array, bool back, fct_mesh *lit) {
    fct_release(f->scene->env, lit->normals);
    lit->normals = fct_allocate(f->scene->env, lit->vertex_count, 3 * sizeof *lit->normals);
    if (!lit->normals) return fct_fail_memory(f->scene->env, "the normals of a glTF file");
    for (size_t v = 0; v < lit->vertex_count; ++v) {
        float *n = lit->normals + 3 * v;
        interpolate(f, array, v, n);
        for (int c = 0; back && c < 3; ++c) n[c] = -n[c];
    }
    return FCT_OK;
}

/* The first set of colours that the primitive does not have. */
static void name_colors(json_t *attributes, char *out, size_t size) {
    unsigned set = 0;
    do snprintf(out, size, "COLOR_%u", set++);
    while (json_object_get(attributes, out) && set < 1000);
}

static fct_result find_sources(const filling *f, uint32_t *sources) {
    const uint64_t first = f->span->first_vertex, count = f->span->vertex_count;
    memset(sources, 0, f->lit->vertex_count * sizeof *sources);
    for (size_t c = 3 * (size_t)f->lit->face_count; c-- > 0;) {
        sources[f->lit->triangles[c]] = (uint32_t)c;
        if (f->corners[c] < first || f->corners[c] - first >= count)
            return fct_glb_fail(&f->scene->document->glb, "it is not the file that the scene was read from");
    }
    return FCT_OK;
}

static fct_result fill_all(filling *f, json_t *attributes, const fct_glb_lit *lit, fct_glb_piece *piece) {
    const char *name;
    json_t *value;
    const fct_glb_array *array;
    int64_t accessor;
    fct_glb *glb = &f->scene->document->glb;
    fct_result result = fct_glb_index(glb, attributes, "NORMAL", &accessor);
    if (result == FCT_OK && accessor >= 0 && (lit->file_normals || !piece->lit.normals)) {
        result = find_array(f, accessor, &array);
        if (result == FCT_OK && array && array->width == 3)
            result = add_normals(f, array, lit->back, &piece->lit);
    }
    json_object_foreach(attributes, name, value) {
        if (result != FCT_OK) return result;
        if (is_replaced(name)) continue;
        result = fct_glb_index(glb, attributes, name, &accessor);
        if (result == FCT_OK) result = find_array(f, accessor, &array);
        if (result != FCT_OK) return result;
        if (!array || piece->extra_count == FCT_GLB_EXTRAS || strlen(name) >= sizeof piece->extras->name)
            ++f->scene->lost;
        else
            result = add_extra(f, name, array, piece);
    }
    return result;
}

fct_result fct_glb_fill_attributes(fct_glb_scene *scene, const fct_glb_span *span, const uint32_t *corners,
                                   const fct_glb_lit *lit, fct_glb_piece *piece) {
    fct_gltf *d = scene->document;
    json_t *mesh = json_array_get(json_object_get(d->glb.root, "meshes"), (size_t)span->mesh);
    json_t *primitive = json_array_get(json_object_get(mesh, "primitives"), (size_t)span->primitive);
    json_t *attributes = json_object_get(primitive, "attributes");
    uint32_t *sources = fct_allocate(scene->env, piece->lit.vertex_count, sizeof *sources);
    piece->extras = fct_allocate_zero(scene->env, FCT_GLB_EXTRAS, sizeof *piece->extras);
    filling f = {scene, span, sources, corners, &piece->lit};
    fct_result result = sources && piece->extras
                            ? find_sources(&f, sources)
                            : fct_fail_memory(scene->env, "the attributes of a glTF file");
    name_colors(attributes, piece->color_name, sizeof piece->color_name);
    if (result == FCT_OK) result = fill_all(&f, attributes, lit, piece);
    fct_release(scene->env, sources);
    return result;
}
