/* radiosity/surface/creases.c: see creases.h.
 *
 * Two parallel passes over the positions:
 *   1. join a position's corners across smooth edges, sort them by group and vertex, count added vertices;
 *   2. number and fill the vertices.
 * Cost: O(F log valence).
 */
#include "radiosity/surface/creases.h"

#include "base/parallel.h"
#include "base/sort.h"
#include "base/union_find.h"
#include "radiosity/surface/split.h"

#include <string.h>

/* Positions per chunk. */
#define GRAIN 4096

/* Flags of a corner in the sorted list: a vertex, an added vertex, a group, a group on a rim begins here. */
enum { BEGIN_VERTEX = 1, ADDED_VERTEX = 2, BEGIN_GROUP = 4, RIM_GROUP = 8 };

typedef struct work {
    const fct_corners *mesh;
    const fct_shading *shading;
    const uint32_t *source_faces, *places; /* per face */
    const float *source_uv;                /* per corner x 2 */
    uint32_t *first;                       /* vertex -> lowest vertex at its position */
    float *normals;                        /* per face */
    float *shades;     /* FILE: per corner, the file's normal; zero: not usable. Else NULL */
    size_t *begin;     /* position (by lowest vertex) -> its corners in `corners`; vertex_count + 1 */
    uint32_t *corners; /* 3 face_count */
    uint8_t *flags;    /* 3 face_count, as `corners` */
    uint8_t *taken;    /* per vertex: a group has its number */
    uint32_t *added;   /* per position: vertices added; from make_room on, number of the first one */
    size_t largest;    /* most corners at a position */
    uint64_t *keys;    /* 2 x largest per thread; sorted with `values` */
    uint32_t *values;  /* 2 x largest per thread */
    uint32_t *parents; /* largest per thread: union-find over a position's corners */
    uint8_t *open;     /* largest per thread */
    fct_surface *out;
} work;

/* A degenerate face has no normal, so it is smooth with every neighbour. */
static bool corners_are_smooth(const work *w, uint32_t a, uint32_t b) {
    if (w->shading->rule == FCT_NORMALS_FLAT) return w->source_faces[a / 3] == w->source_faces[b / 3];
    v3 n = v3_load(w->normals + a / 3 * (size_t)3), m = v3_load(w->normals + b / 3 * (size_t)3);
    if (v3_norm2(n) == 0 || v3_norm2(m) == 0) return true;
    if (w->shades) {
        v3 p = v3_load(w->shades + 3 * (size_t)a), q = v3_load(w->shades + 3 * (size_t)b);
        if (v3_norm2(p) > 0 || v3_norm2(q) > 0) return fct_shading_same(p, q);
    }
    return v3_dot(n, m) > w->shading->crease_cosine;
}

/* Corners of a vertex that a corner is compared with, at most: few vertices have more different normals. */
enum { MOST_COMPARED = 32 };

/* Joins corner `at` of the list with the first of those from `begin` on that has the same normal. */
static void join_to_earlier(const work *w, const uint32_t *corners, const uint32_t *list, size_t begin,
                            size_t at, uint32_t *parents) {
    const v3 own = v3_load(w->shades + 3 * (size_t)corners[list[at]]);
    for (size_t i = begin; i < at && i < begin + MOST_COMPARED; ++i) {
        if (!fct_shading_same(v3_load(w->shades + 3 * (size_t)corners[list[i]]), own)) continue;
        fct_sets_join(parents, list[i], list[at]);
        return;
    }
}

/* Joins corners of one vertex that have the same normal of the file. Corners without one stay apart. */
static void join_shared_normals(const work *w, const uint32_t *corners, size_t count, uint64_t *keys,
                                uint32_t *values, uint32_t *parents) {
    for (size_t i = 0; i < count; ++i) keys[i] = w->mesh->triangles[corners[i]], values[i] = (uint32_t)i;
    fct_sort_in_place(keys, values, count);
    for (size_t i = 0, end; i < count; i = end)
        for (end = i; end < count && keys[end] == keys[i]; ++end)
            join_to_earlier(w, corners, values, i, end, parents);
}

/* Joins the corners around a position across smooth edges. open[i]: corner i has an edge that is not joined;
 * at the lowest corner of a group: any corner of the group has one. */
