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

void fct_mesh_arrays(fct_mesh *m, fct_mesh_array out[FCT_MESH_ARRAYS]) {
    const fct_mesh_array arrays[FCT_MESH_ARRAYS] = {
        {&m->positions, 3 * sizeof(float), 0, false},
        {&m->triangles, 3 * sizeof(uint32_t), 0, true},
        {&m->colors, 3 * sizeof(float), FCT_MESH_COLORS, false},
        {&m->irradiance, 3 * sizeof(float), FCT_MESH_IRRADIANCE, false},
        {&m->direct, 3 * sizeof(float), FCT_MESH_DIRECT, false},
        {&m->indirect, 3 * sizeof(float), FCT_MESH_INDIRECT, false},
        {&m->error, sizeof(float), FCT_MESH_ERROR, false},
        {&m->normals, 3 * sizeof(float), FCT_MESH_NORMALS, false},
        {&m->texcoords, 6 * sizeof(float), FCT_MESH_TEXCOORDS, true},
        {&m->corner_normals, 9 * sizeof(float), FCT_MESH_CORNER_NORMALS, true},
        {&m->face_colors, 3 * sizeof(float), FCT_MESH_FACE_COLORS, true},
        {&m->materials, sizeof(uint32_t), FCT_MESH_MATERIALS, true},
        {&m->source_faces, sizeof(uint32_t), FCT_MESH_SOURCE_FACES, true},
        {&m->source_uv, 6 * sizeof(float), FCT_MESH_SOURCE_UV, true},
    };
    memcpy(out, arrays, sizeof arrays);
}

static void *get_array(const fct_mesh_array *array) {
    void *values;
    memcpy(&values, array->member, sizeof values);
    return values;
}

static void set_array(const fct_mesh_array *array, void *values) {
    memcpy(array->member, &values, sizeof values);
}

/* The arrays of a mesh that is only read. */
static void list_arrays(const fct_mesh *mesh, fct_mesh *room, fct_mesh_array out[FCT_MESH_ARRAYS]) {
    *room = *mesh;
    fct_mesh_arrays(room, out);
}

void fct_mesh_release(const fct_env *env, fct_mesh *mesh) {
    fct_mesh_array arrays[FCT_MESH_ARRAYS];
    fct_mesh_arrays(mesh, arrays);
    for (int i = 0; i < FCT_MESH_ARRAYS; ++i) fct_release(env, get_array(arrays + i));
    fct_names_release(env, mesh->material_names, mesh->material_count);
    *mesh = (fct_mesh){0};
}

fct_result fct_mesh_create(const fct_env *env, uint32_t vertex_count, uint32_t face_count, unsigned arrays,
                           fct_mesh *out) {
    *out = (fct_mesh){.vertex_count = vertex_count, .face_count = face_count};
    fct_mesh_array all[FCT_MESH_ARRAYS];
    fct_mesh_arrays(out, all);
    for (int i = 0; i < FCT_MESH_ARRAYS; ++i) {
        if (all[i].bit && !(arrays & all[i].bit)) continue;
        void *values = fct_allocate(env, all[i].of_faces ? face_count : vertex_count, all[i].size);
        set_array(all + i, values);
        if (values) continue;
        fct_mesh_release(env, out);
        return fct_fail_memory(env, "a mesh");
    }
    return FCT_OK;
}

unsigned fct_mesh_bits(const fct_mesh *mesh) {
    fct_mesh room;
    fct_mesh_array arrays[FCT_MESH_ARRAYS];
    unsigned bits = 0;
    list_arrays(mesh, &room, arrays);
    for (int i = 0; i < FCT_MESH_ARRAYS; ++i) bits |= get_array(arrays + i) ? arrays[i].bit : 0;
    return bits;
}

fct_result fct_names_copy(const fct_env *env, char *const *names, uint32_t count, char ***out) {
    *out = NULL;
    if (!names) return FCT_OK;
    char **copies = fct_allocate_zero(env, count, sizeof *copies);
    bool done = copies != NULL;
    for (uint32_t i = 0; i < count && done; ++i) {
        copies[i] = fct_copy_text(env, names[i], strlen(names[i]));
        done = copies[i] != NULL;
    }
    if (done) {
        *out = copies;
        return FCT_OK;
    }
    fct_names_release(env, copies, count);
    return fct_fail_memory(env, "material names");
}

/* Copies the number of materials and their names. */
static fct_result copy_materials(const fct_env *env, const fct_mesh *mesh, fct_mesh *out) {
    out->material_count = mesh->material_count;
    return fct_names_copy(env, mesh->material_names, mesh->material_count, &out->material_names);
}

/* Copies the arrays that both meshes have behind the first `vertices` and `faces` elements of `to`. */
static void copy_arrays(const fct_mesh *from, fct_mesh *to, size_t vertices, size_t faces) {
    fct_mesh room;
    fct_mesh_array sources[FCT_MESH_ARRAYS], targets[FCT_MESH_ARRAYS];
    list_arrays(from, &room, sources);
    fct_mesh_arrays(to, targets);
    for (int i = 0; i < FCT_MESH_ARRAYS; ++i) {
        const size_t count = sources[i].of_faces ? from->face_count : from->vertex_count;
        const size_t before = sources[i].of_faces ? faces : vertices;
        const void *values = get_array(sources + i);
        char *copies = get_array(targets + i);
        if (values && copies && count)
            memcpy(copies + before * sources[i].size, values, count * sources[i].size);
    }
}

