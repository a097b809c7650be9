/* mesh/inspect.c: counts the elements and the defects of a mesh.
 *
 * The sides of all faces are sorted by vertex pair, so the faces of an edge are adjacent. Disjoint sets of
 * faces, corners and boundary vertices give components, fans and loops. A side from a vertex to itself is no
 * edge. A face with two sides on an edge counts once there. Cost: three radix sorts of 3F keys. The area is
 * summed in face order, so it does not depend on the threads.
 */
#include <math.h>

#include "base/env.h"
#include "base/key.h"
#include "base/math/vec.h"
#include "base/parallel.h"
#include "base/sort.h"
#include "base/union_find.h"
#include "facetree/mesh.h"

typedef struct sides {
    const fct_mesh *mesh;
    uint64_t *keys;   /* lower vertex << 32 | upper vertex */
    uint32_t *values; /* 3 * face + corner where the side begins */
} sides;

static void fill_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    sides *s = user;
    for (size_t f = begin; f < end; ++f)
        for (uint32_t j = 0; j < 3; ++j) {
            uint32_t a = s->mesh->triangles[3 * f + j], b = s->mesh->triangles[3 * f + (j + 1) % 3];
            s->keys[3 * f + j] = fct_pair_key(a, b);
            s->values[3 * f + j] = (uint32_t)(3 * f + j);
        }
}

static uint32_t side_end(uint32_t side) {
    return side % 3 == 2 ? side - 2 : side + 1;
}

typedef struct unions {
    uint32_t *corners;          /* 3F: corners of one vertex whose faces share an edge there */
    uint32_t *faces;            /* F: faces that share an edge */
    uint32_t *loops;            /* V: ends of boundary edges */
    unsigned char *on_boundary; /* V */
} unions;

/* Counts the edge of the sides values[begin, end), and joins its faces, corners and boundary vertices. */
static void count_edge(const sides *s, size_t begin, size_t end, unions *u, fct_mesh_report *report) {
    const uint32_t *t = s->mesh->triangles;
    uint32_t first = s->values[begin], faces = 1, before = first / 3, same_direction = 0;
    for (size_t i = begin + 1; i < end; ++i) {
        uint32_t side = s->values[i], face = side / 3;
        bool along = t[side] == t[first];
        fct_sets_join(u->corners, along ? first : side_end(first), side);
        fct_sets_join(u->corners, along ? side_end(first) : first, side_end(side));
        if (face == before) continue;
        fct_sets_join(u->faces, before, face);
        same_direction += along;
        before = face;
        ++faces;
    }
    ++report->edges;
    report->nonmanifold_edges += faces > 2;
    report->misoriented_edges += faces == 2 && same_direction == 1;
    if (faces > 1) return;
    ++report->boundary_edges;
    uint32_t a = t[first], b = t[side_end(first)];
    u->on_boundary[a] = u->on_boundary[b] = 1;
    fct_sets_join(u->loops, a, b);
}

static void count_edges(const sides *s, unions *u, fct_mesh_report *report) {
    size_t count = 3 * (size_t)s->mesh->face_count;
    for (size_t begin = 0, end; begin < count; begin = end) {
        uint64_t key = s->keys[begin];
        for (end = begin + 1; end < count && s->keys[end] == key;) ++end;
        if ((uint32_t)key != (uint32_t)(key >> 32)) count_edge(s, begin, end, u, report);
    }
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) report->components += u->faces[f] == f;
    for (uint32_t v = 0; v < s->mesh->vertex_count; ++v)
        report->boundary_loops += u->on_boundary[v] && fct_sets_find(u->loops, v) == v;
}

/* A vertex is manifold if all its corners are in one set. seen: scratch, vertex_count. */
static void count_vertices(const fct_mesh *mesh, unions *u, uint32_t *seen, fct_mesh_report *report) {
    enum { MANY = FCT_NONE - 1 };
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) seen[v] = FCT_NONE;
    size_t corners = 3 * (size_t)mesh->face_count;
    for (size_t c = 0; c < corners; ++c) {
        /* Repeated corners of a degenerate face are one corner. */
        size_t face = c - c % 3;
        for (size_t d = face; d < c; ++d)
            if (mesh->triangles[d] == mesh->triangles[c]) fct_sets_join(u->corners, (uint32_t)d, (uint32_t)c);
    }
    for (size_t c = 0; c < corners; ++c) {
        uint32_t *place = seen + mesh->triangles[c], root = fct_sets_find(u->corners, (uint32_t)c);
        *place = *place == FCT_NONE || *place == root ? root : (uint32_t)MANY;
    }
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        report->unreferenced_vertices += seen[v] == FCT_NONE;
        report->nonmanifold_vertices += seen[v] == (uint32_t)MANY;
    }
}

/* Sorts the faces by their vertices in ascending order: first by the largest vertex, then, stably, by the
 * other two. Equal faces are then adjacent. */
