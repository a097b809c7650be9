/* scene/transform.c: transforms of instances, computed in double and rounded once.
 *
 * R takes the area vector n of a triangle to cof(R) n, where cof(R) = det(R) R^-T. Under a reflection the
 * result of an outward vector points into a closed model.
 */
#include "scene/transform.h"

#include <float.h>
#include <string.h>

#include "base/env.h"
#include "base/math/round.h"
#include "facetree/partition.h"

const float fct_transform_identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

enum { CUT = 256 }; /* clusters whose boxes bound an instance */

/* Relative differences of R^T R from a multiple of the identity below this count as rounding of floats. */
#define UNIFORM_TOLERANCE 1e-5
/* |det R| over the product of the columns' lengths. */
#define SINGULAR_RATIO 1e-6
/* Margin of a box, as a share of its coordinates. A transformed ray has a float origin, which errs by less
 * than 2^-23 of the coordinates per axis. */
#define RAY_SLACK 1e-6

static bool all_finite(const float *values, int count) {
    for (int i = 0; i < count; ++i)
        if (!isfinite(values[i])) return false;
    return true;
}

/* The factor s if R is s times a rotation or reflection, else 0. */
static double find_uniform_scale(const v3 column[3]) {
    double square = (v3_norm2(column[0]) + v3_norm2(column[1]) + v3_norm2(column[2])) / 3;
    for (int i = 0; i < 3; ++i) {
        if (fabs(v3_norm2(column[i]) - square) > UNIFORM_TOLERANCE * square) return 0;
        if (fabs(v3_dot(column[i], column[(i + 1) % 3])) > UNIFORM_TOLERANCE * square) return 0;
    }
    return sqrt(square);
}

fct_transform_kind fct_transform_set(const float m[12], fct_instance *instance, double inverse[12]) {
    if (!all_finite(m, 12)) return FCT_TRANSFORM_NOT_FINITE;
    v3 column[3], cofactor[3];
    for (int j = 0; j < 3; ++j) column[j] = v3_make(m[j], m[4 + j], m[8 + j]);
    for (int j = 0; j < 3; ++j) cofactor[j] = v3_cross(column[(j + 1) % 3], column[(j + 2) % 3]);
    double det = v3_dot(column[0], cofactor[0]);
    double volume = v3_norm(column[0]) * v3_norm(column[1]) * v3_norm(column[2]);
    if (!(fabs(det) > SINGULAR_RATIO * volume)) return FCT_TRANSFORM_SINGULAR;
    v3 t = v3_make(m[3], m[7], m[11]);
    for (int j = 0; j < 3; ++j) { /* column j of the cofactors over det is row j of the inverse */
        v3 row = v3_scale(cofactor[j], 1 / det);
        double four[4] = {row.x, row.y, row.z, -v3_dot(row, t)};
        memcpy(inverse + 4 * j, four, sizeof four);
    }
    memcpy(instance->to_world, m, sizeof instance->to_world);
    for (int i = 0; i < 12; ++i) instance->to_model[i] = (float)inverse[i];
    for (int j = 0; j < 3; ++j) {
        instance->normal_matrix[j] = (float)cofactor[j].x;
        instance->normal_matrix[3 + j] = (float)cofactor[j].y;
        instance->normal_matrix[6 + j] = (float)cofactor[j].z;
    }
    if (!all_finite(instance->to_model, 12) || !all_finite(instance->normal_matrix, 9))
        return FCT_TRANSFORM_SINGULAR;
    for (int j = 0; j < 3; ++j)
        if (v3_norm(cofactor[j]) < (double)FLT_MIN) return FCT_TRANSFORM_SINGULAR;
    instance->uniform_scale = (float)find_uniform_scale(column);
    instance->mirrored = det < 0;
    return FCT_TRANSFORM_GOOD;
}

void fct_transform_multiply(const double a[12], const double b[12], double out[12]) {
    double result[12];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j) {
            const double *row = a + 4 * i;
            result[4 * i + j] = row[0] * b[j] + row[1] * b[4 + j] + row[2] * b[8 + j] + (j == 3 ? row[3] : 0);
        }
    memcpy(out, result, sizeof result);
}

