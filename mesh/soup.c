/* mesh/soup.c: see soup.h. */
#include "mesh/soup.h"

#include <string.h>

#include "mesh/triangulate.h"

void fct_soup_release(const fct_env *env, fct_soup *soup) {
    fct_release(env, soup->positions);
    fct_release(env, soup->colors);
    fct_release(env, soup->normals);
    fct_release(env, soup->irradiance);
    fct_release(env, soup->direct);
    fct_release(env, soup->indirect);
    fct_release(env, soup->error);
    fct_release(env, soup->corners);
    fct_release(env, soup->starts);
    fct_release(env, soup->texcoords);
    fct_release(env, soup->corner_normals);
    fct_release(env, soup->polygon_colors);
    fct_release(env, soup->materials);
    fct_names_release(env, soup->material_names, soup->material_count);
    *soup = (fct_soup){0};
}

static size_t count_triangles(const fct_soup *soup) {
    if (!soup->starts) return soup->polygon_count;
    size_t count = 0;
    for (uint32_t i = 0; i < soup->polygon_count; ++i) {
        uint32_t corners = soup->starts[i + 1] - soup->starts[i];
        count += corners > 2 ? corners - 2 : 0;
    }
    return count;
}

/* Sends one warning for polygons of fewer than three corners. */
static void warn_of_small_polygons(const fct_env *env, const char *name, const fct_soup *soup) {
    uint32_t count = 0;
    for (uint32_t i = 0; soup->starts && i < soup->polygon_count; ++i)
        count += soup->starts[i + 1] - soup->starts[i] < 3;
    if (count)
        fct_note(env, FCT_MESSAGE_WARNING, "%s: %u face%s with fewer than three corners %s left out", name,
                 count, count == 1 ? "" : "s", count == 1 ? "is" : "are");
}

static bool is_polygon_list(const fct_soup *soup) {
    for (uint32_t i = 0; soup->starts && i < soup->polygon_count; ++i)
        if (soup->starts[i + 1] - soup->starts[i] != 3) return true;
    return false;
}

static fct_result check_soup(const fct_env *env, const char *name, const fct_soup *soup) {
    uint32_t largest = 0;
    for (size_t i = 0; i < soup->corner_count; ++i)
        largest = soup->corners[i] > largest ? soup->corners[i] : largest;
    if (soup->corner_count && largest >= soup->vertex_count) {
        size_t i = 0;
        while (soup->corners[i] < soup->vertex_count) ++i;
        size_t face = i / 3;
        if (soup->starts)
            for (face = 0; soup->starts[face + 1] <= i;) ++face;
        return fct_fail(env, FCT_ERROR_DATA, "%s: face %zu: vertex index %d is out of range, of %u vertices",
                        name, face, (int)soup->corners[i], soup->vertex_count);
    }
    if (count_triangles(soup) > FCT_MESH_LIMIT || soup->vertex_count > FCT_MESH_LIMIT)
        return fct_fail(env, FCT_ERROR_DATA, "%s: more than %llu vertices or triangles", name,
                        (unsigned long long)FCT_MESH_LIMIT);
    return FCT_OK;
}

/* Releases *array if a value is not finite, and sends one warning that names the first such element. */
static void drop_if_not_finite(const fct_env *env, const char *name, const char *element, const char *what,
                               float **array, size_t count, unsigned width) {
    if (!*array) return;
    size_t first = fct_first_not_finite(*array, count * width) / width, bad = 0;
    if (first == count) return;
    for (size_t i = first; i < count; ++i) bad += fct_first_not_finite(*array + i * width, width) < width;
    fct_note(env, FCT_MESSAGE_WARNING, "%s: the %s are left out, because %zu of %zu are wrong (%s %zu first)",
             name, what, bad, count, element, first);
    fct_release(env, *array);
    *array = NULL;
}

static void drop_wrong_attributes(const fct_env *env, const char *name, fct_soup *soup) {
    size_t vertices = soup->vertex_count, polygons = soup->polygon_count;
    drop_if_not_finite(env, name, "vertex", "colours", &soup->colors, vertices, 3);
    drop_if_not_finite(env, name, "vertex", "irradiance", &soup->irradiance, vertices, 3);
    drop_if_not_finite(env, name, "vertex", "direct light", &soup->direct, vertices, 3);
    drop_if_not_finite(env, name, "vertex", "indirect light", &soup->indirect, vertices, 3);
    drop_if_not_finite(env, name, "vertex", "errors", &soup->error, vertices, 1);
    drop_if_not_finite(env, name, "vertex", "normals", &soup->normals, vertices, 3);
    drop_if_not_finite(env, name, "corner", "texture coordinates", &soup->texcoords, soup->corner_count, 2);
    drop_if_not_finite(env, name, "face", "face colours", &soup->polygon_colors, polygons, 3);
}