static void join_corners(const work *w, const uint32_t *corners, size_t count, uint64_t *keys,
                         uint32_t *values, uint32_t *parents, uint8_t *open) {
    const uint32_t *t = w->mesh->triangles;
    for (size_t i = 0; i < count; ++i) {
        size_t face = corners[i] / 3 * (size_t)3;
        uint32_t k = corners[i] % 3, slot = (uint32_t)i;
        parents[i] = slot, open[i] = 2;
        keys[2 * i] = w->first[t[face + (k + 1) % 3]], values[2 * i] = 2 * slot;
        keys[2 * i + 1] = w->first[t[face + (k + 2) % 3]], values[2 * i + 1] = 2 * slot + 1;
    }
    fct_sort_in_place(keys, values, 2 * count);
    for (size_t i = 0, end; i < 2 * count; i = end) {
        for (end = i + 1; end < 2 * count && keys[end] == keys[i];) ++end;
        uint32_t a = values[i], b = values[end - 1];
        if (end - i != 2 || (a & 1) == (b & 1) || !corners_are_smooth(w, corners[a / 2], corners[b / 2]))
            continue;
        fct_sets_join(parents, a / 2, b / 2);
        --open[a / 2], --open[b / 2];
    }
    if (w->shades) join_shared_normals(w, corners, count, keys, values, parents);
    for (size_t i = 0; i < count; ++i) {
        parents[i] = fct_sets_find(parents, (uint32_t)i);
        if (open[i]) open[parents[i]] = 1;
    }
}

/* The normal of a group: that of the file if it has one, else that of the faces. Returns false if it is not
 * in front of all faces. */
static bool find_group_normal(const work *w, size_t begin, size_t end, v3 *normal) {
    const uint32_t *corners = w->corners + begin;
    v3 sum = {0, 0, 0};
    for (size_t i = begin; w->shades && i < end; ++i)
        sum = v3_add(sum, v3_load(w->shades + 3 * (size_t)w->corners[i]));
    *normal = v3_unit(sum);
    return v3_norm2(sum) > 0 ? fct_corner_front(w->mesh, corners, end - begin, *normal)
                             : fct_corner_normal(w->mesh, corners, end - begin, normal);
}

/* Sets the flags of the corners [begin, end) of one group. A group without a normal in front of all its faces
 * becomes one group per corner. Returns the number of vertices to add. */
static uint32_t mark_group(const work *w, size_t begin, size_t end, bool rim) {
    const uint32_t *t = w->mesh->triangles;
    uint32_t added = 0;
    v3 normal;
    bool whole = find_group_normal(w, begin, end, &normal);
    for (size_t i = begin; i < end; ++i) {
        uint32_t v = t[w->corners[i]];
        uint8_t flag = 0;
        if (i == begin || !whole) flag = (uint8_t)(BEGIN_GROUP | (rim || !whole ? RIM_GROUP : 0));
        if (flag || v != t[w->corners[i - 1]]) {
            flag |= BEGIN_VERTEX;
            if (w->taken[v]) flag |= ADDED_VERTEX, ++added;
            w->taken[v] = 1;
        }
        w->flags[i] = flag;
    }
    return added;
}

/* First pass: positions [begin, end). */
static void group_positions(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk;
    const work *w = user;
    uint64_t *keys = w->keys + 2 * w->largest * thread;
    uint32_t *values = w->values + 2 * w->largest * thread;
    uint32_t *parents = w->parents + w->largest * thread;
    uint8_t *open = w->open + w->largest * thread;
    for (size_t v = begin; v < end; ++v) {
        size_t from = w->begin[v], count = w->begin[v + 1] - from;
        uint32_t *corners = w->corners + from;
        join_corners(w, corners, count, keys, values, parents, open);
        for (size_t i = 0; i < count; ++i)
            keys[i] = (uint64_t)parents[i] << 32 | w->mesh->triangles[corners[i]], values[i] = corners[i];
        fct_sort_in_place(keys, values, count);
        memcpy(corners, values, count * sizeof *corners);
        w->added[v] = 0;
        for (size_t i = 0, next; i < count; i = next) {
            uint64_t group = keys[i] >> 32;
            for (next = i + 1; next < count && keys[next] >> 32 == group;) ++next;
            w->added[v] += mark_group(w, from + i, from + next, open[group]);
        }
    }
}

