/* dual/winding.c: finds and turns closed bodies that are wound inwards.
 *
 * 1. The sides of all faces, in terms of welded vertices, are sorted by their ends. Faces that share a side
 * belong to one body. A body is closed if each side has exactly two faces, which use it in opposite
 * directions.
 * 2. The volume of a closed body is the sum of the tetrahedra from a point of it to its faces. It is negative
 * if the body is wound inwards.
 * 3. A body of negative volume inside the bounds of a body of positive volume is a cavity, and right as it
 * is. Cost: O(F), a sort of 3 F keys, and 64 comparisons per body of negative volume.
 */
#include <math.h>

#include "base/env.h"
#include "base/key.h"
#include "base/math/vec.h"
#include "base/sort.h"
#include "base/union_find.h"
#include "facetree/dual.h"

/* A volume below this share of the sum of its terms' magnitudes is 0: a flat body. */
#define FLAT 1e-9

enum { SHELLS = 64 }; /* the largest bodies, in which cavities are searched */

typedef struct body {
    double volume, magnitude; /* times 6; magnitude: sum of the terms' magnitudes */
    bool inward;
    float lower[3], upper[3];
    uint32_t origin; /* a vertex */
} body;

typedef struct finder {
    const fct_mesh *mesh;
    const uint32_t *triangles; /* welded */
    uint32_t *parents;         /* per face: disjoint sets of bodies */
    uint32_t *numbers;         /* per face: its body; FCT_NONE if that is not closed */
    uint8_t *open;             /* per face: it has a side that makes its body not closed */
    body *bodies;
    uint32_t body_count;
    uint64_t *keys;
    uint32_t *order;
} finder;

/* Sorts the sides by their ends and joins the faces of each edge. */
static fct_result join_faces(const fct_env *env, finder *f) {
    size_t count = 3 * (size_t)f->mesh->face_count;
    const uint32_t *t = f->triangles;
    for (uint32_t c = 0; c < count; ++c) {
        f->keys[c] = fct_pair_key(t[c], t[c % 3 == 2 ? c - 2 : c + 1]);
        f->order[c] = c;
    }
    fct_result result = fct_sort_pairs(env, f->keys, f->order, count);
    if (result != FCT_OK) return result;
    fct_sets_create(f->parents, f->mesh->face_count);
    for (size_t i = 0, end; i < count; i = end) {
        for (end = i + 1; end < count && f->keys[end] == f->keys[i];) ++end;
        uint32_t a = f->order[i], b = f->order[end - 1];
        bool closed = end == i + 2 && a / 3 != b / 3 && t[a] != t[b];
        for (size_t k = i; k < end; ++k) {
            fct_sets_join(f->parents, a / 3, f->order[k] / 3);
            if (!closed) f->open[f->order[k] / 3] = 1;
        }
    }
    return FCT_OK;
}

/* Numbers the closed bodies; the faces of others get FCT_NONE. */
static void number_bodies(finder *f) {
    uint32_t faces = f->mesh->face_count;
    for (uint32_t i = 0; i < faces; ++i)
        if (f->open[i]) f->open[fct_sets_find(f->parents, i)] = 1;
    f->body_count = 0;
    for (uint32_t i = 0; i < faces; ++i) { /* the root of a body is its first face */
        uint32_t root = fct_sets_find(f->parents, i);
        if (root == i) f->numbers[i] = f->open[i] ? FCT_NONE : f->body_count++;
        f->numbers[i] = f->numbers[root];
    }
}

static void measure_bodies(finder *f) {
    for (uint32_t i = 0; i < f->body_count; ++i)
        f->bodies[i] = (body){.lower = {INFINITY, INFINITY, INFINITY},
                              .upper = {-INFINITY, -INFINITY, -INFINITY},
                              .origin = FCT_NONE};
    for (uint32_t i = 0; i < f->mesh->face_count; ++i) {
        if (f->numbers[i] == FCT_NONE) continue;
        body *b = &f->bodies[f->numbers[i]];
        const uint32_t *t = f->triangles + 3 * (size_t)i;
        if (b->origin == FCT_NONE) b->origin = t[0];
        v3 origin = v3_load(f->mesh->positions + 3 * (size_t)b->origin), p[3];
        for (int k = 0; k < 3; ++k) {
            const float *at = f->mesh->positions + 3 * (size_t)t[k];
            p[k] = v3_sub(v3_load(at), origin);
            for (int c = 0; c < 3; ++c) {
                if (at[c] < b->lower[c]) b->lower[c] = at[c];
                if (at[c] > b->upper[c]) b->upper[c] = at[c];
            }
        }
        double term = v3_dot(p[0], v3_cross(p[1], p[2]));
        b->volume += term, b->magnitude += fabs(term);
    }
}

static bool is_inside(const body *inner, const body *outer) {
    for (int c = 0; c < 3; ++c)
        if (!(inner->lower[c] > outer->lower[c] && inner->upper[c] < outer->upper[c])) return false;
    return true;
}

/* Lists the largest bodies of positive volume, the largest first. Returns their number. */
static uint32_t list_shells(const finder *f, const body *shells[SHELLS]) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < f->body_count; ++i) {
        const body *b = &f->bodies[i];
        if (!(b->volume > FLAT * b->magnitude)) continue;
        if (count == SHELLS && b->volume <= shells[SHELLS - 1]->volume) continue;
        uint32_t k = count < SHELLS ? count++ : SHELLS - 1;
        for (; k > 0 && shells[k - 1]->volume < b->volume; --k) shells[k] = shells[k - 1];
        shells[k] = b;
    }
    return count;
}

