/* mesh/glb/primitive.c: see primitive.h. Source: glTF 2.0 specification, chapter 3.7. */
#include "mesh/glb/primitive.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "mesh/glb/document/accessor.h"

static const fct_env *env_of(const fct_glb_builder *b) {
    return b->glb->source->env;
}

static double compute_cofactor(const double *m, int i, int j) {
    int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
    return m[4 * a + c] * m[4 * b + d] - m[4 * a + d] * m[4 * b + c];
}

static bool is_mirroring(const fct_glb_transform *t) {
    double determinant = 0;
    for (int j = 0; j < 3; ++j) determinant += t->m[j] * compute_cofactor(t->m, 0, j);
    return determinant < 0;
}

static fct_result append_positions(fct_glb_builder *b, const fct_glb_transform *t,
                                   const fct_glb_array *positions) {
    float *to = b->soup->positions + 3 * (size_t)b->soup->vertex_count;
    for (size_t v = 0; v < positions->count; ++v) {
        double p[3], placed[3];
        for (int k = 0; k < 3; ++k) p[k] = fct_glb_value(positions, v, k);
        for (int k = 0; k < 3; ++k) {
            const double *m = t->m + 4 * k;
            placed[k] = t->identity ? p[k] : m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3];
        }
        fct_soup_place(b->soup, placed, to + 3 * v);
        if (!isfinite(to[3 * v]) || !isfinite(to[3 * v + 1]) || !isfinite(to[3 * v + 2]))
            return fct_glb_fail(b->glb, "a position is not finite (vertex %zu)", b->soup->vertex_count + v);
    }
    return FCT_OK;
}

/* Multiplies normals by the cofactor matrix, which is right for any scale, and makes them unit vectors. */
static void append_normals(fct_glb_builder *b, const fct_glb_transform *t, const fct_glb_array *normals) {
    float *to = b->soup->normals + 3 * (size_t)b->soup->vertex_count;
    double sign = is_mirroring(t) ? -1 : 1;
    for (size_t v = 0; v < normals->count; ++v) {
        double n[3], turned[3], length = 0;
        for (int k = 0; k < 3; ++k) n[k] = fct_glb_value(normals, v, k);
        for (int k = 0; k < 3; ++k) {
            turned[k] = 0;
            for (int j = 0; j < 3; ++j) turned[k] += sign * compute_cofactor(t->m, k, j) * n[j];
            length += turned[k] * turned[k];
        }
        length = sqrt(length);
        for (int k = 0; k < 3; ++k)
            to[3 * v + k] = (float)(t->identity ? n[k] : length > 0 ? turned[k] / length : 0);
    }
}

/* An accessor with one element per position. */
static fct_result get_array(const fct_glb_builder *b, int64_t index, int least, int most, size_t count,
                            const fct_glb_array **out) {
    fct_result result = fct_glb_array_of(b->glb, index, least, most, out);
    if (result == FCT_OK && (*out)->count != count)
        return fct_glb_fail(b->glb, "accessors[%lld] has %zu elements, expected %zu, the number of positions",
                            (long long)index, (*out)->count, count);
    return result;
}

/* The most vertices, and the most triangles, of all appended meshes. The size of the file limits them, so
 * that a short file with many references cannot exhaust the memory. */
static uint64_t find_limit(const fct_glb_builder *b) {
    return 64 * (uint64_t)b->glb->byte_count + 4000000;
}

static fct_result grow_vertices(fct_glb_builder *b, size_t count) {
    fct_soup *soup = b->soup;
    size_t total = soup->vertex_count + count, room = total > 0 ? total : 1; /* so that no array is NULL */
    b->glb->vertex_count += count;
    if (b->glb->vertex_count > find_limit(b) || total > FCT_MESH_LIMIT)
        return fct_glb_fail(b->glb, "its nodes place more than %llu vertices",
                            (unsigned long long)find_limit(b));
    fct_result result =
        fct_grow(env_of(b), (void **)&soup->positions, &b->vertex_capacity, room, 3 * sizeof(float));
    if (result == FCT_OK && b->has_colors)
        result = fct_grow(env_of(b), (void **)&soup->colors, &b->color_capacity, room, 3 * sizeof(float));
    if (result == FCT_OK && b->has_normals)
        result = fct_grow(env_of(b), (void **)&soup->normals, &b->normal_capacity, room, 3 * sizeof(float));
    if (result == FCT_OK && b->has_errors)
        result = fct_grow(env_of(b), (void **)&soup->error, &b->error_capacity, room, sizeof(float));
    return result;
}

