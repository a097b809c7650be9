/* Transforms against direct formulas in double: composition, inverse, normals, scales, and bounds. */
#include "support.h"

#include "facetree/scene.h"
#include "scene/scene.h"
#include "scene/transform.h"

static uint64_t state = 1;
static double between(double a, double b) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return a + (b - a) * (double)(state >> 11) * 0x1p-53;
}

static v3 random_unit_vector(void) {
    v3 a;
    do {
        a = v3_make(between(-1, 1), between(-1, 1), between(-1, 1));
    } while (v3_norm(a) > 1 || v3_norm(a) < .1);
    return v3_unit(a);
}

/* Rodrigues: p cos(a) + (k x p) sin(a) + k (k . p) (1 - cos(a)). */
static v3 rotate(v3 k, double angle, v3 p) {
    v3 out = v3_scale(p, cos(angle));
    out = v3_mad(out, sin(angle), v3_cross(k, p));
    return v3_mad(out, v3_dot(k, p) * (1 - cos(angle)), k);
}

static v3 apply(const double m[12], v3 p) {
    return v3_make(m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
                   m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]);
}

static void compose(v3 axis, double angle, const double scale[3], const double translate[3], float out[12]) {
    double s = sin(angle / 2), q[4] = {s * axis.x, s * axis.y, s * axis.z, cos(angle / 2)}, m[12];
    fct_transform_compose(translate, q, scale, m);
    for (int k = 0; k < 12; ++k) out[k] = (float)m[k];
}

static void composition_scales_then_rotates_then_moves(void **unused) {
    (void)unused;
    for (int i = 0; i < 500; ++i) {
        v3 axis = random_unit_vector(), p = {between(-2, 2), between(-2, 2), between(-2, 2)};
        double angle = between(-7, 7), m[12], n[12], both[12];
        double s = sin(angle / 2), q[4] = {s * axis.x, s * axis.y, s * axis.z, cos(angle / 2)};
        double scale[3] = {between(-2, 2), between(-2, 2), between(-2, 2)};
        double t[3] = {between(-9, 9), between(-9, 9), between(-9, 9)};
        fct_transform_compose(t, q, scale, m);
        v3 scaled = {scale[0] * p.x, scale[1] * p.y, scale[2] * p.z};
        v3 expected = v3_add(rotate(axis, angle, scaled), v3_make(t[0], t[1], t[2]));
        assert_true(v3_norm(v3_sub(apply(m, p), expected)) < 1e-13);
        for (int k = 0; k < 12; ++k) n[k] = between(-2, 2);
        fct_transform_multiply(n, m, both);
        assert_true(v3_norm(v3_sub(apply(both, p), apply(n, apply(m, p)))) < 1e-12);
        fct_transform_multiply(n, m, m); /* the output may be an input */
        assert_memory_equal(m, both, sizeof m);
    }
}

static void an_instance_has_inverse_normals_and_side(void **unused) {
    (void)unused;
    for (int i = 0; i < 500; ++i) {
        float m[12];
        double inverse[12];
        fct_instance instance;
        for (int k = 0; k < 12; ++k) m[k] = (float)between(-2, 2);
        v3 x = {m[0], m[4], m[8]}, y = {m[1], m[5], m[9]}, z = {m[2], m[6], m[10]};
        double det = v3_dot(x, v3_cross(y, z));
        if (fabs(det) < .1) continue;
        assert_int_equal(fct_transform_set(m, &instance, inverse), FCT_TRANSFORM_GOOD);
        assert_memory_equal(instance.to_world, m, sizeof m);
        assert_int_equal(instance.mirrored, det < 0);
        assert_true(instance.uniform_scale == 0);
        v3 p = {between(-2, 2), between(-2, 2), between(-2, 2)}, e = random_unit_vector(),
           f = random_unit_vector();
        assert_true(v3_norm(v3_sub(apply(inverse, fct_transform_point(m, p)), p)) < 1e-12);
        for (int k = 0; k < 12; ++k) assert_true(instance.to_model[k] == (float)inverse[k]);
        /* The area vector of a transformed triangle. */
        v3 area = v3_cross(fct_transform_vector(m, e), fct_transform_vector(m, f));
        v3 got = fct_transform_normal(instance.normal_matrix, v3_cross(e, f));
        assert_true(v3_norm(v3_sub(got, area)) < 1e-5);
    }
}

static fct_transform_kind kind_of(const float m[12], fct_instance *instance) {
    double inverse[12];
    return fct_transform_set(m, instance, inverse);
}

