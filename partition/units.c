/* partition/units.c: graphs of faces and of runs of faces, see units.h.
 *
 * Rows of faces come from the dual graph's edges by counting. Rows of runs come from the rows of their faces,
 * with one slot per unit that holds its index in the row. O(F), no sort.
 */
#include "partition/units.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/env.h"
#include "base/union_find.h"

void fct_units_release(const fct_env *env, fct_units *units) {
    fct_dual_release(env, &units->dual);
    fct_release(env, units->first);
    fct_release(env, units->neighbours);
    fct_release(env, units->face_lengths);
    fct_release(env, units->lengths);
    fct_release(env, units->perimeters);
    fct_release(env, units->vectors);
    fct_release(env, units->materials);
    *units = (fct_units){0};
}

/* Turns the lengths of rows into their first indices. */
static void sum_rows(uint32_t *first, uint32_t count) {
    uint32_t end = 0;
    for (uint32_t i = 0; i <= count; ++i) {
        uint32_t row = i < count ? first[i] : 0;
        first[i] = end;
        end += row;
    }
}

/* While rows are filled, first[i + 1] is the next free entry of row i; it ends as the beginning of row i + 1.
 */
static void list_faces(fct_units *units) {
    const fct_dual *dual = &units->dual;
    uint32_t *next = units->first + 1;
    memset(units->first, 0, ((size_t)units->count + 2) * sizeof *units->first);
    for (size_t e = 0; e < 2 * (size_t)dual->edge_count; ++e) ++next[dual->edges[e]];
    sum_rows(next, units->count);
    for (size_t e = 0; e < 2 * (size_t)dual->edge_count; ++e) {
        uint32_t place = next[dual->edges[e]]++;
        units->neighbours[place] = dual->edges[e ^ 1];
        units->face_lengths[place] = dual->lengths[e / 2];
    }
}

/* Renumbers the faces of the dual graph. */
static fct_result renumber_dual(const fct_env *env, const uint32_t *numbers, fct_dual *dual) {
    float *perimeters = fct_allocate(env, dual->face_count, sizeof *perimeters);
    if (!perimeters) return fct_fail_memory(env, "refining a partition");
    for (uint32_t f = 0; f < dual->face_count; ++f) perimeters[numbers[f]] = dual->perimeters[f];
    for (size_t e = 0; e < 2 * (size_t)dual->edge_count; ++e) dual->edges[e] = numbers[dual->edges[e]];
    fct_release(env, dual->perimeters);
    dual->perimeters = perimeters;
    return FCT_OK;
}

/* Extents of a mesh whose lengths are floats of full precision. */
#define LEAST_EXTENT 1e-30
#define MOST_EXTENT  1e37

/* The longest side of the bounds of the faces. */
static double find_extent(const fct_mesh *mesh) {
    double extent = 0;
    for (size_t k = 0; k < 3; ++k) {
        double lower = INFINITY, upper = -INFINITY;
        for (size_t i = 0; i < 3 * (size_t)mesh->face_count; ++i) {
            double x = (double)mesh->positions[3 * (size_t)mesh->triangles[i] + k];
            lower = x < lower ? x : lower, upper = x > upper ? x : upper;
        }
        extent = upper - lower > extent ? upper - lower : extent;
    }
    return extent;
}

fct_result fct_units_dual(const fct_env *env, const fct_mesh *mesh, fct_dual *out, double *unit) {
    double extent = find_extent(mesh);
    int power;
    *out = (fct_dual){0}, *unit = 1;
    if (!(extent > 0) || (extent >= LEAST_EXTENT && extent <= MOST_EXTENT))
        return fct_dual_build(env, mesh, out);
    frexp(extent, &power);
    *unit = ldexp(1, power);
    fct_mesh scaled = *mesh;
    scaled.positions = fct_allocate(env, mesh->vertex_count, 3 * sizeof *scaled.positions);
    if (!scaled.positions) return fct_fail_memory(env, "measuring a partition");
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; ++i)
        scaled.positions[i] =
            (float)fmax(fmin((double)mesh->positions[i] / *unit, (double)FLT_MAX), -(double)FLT_MAX);
    fct_result result = fct_dual_build(env, &scaled, out);
    fct_release(env, scaled.positions);
    return result;
}