/* Appends the primitive's vertices. */
static fct_result append_vertices(fct_glb_builder *b, const fct_glb_transform *t,
                                  const fct_glb_primitive *p) {
    fct_soup *soup = b->soup;
    const fct_glb_array *positions, *values = NULL;
    fct_result result = fct_glb_array_of(b->glb, p->position, 3, 3, &positions);
    if (result == FCT_OK) result = grow_vertices(b, positions->count);
    if (result == FCT_OK) result = append_positions(b, t, positions);
    if (result != FCT_OK) return result;
    if (b->has_normals && p->normal >= 0) {
        result = get_array(b, p->normal, 3, 3, positions->count, &values);
        if (result != FCT_OK) return result;
        append_normals(b, t, values);
    } else if (b->has_normals) {
        memset(soup->normals + 3 * (size_t)soup->vertex_count, 0, positions->count * 3 * sizeof(float));
    }
    if (b->has_colors) {
        float *to = soup->colors + 3 * (size_t)soup->vertex_count;
        int64_t index = p->light >= 0 ? p->light : p->color;
        if (index >= 0) result = get_array(b, index, 3, 4, positions->count, &values);
        if (result != FCT_OK) return result;
        b->without_color += index < 0 ? positions->count : 0;
        for (size_t v = 0; v < positions->count; ++v)
            for (int k = 0; k < 3; ++k) to[3 * v + k] = index < 0 ? 1 : (float)fct_glb_value(values, v, k);
        for (size_t v = 0; index >= 0 && index == p->color && values->width == 4 && v < positions->count; ++v)
            b->clear += fct_glb_value(values, v, 3) < 1;
    }
    if (b->has_errors) {
        result = get_array(b, p->error, 1, 1, positions->count, &values);
        if (result != FCT_OK) return result;
        for (size_t v = 0; v < positions->count; ++v)
            soup->error[soup->vertex_count + v] = (float)fct_glb_value(values, v, 0);
    }
    soup->vertex_count += (uint32_t)positions->count;
    return FCT_OK;
}

static fct_result grow_corners(fct_glb_builder *b, size_t corners) {
    fct_soup *soup = b->soup;
    size_t total = soup->corner_count + corners;
    b->glb->corner_count += corners;
    if (b->glb->corner_count > 3 * find_limit(b) || total / 3 > FCT_MESH_LIMIT)
        return fct_glb_fail(b->glb, "its nodes place more than %llu triangles",
                            (unsigned long long)find_limit(b));
    fct_result result =
        fct_grow(env_of(b), (void **)&soup->corners, &b->corner_capacity, total, sizeof(uint32_t));
    if (result == FCT_OK && b->has_texcoords)
        result =
            fct_grow(env_of(b), (void **)&soup->texcoords, &b->texcoord_capacity, total, 2 * sizeof(float));
    if (result == FCT_OK && b->has_materials)
        result = fct_grow(env_of(b), (void **)&soup->materials, &b->material_capacity, total / 3 + 1,
                          sizeof(uint32_t));
    return result;
}

/* Finds the three places in the index list that form triangle k of a list (4), strip (5) or fan (6). */
static void find_places(int64_t mode, size_t k, size_t places[3]) {
    if (mode == 4) {
        for (size_t j = 0; j < 3; ++j) places[j] = 3 * k + j;
    } else if (mode == 5) {
        places[0] = k, places[1] = k + 1 + (k & 1), places[2] = k + 2 - (k & 1);
    } else {
        places[0] = k + 1, places[1] = k + 2, places[2] = 0;
    }
}

/* Appends the primitive's triangles. Its vertices begin at `first`. turn: reverse the winding. */
static fct_result append_triangles(fct_glb_builder *b, const fct_glb_primitive *p, uint32_t first,
                                   bool turn) {
    fct_soup *soup = b->soup;
    const fct_glb_array *indices = NULL, *texcoords = NULL;
    size_t vertices = soup->vertex_count - first, count = vertices;
    fct_result result = FCT_OK;
    if (p->indices >= 0) {
        result = fct_glb_array_of(b->glb, p->indices, 1, 1, &indices);
        if (result == FCT_OK) count = indices->count;
    }
    if (result == FCT_OK && b->has_texcoords && p->texcoord >= 0)
        result = get_array(b, p->texcoord, 2, 2, vertices, &texcoords);
    if (result != FCT_OK) return result;
    b->incomplete += p->mode == 4 ? count % 3 != 0 : count == 1 || count == 2;
    size_t triangles = p->mode == 4 ? count / 3 : count < 3 ? 0 : count - 2;
    result = grow_corners(b, 3 * triangles);
    if (result != FCT_OK) return result;
    for (size_t k = 0; k < triangles; ++k) {
        size_t places[3];
        find_places(p->mode, k, places);
        for (size_t j = 0; j < 3; ++j) {
            size_t place = places[turn && j ? 3 - j : j], corner = soup->corner_count + j;
            double index = p->indices >= 0 ? fct_glb_value(indices, place, 0) : (double)place;
            if (!(index >= 0 && index < (double)vertices))
                return fct_glb_fail(b->glb, "vertex index %.0f is out of range, of %zu vertices", index,
                                    vertices);
            soup->corners[corner] = first + (uint32_t)index;
            for (int c = 0; b->has_texcoords && c < 2; ++c)
                soup->texcoords[2 * corner + c] =
                    p->texcoord >= 0 ? (float)fct_glb_value(texcoords, (size_t)index, c) : 0;
        }
        if (b->has_materials)
            soup->materials[soup->corner_count / 3] = b->by_primitive    ? b->primitive_count
                                                      : p->material >= 0 ? (uint32_t)p->material
                                                                         : b->unnamed;
        soup->corner_count += 3;
    }
    b->without_texcoord += b->has_texcoords && p->texcoord < 0 ? 3 * triangles : 0;
    return FCT_OK;
}