/* Singular: |det R| is at most 1e-6 of the product of the columns' lengths. */
static void singular_and_endless_transforms_are_told(void **unused) {
    (void)unused;
    fct_instance instance;
    for (int k = 0; k < 12; ++k) {
        float m[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        m[k] = k % 2 ? NAN : INFINITY;
        assert_int_equal(kind_of(m, &instance), FCT_TRANSFORM_NOT_FINITE);
    }
    for (int scale = -3; scale <= 3; ++scale)
        for (int k = 0; k < 2; ++k) {
            float s = powf(10, (float)scale), lean = k ? 1.1e-6f : .9e-6f;
            float m[12] = {s, s, 0, 5, 0, s * lean, 0, 5, 0, 0, s, 5};
            assert_int_equal(kind_of(m, &instance), k ? FCT_TRANSFORM_GOOD : FCT_TRANSFORM_SINGULAR);
        }
    for (int k = 0; k < 4; ++k) { /* area factors beyond a float */
        float s = k == 0 ? 1e20f : k == 1 ? 1e-20f : k == 2 ? 1e18f : 1e-18f;
        float m[12] = {s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0};
        assert_int_equal(kind_of(m, &instance), k < 2 ? FCT_TRANSFORM_SINGULAR : FCT_TRANSFORM_GOOD);
    }
}

/* The smallest |R x| over unit x: the eigenvalue of R^T R by inverse iteration, in double. */
static double least_stretch(const float m[12]) {
    fct_instance instance;
    double inverse[12], length = 0;
    assert_int_equal(fct_transform_set(m, &instance, inverse), FCT_TRANSFORM_GOOD);
    v3 x = v3_unit(v3_make(.3, .5, .8));
    for (int i = 0; i < 300; ++i) { /* x <- R^-1 R^-T x */
        v3 y = {inverse[0] * x.x + inverse[4] * x.y + inverse[8] * x.z,
                inverse[1] * x.x + inverse[5] * x.y + inverse[9] * x.z,
                inverse[2] * x.x + inverse[6] * x.y + inverse[10] * x.z};
        v3 next = v3_sub(apply(inverse, y), v3_make(inverse[3], inverse[7], inverse[11]));
        length = v3_norm(next);
        x = v3_unit(next);
    }
    return 1 / sqrt(length);
}

static void scales_are_found_and_bounded_from_below(void **unused) {
    (void)unused;
    const double none[3] = {0, 0, 0};
    for (int i = 0; i < 300; ++i) {
        fct_instance instance;
        float m[12];
        v3 axis = random_unit_vector();
        double size = exp2(between(-9, 9)), angle = between(-3, 3);
        /* A rotation times a factor, mirrored or not. */
        double uniform[3] = {i % 2 ? size : -size, size, size};
        compose(axis, angle, uniform, none, m);
        assert_int_equal(kind_of(m, &instance), FCT_TRANSFORM_GOOD);
        assert_true(fabs((double)instance.uniform_scale / size - 1) < 1e-6);
        assert_int_equal(instance.mirrored, i % 2 == 0);
        double shrink = fct_transform_shrink(&instance);
        assert_true(shrink <= size * (1 - 1e-5) && shrink >= size * (1 - 4e-5));
        /* Lengths that differ by 1e-4, and columns that are not at right angles by as much. */
        double uneven[3] = {size, size * (i % 2 ? 1 + 1e-4 : 1 - 1e-4), size};
        compose(axis, angle, uneven, none, m);
        assert_int_equal(kind_of(m, &instance), FCT_TRANSFORM_GOOD);
        assert_true(instance.uniform_scale == 0);
        compose(axis, angle, uniform, none, m);
        for (int r = 0; r < 3; ++r) m[4 * r] += 1e-4f * m[4 * r + 1 + i % 2];
        assert_int_equal(kind_of(m, &instance), FCT_TRANSFORM_GOOD);
        assert_true(instance.uniform_scale == 0);
        /* Scales along the axes: the least of them; any other: no more, and at least a third of it. */
        double three[3] = {between(.2, 3), between(.2, 3), between(.2, 3)};
        compose(v3_make(0, 0, 1), 0, three, none, m);
        assert_int_equal(kind_of(m, &instance), FCT_TRANSFORM_GOOD);
        double least = fmin(three[0], fmin(three[1], three[2]));
        assert_true(fct_transform_shrink(&instance) < least);
        assert_true(fct_transform_shrink(&instance) > .99999 * least);
        for (int k = 0; k < 12; ++k) m[k] = (float)between(-2, 2);
        if (kind_of(m, &instance) != FCT_TRANSFORM_GOOD) continue;
        double stretch = least_stretch(m);
        assert_true(fct_transform_shrink(&instance) < stretch);
        assert_true(fct_transform_shrink(&instance) > stretch / 3);
    }
}

/* ---- Bounds ---- */

static void world_bounds(const float m[12], const fct_tree_view *view, double low[3], double high[3]) {
    for (int k = 0; k < 3; ++k) low[k] = INFINITY, high[k] = -INFINITY;
    for (uint32_t i = 0; i < view->vertex_count; ++i) {
        v3 p = fct_transform_point(m, v3_load(view->positions + 3 * (size_t)i));
        double at[3] = {p.x, p.y, p.z};
        for (int k = 0; k < 3; ++k) low[k] = fmin(low[k], at[k]), high[k] = fmax(high[k], at[k]);
    }
}

/* A bent strip along the diagonal: its axis box is mostly empty, those of its clusters are not. */
static fct_mesh make_strip(const fct_env *env) {
    fct_mesh mesh = make_grid(env, 40);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * (size_t)v, x = p[0], y = .02f * p[1];
        p[0] = x + y, p[1] = x - y, p[2] = x * x;
    }
    return mesh;
}

