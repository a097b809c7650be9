/* bench/simplify/defects.c: finds defects from sorted points and sides. O(F log F). */
#include "bench/simplify/defects.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/math/vec.h"
#include "facetree/bvh.h"

/* Two faces at an edge are folded below this angle, 25.8 degrees: a cosine of .9. */
#define FOLD_ANGLE 0.45102681179626
/* A face has no area if twice its area is below this part of the square of its longest side: the rounding of
 * the cross product in double. Corners that are floats on one line stay below. */
#define NO_AREA 1e-15
/* A defect is near one of the input within this part of its longest side, and of the diagonal. */
#define NEAR_SIDE     .5
#define NEAR_DIAGONAL .02

/* --- Points --- */

typedef struct place {
    float at[3];
    uint32_t vertex;
} place;

static int compare_places(const void *x, const void *y) {
    const place *a = x, *b = y;
    for (int k = 0; k < 3; ++k)
        if (a->at[k] != b->at[k]) return a->at[k] < b->at[k] ? -1 : 1;
    return a->vertex < b->vertex ? -1 : a->vertex > b->vertex;
}

/* For each vertex, the lowest vertex at its place. */
static uint32_t *weld_places(const fct_mesh *mesh) {
    place *places = bench_allocate(mesh->vertex_count, sizeof *places);
    uint32_t *points = bench_allocate(mesh->vertex_count, sizeof *points);
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        memcpy(places[v].at, mesh->positions + 3 * (size_t)v, sizeof places[v].at);
        places[v].vertex = v;
    }
    qsort(places, mesh->vertex_count, sizeof *places, compare_places);
    for (size_t i = 0, first = 0; i < mesh->vertex_count; ++i) {
        for (int k = 0; k < 3; ++k)
            if (places[i].at[k] != places[first].at[k]) first = i;
        points[places[i].vertex] = places[first].vertex;
    }
    free(places);
    return points;
}

static v3 position(const fct_mesh *mesh, uint32_t vertex) {
    return v3_load(mesh->positions + 3 * (size_t)vertex);
}

static void add_defect(bench_places *places, bench_defect kind, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t n = places->count[kind]++;
    if ((n & (n - 1)) == 0) { /* full at powers of two */
        size_t room = n ? 2 * (size_t)n : 1;
        uint32_t *grown = realloc(places->corners[kind], 3 * room * sizeof *grown);
        if (!grown) bench_fail("out of memory for %zu defects", room);
        places->corners[kind] = grown;
    }
    uint32_t *to = places->corners[kind] + 3 * (size_t)n;
    to[0] = a, to[1] = b, to[2] = c;
}

/* --- Faces --- */

typedef struct face {
    uint32_t low, middle, high;
} face;

static int compare_faces(const void *x, const void *y) {
    const face *a = x, *b = y;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->middle != b->middle) return a->middle < b->middle ? -1 : 1;
    return a->high < b->high ? -1 : a->high > b->high;
}

static face sort_points(uint32_t a, uint32_t b, uint32_t c) {
    uint32_t low = a < b ? a : b, high = a < b ? b : a;
    return (face){c < low ? c : low, c < low ? low : c < high ? c : high, c < high ? high : c};
}

static bool has_no_area(v3 a, v3 b, v3 c) {
    v3 ab = v3_sub(b, a), ac = v3_sub(c, a), bc = v3_sub(c, b);
    double longest = fmax(fmax(v3_norm2(ab), v3_norm2(ac)), v3_norm2(bc));
    return v3_norm(v3_cross(ab, ac)) <= NO_AREA * longest;
}

/* Finds faces without area and duplicates among the others. Writes the faces of three points to `faces`, in
 * order and without duplicates, and returns their number. */