/* A third of the area of the corner's face. */
static double measure_corner_area(const fct_corners *mesh, uint32_t corner) {
    const uint32_t *t = mesh->triangles + corner / 3 * (size_t)3;
    v3 a = v3_load(mesh->positions + 3 * (size_t)t[0]);
    v3 e1 = v3_sub(v3_load(mesh->positions + 3 * (size_t)t[1]), a);
    v3 e2 = v3_sub(v3_load(mesh->positions + 3 * (size_t)t[2]), a);
    return v3_norm(v3_cross(e1, e2)) / 6;
}

/* Fills the vertices of one group, corners [begin, end). *next is the number of the next added vertex. */
static void fill_group(const work *w, size_t begin, size_t end, uint32_t *next) {
    const fct_corners *mesh = w->mesh;
    v3 normal;
    find_group_normal(w, begin, end, &normal);
    bool rim = w->flags[begin] & RIM_GROUP;
    fct_foothold at = fct_corner_foothold(mesh, w->corners + begin, end - begin, normal, rim);
    at.sample = fct_shading_lift(w->shading, w->places[at.face], at.sample);
    uint32_t v = FCT_NONE;
    double area = 0;
    for (size_t i = begin; i < end; ++i) {
        uint32_t old = mesh->triangles[w->corners[i]];
        if (w->flags[i] & BEGIN_VERTEX) {
            v = w->flags[i] & ADDED_VERTEX ? (*next)++ : old;
            memcpy(w->out->mesh.positions + 3 * (size_t)v, mesh->positions + 3 * (size_t)old,
                   3 * sizeof(float));
            fct_surface_place(w->out, v, &at);
            area = 0;
        }
        area += measure_corner_area(mesh, w->corners[i]);
        w->out->areas[v] = (float)area;
        w->out->mesh.triangles[w->corners[i]] = v;
    }
}

/* Second pass: positions [begin, end). */
static void fill_positions(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const work *w = user;
    for (size_t v = begin; v < end; ++v) {
        uint32_t next = w->added[v];
        for (size_t i = w->begin[v], group; i < w->begin[v + 1]; i = group) {
            for (group = i + 1; group < w->begin[v + 1] && !(w->flags[group] & BEGIN_GROUP);) ++group;
            fill_group(w, i, group, &next);
        }
    }
}

/* The file's normals at the corners of a face. */
static void load_shades(const work *w, size_t f) {
    fct_shaded_face face;
    fct_shading_face(w->shading, w->places[f], &face);
    for (size_t c = 3 * f; c < 3 * f + 3; ++c)
        v3_store(w->shades + 3 * c, fct_shaded_normal(&face, w->source_uv + 2 * c));
}

static void compute_normals(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const work *w = user;
    for (size_t f = begin; f < end; ++f) {
        const uint32_t *t = w->mesh->triangles + 3 * f;
        v3 a = v3_load(w->mesh->positions + 3 * (size_t)t[0]);
        v3 e1 = v3_sub(v3_load(w->mesh->positions + 3 * (size_t)t[1]), a);
        v3 e2 = v3_sub(v3_load(w->mesh->positions + 3 * (size_t)t[2]), a);
        v3_store(w->normals + 3 * f, v3_unit(v3_cross(e1, e2)));
        if (w->shades) load_shades(w, f);
    }
}

/* Lists the corners at each position, in the order of faces. */
static void list_corners(work *w) {
    const fct_corners *mesh = w->mesh;
    size_t corners = 3 * (size_t)mesh->face_count;
    memset(w->begin, 0, (mesh->vertex_count + (size_t)1) * sizeof *w->begin);
    for (size_t c = 0; c < corners; ++c) ++w->begin[w->first[mesh->triangles[c]] + 1];
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        if (w->begin[v + 1] > w->largest) w->largest = w->begin[v + 1];
        w->begin[v + 1] += w->begin[v];
    }
    /* Shift by one: begin[v + 1] is the next free place of v, and ends as the begin of v + 1. */
    for (size_t v = mesh->vertex_count; v > 0; --v) w->begin[v] = w->begin[v - 1];
    for (size_t c = 0; c < corners; ++c)
        w->corners[w->begin[w->first[mesh->triangles[c]] + 1]++] = (uint32_t)c;
    w->begin[0] = 0;
}

enum { ARRAYS = 8, SCRATCH = 4 };