static void bounds_hold_the_surface_and_are_tight(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_strip(&env);
    fct_tree *tree;
    fct_tree_def def = fct_tree_def_default();
    assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_OK);
    fct_tree_view view = fct_tree_get(tree);
    for (int i = 0; i < 100; ++i) {
        float m[12];
        fct_bounds bounds;
        double scale[3] = {between(.5, 2), between(-2, -.5), between(.5, 2)}, low[3], high[3];
        double t[3] = {between(-3, 3), between(-3, 3), between(-3, 3)};
        compose(random_unit_vector(), between(-3, 3), scale, t, m);
        assert_int_equal(fct_transform_bounds(&env, tree, &view.bounds, m, &bounds), FCT_OK);
        world_bounds(m, &view, low, high);
        for (int k = 0; k < 3; ++k) {
            /* The boxes of 256 clusters reach beyond the surface by at most their own thickness. */
            assert_true((double)bounds.lower[k] < low[k] && (double)bounds.lower[k] > low[k] - .05);
            assert_true((double)bounds.upper[k] > high[k] && (double)bounds.upper[k] < high[k] + .05);
        }
    }
    fct_bounds same;
    assert_int_equal(fct_transform_bounds(&env, tree, &view.bounds, fct_transform_identity, &same), FCT_OK);
    assert_memory_equal(&same, &view.bounds, sizeof same);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

/* The slack for rays that rounding moves: 1e-6 of the distance of the box's centre plus its three extents.
 * The model is flat and parallel to the axes, so that its boxes and its bounds agree. */
static void bounds_leave_the_slack_that_rays_need(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 1);
    fct_tree *tree;
    fct_tree_def def = fct_tree_def_default();
    assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_OK);
    fct_tree_view view = fct_tree_get(tree);
    for (int i = 0; i < 30; ++i) {
        double size = between(100, 300), t[3] = {between(-2, 2), 3e3, -5e3}, low[3], high[3];
        float m[12] = {(float)size, 0, 0, (float)t[0], 0, (float)size, 0, (float)t[1], 0, 0, 1, (float)t[2]};
        fct_bounds bounds;
        assert_int_equal(fct_transform_bounds(&env, tree, &view.bounds, m, &bounds), FCT_OK);
        world_bounds(m, &view, low, high);
        for (int k = 0; k < 3; ++k) {
            double center = (low[k] + high[k]) / 2, slack = 1e-6 * (fabs(center) + size / 2 + size / 2);
            double ulp = 1.2e-7 * (fabs(center) + size);
            assert_true(low[k] - (double)bounds.lower[k] > .7 * slack - ulp);
            assert_true(low[k] - (double)bounds.lower[k] < slack + 2 * ulp);
            assert_true((double)bounds.upper[k] - high[k] > .7 * slack - ulp);
            assert_true((double)bounds.upper[k] - high[k] < slack + 2 * ulp);
        }
    }
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(composition_scales_then_rotates_then_moves),
        cmocka_unit_test(an_instance_has_inverse_normals_and_side),
        cmocka_unit_test(singular_and_endless_transforms_are_told),
        cmocka_unit_test(scales_are_found_and_bounded_from_below),
        cmocka_unit_test(bounds_hold_the_surface_and_are_tight),
        cmocka_unit_test(bounds_leave_the_slack_that_rays_need),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
