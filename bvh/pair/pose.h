/* bvh/pair/pose.h: arithmetic of poses. */
#ifndef FCT_BVH_POSE_H
#define FCT_BVH_POSE_H

#include "base/math/vec.h"
#include "facetree/collide.h"

static inline v3 fct_rotate(const double m[3][3], v3 p) {
    return v3_make(m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z,
                   m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z,
                   m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z);
}
static inline v3 fct_pose_apply(const fct_pose *pose, v3 p) {
    return v3_add(fct_rotate(pose->rotation, p),
                  v3_make(pose->translation[0], pose->translation[1], pose->translation[2]));
}
static inline v3 fct_matrix_column(const double m[3][3], int i) {
    return v3_make(m[0][i], m[1][i], m[2][i]);
}
static inline double fct_determinant(const double m[3][3]) {
    return v3_dot(fct_matrix_column(m, 0), v3_cross(fct_matrix_column(m, 1), fct_matrix_column(m, 2)));
}
/* Whether the columns are independent beyond rounding. */
static inline bool fct_has_inverse(const double m[3][3]) {
    double size = 1;
    for (int i = 0; i < 3; ++i) size *= v3_norm(fct_matrix_column(m, i));
    return fabs(fct_determinant(m)) > 1e-12 * size;
}

/* The pose of b in the coordinates of a, from those of both in the world. a's rotation has an inverse. */
static inline fct_pose fct_pose_relate(const fct_pose *a, const fct_pose *b) {
    v3 x = fct_matrix_column(a->rotation, 0), y = fct_matrix_column(a->rotation, 1),
       z = fct_matrix_column(a->rotation, 2);
    double over = 1 / fct_determinant(a->rotation);
    v3 inverse[3] = {v3_scale(v3_cross(y, z), over), v3_scale(v3_cross(z, x), over),
                     v3_scale(v3_cross(x, y), over)};
    v3 shift = v3_make(b->translation[0] - a->translation[0], b->translation[1] - a->translation[1],
                       b->translation[2] - a->translation[2]);
    fct_pose out;
    for (int i = 0; i < 3; ++i) {
        out.translation[i] = v3_dot(inverse[i], shift);
        for (int j = 0; j < 3; ++j)
            out.rotation[i][j] = v3_dot(inverse[i], fct_matrix_column(b->rotation, j));
    }
    return out;
}

#endif
