/* partition/face.h: geometry of single faces of a tree, by place. Side 3 place + k runs from corner k to
 * corner k + 1. */
#ifndef FCT_PARTITION_FACE_H
#define FCT_PARTITION_FACE_H

#include "base/math/elementary.h"
#include "base/math/vec.h"
#include "facetree/cluster.h"

#define FCT_HALF_TURN 3.14159265358979323846

static inline v3 fct_face_vector(const fct_tree_view *view, size_t place) {
    const uint32_t *t = view->triangles + 3 * place;
    v3 p = v3_load(view->positions + 3 * (size_t)t[0]), q = v3_load(view->positions + 3 * (size_t)t[1]),
       r = v3_load(view->positions + 3 * (size_t)t[2]);
    return v3_scale(v3_cross(v3_sub(q, p), v3_sub(r, p)), 0.5);
}

static inline double fct_side_length(const fct_tree_view *view, size_t side) {
    const uint32_t *t = view->triangles + side / 3 * 3;
    v3 p = v3_load(view->positions + 3 * (size_t)t[side % 3]),
       q = v3_load(view->positions + 3 * (size_t)t[(side + 1) % 3]);
    return v3_norm(v3_sub(q, p));
}

/* The angle between two vectors; 0 if one of them is 0. Uses the chord of the unit vectors, because the
 * cosine loses small angles. */
static inline double fct_angle(v3 a, v3 b) {
    v3 u = v3_unit(a), v = v3_unit(b);
    if (v3_norm2(u) == 0 || v3_norm2(v) == 0) return 0;
    double chord = v3_norm(v3_sub(u, v));
    return chord < 1.4142 ? 2 * fct_asin(0.5 * chord)
                          : FCT_HALF_TURN - 2 * fct_asin(fmin(0.5 * v3_norm(v3_add(u, v)), 1));
}

/* Whether the face uses a vertex twice. */
static inline bool fct_face_repeats(const fct_tree_view *view, size_t place) {
    const uint32_t *t = view->triangles + 3 * place;
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

#endif
