/* mesh/mesh.c: creates, releases, copies, extracts and validates meshes. */
#include "mesh/mesh.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/key.h"

void fct_memory_release(const fct_env *env, void *memory) {
    fct_release(env, memory);
}

void fct_names_release(const fct_env *env, char **names, uint32_t count) {
    if (!names) return;
    for (uint32_t i = 0; i < count; ++i) fct_release(env, names[i]);
    fct_release(env, names);
}

char *fct_copy_text(const fct_env *env, const char *text, size_t length) {
    char *copy = fct_allocate(env, length + 1, 1);
    if (!copy) return NULL;
    memcpy(copy, text, length);
    copy[length] = 0;
    return copy;
}

void fct_mesh_release(const fct_env *env, fct_mesh *mesh) {
    fct_release(env, mesh->positions);
    fct_release(env, mesh->triangles);
    fct_release(env, mesh->colors);
    fct_release(env, mesh->normals);
    fct_release(env, mesh->texcoords);
    fct_release(env, mesh->face_colors);
    fct_release(env, mesh->materials);
    fct_release(env, mesh->source_faces);
    fct_names_release(env, mesh->material_names, mesh->material_count);
    *mesh = (fct_mesh){0};
}

fct_result fct_mesh_create(const fct_env *env, uint32_t vertex_count, uint32_t face_count, unsigned arrays,
                           fct_mesh *out) {
    *out = (fct_mesh){.vertex_count = vertex_count, .face_count = face_count};
    size_t vertices = vertex_count, faces = face_count;
    const fct_array all[] = {
        FCT_ARRAY(out->positions, 3 * vertices),
        FCT_ARRAY(out->triangles, 3 * faces),
        FCT_ARRAY_IF(arrays & FCT_MESH_COLORS, out->colors, 3 * vertices),
        FCT_ARRAY_IF(arrays & FCT_MESH_NORMALS, out->normals, 3 * vertices),
        FCT_ARRAY_IF(arrays & FCT_MESH_TEXCOORDS, out->texcoords, 6 * faces),
        FCT_ARRAY_IF(arrays & FCT_MESH_FACE_COLORS, out->face_colors, 3 * faces),
        FCT_ARRAY_IF(arrays & FCT_MESH_MATERIALS, out->materials, faces),
        FCT_ARRAY_IF(arrays & FCT_MESH_SOURCE_FACES, out->source_faces, faces),
    };
    fct_result result = fct_allocate_all(env, all, FCT_LENGTH(all), "a mesh");
    if (result != FCT_OK) *out = (fct_mesh){0};
    return result;
}

static unsigned arrays_of(const fct_mesh *mesh) {
    return (mesh->colors ? FCT_MESH_COLORS : 0u) | (mesh->normals ? FCT_MESH_NORMALS : 0u) |
           (mesh->texcoords ? FCT_MESH_TEXCOORDS : 0u) | (mesh->face_colors ? FCT_MESH_FACE_COLORS : 0u) |
           (mesh->materials ? FCT_MESH_MATERIALS : 0u) | (mesh->source_faces ? FCT_MESH_SOURCE_FACES : 0u);
}

/* Copies the material names. On failure out owns the names copied so far. */
static fct_result copy_names(const fct_env *env, const fct_mesh *mesh, fct_mesh *out) {
    if (!mesh->material_names) {
        out->material_count = mesh->material_count;
        return FCT_OK;
    }
    out->material_names = fct_allocate_zero(env, mesh->material_count, sizeof(char *));
    if (!out->material_names) return fct_fail_memory(env, "material names");
    for (uint32_t i = 0; i < mesh->material_count; ++i) {
        const char *name = mesh->material_names[i];
        out->material_names[i] = fct_copy_text(env, name, strlen(name));
        if (!out->material_names[i]) return fct_fail_memory(env, "material names");
        out->material_count = i + 1;
    }
    return FCT_OK;
}

static void copy(void *to, const void *from, size_t count, size_t size) {
    if (from && count) memcpy(to, from, count * size);
}

fct_result fct_mesh_copy(const fct_env *env, const fct_mesh *mesh, fct_mesh *out) {
    fct_result result = fct_mesh_create(env, mesh->vertex_count, mesh->face_count, arrays_of(mesh), out);
    if (result != FCT_OK) return result;
    size_t vertices = mesh->vertex_count, faces = mesh->face_count;
    memcpy(out->origin, mesh->origin, sizeof out->origin);
    out->source_count = mesh->source_count;
    copy(out->positions, mesh->positions, vertices, 3 * sizeof(float));
    copy(out->colors, mesh->colors, vertices, 3 * sizeof(float));
    copy(out->normals, mesh->normals, vertices, 3 * sizeof(float));
    copy(out->triangles, mesh->triangles, faces, 3 * sizeof(uint32_t));
    copy(out->texcoords, mesh->texcoords, faces, 6 * sizeof(float));
    copy(out->face_colors, mesh->face_colors, faces, 3 * sizeof(float));
    copy(out->materials, mesh->materials, faces, sizeof(uint32_t));
    copy(out->source_faces, mesh->source_faces, faces, sizeof(uint32_t));
    result = copy_names(env, mesh, out);
    if (result != FCT_OK) fct_mesh_release(env, out);
    return result;
}

