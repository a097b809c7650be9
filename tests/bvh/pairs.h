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

/* A grid over [-1, 1]^2 in the plane x = 1e12, and a pose that puts its lowest corner near a point of the
 * grid z = 0. Double arithmetic in this pose errs by about 1e-4. */
#define FAR_SHEET_X 0x1.d1a94ap39
static inline fct_mesh make_far_sheet(const fct_env *env, uint32_t n) {
    fct_mesh mesh = make_grid(env, n);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * v;
        p[2] = 2 * p[1] - 1, p[1] = 2 * p[0] - 1, p[0] = (float)FAR_SHEET_X;
    }
    return mesh;
}
static inline fct_pose place_far_sheet(uint64_t *seed) {
    fct_pose pose = random_pose(seed, 0);
    const double *low = pose.rotation[2];
    double y = low[1] > 0 ? -1 : 1, z = low[2] > 0 ? -1 : 1;
    for (int k = 0; k < 3; ++k) {
        const double *r = pose.rotation[k];
        double at = k < 2 ? .2 + .6 * random_unit(seed) : 4e-4 * random_unit(seed) - 2e-4;
        pose.translation[k] = at - (r[0] * FAR_SHEET_X + r[1] * y + r[2] * z);
    }
    return pose;
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