/* Moves the arrays of vertices, and the material names. */
static void move_shared(fct_soup *soup, fct_mesh *out) {
    memcpy(out->origin, soup->origin, sizeof out->origin);
    out->vertex_count = soup->vertex_count;
    out->positions = soup->positions;
    out->colors = soup->colors;
    out->normals = soup->normals;
    out->irradiance = soup->irradiance;
    out->direct = soup->direct;
    out->indirect = soup->indirect;
    out->error = soup->error;
    out->material_count = soup->material_count;
    out->material_names = soup->material_names;
    soup->positions = soup->colors = soup->normals = NULL;
    soup->irradiance = soup->direct = soup->indirect = soup->error = NULL;
    soup->material_names = NULL;
    soup->material_count = 0;
}

static void move_triangles(fct_soup *soup, fct_mesh *out) {
    out->face_count = soup->polygon_count;
    out->triangles = soup->corners;
    out->texcoords = soup->texcoords;
    out->corner_normals = soup->corner_normals;
    out->face_colors = soup->polygon_colors;
    out->materials = soup->materials;
    soup->corners = soup->materials = NULL;
    soup->texcoords = soup->corner_normals = soup->polygon_colors = NULL;
}

static void cut_polygons(const fct_env *env, const char *name, const fct_soup *soup,
                         const fct_polygon_scratch *scratch, uint32_t *local, fct_mesh *out) {
    uint64_t budget = 64 * (uint64_t)soup->corner_count + (1u << 28);
    uint32_t face = 0;
    for (uint32_t polygon = 0; polygon < soup->polygon_count; ++polygon) {
        uint32_t first = soup->starts[polygon], count = soup->starts[polygon + 1] - first;
        if (count > 2)
            fct_triangulate(soup->positions, soup->corners + first, count, scratch, &budget, local);
        for (uint32_t k = 0; k + 2 < count; ++k, ++face) {
            for (uint32_t j = 0; j < 3; ++j) {
                size_t corner = first + local[3 * k + j], place = 3 * (size_t)face + j;
                out->triangles[place] = soup->corners[corner];
                if (out->texcoords)
                    memcpy(out->texcoords + 2 * place, soup->texcoords + 2 * corner, 2 * sizeof(float));
                if (out->corner_normals)
                    memcpy(out->corner_normals + 3 * place, soup->corner_normals + 3 * corner,
                           3 * sizeof(float));
            }
            out->source_faces[face] = polygon;
            if (out->materials) out->materials[face] = soup->materials[polygon];
            if (out->face_colors)
                memcpy(out->face_colors + 3 * (size_t)face, soup->polygon_colors + 3 * (size_t)polygon,
                       3 * sizeof(float));
        }
    }
    if (!budget)
        fct_note(env, FCT_MESSAGE_WARNING,
                 "%s: concave polygons of very many corners: some were cut as fans and may overlap", name);
}

static fct_result triangulate_soup(const fct_env *env, const char *name, fct_soup *soup, fct_mesh *out) {
    uint32_t widest = 3;
    for (uint32_t i = 0; i < soup->polygon_count; ++i) {
        uint32_t count = soup->starts[i + 1] - soup->starts[i];
        widest = count > widest ? count : widest;
    }
    fct_polygon_scratch scratch;
    uint32_t *local;
    const fct_array lists[] = {FCT_ARRAY(scratch.flat, widest), FCT_ARRAY(scratch.next, widest),
                               FCT_ARRAY(scratch.previous, widest), FCT_ARRAY(scratch.reflex, widest),
                               FCT_ARRAY(local, 3 * (size_t)widest)};
    unsigned arrays = FCT_MESH_SOURCE_FACES | (soup->texcoords ? FCT_MESH_TEXCOORDS : 0) |
                      (soup->corner_normals ? FCT_MESH_CORNER_NORMALS : 0) |
                      (soup->polygon_colors ? FCT_MESH_FACE_COLORS : 0) |
                      (soup->materials ? FCT_MESH_MATERIALS : 0);
    fct_mesh faces = {0};
    fct_result result = fct_allocate_all(env, lists, FCT_LENGTH(lists), "triangulation");
    if (result == FCT_OK) result = fct_mesh_create(env, 0, (uint32_t)count_triangles(soup), arrays, &faces);
    if (result == FCT_OK) {
        cut_polygons(env, name, soup, &scratch, local, &faces);
        fct_release(env, faces.positions);
        *out = faces;
        out->source_count = soup->polygon_count;
    }
    fct_release_all(env, lists, FCT_LENGTH(lists));
    return result;
}

fct_result fct_soup_mesh(const fct_env *env, const char *name, fct_soup *soup, fct_mesh *out) {
    *out = (fct_mesh){0};
    fct_result result = check_soup(env, name, soup);
    if (result == FCT_OK) {
        warn_of_small_polygons(env, name, soup);
        drop_wrong_attributes(env, name, soup);
    }
    if (result == FCT_OK && is_polygon_list(soup))
        result = triangulate_soup(env, name, soup, out);
    else if (result == FCT_OK)
        move_triangles(soup, out);
    if (result == FCT_OK) {
        move_shared(soup, out);
        result = fct_mesh_check(env, name, out);
    }
    fct_soup_release(env, soup);
    if (result != FCT_OK) fct_mesh_release(env, out);
    return result;
}