/* Marks the bodies that are wound inwards. Returns their number. */
static uint32_t select_inward(finder *f) {
    const body *shells[SHELLS];
    uint32_t shell_count = list_shells(f, shells), inward = 0;
    for (uint32_t i = 0; i < f->body_count; ++i) {
        body *b = &f->bodies[i];
        b->inward = b->volume < -FLAT * b->magnitude;
        for (uint32_t k = 0; k < shell_count && b->inward; ++k) b->inward = !is_inside(b, shells[k]);
        inward += b->inward;
    }
    return inward;
}

static fct_result find_bodies(const fct_env *env, finder *f, uint32_t *count, uint8_t *faces) {
    fct_result result = join_faces(env, f);
    if (result != FCT_OK) return result;
    number_bodies(f);
    f->bodies = fct_allocate(env, f->body_count, sizeof *f->bodies);
    if (!f->bodies) return fct_fail_memory(env, "the bodies of a mesh");
    measure_bodies(f);
    *count = select_inward(f);
    for (uint32_t i = 0; i < f->mesh->face_count && faces; ++i)
        faces[i] = f->numbers[i] != FCT_NONE && f->bodies[f->numbers[i]].inward;
    return FCT_OK;
}

fct_result fct_inward_find(const fct_env *env, const fct_mesh *mesh, uint32_t *count, uint8_t *faces) {
    *count = 0;
    finder f = {.mesh = mesh};
    fct_weld weld;
    fct_result result = fct_weld_build(env, mesh, &weld);
    if (result != FCT_OK) return result;
    size_t face_count = mesh->face_count;
    f.triangles = weld.triangles ? weld.triangles : mesh->triangles;
    const fct_array arrays[] = {FCT_ARRAY(f.parents, face_count), FCT_ARRAY(f.numbers, face_count),
                                FCT_ARRAY_ZERO(f.open, face_count), FCT_ARRAY(f.keys, 3 * face_count),
                                FCT_ARRAY(f.order, 3 * face_count)};
    result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the bodies of a mesh");
    if (result == FCT_OK) result = find_bodies(env, &f, count, faces);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    fct_release(env, f.bodies);
    fct_weld_release(env, &weld);
    return result;
}

static void swap_floats(float *a, float *b, uint32_t count) {
    for (uint32_t k = 0; k < count; ++k) {
        float swap = a[k];
        a[k] = b[k], b[k] = swap;
    }
}

/* Exchanges the last two corners of the marked faces. */
static void turn_faces(fct_mesh *mesh, const uint8_t *faces) {
    for (size_t f = 0; f < mesh->face_count; ++f) {
        if (!faces[f]) continue;
        uint32_t *t = mesh->triangles + 3 * f, swap = t[1];
        t[1] = t[2], t[2] = swap;
        if (mesh->texcoords) swap_floats(mesh->texcoords + 6 * f + 2, mesh->texcoords + 6 * f + 4, 2);
        if (mesh->corner_normals)
            swap_floats(mesh->corner_normals + 9 * f + 3, mesh->corner_normals + 9 * f + 6, 3);
    }
}

/* Twice the area vector of a face. */
static v3 find_cross(const fct_mesh *mesh, size_t f) {
    const uint32_t *t = mesh->triangles + 3 * f;
    const v3 p = v3_load(mesh->positions + 3 * (size_t)t[0]);
    return v3_cross(v3_sub(v3_load(mesh->positions + 3 * (size_t)t[1]), p),
                    v3_sub(v3_load(mesh->positions + 3 * (size_t)t[2]), p));
}

/* Negates the normals of the corners of marked faces that point away from the side of their face. */
static void turn_corner_normals(fct_mesh *mesh, const uint8_t *faces) {
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c) {
        float *n = mesh->corner_normals + 3 * c;
        if (faces[c / 3] && v3_dot(find_cross(mesh, c / 3), v3_load(n)) < 0)
            v3_store(n, v3_scale(v3_load(n), -1));
    }
}

/* Negates the normals of marked faces that point away from the side of their faces. sums: vertex_count x 3,
 * zero. */
static void turn_normals(fct_mesh *mesh, const uint8_t *faces, double *sums) {
    for (size_t f = 0; f < mesh->face_count; ++f) {
        if (!faces[f]) continue;
        const uint32_t *t = mesh->triangles + 3 * f;
        const v3 n = find_cross(mesh, f);
        for (int k = 0; k < 3; ++k) {
            double *sum = sums + 3 * (size_t)t[k];
            sum[0] += n.x, sum[1] += n.y, sum[2] += n.z;
        }
    }
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        float *n = mesh->normals + 3 * v;
        double dot = n[0] * sums[3 * v] + n[1] * sums[3 * v + 1] + n[2] * sums[3 * v + 2];
        for (int k = 0; k < 3 && dot < 0; ++k) n[k] = -n[k];
    }
}

fct_result fct_inward_flip(const fct_env *env, fct_mesh *mesh, uint32_t *count) {
    uint8_t *faces;
    double *sums;
    *count = 0;
    const fct_array arrays[] = {FCT_ARRAY(faces, mesh->face_count),
                                FCT_ARRAY_ZERO(sums, mesh->normals ? 3 * (size_t)mesh->vertex_count : 0)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the bodies of a mesh");
    if (result == FCT_OK) result = fct_inward_find(env, mesh, count, faces);
    if (result == FCT_OK && *count) {
        turn_faces(mesh, faces);
        if (mesh->normals) turn_normals(mesh, faces, sums);
        if (mesh->corner_normals) turn_corner_normals(mesh, faces);
    }
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}
