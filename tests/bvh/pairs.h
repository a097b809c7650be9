/* tests/bvh/pairs.h: models and poses for the tests of queries on two models. */
#ifndef FCT_TESTS_BVH_PAIRS_H
#define FCT_TESTS_BVH_PAIRS_H

#include "models.h"

#include "facetree/collide.h"

static inline model pair_model_make(const fct_env *env, fct_mesh mesh) {
    model m = {.mesh = mesh};
    fct_tree_def def = fct_tree_def_default();
    fct_bvh_def parts = fct_bvh_def_default();
    def.weld = false;
    parts.parts = FCT_BVH_PAIRS | FCT_BVH_SIGN;
    assert_int_equal(fct_tree_build(env, &mesh, &def, NULL, &m.tree), FCT_OK);
    assert_int_equal(fct_bvh_build(env, m.tree, &parts, &m.bvh), FCT_OK);
    return m;
}

/* A rotation by a random quaternion, and a shift by up to `far` in each coordinate. */
static inline fct_pose random_pose(uint64_t *seed, double far) {
    double q[4], length = 0;
    do {
        length = 0;
        for (int i = 0; i < 4; ++i) q[i] = 2 * random_unit(seed) - 1, length += q[i] * q[i];
    } while (length > 1 || length < .01);
    for (int i = 0; i < 4; ++i) q[i] /= sqrt(length);
    double w = q[0], x = q[1], y = q[2], z = q[3];
    fct_pose pose = {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                      {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                      {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}},
                     {0, 0, 0}};
    for (int k = 0; k < 3; ++k) pose.translation[k] = far * (2 * random_unit(seed) - 1);
    return pose;
}

/* As the header says: rounded once per operation. */
static inline v3 pose_point(const fct_pose *pose, v3 p) {
    double out[3];
    for (int k = 0; k < 3; ++k) {
        const double *r = pose->rotation[k];
        double sum = r[0] * p.x + r[1] * p.y;
        sum = sum + r[2] * p.z;
        out[k] = sum + pose->translation[k];
    }
    return v3_make(out[0], out[1], out[2]);
}

static inline void posed_corners(const fct_mesh *mesh, const fct_pose *pose, uint32_t face, v3 p[3]) {
    face_corners(mesh, face, p);
    for (int c = 0; c < 3; ++c) p[c] = pose_point(pose, p[c]);
}

/* The inverse of a rigid pose. */
static inline fct_pose invert_pose(const fct_pose *pose) {
    fct_pose out;
    for (int i = 0; i < 3; ++i) {
        out.translation[i] = 0;
        for (int j = 0; j < 3; ++j) {
            out.rotation[i][j] = pose->rotation[j][i];
            out.translation[i] -= pose->rotation[j][i] * pose->translation[j];
        }
    }
    return out;
}

#endif
