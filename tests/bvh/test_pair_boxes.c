/* The kernels of the searches through two models: boxes against boxes, and a triangle against eight. */
#include "base/math/simd.h"
#include "pairs.h"

#include "bvh/pair/apart.h"
#include "bvh/pair/boxes.h"
#include "bvh/pair/triangles.h"

typedef struct box {
    v3 center, axis[3];
    double half[3];
} box;

static void random_axes(uint64_t *seed, v3 axis[3]) {
    fct_pose pose = random_pose(seed, 0);
    for (int k = 0; k < 3; ++k)
        axis[k] = v3_make(pose.rotation[k][0], pose.rotation[k][1], pose.rotation[k][2]);
}

/* Kinds: any; flat; a needle; axes along the coordinates, which other boxes of this kind share. */
static box random_box(uint64_t *seed, int kind, double size) {
    box b = {.axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    if (kind < 3) random_axes(seed, b.axis);
    for (int k = 0; k < 3; ++k) b.half[k] = size * (.05 + random_unit(seed));
    if (kind == 1) b.half[0] = 1e-6;
    if (kind == 2) b.half[0] = b.half[2] = 1e-4 * size;
    b.center = v3_make(random_unit(seed) - .5, random_unit(seed) - .5, random_unit(seed) - .5);
    return b;
}

static void set_slot(fct_pair_node *node, uint32_t i, const box *b) {
    float c[3], a[3];
    v3_store(c, b->center);
    for (int k = 0; k < 3; ++k) {
        node->center[k][i] = c[k], node->half[k][i] = (float)b->half[k];
        v3_store(a, b->axis[k]);
        for (int j = 0; j < 3; ++j) node->axes[k][j][i] = a[j];
    }
}

/* What the node stores, read back. */
static box read_slot(const fct_pair_node *node, uint32_t i) {
    box b;
    b.center = v3_make(node->center[0][i], node->center[1][i], node->center[2][i]);
    for (int k = 0; k < 3; ++k) {
        b.half[k] = node->half[k][i];
        b.axis[k] = v3_make(node->axes[k][0][i], node->axes[k][1][i], node->axes[k][2][i]);
    }
    return b;
}

static fct_placed_box place_plainly(const fct_pair_node *node, uint32_t i, float slack) {
    fct_placed_box out = {.slack = slack};
    for (int k = 0; k < 3; ++k) {
        out.center[k] = node->center[k][i], out.half[k] = node->half[k][i];
        for (int j = 0; j < 3; ++j) out.axes[k][j] = node->axes[k][j][i];
    }
    return out;
}

/* How far two boxes are apart along a direction, times its length. */
static double separate(const box *a, const box *b, v3 along) {
    double gap = fabs(v3_dot(along, v3_sub(a->center, b->center)));
    for (int k = 0; k < 3; ++k)
        gap -= a->half[k] * fabs(v3_dot(along, a->axis[k])) + b->half[k] * fabs(v3_dot(along, b->axis[k]));
    return gap;
}

static void boxes_meet_or_not(void **state) {
    (void)state;
    uint64_t seed = 1;
    size_t apart_by_face = 0, apart_by_cross = 0, met = 0;
    for (int i = 0; i < 40000; ++i) {
        fct_pair_node node;
        box own[8], one;
        for (uint32_t k = 0; k < 8; ++k) {
            own[k] = random_box(&seed, (int)(random_next(&seed) % 4), .3);
            set_slot(&node, k, &own[k]);
            own[k] = read_slot(&node, k);
        }
        fct_pair_node other;
        one = random_box(&seed, i % 4, .3);
        set_slot(&other, 0, &one);
        one = read_slot(&other, 0);
        fct_placed_box placed = place_plainly(&other, 0, 2e-6f);
        float depth[8], gap[8];
        f8 gaps;
        uint32_t mask = meet_boxes(&placed, &node, 0, depth, &gaps);
        f8_store(gap, gaps);
        for (uint32_t k = 0; k < 8; ++k) {
            double face = -INFINITY, cross = -INFINITY;
            for (int r = 0; r < 3; ++r) {
                face = fmax(face, fmax(separate(&one, &own[k], one.axis[r]),
                                       separate(&one, &own[k], own[k].axis[r])));
                for (int s = 0; s < 3; ++s)
                    cross = fmax(cross, separate(&one, &own[k], v3_cross(one.axis[r], own[k].axis[s])));
            }
            double most = fmax(face, cross);
            if (fabs(most - 2e-6) > 1e-6) assert_int_equal(mask >> k & 1, most < 2e-6);
            assert_true(fabs(depth[k] - face) < 2e-6);
            /* The largest separation, if the boxes are not told apart by an axis before. */
            assert_true(gap[k] > face - 2e-6 && gap[k] < fmax(face, cross) + 2e-6);
            if (mask) assert_true(fabs(gap[k] - most) < 2e-6);
            met += most<0, apart_by_face += face> 0, apart_by_cross += face < 0 && cross > 0;
        }
    }

    assert_true(met > 20000 && apart_by_face > 50000 && apart_by_cross > 2000);
}

static double box_gap(const box *own, const box *other, double slack) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        double gap = separate(own, other, own->axis[k]) - slack;
        if (gap > 0) sum += gap * gap;
    }
    return sum;
}