static void list_arrays(work *w, fct_array out[ARRAYS]) {
    size_t vertices = w->mesh->vertex_count, faces = w->mesh->face_count;
    const bool given = w->shading->rule == FCT_NORMALS_FILE;
    const fct_array arrays[ARRAYS] = {
        FCT_ARRAY(w->first, vertices),     FCT_ARRAY(w->normals, 3 * faces),
        FCT_ARRAY(w->begin, vertices + 1), FCT_ARRAY(w->corners, 3 * faces),
        FCT_ARRAY(w->flags, 3 * faces),    FCT_ARRAY_ZERO(w->taken, vertices),
        FCT_ARRAY(w->added, vertices),     FCT_ARRAY_IF(given, w->shades, 9 * faces),
    };
    memcpy(out, arrays, sizeof arrays);
}

/* Scratch space of all threads. */
static void list_scratch(work *w, size_t threads, fct_array out[SCRATCH]) {
    const fct_array arrays[SCRATCH] = {
        FCT_ARRAY(w->keys, 2 * threads * w->largest),
        FCT_ARRAY(w->values, 2 * threads * w->largest),
        FCT_ARRAY(w->parents, threads * w->largest),
        FCT_ARRAY(w->open, threads * w->largest),
    };
    memcpy(out, arrays, sizeof arrays);
}

/* Numbers the added vertices in the order of positions, and allocates the surface. */
static fct_result make_room(const fct_env *env, work *w) {
    uint64_t total = w->mesh->vertex_count;
    for (size_t v = 0; v < w->mesh->vertex_count; ++v) {
        uint32_t added = w->added[v];
        w->added[v] = (uint32_t)total;
        total += added;
    }
    if (total > FCT_SPLIT_MAX_FACES)
        return fct_fail(env, FCT_ERROR_MEMORY, "a surface has too many vertices");
    fct_result result = fct_surface_allocate(env, (uint32_t)total, w->mesh->face_count, w->out);
    if (result != FCT_OK) return result;
    size_t faces = w->mesh->face_count, vertices = w->mesh->vertex_count;
    w->out->shading = *w->shading;
    memcpy(w->out->mesh.source_faces, w->source_faces, faces * sizeof *w->source_faces);
    memcpy(w->out->mesh.source_uv, w->source_uv, 6 * faces * sizeof *w->source_uv);
    memcpy(w->out->face_places, w->places, faces * sizeof *w->places);
    memcpy(w->out->mesh.positions, w->mesh->positions, 3 * vertices * sizeof(float));
    memcpy(w->out->sample_points, w->mesh->positions, 3 * vertices * sizeof(float));
    return FCT_OK;
}

fct_result fct_surface_vertices(const fct_env *env, const fct_corners *mesh, const uint32_t *source_faces,
                                const float *source_uv, const uint32_t *face_places,
                                const fct_shading *shading, fct_surface *out) {
    *out = (fct_surface){0};
    if (mesh->face_count > UINT32_MAX / 3)
        return fct_fail(env, FCT_ERROR_MEMORY, "a surface of %u triangles has too many corners",
                        mesh->face_count);
    work w = {.mesh = mesh,
              .shading = shading,
              .source_faces = source_faces,
              .places = face_places,
              .source_uv = source_uv,
              .out = out};
    fct_array arrays[ARRAYS], scratch[SCRATCH];
    list_arrays(&w, arrays);
    fct_result result = fct_allocate_all(env, arrays, ARRAYS, "the vertices of a surface");
    if (result != FCT_OK) return result;
    result = fct_weld(env, mesh->vertex_count, mesh->positions, w.first);
    if (result != FCT_OK) goto done;
    fct_parallel_for(env, mesh->face_count, GRAIN, compute_normals, &w);
    list_corners(&w);
    list_scratch(&w, fct_env_threads(env), scratch);
    result = fct_allocate_all(env, scratch, SCRATCH, "the vertices of a surface");
    if (result != FCT_OK) goto done;
    fct_parallel_for(env, mesh->vertex_count, GRAIN, group_positions, &w);
    result = make_room(env, &w);
    if (result == FCT_OK) fct_parallel_for(env, mesh->vertex_count, GRAIN, fill_positions, &w);
    fct_release_all(env, scratch, SCRATCH);
done:
    fct_release_all(env, arrays, ARRAYS);
    return result;
}
