/* simplify/output.c: see output.h. Cost: linear in the corners of the input. */
#include "simplify/output.h"

#include "mesh/mesh.h"
#include "simplify/cost/constraint.h"

/* Corners with equal keys share an output vertex: their point, or the class of their wedge. */
static uint32_t find_vertex_key(fct_simplifier *s, uint32_t c) {
    return s->wedge_classes ? s->wedge_classes[corner_wedge(s, c)] : s->triangles[c];
}

/* Writes the attributes of a live corner's wedge: c in the input, `corner` and its vertex v in the output.
 * Wedges that share a vertex differ only in texture coordinates. */
static void write_attributes(fct_simplifier *s, fct_mesh *out, uint32_t corner, uint32_t c, uint32_t v) {
    const double *a = s->attributes + (size_t)s->channel_count * corner_wedge(s, c);
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        const fct_channel *channel = &s->channels[i];
        float value = (float)(a[i] / channel->factor);
        if (channel->source == CHANNEL_TEXCOORD)
            out->texcoords[2 * (size_t)corner + channel->component] = value;
        else
            (*stream_slot(out,
                          channel->stream))[stream_width(channel->stream) * (size_t)v + channel->component] =
                value;
    }
}

void fct_simplify_write_normal(float *n) {
    v3 unit = v3_unit(v3_load(n));
    if (v3_norm2(unit) > 0) v3_store(n, unit);
}

static void write_face(const fct_mesh *mesh, fct_mesh *out, uint32_t f, uint32_t to) {
    if (out->face_colors)
        memcpy(out->face_colors + 3 * (size_t)to, mesh->face_colors + 3 * (size_t)f, 3 * sizeof(float));
    if (out->materials) out->materials[to] = mesh->materials[f];
    if (out->source_faces) out->source_faces[to] = mesh->source_faces[f];
}

/* numbers: key -> output vertex, in the order of first use. Returns the number of vertices. */
static uint32_t number_vertices(fct_simplifier *s, const uint32_t *places, uint32_t *numbers,
                                uint32_t key_count) {
    uint32_t vertices = 0;
    memset(numbers, 0xff, key_count * sizeof *numbers);
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        uint32_t first = 3 * places[f];
        for (uint32_t c = first; c < first + 3 && !corner_dead(s, first); ++c) {
            uint32_t key = find_vertex_key(s, c);
            if (numbers[key] == FCT_NONE) numbers[key] = vertices++;
        }
    }
    return vertices;
}

fct_result fct_simplify_spread(fct_simplifier *s, const uint32_t *places, const float *values, uint32_t count,
                               float *out) {
    uint32_t key_count = s->wedge_count;
    uint32_t *numbers = fct_allocate(s->env, key_count, sizeof *numbers);
    if (!numbers) return fct_fail_memory(s->env, "output vertices");
    uint32_t vertices = number_vertices(s, places, numbers, key_count);
    memset(out, 0, s->point_count * sizeof *out);
    for (uint32_t c = 0; c < 3 * s->mesh->face_count && vertices == count; ++c) {
        if (corner_dead(s, c)) continue;
        float value = values[numbers[find_vertex_key(s, c)]], *to = &out[s->triangles[c]];
        *to = value > *to ? value : *to;
    }
    fct_release(s->env, numbers);
    if (vertices == count) return FCT_OK;
    return fct_fail(s->env, FCT_ERROR_DATA, "%u weights, expected %u, one per vertex of the current mesh",
                    count, vertices);
}

fct_result fct_simplify_output(fct_simplifier *s, const uint32_t *places, fct_mesh *out) {
    const fct_mesh *mesh = s->mesh;
    uint32_t key_count = s->wedge_count;
    uint32_t *numbers = fct_allocate(s->env, key_count, sizeof *numbers);
    if (!numbers) return fct_fail_memory(s->env, "output vertices");
    uint32_t vertices = number_vertices(s, places, numbers, key_count);
    unsigned arrays = stream_kinds(mesh) | (mesh->texcoords ? FCT_MESH_TEXCOORDS : 0) |
                      (mesh->face_colors ? FCT_MESH_FACE_COLORS : 0) |
                      (mesh->materials ? FCT_MESH_MATERIALS : 0) |
                      (mesh->source_faces ? FCT_MESH_SOURCE_FACES : 0);
    fct_result result = fct_mesh_create(s->env, vertices, s->live_faces, arrays, out);
    if (result == FCT_OK) memcpy(out->origin, mesh->origin, sizeof out->origin);
    if (result == FCT_OK) out->material_count = mesh->material_count;
    if (result == FCT_OK && mesh->source_faces) out->source_count = mesh->source_count;
    if (result == FCT_OK)
        result = fct_names_copy(s->env, mesh->material_names, mesh->material_count, &out->material_names);
    uint32_t to = 0;
    for (uint32_t i = 0; i < mesh->face_count && result == FCT_OK; ++i) {
        uint32_t f = places[i];
        if (corner_dead(s, 3 * f)) continue;
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t c = 3 * f + k, v = numbers[find_vertex_key(s, c)];
            out->triangles[3 * (size_t)to + k] = v;
            write_point(s, s->triangles[c], out->positions + 3 * (size_t)v);
            if (s->channel_count) write_attributes(s, out, 3 * to + k, c, v);
            if (out->normals && !point_is_locked(s, s->triangles[c]))
                fct_simplify_write_normal(out->normals + 3 * (size_t)v);
        }
        write_face(mesh, out, f, to++);
    }
    fct_release(s->env, numbers);
    return result;
}