bool fct_glb_share_vertices(const fct_glb_primitive *a, const fct_glb_primitive *b) {
    return a->position == b->position && a->normal == b->normal && a->color == b->color &&
           a->light == b->light && a->error == b->error;
}

const char *fct_glb_find_light(json_t *attributes) {
    static const char *const names[] = {"_RADIOSITY", "_IRRADIANCE", "_DIRECT", "_INDIRECT"};
    for (size_t i = 0; i < FCT_LENGTH(names); ++i)
        if (json_object_get(attributes, names[i])) return names[i];
    return NULL;
}

/* The name may mean something else in the file of another program: then it is absent. */
static int64_t find_error(const fct_glb *glb, json_t *attributes) {
    json_t *index = json_object_get(attributes, "_ERROR");
    if (!json_is_integer(index) || json_integer_value(index) < 0) return FCT_GLB_ABSENT;
    json_t *accessors = json_object_get(glb->root, "accessors");
    json_t *accessor = json_array_get(accessors, (size_t)json_integer_value(index));
    const char *type = json_string_value(json_object_get(accessor, "type"));
    return type && !strcmp(type, "SCALAR") ? json_integer_value(index) : FCT_GLB_ABSENT;
}

fct_result fct_glb_read_primitive(const fct_glb *glb, json_t *object, fct_glb_primitive *out) {
    json_t *attributes = json_object_get(object, "attributes");
    fct_result result = fct_glb_index(glb, attributes, "POSITION", &out->position);
    if (result == FCT_OK) result = fct_glb_index(glb, attributes, "NORMAL", &out->normal);
    if (result == FCT_OK) result = fct_glb_index(glb, attributes, "COLOR_0", &out->color);
    out->light_name = fct_glb_find_light(attributes), out->light = FCT_GLB_ABSENT;
    out->error = find_error(glb, attributes);
    if (result == FCT_OK && out->light_name)
        result = fct_glb_index(glb, attributes, out->light_name, &out->light);
    if (result == FCT_OK) result = fct_glb_index(glb, attributes, "TEXCOORD_0", &out->texcoord);
    if (result == FCT_OK) result = fct_glb_index(glb, object, "indices", &out->indices);
    if (result == FCT_OK) result = fct_glb_index(glb, object, "material", &out->material);
    if (result == FCT_OK) result = fct_glb_index(glb, object, "mode", &out->mode);
    if (result == FCT_OK && out->mode == FCT_GLB_ABSENT) out->mode = 4;
    return result;
}

fct_result fct_glb_choose_texcoords(const fct_glb_builder *b, json_t *object, fct_glb_primitive *p) {
    char key[24];
    const bool known = p->material >= 0 && (uint64_t)p->material < fct_glb_count(b->glb, "materials");
    if (!b->texcoord_sets || !known || !b->texcoord_sets[p->material]) return FCT_OK;
    snprintf(key, sizeof key, "TEXCOORD_%u", b->texcoord_sets[p->material]);
    return fct_glb_index(b->glb, json_object_get(object, "attributes"), key, &p->texcoord);
}

/* Lines are left out. Points only have vertices. */
static bool is_left_out(const fct_glb_builder *b, int64_t mode) {
    return mode < 4 && (mode > 0 || b->by_primitive);
}

