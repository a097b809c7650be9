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
        float depth[8];
        uint32_t mask = meet_boxes(&placed, &node, depth);
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
        float distance2[8], limit2 = (float)(.2 * random_unit(&seed));
        uint32_t mask = bound_boxes(&placed, &node, limit2, distance2);
        for (uint32_t k = 0; k < 8; ++k) {
            double expected = fmax(box_gap(&one, &own[k], 1e-5), box_gap(&own[k], &one, 1e-5));
            assert_true(fabs(sqrt(distance2[k]) - sqrt(expected)) < 1e-5);
            assert_int_equal(mask >> k & 1, distance2[k] <= limit2);
            /* Alternating projections reach the distance from above. */
            v3 p = one.center, q = p;
            for (int step = 0; step < 200; ++step)
                q = nearest_in_box(&own[k], p), p = nearest_in_box(&one, q);
            assert_true(sqrt(distance2[k]) <= v3_norm(v3_sub(p, q)) + 1e-6);
        }
    }
}

static void eight_distances(void **state) {
    (void)state;
    uint64_t seed = 4;
    double worst = 0;
    for (int i = 0; i < 20000; ++i) {
        eight_triangles eight;
        float corners[3][3][8], one[3][3];
        v3 a[8][3], b[3];
        double size = exp2(-6 * random_unit(&seed));
        v3 away = v3_scale(random_direction(&seed), 2 * random_unit(&seed));
        for (int c = 0; c < 3; ++c) {
            v3_store(one[c], v3_add(away, v3_scale(random_direction(&seed), size)));
            if (i % 5 == 0) one[c][2] = (float)(away.z + 1e-3 * random_unit(&seed));
            b[c] = v3_load(one[c]);
            for (int k = 0; k < 8; ++k) {
                float p[3];
                v3_store(p, random_direction(&seed));
                if (i % 5 == 0) p[2] *= 1e-3f;
                if (k == 7 && c == 2) /* a needle */
                    for (int j = 0; j < 3; ++j) p[j] = .5f * corners[0][j][7] + .5f * corners[1][j][7];
                for (int j = 0; j < 3; ++j) corners[c][j][k] = p[j];
                a[k][c] = v3_load(p);
            }
            for (int j = 0; j < 3; ++j) eight.p[c][j] = f8_load(corners[c][j]);
        }
        lane_triangles spread = spread_triangle((const float(*)[3])one);
        float distance2[8];
        f8_store(distance2, find_distances2(&eight, &spread));
        for (int k = 0; k < 8; ++k) {
            v3 pa, pb;
            double exact = sqrt(fct_triangles_distance(a[k], b, &pa, &pb));
            if (exact == 0) continue;
            double error = fabs(sqrt(distance2[k]) - exact), extent = 6;
            assert_true(error <= (double)DISTANCE_ERROR * extent);
            worst = fmax(worst, i % 5 && k < 7 ? error : 0);
        }
    }

    /* Away from degenerate cases, the result has the digits of a float. */
    assert_true(worst < 1e-5);
}

int main(void) {
    skip_unless_variant_runs();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boxes_meet_or_not),
        cmocka_unit_test(bounds_are_below_distances),
        cmocka_unit_test(eight_distances),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
