/* partition/chart/chart.h: what the steps of making charts share. */
#ifndef FCT_CLUSTER_CHART_H
#define FCT_CLUSTER_CHART_H

#include "base/math/elementary.h"
#include "base/math/vec.h"
#include "cluster/tree/node.h"
#include "facetree/partition.h"
#include "partition/sides.h"

#define FCT_HALF_TURN 3.14159265358979323846

typedef struct fct_charter {
    const fct_tree *tree;
    const fct_tree_view *view; /* of the tree */
    fct_chart_def def;
    fct_sides sides;  /* by place */
    uint32_t *labels; /* chart of each place; charts are numbered by first place */
    uint32_t count;   /* of charts */
} fct_charter;

/* Area vector of the face at a place. */
static inline v3 fct_face_vector(const fct_tree_view *view, size_t place) {
    const uint32_t *t = view->triangles + 3 * place;
    v3 p = v3_load(view->positions + 3 * (size_t)t[0]), q = v3_load(view->positions + 3 * (size_t)t[1]),
       r = v3_load(view->positions + 3 * (size_t)t[2]);
    return v3_scale(v3_cross(v3_sub(q, p), v3_sub(r, p)), 0.5);
}

/* Length of side 3 place + k. */
static inline double fct_side_length(const fct_tree_view *view, size_t side) {
    const uint32_t *t = view->triangles + side / 3 * 3;
    v3 p = v3_load(view->positions + 3 * (size_t)t[side % 3]),
       q = v3_load(view->positions + 3 * (size_t)t[(side + 1) % 3]);
    return v3_norm(v3_sub(q, p));
}

/* Angle between two vectors by the chord of their unit vectors, which keeps small angles; 0 where one of them
 * is 0. */
static inline double fct_angle(v3 a, v3 b) {
    v3 u = v3_unit(a), v = v3_unit(b);
    if (v3_norm2(u) == 0 || v3_norm2(v) == 0) return 0;
    double chord = v3_norm(v3_sub(u, v));
    return chord < 1.4142 ? 2 * fct_asin(0.5 * chord)
                          : FCT_HALF_TURN - 2 * fct_asin(fmin(0.5 * v3_norm(v3_add(u, v)), 1));
}

/* Whether the face at a place has a vertex twice. */
static inline bool fct_face_repeats(const fct_tree_view *view, size_t place) {
    const uint32_t *t = view->triangles + 3 * place;
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

/* Merges neighbouring charts whose union is a chart by c->def; relabels. Errors: MEMORY, CANCELLED. */
fct_result fct_charts_merge(const fct_env *env, fct_charter *c);

/* Counts what there is, from labels and triangles alone: charts, non_disks, largest_faces, largest_angle and
 * lengths of *stats. Errors: MEMORY. */
fct_result fct_charts_audit(const fct_env *env, const fct_charter *c, fct_chart_stats *stats);

#endif