static fct_result count_duplicates(const fct_env *env, sides *s, fct_mesh_report *report) {
    const fct_mesh *mesh = s->mesh;
    size_t count = mesh->face_count;
    uint32_t *t = mesh->triangles;
    for (size_t f = 0; f < count; ++f) {
        uint32_t a = t[3 * f], b = t[3 * f + 1], c = t[3 * f + 2];
        uint32_t top = a > b ? a : b;
        s->keys[f] = top > c ? top : c;
        s->values[f] = (uint32_t)f;
    }
    fct_result result = fct_sort_pairs(env, s->keys, s->values, count);
    if (result != FCT_OK) return result;
    uint32_t *largest = s->values + count; /* 3F values are there, F of them in use */
    for (size_t i = 0; i < count; ++i) {
        const uint32_t *v = t + 3 * (size_t)s->values[i];
        uint32_t low = v[0] < v[1] ? v[0] : v[1], high = v[0] < v[1] ? v[1] : v[0];
        uint32_t bottom = low < v[2] ? low : v[2];
        uint32_t middle = v[2] < low ? low : v[2] < high ? v[2] : high;
        largest[s->values[i]] = (uint32_t)s->keys[i];
        s->keys[i] = (uint64_t)bottom << 32 | middle;
    }
    result = fct_sort_pairs(env, s->keys, s->values, count);
    for (size_t i = 1; result == FCT_OK && i < count; ++i)
        report->duplicate_faces +=
            s->keys[i] == s->keys[i - 1] && largest[s->values[i]] == largest[s->values[i - 1]];
    return result;
}

static void measure_surface(const fct_mesh *mesh, fct_mesh_report *report) {
    for (int k = 0; k < 3; ++k) report->bounds.lower[k] = INFINITY, report->bounds.upper[k] = -INFINITY;
    for (size_t v = 0; v < mesh->vertex_count; ++v)
        for (int k = 0; k < 3; ++k) {
            float x = mesh->positions[3 * v + k];
            if (x < report->bounds.lower[k]) report->bounds.lower[k] = x;
            if (x > report->bounds.upper[k]) report->bounds.upper[k] = x;
        }
    if (mesh->vertex_count)
        report->diagonal = v3_norm(v3_sub(v3_load(report->bounds.upper), v3_load(report->bounds.lower)));
    for (size_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * f;
        v3 p = v3_load(mesh->positions + 3 * (size_t)t[0]);
        v3 a = v3_sub(v3_load(mesh->positions + 3 * (size_t)t[1]), p);
        v3 b = v3_sub(v3_load(mesh->positions + 3 * (size_t)t[2]), p);
        double area = .5 * v3_norm(v3_cross(a, b));
        report->area += area;
        report->degenerate_faces += !(area > 0);
    }
    report->polygons = mesh->face_count;
    if (mesh->source_faces) {
        report->polygons = mesh->face_count > 0;
        for (size_t f = 1; f < mesh->face_count; ++f)
            report->polygons += mesh->source_faces[f] != mesh->source_faces[f - 1];
    }
}

fct_result fct_mesh_inspect(const fct_env *env, const fct_mesh *mesh, fct_mesh_report *report) {
    fct_mesh_report found = {.vertices = mesh->vertex_count, .faces = mesh->face_count};
    size_t corners = 3 * (size_t)mesh->face_count, vertices = mesh->vertex_count;
    if (corners > UINT32_MAX) return fct_fail_memory(env, "an inspection of more than 2^32 corners");
    fct_result result = fct_progress(env, "inspect", 0);
    if (result != FCT_OK) return result;
    sides s = {.mesh = mesh};
    unions u;
    const fct_array arrays[] = {FCT_ARRAY(s.keys, corners),    FCT_ARRAY(s.values, corners),
                                FCT_ARRAY(u.corners, corners), FCT_ARRAY(u.faces, mesh->face_count),
                                FCT_ARRAY(u.loops, vertices),  FCT_ARRAY_ZERO(u.on_boundary, vertices)};
    result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "an inspection");
    if (result != FCT_OK) goto done;
    measure_surface(mesh, &found);
    fct_sets_create(u.corners, corners);
    fct_sets_create(u.faces, mesh->face_count);
    fct_sets_create(u.loops, vertices);
    fct_parallel_for(env, mesh->face_count, 16384, fill_sides, &s);
    result = fct_sort_pairs(env, s.keys, s.values, corners);
    if (result == FCT_OK) result = fct_progress(env, "inspect", .5);
    if (result != FCT_OK) goto done;
    count_edges(&s, &u, &found);
    count_vertices(mesh, &u, u.loops, &found);
    result = count_duplicates(env, &s, &found);
    if (result == FCT_OK) result = fct_progress(env, "inspect", 1);
done:
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    if (result == FCT_OK) *report = found;
    return result;
}