fct_result fct_units_of_faces(const fct_env *env, const fct_mesh *mesh, const uint32_t *numbers,
                              const fct_mesh *numbered, fct_units *out) {
    *out = (fct_units){.count = mesh->face_count, .mesh = numbers ? numbered : mesh};
    out->of_faces = out->mesh->materials;
    double unit; /* a refinement does not depend on it */
    fct_result result = fct_units_dual(env, mesh, &out->dual, &unit);
    if (result == FCT_OK && numbers) result = renumber_dual(env, numbers, &out->dual);
    if (result != FCT_OK) goto failed;
    size_t ends = 2 * (size_t)out->dual.edge_count;
    if (ends > UINT32_MAX) {
        result = fct_fail(env, FCT_ERROR_DATA,
                          "%zu sides of faces have neighbours, at most %u can be refined", ends, UINT32_MAX);
        goto failed;
    }
    const fct_array arrays[] = {FCT_ARRAY(out->first, (size_t)out->count + 2),
                                FCT_ARRAY(out->neighbours, ends), FCT_ARRAY(out->face_lengths, ends)};
    result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "refining a partition");
    if (result != FCT_OK) goto failed;
    list_faces(out);
    fct_release(env, out->dual.edges);
    fct_release(env, out->dual.lengths);
    out->dual.edges = NULL, out->dual.lengths = NULL;
    return FCT_OK;
failed:
    fct_units_release(env, out);
    return result;
}

/* Sums over the faces of each unit; marks the units that never move. */
static void sum_runs(const fct_units *faces, const uint32_t *unit_of, uint32_t *parents, uint32_t *pieces,
                     fct_units *out) {
    memset(out->vectors, 0, (size_t)out->count * sizeof *out->vectors);
    memset(pieces, 0, (size_t)out->count * sizeof *pieces);
    for (uint32_t u = 0; u < out->count; ++u) out->perimeters[u] = 0;
    for (uint32_t f = 0; f < faces->count; ++f) {
        uint32_t u = unit_of[f], material = faces->of_faces ? faces->of_faces[f] : 0;
        bool begins = f == 0 || unit_of[f - 1] != u;
        out->vectors[u] = v3_add(out->vectors[u], fct_unit_vector(faces, f));
        out->perimeters[u] += fct_unit_perimeter(faces, f);
        out->materials[u] = begins || out->materials[u] == material ? material : FCT_NONE;
        parents[f] = f;
        ++pieces[u];
        for (uint32_t i = faces->first[f]; i < faces->first[f + 1]; ++i) {
            uint32_t other = faces->neighbours[i];
            if (unit_of[other] != u) continue;
            out->perimeters[u] -= fct_unit_length(faces, i);
            if (other < f && fct_sets_join(parents, f, other)) --pieces[u];
        }
    }
    for (uint32_t u = 0; u < out->count; ++u)
        if (pieces[u] > 1) out->materials[u] = FCT_NONE;
}

/* Fills the rows of the units; only finds their beginnings while there are no arrays. slots: one per unit. */
static void list_runs(const fct_units *faces, const uint32_t *unit_of, uint32_t *slots, fct_units *out) {
    uint32_t end = 0, row = 0;
    for (uint32_t u = 0; u < out->count; ++u) slots[u] = FCT_NONE;
    for (uint32_t f = 0; f < faces->count; ++f) {
        uint32_t u = unit_of[f];
        if (f == 0 || unit_of[f - 1] != u) out->first[u] = row = end;
        for (uint32_t i = faces->first[f]; i < faces->first[f + 1]; ++i) {
            uint32_t other = unit_of[faces->neighbours[i]];
            if (other == u) continue;
            if (slots[other] == FCT_NONE || slots[other] < row) {
                slots[other] = end;
                if (out->neighbours) out->neighbours[end] = other, out->lengths[end] = 0;
                ++end;
            }
            if (out->lengths) out->lengths[slots[other]] += fct_unit_length(faces, i);
        }
    }
    out->first[out->count] = end;
}

fct_result fct_units_of_runs(const fct_env *env, const fct_units *faces, const uint32_t *unit_of,
                             uint32_t count, uint32_t *scratch, fct_units *out) {
    *out = (fct_units){.count = count};
    const fct_array arrays[] = {FCT_ARRAY(out->first, (size_t)count + 1), FCT_ARRAY(out->vectors, count),
                                FCT_ARRAY(out->perimeters, count), FCT_ARRAY(out->materials, count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "refining a partition");
    if (result != FCT_OK) return result;
    sum_runs(faces, unit_of, scratch, scratch + faces->count, out);
    list_runs(faces, unit_of, scratch, out);
    size_t ends = out->first[count];
    const fct_array ends_arrays[] = {FCT_ARRAY(out->lengths, ends), FCT_ARRAY(out->neighbours, ends)};
    result = fct_allocate_all(env, ends_arrays, FCT_LENGTH(ends_arrays), "refining a partition");
    if (result == FCT_OK)
        list_runs(faces, unit_of, scratch, out);
    else
        fct_units_release(env, out);
    return result;
}