/* The vertices of some faces. The span from the least to the greatest is all that an extraction looks at, so
 * that it does not take time in proportion to the whole mesh. */
typedef struct vertex_span {
    uint32_t first, count;
    uint32_t *numbers; /* per vertex of the span: its number in the extracted mesh, or FCT_NONE */
} vertex_span;

static void find_span(const fct_mesh *mesh, const uint32_t *faces, uint32_t count, vertex_span *span) {
    uint32_t least = FCT_NONE, greatest = 0;
    for (uint32_t i = 0; i < count; ++i)
        for (int j = 0; j < 3; ++j) {
            uint32_t v = mesh->triangles[3 * (size_t)faces[i] + j];
            least = v < least ? v : least;
            greatest = v > greatest ? v : greatest;
        }
    *span = (vertex_span){.first = count ? least : 0, .count = count ? greatest - least + 1 : 0};
}

/* Numbers the vertices of the listed faces in ascending order. Returns their count. */
static uint32_t number_vertices(const fct_mesh *mesh, const uint32_t *faces, uint32_t count,
                                const vertex_span *span) {
    uint32_t used = 0;
    for (uint32_t i = 0; i < span->count; ++i) span->numbers[i] = FCT_NONE;
    for (uint32_t i = 0; i < count; ++i)
        for (int j = 0; j < 3; ++j)
            span->numbers[mesh->triangles[3 * (size_t)faces[i] + j] - span->first] = 0;
    for (uint32_t i = 0; i < span->count; ++i)
        if (span->numbers[i] != FCT_NONE) span->numbers[i] = used++;
    return used;
}

static void extract_vertices(const fct_mesh *mesh, const vertex_span *span, fct_mesh *out, uint32_t *ids) {
    for (uint32_t i = 0; i < span->count; ++i) {
        if (span->numbers[i] == FCT_NONE) continue;
        uint32_t v = span->first + i;
        size_t from = 3 * (size_t)v, to = 3 * (size_t)span->numbers[i];
        copy(out->positions + to, mesh->positions + from, 3, sizeof(float));
        if (mesh->colors) copy(out->colors + to, mesh->colors + from, 3, sizeof(float));
        if (mesh->normals) copy(out->normals + to, mesh->normals + from, 3, sizeof(float));
        if (ids) ids[span->numbers[i]] = v;
    }
}

static void extract_faces(const fct_mesh *mesh, const vertex_span *span, const uint32_t *faces,
                          uint32_t count, fct_mesh *out) {
    for (uint32_t i = 0; i < count; ++i) {
        size_t from = faces[i], to = i;
        for (int j = 0; j < 3; ++j)
            out->triangles[3 * to + j] = span->numbers[mesh->triangles[3 * from + j] - span->first];
        if (mesh->texcoords) copy(out->texcoords + 6 * to, mesh->texcoords + 6 * from, 6, sizeof(float));
        if (mesh->face_colors)
            copy(out->face_colors + 3 * to, mesh->face_colors + 3 * from, 3, sizeof(float));
        if (mesh->materials) out->materials[to] = mesh->materials[from];
        if (mesh->source_faces) out->source_faces[to] = mesh->source_faces[from];
    }
}

fct_result fct_mesh_extract(const fct_env *env, const fct_mesh *mesh, const uint32_t *faces, uint32_t count,
                            fct_mesh *out, uint32_t **vertex_ids) {
    *out = (fct_mesh){0};
    if (vertex_ids) *vertex_ids = NULL;
    uint32_t *ids = NULL;
    vertex_span span;
    find_span(mesh, faces, count, &span);
    span.numbers = fct_allocate(env, span.count, sizeof(uint32_t));
    if (!span.numbers) return fct_fail_memory(env, "vertex numbers");
    uint32_t used = number_vertices(mesh, faces, count, &span);
    fct_result result = fct_mesh_create(env, used, count, arrays_of(mesh), out);
    if (result == FCT_OK && vertex_ids && !(ids = fct_allocate(env, used, sizeof(uint32_t))))
        result = fct_fail_memory(env, "vertex ids");
    if (result == FCT_OK) {
        memcpy(out->origin, mesh->origin, sizeof out->origin);
        out->source_count = mesh->source_count;
        extract_vertices(mesh, &span, out, ids);
        extract_faces(mesh, &span, faces, count, out);
        result = copy_names(env, mesh, out);
    }
    fct_release(env, span.numbers);
    if (result != FCT_OK) {
        fct_release(env, ids);
        fct_mesh_release(env, out);
    } else if (vertex_ids) {
        *vertex_ids = ids;
    }
    return result;
}

