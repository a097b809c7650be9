/* scene/transform.h: affine transforms, stored as 3 rows of four numbers, R|t. */
#ifndef FCT_SCENE_TRANSFORM_H
#define FCT_SCENE_TRANSFORM_H

#include "base/math/vec.h"
#include "facetree/scene.h"

extern const float fct_transform_identity[12];

typedef enum fct_transform_kind {
    FCT_TRANSFORM_GOOD,
    FCT_TRANSFORM_NOT_FINITE,
    FCT_TRANSFORM_SINGULAR /* |det R| <= 1e-6 of the product of the columns' lengths, or the inverse or the
                              normal matrix overflows or vanishes as floats */
} fct_transform_kind;

/* Fills to_world, to_model, normal_matrix, uniform_scale and mirrored of *instance. `inverse` receives
 * to_model in double, for the origins of rays. */
fct_transform_kind fct_transform_set(const float to_world[12], fct_instance *instance, double inverse[12]);

/* out = a b; `out` may be a or b. */
void fct_transform_multiply(const double a[12], const double b[12], double out[12]);
/* out = T R S: scale, then rotate by the unit quaternion x y z w, then translate. */
void fct_transform_compose(const double translate[3], const double quaternion[4], const double scale[3],
                           double out[12]);

static inline v3 fct_transform_point(const float m[12], v3 p) {
    return v3_make(m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
                   m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]);
}
/* R p, without the translation. */
static inline v3 fct_transform_vector(const float m[12], v3 p) {
    return v3_make(m[0] * p.x + m[1] * p.y + m[2] * p.z, m[4] * p.x + m[5] * p.y + m[6] * p.z,
                   m[8] * p.x + m[9] * p.y + m[10] * p.z);
}
/* m is 3 x 3, by rows. */
static inline v3 fct_transform_normal(const float m[9], v3 n) {
    return v3_make(m[0] * n.x + m[1] * n.y + m[2] * n.z, m[3] * n.x + m[4] * n.y + m[5] * n.z,
                   m[6] * n.x + m[7] * n.y + m[8] * n.z);
}

/* Bounds of the transformed surface. They hold every vertex, with slack for rays whose transform is rounded.
 * They are the bounds of the transformed oriented boxes of 256 clusters, or those of the transformed `model`
 * (the tree's bounds) where these are tighter. Errors: DATA (a damaged hierarchy file), MEMORY. */
fct_result fct_transform_bounds(const fct_env *env, const fct_tree *tree, const fct_bounds *model,
                                const float to_world[12], fct_bounds *out);

/* A lower bound of |R x| / |x| over all x. Up to rounding it is exact for scales along the axes and for
 * rotations times a factor; for other transforms it is at least a third of the exact value. */
double fct_transform_shrink(const fct_instance *instance);

#endif
