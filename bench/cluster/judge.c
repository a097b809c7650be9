/* bench/cluster/judge.c: measures a partition from triangles and labels.
 *
 * Independent of the library's own measure, and the same for all builders. Sums are in double. Covariances
 * are about the first corner of the cluster and then move to its centroid. Borders come from the dual graph.
 * O(F log F).
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/math/vec.h"
#include "bench/cluster/bench.h"
#include "facetree/dual.h"

typedef struct sums {
    double area, perimeter;
    v3 vector, origin, first; /* S; a corner of the cluster; integral of x - origin */
    double second[6];         /* integral of (x - origin)(x - origin)^T */
    uint32_t faces;
} sums;

static void add_face(sums *s, const fct_mesh *mesh, uint32_t face) {
    v3 p[3];
    for (size_t k = 0; k < 3; ++k)
        p[k] = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)face + k]);
    if (s->faces++ == 0) s->origin = p[0];
    v3 a = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), .5), sum = {0, 0, 0};
    double area = v3_norm(a);
    for (size_t k = 0; k < 3; ++k) {
        p[k] = v3_sub(p[k], s->origin);
        sum = v3_add(sum, p[k]);
        sym3_add_outer(s->second, area / 12, p[k]);
    }
    sym3_add_outer(s->second, area / 12, sum);
    s->first = v3_mad(s->first, area / 3, sum);
    s->vector = v3_add(s->vector, a);
    s->area += area;
}

typedef struct corners {
    uint32_t low, middle, high, face;
    int turn; /* orientation of the corners: 1 or -1 */
} corners;

static corners sort_corners(const uint32_t *t, uint32_t face) {
    corners c = {t[0], t[1], t[2], face, 1};
    for (int i = 0; i < 3; ++i) {
        uint32_t *first = i == 1 ? &c.middle : &c.low, *second = i == 1 ? &c.high : &c.middle, swap = *first;
        if (*first > *second) *first = *second, *second = swap, c.turn = -c.turn;
    }
    return c;
}

static int compare_corners(const void *x, const void *y) {
    const corners *a = x, *b = y;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->middle != b->middle) return a->middle < b->middle ? -1 : 1;
    if (a->high != b->high) return a->high < b->high ? -1 : 1;
    return a->face < b->face ? -1 : a->face > b->face;
}

bool *bench_single_faces(const fct_mesh *mesh) {
    bool *single = bench_allocate(mesh->face_count, sizeof *single);
    corners *all = bench_allocate(mesh->face_count, sizeof *all);
    for (uint32_t f = 0; f < mesh->face_count; ++f) all[f] = sort_corners(mesh->triangles + 3 * (size_t)f, f);
    qsort(all, mesh->face_count, sizeof *all, compare_corners);
    for (size_t i = 0, end; i < mesh->face_count; i = end) {
        int sum = 0;
        for (end = i; end < mesh->face_count && all[end].low == all[i].low &&
                      all[end].middle == all[i].middle && all[end].high == all[i].high;
             ++end)
            sum += all[end].turn;
        bool flat = all[i].low == all[i].middle || all[i].middle == all[i].high;
        single[all[i].face] = sum != 0 && !flat;
    }
    free(all);
    return single;
}

/* Adds the borders of the whole mesh. Doubled faces count: their sides are borders of their clusters. */
static void add_borders(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels, sums *all) {
    fct_dual dual;
    bench_check(fct_dual_build(env, mesh, &dual), "the dual graph");
    for (uint32_t f = 0; f < mesh->face_count; ++f)
        if (labels[f] != FCT_NONE) all[labels[f]].perimeter += (double)dual.perimeters[f];
    for (size_t e = 0; e < dual.edge_count; ++e) {
        uint32_t a = labels[dual.edges[2 * e]], b = labels[dual.edges[2 * e + 1]];
        if (a == b && a != FCT_NONE) all[a].perimeter -= 2 * (double)dual.lengths[e];
    }
    fct_dual_release(env, &dual);
}

static double least_moment(const sums *s) {
    double m[6], values[3], vectors[3][3];
    memcpy(m, s->second, sizeof m);
    sym3_add_outer(m, -1 / s->area, s->first);
    bench_eigen(m, values, vectors);
    return fmax(values[0], 0);
}

bench_quality bench_judge(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                          uint32_t label_count) {
    sums *all = bench_allocate(label_count, sizeof *all);
    bool *single = bench_single_faces(mesh);
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        if (labels[f] >= label_count && (labels[f] != FCT_NONE || single[f]))
            bench_fail("face %u has label %u of %u", f, labels[f], label_count);
        if (single[f]) add_face(&all[labels[f]], mesh, f);
    }
    add_borders(env, mesh, labels, all);
    double area = 0, diagonal = bench_diagonal(mesh);
    bench_quality q = {0};
    for (uint32_t i = 0; i < label_count; ++i) {
        const sums *s = &all[i];
        q.clusters += s->faces > 0;
        if (!(s->area > 0)) continue;
        q.deviation += 2 * fmax(s->area - v3_norm(s->vector), 0);
        q.fit += least_moment(s) / (diagonal * diagonal);
        q.irregularity += fmax(s->perimeter, 0) * fmax(s->perimeter, 0) / (4 * M_PI);
        area += s->area;
    }
    if (area > 0) q.deviation /= area, q.fit /= area, q.irregularity /= area;
    free(all);
    free(single);
    return q;
}