/* A point of the box in the direction from `p`, by projection. */
static v3 nearest_in_box(const box *b, v3 p) {
    v3 out = b->center, d = v3_sub(p, b->center);
    for (int k = 0; k < 3; ++k) {
        double at = fmax(-b->half[k], fmin(b->half[k], v3_dot(d, b->axis[k])));
        out = v3_mad(out, at, b->axis[k]);
    }
    return out;
}

static void bounds_are_below_distances(void **state) {
    (void)state;
    uint64_t seed = 2;
    for (int i = 0; i < 5000; ++i) {
        fct_pair_node node, other;
        box own[8], one = random_box(&seed, i % 4, .1);
        for (uint32_t k = 0; k < 8; ++k) {
            own[k] = random_box(&seed, (int)(random_next(&seed) % 4), .1);
            set_slot(&node, k, &own[k]);
            own[k] = read_slot(&node, k);
        }
        set_slot(&other, 0, &one);
        one = read_slot(&other, 0);
        fct_placed_box placed = place_plainly(&other, 0, 1e-5f);
        float distance2[8], guess[8], limit2 = (float)(.2 * random_unit(&seed));
        uint32_t mask = bound_boxes(&placed, &node, limit2, distance2, guess);
        for (uint32_t k = 0; k < 8; ++k) {
            double expected = fmax(box_gap(&one, &own[k], 1e-5), box_gap(&own[k], &one, 1e-5));
            assert_true(fabs(sqrt(distance2[k]) - sqrt(expected)) < 1e-5);
            assert_int_equal(mask >> k & 1, distance2[k] <= limit2);
            double away = v3_norm(v3_sub(own[k].center, one.center)),
                   radius = v3_norm(v3_make(own[k].half[0], own[k].half[1], own[k].half[2]));
            assert_true(fabs(guess[k] - (away - radius / 2)) < 1e-6);
            /* Alternating projections reach the distance from above. */
            v3 p = one.center, q = p;
            for (int step = 0; step < 200; ++step)
                q = nearest_in_box(&own[k], p), p = nearest_in_box(&one, q);
            assert_true(sqrt(distance2[k]) <= v3_norm(v3_sub(p, q)) + 1e-6);
        }
    }
}

/* Triangles near each other, some of them flat, needles or parallel. Every pair of the eight of each side is
 * gathered once. */
static void distances_lie_between_bounds(void **state) {
    (void)state;
    uint64_t seed = 4;
    double loose = 0;
    size_t met = 0, tight = 0, pairs = 0;
    for (int i = 0; i < 2000; ++i) {
        leaf_corners corners[2];
        v3 t[2][8][3];
        double size = exp2(-6 * random_unit(&seed));
        v3 away = v3_scale(random_direction(&seed), 2 * random_unit(&seed));
        for (int side = 0; side < 2; ++side)
            for (int k = 0; k < 8; ++k)
                for (int c = 0; c < 3; ++c) {
                    float p[3];
                    v3_store(p, side ? v3_add(away, v3_scale(random_direction(&seed), size))
                                     : random_direction(&seed));
                    if (i % 5 == 0) p[2] = side ? (float)away.z + 1e-3f * p[2] : 1e-3f * p[2];
                    if (k == 7 && c == 2)
                        for (int j = 0; j < 3; ++j)
                            p[j] = .5f * corners[side].p[0][j][7] + .5f * corners[side].p[1][j][7];
                    for (int j = 0; j < 3; ++j)
                        corners[side].p[c][j][k] = corners[side].p[c][j][k + 8] = p[j];
                    t[side][k][c] = v3_load(p);
                }
        for (uint32_t turn = 0; turn < 8; ++turn) {
            uint32_t list_a[8], list_b[8];
            for (uint32_t k = 0; k < 8; ++k) list_a[k] = k, list_b[k] = 8 * (turn & 1) + (k + turn) % 8;
            lane_triangles a = gather_triangles(&corners[0], list_a),
                           b = gather_triangles(&corners[1], list_b);
            f8 lower_lanes, upper_lanes;
            float lower[8], upper[8];
            bound_distances(&a, &b, &lower_lanes, &upper_lanes);
            f8_store(lower, lower_lanes), f8_store(upper, upper_lanes);
            for (uint32_t k = 0; k < 8; ++k) {
                v3 pa, pb;
                double exact = sqrt(fct_triangles_distance(t[0][k], t[1][list_b[k] % 8], &pa, &pb));
                /* Both triangles extend over at most 4 per coordinate. */
                assert_true(lower[k] <= exact + APART_ERROR * 12 && exact <= upper[k] + APART_ERROR * 12);
                if (exact == 0) {
                    ++met;
                    continue;
                }
                ++pairs;
                tight += upper[k] - lower[k] < 1e-5;
                if (i % 5 && k < 7 && list_b[k] % 8 < 7) loose = fmax(loose, upper[k] - exact);
            }
        }
    }

    /* Away from degenerate triangles, the upper bound has the digits of a float, and so has the lower one
     * but for edges that are nearly parallel. */
    assert_true(loose < 1e-6);
    assert_true(tight > pairs - pairs / 200 && met > 1000);
}

int main(void) {
    skip_unless_variant_runs();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boxes_meet_or_not),
        cmocka_unit_test(bounds_are_below_distances),
        cmocka_unit_test(distances_lie_between_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