void fct_transform_compose(const double translate[3], const double q[4], const double scale[3],
                           double out[12]) {
    double x = q[0], y = q[1], z = q[2], w = q[3];
    double rotation[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
                          2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                          2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) out[4 * i + j] = rotation[3 * i + j] * scale[j];
        out[4 * i + 3] = translate[i];
    }
}

/* Grows bounds by the image of an oriented box, with slack. */
static void add_transformed_box(const float m[12], const fct_box *box, double lower[3], double upper[3]) {
    v3 center = fct_transform_point(m, v3_load(box->center));
    double c[3] = {center.x, center.y, center.z}, extent[3] = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
        v3 axis = v3_scale(fct_transform_vector(m, v3_load(box->axes[k])), box->half[k]);
        extent[0] += fabs(axis.x), extent[1] += fabs(axis.y), extent[2] += fabs(axis.z);
    }
    for (int i = 0; i < 3; ++i) {
        double slack = RAY_SLACK * (fabs(c[i]) + extent[0] + extent[1] + extent[2]);
        lower[i] = fmin(lower[i], c[i] - extent[i] - slack);
        upper[i] = fmax(upper[i], c[i] + extent[i] + slack);
    }
}

fct_result fct_transform_bounds(const fct_env *env, const fct_tree *tree, const fct_bounds *model,
                                const float to_world[12], fct_bounds *out) {
    if (memcmp(to_world, fct_transform_identity, sizeof fct_transform_identity) == 0) {
        *out = *model;
        return FCT_OK;
    }
    double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
    double tight_lower[3] = {INFINITY, INFINITY, INFINITY},
           tight_upper[3] = {-INFINITY, -INFINITY, -INFINITY};
    fct_box whole = {.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (int i = 0; i < 3; ++i) {
        whole.center[i] = (float)fct_round(.5 * ((double)model->lower[i] + model->upper[i]));
        float below = whole.center[i] - model->lower[i], above = model->upper[i] - whole.center[i];
        whole.half[i] = below > above ? below : above;
    }
    add_transformed_box(to_world, &whole, lower, upper);

    fct_tree_view view = fct_tree_get(tree);
    uint32_t count = view.root_count > CUT ? view.root_count : CUT;
    uint32_t *nodes = fct_allocate(env, count, sizeof *nodes);
    if (!nodes) return fct_fail_memory(env, "the bounds of a scene");
    fct_result result = fct_tree_partition(env, tree, count, nodes, &count);
    for (uint32_t k = 0; k < count && result == FCT_OK; ++k) {
        fct_cluster cluster;
        fct_box box;
        result = fct_tree_cluster(tree, nodes[k], &cluster);
        fct_cluster_box(&cluster, &box);
        add_transformed_box(to_world, &box, tight_lower, tight_upper);
    }
    fct_release(env, nodes);
    if (result != FCT_OK) return result;
    for (int i = 0; i < 3; ++i) { /* both bounds hold the surface, so their intersection does */
        out->lower[i] = nextafterf((float)fmax(lower[i], tight_lower[i]), -INFINITY);
        out->upper[i] = nextafterf((float)fmin(upper[i], tight_upper[i]), INFINITY);
    }
    return FCT_OK;
}

double fct_transform_shrink(const fct_instance *instance) {
    /* A uniform R may differ from a rotation by UNIFORM_TOLERANCE. */
    if (instance->uniform_scale > 0) return instance->uniform_scale * (1 - 2 * UNIFORM_TOLERANCE);
    /* The least stretch of R is 1 / |R^-1|_2, and |R^-1|_2 <= sqrt(|R^-1|_1 |R^-1|_inf). The factor covers
     * the rounding of to_model. */
    double row = 0, column = 0;
    for (int i = 0; i < 3; ++i) {
        const float *m = instance->to_model;
        row = fmax(row, fabs(m[4 * i]) + fabs(m[4 * i + 1]) + fabs(m[4 * i + 2]));
        column = fmax(column, fabs(m[i]) + fabs(m[4 + i]) + fabs(m[8 + i]));
    }
    return (1 - 1e-6) / sqrt(row * column);
}