fct_result fct_mesh_copy(const fct_env *env, const fct_mesh *mesh, fct_mesh *out) {
    fct_result result = fct_mesh_create(env, mesh->vertex_count, mesh->face_count, fct_mesh_bits(mesh), out);
    if (result != FCT_OK) return result;
    memcpy(out->origin, mesh->origin, sizeof out->origin);
    out->source_count = mesh->source_count;
    copy_arrays(mesh, out, 0, 0);
    result = copy_materials(env, mesh, out);
    if (result != FCT_OK) fct_mesh_release(env, out);
    return result;
}

fct_result fct_mesh_join(const fct_env *env, const fct_mesh *parts, size_t count, fct_mesh *out) {
    uint64_t vertices = 0, faces = 0;
    unsigned arrays = ~0u;
    *out = (fct_mesh){0};
    for (size_t i = 0; i < count; ++i) {
        vertices += parts[i].vertex_count, faces += parts[i].face_count;
        if (parts[i].vertex_count || parts[i].face_count) arrays &= fct_mesh_bits(&parts[i]);
    }
    if (vertices > FCT_MESH_LIMIT || faces > FCT_MESH_LIMIT)
        return fct_fail(env, FCT_ERROR_MEMORY, "the joined mesh has more than 2^31 vertices or faces");
    arrays = vertices || faces ? arrays & ~(unsigned)FCT_MESH_MATERIALS : 0;
    fct_result result = fct_mesh_create(env, (uint32_t)vertices, (uint32_t)faces, arrays, out);
    if (result != FCT_OK) return result;
    if (count) memcpy(out->origin, parts[0].origin, sizeof out->origin);
    uint32_t vertex = 0, face = 0;
    for (size_t i = 0; i < count; ++i) {
        copy_arrays(&parts[i], out, vertex, face);
        uint32_t *corners = out->triangles + 3 * (size_t)face;
        for (size_t c = 0; c < 3 * (size_t)parts[i].face_count; ++c) corners[c] += vertex;
        vertex += parts[i].vertex_count, face += parts[i].face_count;
    }
    return FCT_OK;
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

/* Copies the elements of the listed faces and of their vertices. ids: the old vertices, or NULL. */
static void extract_elements(const fct_mesh *mesh, const vertex_span *span, const uint32_t *faces,
                             uint32_t count, fct_mesh *out, uint32_t *ids) {
    fct_mesh room;
    fct_mesh_array sources[FCT_MESH_ARRAYS], targets[FCT_MESH_ARRAYS];
    list_arrays(mesh, &room, sources);
    fct_mesh_arrays(out, targets);
    for (int k = 0; k < FCT_MESH_ARRAYS; ++k) {
        const size_t size = sources[k].size;
        const char *from = get_array(sources + k);
        char *to = get_array(targets + k);
        for (size_t i = 0; from && sources[k].of_faces && i < count; ++i)
            memcpy(to + i * size, from + faces[i] * size, size);
        for (size_t i = 0; from && !sources[k].of_faces && i < span->count; ++i)
            if (span->numbers[i] != FCT_NONE)
                memcpy(to + span->numbers[i] * size, from + (span->first + i) * size, size);
    }
    for (uint32_t i = 0; ids && i < span->count; ++i)
        if (span->numbers[i] != FCT_NONE) ids[span->numbers[i]] = span->first + i;
    for (size_t c = 0; c < 3 * (size_t)count; ++c)
        out->triangles[c] = span->numbers[out->triangles[c] - span->first];
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
    fct_result result = fct_mesh_create(env, used, count, fct_mesh_bits(mesh), out);
    if (result == FCT_OK && vertex_ids && !(ids = fct_allocate(env, used, sizeof(uint32_t))))
        result = fct_fail_memory(env, "vertex ids");
    if (result == FCT_OK) {
        memcpy(out->origin, mesh->origin, sizeof out->origin);
        out->source_count = mesh->source_count;
        extract_elements(mesh, &span, faces, count, out, ids);
        result = copy_materials(env, mesh, out);
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
                  {"vertex", "irradiance", mesh->irradiance, vertices, 3},
                  {"vertex", "direct light", mesh->direct, vertices, 3},
                  {"vertex", "indirect light", mesh->indirect, vertices, 3},
                  {"vertex", "error", mesh->error, vertices, 1},
                  {"vertex", "normal", mesh->normals, vertices, 3},
                  {"face", "texture coordinate", mesh->texcoords, faces, 6},
                  {"face", "normal", mesh->corner_normals, faces, 9},
                  {"face", "colour", mesh->face_colors, faces, 3},
                  {"face", "place in its source face", mesh->source_uv, faces, 6}};
    for (size_t i = 0; result == FCT_OK && i < sizeof floats / sizeof *floats; ++i)
        result = check_floats(env, prefix, floats[i].element, floats[i].what, floats[i].values,
                              floats[i].count, floats[i].width);
    return result;
}

fct_result fct_mesh_validate(const fct_env *env, const fct_mesh *mesh) {
    return fct_mesh_check(env, NULL, mesh);
}

/* Swaps the values of the second and the third corner of every face, `width` floats each. NULL is allowed. */
static void swap_corners(float *values, size_t faces, size_t width) {
    for (size_t f = 0; values && f < faces; ++f)
        for (size_t k = 0; k < width; ++k) {
            float *second = values + (3 * f + 1) * width + k, swap = *second;
            *second = second[width], second[width] = swap;
        }
}

void fct_mesh_turn_over(fct_mesh *mesh) {
    for (size_t f = 0; f < mesh->face_count; ++f) {
        uint32_t *t = mesh->triangles + 3 * f, swap = t[1];
        t[1] = t[2], t[2] = swap;
    }
    swap_corners(mesh->texcoords, mesh->face_count, 2);
    swap_corners(mesh->source_uv, mesh->face_count, 2);
    swap_corners(mesh->corner_normals, mesh->face_count, 3);
}