static uint32_t find_faces(const fct_mesh *mesh, const uint32_t *points, bench_places *places, face *faces) {
    uint32_t count = 0, distinct = 0;
    for (size_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * f;
        uint32_t a = points[t[0]], b = points[t[1]], c = points[t[2]];
        if (has_no_area(position(mesh, a), position(mesh, b), position(mesh, c)))
            add_defect(places, BENCH_FLAT, a, b, c);
        if (a != b && b != c && c != a) faces[count++] = sort_points(a, b, c);
    }
    qsort(faces, count, sizeof *faces, compare_faces);
    for (uint32_t i = 0; i < count; ++i) {
        if (i > 0 && compare_faces(&faces[i], &faces[i - 1]) == 0)
            add_defect(places, BENCH_DUPLICATE, faces[i].low, faces[i].middle, faces[i].high);
        else
            faces[distinct++] = faces[i];
    }
    return distinct;
}

/* --- Edges --- */

typedef struct side {
    uint32_t low, high, apex;
} side;

static int compare_sides(const void *x, const void *y) {
    const side *a = x, *b = y;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->high != b->high) return a->high < b->high ? -1 : 1;
    return a->apex < b->apex ? -1 : a->apex > b->apex;
}

static int compare_angles(const void *x, const void *y) {
    const double *a = x, *b = y;
    return *a < *b ? -1 : *a > *b;
}

/* Whether two of the faces at one edge have less than FOLD_ANGLE between them. The faces are half-planes
 * around the edge: sorted by angle, the nearest two are neighbours.
 *
 *      apex        The picture looks along the edge o. The angle of an apex counts
 *       /          from the first one.
 *      o----first
 */
static bool has_fold(const fct_mesh *mesh, const side *sides, uint32_t count, double *angles) {
    v3 from = position(mesh, sides[0].low), along = v3_sub(position(mesh, sides[0].high), from);
    v3 across = {0, 0, 0}, third = {0, 0, 0};
    uint32_t n = 0;
    for (uint32_t i = 0; i < count; ++i) {
        v3 apex = position(mesh, sides[i].apex);
        if (has_no_area(from, v3_add(from, along), apex)) continue;
        v3 arm = v3_sub(apex, from);
        arm = v3_mad(arm, -v3_dot(arm, along) / v3_norm2(along), along);
        if (n == 0) {
            across = v3_scale(arm, 1 / v3_norm(arm));
            third = v3_scale(v3_cross(along, across), 1 / v3_norm(along));
        }
        angles[n++] = atan2(v3_dot(arm, third), v3_dot(arm, across));
    }
    if (n < 2) return false;
    qsort(angles, n, sizeof *angles, compare_angles);
    double least = angles[0] + 2 * M_PI - angles[n - 1];
    for (uint32_t i = 1; i < n; ++i) least = fmin(least, angles[i] - angles[i - 1]);
    return least < FOLD_ANGLE;
}

static void find_edges(const fct_mesh *mesh, const face *faces, uint32_t count, bench_places *places) {
    size_t side_count = 3 * (size_t)count;
    side *sides = bench_allocate(side_count, sizeof *sides);
    for (size_t f = 0; f < count; ++f) {
        face p = faces[f];
        sides[3 * f] = (side){p.low, p.middle, p.high};
        sides[3 * f + 1] = (side){p.middle, p.high, p.low};
        sides[3 * f + 2] = (side){p.low, p.high, p.middle};
    }
    qsort(sides, side_count, sizeof *sides, compare_sides);
    double *angles = bench_allocate(count, sizeof *angles);
    for (size_t i = 0, end; i < side_count; i = end) {
        const side *s = &sides[i];
        for (end = i + 1; end < side_count && sides[end].low == s->low && sides[end].high == s->high;) ++end;
        if (end == i + 1) add_defect(places, BENCH_BORDER, s->low, s->high, s->high);
        if (end > i + 2) add_defect(places, BENCH_NONMANIFOLD, s->low, s->high, s->high);
        if (has_fold(mesh, s, (uint32_t)(end - i), angles))
            add_defect(places, BENCH_FOLD, s->low, s->high, s->high);
    }
    free(angles);
    free(sides);
}