fct_result fct_glb_choose_arrays(fct_glb_builder *b, bool *unnamed) {
    json_t *mesh, *object, *material;
    size_t i, j, primitives = 0, with_normals = 0, with_errors = 0;
    *unnamed = false;
    json_array_foreach(json_object_get(b->glb->root, "meshes"), i, mesh)
        json_array_foreach(json_object_get(mesh, "primitives"), j, object) {
        fct_glb_primitive p;
        fct_result result = fct_glb_read_primitive(b->glb, object, &p);
        if (result != FCT_OK) return result;
        if (p.position == FCT_GLB_ABSENT || is_left_out(b, p.mode)) continue;
        ++primitives;
        with_normals += p.normal >= 0;
        with_errors += p.error >= 0;
        b->has_colors |= p.color >= 0 || p.light >= 0;
        b->has_texcoords |= p.texcoord >= 0;
        *unnamed |= p.material < 0;
        if (p.material < 0) continue;
        result = fct_glb_item(b->glb, "materials", p.material, &material);
        if (result != FCT_OK) return result;
        b->has_materials |= json_is_string(json_object_get(material, "name")) || p.material > 0;
    }
    b->has_normals = with_normals && with_normals == primitives;
    b->has_errors = with_errors && with_errors == primitives;
    if (with_normals && !b->has_normals)
        fct_glb_warn(b->glb, "%zu of %zu primitives have no normals, so all normals are left out",
                     primitives - with_normals, primitives);
    return FCT_OK;
}

/* Refuses what the reader cannot understand: another mode, a material that does not exist, or positions that
 * only KHR_draco_mesh_compression holds. */
static fct_result check_primitive(const fct_glb_builder *b, json_t *object, const fct_glb_primitive *p) {
    json_t *accessor;
    if (p->mode > 6)
        return fct_glb_fail(b->glb, "a primitive has mode %lld, expected 0 to 6", (long long)p->mode);
    if (p->material >= 0 && (uint64_t)p->material >= fct_glb_count(b->glb, "materials"))
        return fct_glb_fail(b->glb, "materials[%lld] does not exist, but a primitive uses it",
                            (long long)p->material);
    fct_result result = fct_glb_item(b->glb, "accessors", p->position, &accessor);
    if (result == FCT_OK && fct_glb_extension(object, "KHR_draco_mesh_compression") &&
        !json_object_get(accessor, "bufferView"))
        return fct_glb_fail(b->glb, "KHR_draco_mesh_compression of a primitive is not supported");
    return result;
}

fct_result fct_glb_append_mesh(fct_glb_builder *b, int64_t index, const fct_glb_transform *t) {
    json_t *mesh, *object;
    size_t i;
    fct_result result = fct_glb_item(b->glb, "meshes", index, &mesh);
    if (result != FCT_OK) return result;
    fct_glb_primitive before = {.position = FCT_GLB_ABSENT};
    uint32_t first = 0;
    bool turn = is_mirroring(t);
    json_array_foreach(json_object_get(mesh, "primitives"), i, object) {
        fct_glb_primitive p;
        result = fct_glb_read_primitive(b->glb, object, &p);
        if (result != FCT_OK) return result;
        if (p.position == FCT_GLB_ABSENT) continue;
        result = check_primitive(b, object, &p);
        if (result == FCT_OK) result = fct_glb_choose_texcoords(b, object, &p);
        if (result != FCT_OK) return result;
        if (is_left_out(b, p.mode)) continue;
        if (!fct_glb_share_vertices(&before, &p)) {
            first = b->soup->vertex_count;
            result = append_vertices(b, t, &p);
        }
        if (result == FCT_OK && p.mode) result = append_triangles(b, &p, first, turn);
        b->primitive_count += p.mode > 0;
        if (result != FCT_OK) return result;
        before = p;
    }
    return FCT_OK;
}

fct_result fct_glb_begin_soup(fct_glb_builder *b) {
    fct_result result = grow_vertices(b, 0);
    if (result == FCT_OK) result = grow_corners(b, 0);
    if (result == FCT_OK && !b->soup->corners) b->soup->corners = fct_allocate(env_of(b), 0, 1);
    return result == FCT_OK && !b->soup->corners ? fct_fail_memory(env_of(b), "a mesh") : result;
}

void fct_glb_end_soup(const fct_glb_builder *b) {
    b->soup->polygon_count = (uint32_t)(b->soup->corner_count / 3);
}

void fct_glb_report_builder(const fct_glb_builder *b) {
    if (b->without_color) fct_glb_warn(b->glb, "%zu vertices have no colour and get white", b->without_color);
    if (b->clear && !b->by_primitive) /* else fct_glb_report_losses says it */
        fct_glb_warn(b->glb, "%zu vertices have a colour with an alpha below 1, which is left out", b->clear);
    if (b->without_texcoord)
        fct_glb_warn(b->glb, "%zu corners have no texture coordinate and get 0 0", b->without_texcoord);
    if (b->incomplete)
        fct_glb_warn(b->glb, "%zu primitives end with an incomplete triangle, which is left out",
                     b->incomplete);
}