/* Compares bits as integers per block, because compilers vectorise that, and searches only a block with such
 * a float. */
size_t fct_first_not_finite(const float *values, size_t count) {
    for (size_t begin = 0; begin < count; begin += 4096) {
        size_t end = begin + 4096 < count ? begin + 4096 : count;
        uint32_t largest = 0;
        for (size_t i = begin; i < end; ++i) {
            uint32_t bits = fct_float_bits(values[i]) & 0x7fffffff;
            largest = bits > largest ? bits : largest;
        }
        if (largest < 0x7f800000) continue;
        for (size_t i = begin; i < end; ++i)
            if (!isfinite(values[i])) return i;
    }
    return count;
}

static size_t first_at_least(const uint32_t *values, size_t count, uint32_t limit) {
    for (size_t begin = 0; begin < count; begin += 4096) {
        size_t end = begin + 4096 < count ? begin + 4096 : count;
        uint32_t largest = 0;
        for (size_t i = begin; i < end; ++i) largest = values[i] > largest ? values[i] : largest;
        if (largest < limit) continue;
        for (size_t i = begin; i < end; ++i)
            if (values[i] >= limit) return i;
    }
    return count;
}

static fct_result check_floats(const fct_env *env, const char *prefix, const char *element, const char *what,
                               const float *values, size_t count, unsigned width) {
    if (!values) return FCT_OK;
    size_t bad = fct_first_not_finite(values, count * width);
    if (bad == count * width) return FCT_OK;
    return fct_fail(env, FCT_ERROR_DATA, "%s%s %zu: its %s is not finite (%g)", prefix, element, bad / width,
                    what, (double)values[bad]);
}

static fct_result check_ids(const fct_env *env, const char *prefix, const fct_mesh *mesh) {
    size_t corners = 3 * (size_t)mesh->face_count;
    size_t bad = first_at_least(mesh->triangles, corners, mesh->vertex_count);
    if (bad < corners)
        return fct_fail(env, FCT_ERROR_DATA, "%sface %zu: vertex index %u is out of range, of %u vertices",
                        prefix, bad / 3, mesh->triangles[bad], mesh->vertex_count);
    if (!mesh->materials) return FCT_OK;
    bad = first_at_least(mesh->materials, mesh->face_count, mesh->material_count);
    if (bad < mesh->face_count)
        return fct_fail(env, FCT_ERROR_DATA, "%sface %zu: material %u is out of range, of %u materials",
                        prefix, bad, mesh->materials[bad], mesh->material_count);
    return FCT_OK;
}

fct_result fct_mesh_check(const fct_env *env, const char *name, const fct_mesh *mesh) {
    char prefix[512];
    snprintf(prefix, sizeof prefix, "%s%s", name ? name : "", name ? ": " : "");
    size_t vertices = mesh->vertex_count, faces = mesh->face_count;
    if (vertices > FCT_MESH_LIMIT || faces > FCT_MESH_LIMIT)
        return fct_fail(env, FCT_ERROR_DATA, "%s%zu vertices and %zu faces: at most %llu of each are allowed",
                        prefix, vertices, faces, (unsigned long long)FCT_MESH_LIMIT);
    if (!isfinite(mesh->origin[0]) || !isfinite(mesh->origin[1]) || !isfinite(mesh->origin[2]))
        return fct_fail(env, FCT_ERROR_DATA, "%sthe origin is not finite", prefix);
    fct_result result = check_ids(env, prefix, mesh);
    const struct {
        const char *element, *what;
        const float *values;
        size_t count;
        unsigned width;
    } floats[] = {{"vertex", "position", mesh->positions, vertices, 3},
                  {"vertex", "colour", mesh->colors, vertices, 3},
                  {"vertex", "normal", mesh->normals, vertices, 3},
                  {"face", "texture coordinate", mesh->texcoords, faces, 6},
                  {"face", "colour", mesh->face_colors, faces, 3}};
    for (size_t i = 0; result == FCT_OK && i < sizeof floats / sizeof *floats; ++i)
        result = check_floats(env, prefix, floats[i].element, floats[i].what, floats[i].values,
                              floats[i].count, floats[i].width);
    return result;
}

fct_result fct_mesh_validate(const fct_env *env, const fct_mesh *mesh) {
    return fct_mesh_check(env, NULL, mesh);
}

void fct_mesh_turn_over(fct_mesh *mesh) {
    for (size_t f = 0; f < mesh->face_count; ++f) {
        uint32_t *t = mesh->triangles + 3 * f, swap = t[1];
        t[1] = t[2], t[2] = swap;
        float *c = mesh->texcoords ? mesh->texcoords + 6 * f : NULL;
        for (int k = 0; c && k < 2; ++k) {
            float second = c[2 + k];
            c[2 + k] = c[4 + k], c[4 + k] = second;
        }
    }
}