bench_places bench_find_defects(const fct_mesh *mesh) {
    bench_places places = {0};
    uint32_t *points = weld_places(mesh);
    face *faces = bench_allocate(mesh->face_count, sizeof *faces);
    uint32_t count = find_faces(mesh, points, &places, faces);
    find_edges(mesh, faces, count, &places);
    free(faces);
    free(points);
    return places;
}

void bench_free_places(bench_places *places) {
    for (int kind = 0; kind < BENCH_DEFECTS; ++kind) free(places->corners[kind]);
    *places = (bench_places){0};
}

/* --- Distances to the defects of one kind --- */

typedef struct nearby {
    fct_tree *tree;
    fct_bvh *bvh;
} nearby;

static nearby build_nearby(const fct_env *env, const fct_mesh *mesh, const bench_places *places,
                           bench_defect kind) {
    fct_mesh faces = {.vertex_count = mesh->vertex_count,
                      .face_count = places->count[kind],
                      .positions = mesh->positions,
                      .triangles = places->corners[kind]};
    fct_tree_def def = fct_tree_def_default();
    nearby n = {NULL, NULL};
    bench_check(fct_tree_build(env, &faces, &def, NULL, &n.tree), "a tree of defects");
    bench_check(fct_bvh_create(env, n.tree, FCT_BACKEND_OBB, &n.bvh), "a search for defects");
    return n;
}

static double distance_to(const nearby *n, v3 point) {
    float p[3] = {(float)point.x, (float)point.y, (float)point.z};
    fct_closest closest;
    return fct_bvh_closest_point(n->bvh, p, INFINITY, &closest, NULL) ? (double)closest.distance : INFINITY;
}

static void destroy_nearby(nearby *n) {
    fct_bvh_destroy(n->bvh);
    fct_tree_destroy(n->tree);
}

uint32_t bench_count_new(const fct_env *env, const fct_mesh *input, const bench_places *before,
                         const fct_mesh *mesh, const bench_places *after, bench_defect kind) {
    if (before->count[kind] == 0 || after->count[kind] == 0) return after->count[kind];
    nearby old = build_nearby(env, input, before, kind);
    double reach = NEAR_DIAGONAL * bench_diagonal(input);
    uint32_t count = 0;
    for (size_t i = 0; i < after->count[kind]; ++i) {
        const uint32_t *t = after->corners[kind] + 3 * i;
        v3 a = position(mesh, t[0]), b = position(mesh, t[1]), c = position(mesh, t[2]);
        bool edge = t[1] == t[2];
        v3 middle = edge ? v3_scale(v3_add(a, b), .5) : v3_scale(v3_add(v3_add(a, b), c), 1. / 3);
        double longest = fmax(fmax(v3_norm(v3_sub(b, a)), v3_norm(v3_sub(c, b))), v3_norm(v3_sub(a, c)));
        count += distance_to(&old, middle) > fmin(NEAR_SIDE * longest, reach);
    }
    destroy_nearby(&old);
    return count;
}

static double drift_from(const fct_env *env, const fct_mesh *a, const bench_places *at_a, const fct_mesh *b,
                         const bench_places *at_b) {
    nearby borders = build_nearby(env, a, at_a, BENCH_BORDER);
    double most = 0;
    for (size_t i = 0; i < at_b->count[BENCH_BORDER]; ++i)
        for (int k = 0; k < 2; ++k)
            most = fmax(most,
                        distance_to(&borders, position(b, at_b->corners[BENCH_BORDER][3 * i + (size_t)k])));
    destroy_nearby(&borders);
    return most;
}

double bench_border_drift(const fct_env *env, const fct_mesh *a, const bench_places *at_a, const fct_mesh *b,
                          const bench_places *at_b) {
    bool open_a = at_a->count[BENCH_BORDER] > 0, open_b = at_b->count[BENCH_BORDER] > 0;
    if (!open_a || !open_b) return open_a == open_b ? 0 : INFINITY;
    return fmax(drift_from(env, a, at_a, b, at_b), drift_from(env, b, at_b, a, at_a));
}
