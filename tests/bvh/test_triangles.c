/* Two triangles: whether they meet (against integer arithmetic), their contact, and their distance (against a
 * search over the points of one of them). */
#include "pairs.h"

#include "bvh/pair/orient.h"
#include "bvh/pair/triangles.h"

static int random_int(uint64_t *seed, int low, int high) {
    return low + (int)(random_next(seed) % (uint64_t)(high - low + 1));
}

/* ---- Planes and lines ---- */

static v3 offset(v3 p, int k, double by) {
    (k == 0 ? &p.x : k == 1 ? &p.y : &p.z)[0] += by;
    return p;
}

/* Points of a plane of multiples of 2^-20 are exact doubles. A step in the last place of one coordinate
 * leaves the plane to the side that the normal's component tells. */
static void planes_are_exact(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 100000; ++i) {
        int e[6];
        for (int k = 0; k < 6; ++k) e[k] = random_int(&seed, -1000000, 1000000);
        v3 u = v3_scale(v3_make(e[0], e[1], e[2]), 0x1p-20), v = v3_scale(v3_make(e[3], e[4], e[5]), 0x1p-20);
        v3 a = v3_make(random_int(&seed, -9999, 9999), random_int(&seed, -9999, 9999),
                       random_int(&seed, -9999, 9999));
        v3 b = v3_add(a, u), c = v3_add(a, v);
        v3 d = v3_mad(v3_mad(a, random_int(&seed, -100, 100), u), random_int(&seed, -100, 100), v);
        assert_int_equal(fct_orient_space(a, b, c, d), 0);
        double n[3] = {(double)e[1] * e[5] - (double)e[2] * e[4], (double)e[2] * e[3] - (double)e[0] * e[5],
                       (double)e[0] * e[4] - (double)e[1] * e[3]};
        int k = random_int(&seed, 0, 2), up = i % 2 ? 1 : -1;
        v3 moved = offset(d, k, up * 0x1p-30);
        int side = n[k] > 0 ? up : n[k] < 0 ? -up : 0;
        assert_int_equal(fct_orient_space(a, b, c, moved), side);
        assert_int_equal(fct_orient_space(b, a, c, moved), -side);
        assert_int_equal(fct_orient_space(a, moved, b, c), side);
        int sides[3];
        fct_orient_corners((v3[3]){a, b, c}, (v3[3]){d, moved, offset(d, k, -up * 0x1p-29)}, sides);
        assert_true(sides[0] == 0 && sides[1] == side && sides[2] == -side);
        /* In the plane: c against the line a b, and a step aside. */
        for (int axis = 0; axis < 3; ++axis) {
            int sign = (n[axis] > 0) - (n[axis] < 0), x = (axis + 1) % 3, y = (axis + 2) % 3;
            assert_int_equal(fct_orient_plane(axis, a, b, c), sign);
            assert_int_equal(fct_orient_plane(axis, b, a, c), -sign);
            v3 on = v3_mad(a, random_int(&seed, -50, 50), u);
            assert_int_equal(fct_orient_plane(axis, a, b, on), 0);
            double along[3] = {u.x, u.y, u.z};
            assert_int_equal(fct_orient_plane(axis, a, b, offset(on, y, 0x1p-30)),
                             (along[x] > 0) - (along[x] < 0));
        }
    }
}

static void planes_have_a_side(void **state) {
    (void)state;
    v3 o = {0, 0, 0}, x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
    assert_int_equal(fct_orient_space(o, x, y, z), 1);
    assert_int_equal(fct_orient_space(o, y, x, z), -1);
    assert_int_equal(fct_orient_plane(2, o, x, y), 1);
    assert_int_equal(fct_orient_plane(0, o, y, z), 1);
    assert_int_equal(fct_orient_plane(1, o, z, x), 1);
    /* Corners without any digits in common. */
    v3 tiny = {1e-30, 0, 0}, huge = {1e30, 1e30, 0};
    assert_int_equal(fct_orient_space(tiny, huge, y, v3_make(0, 0, 1e-30)),
                     fct_orient_space(tiny, huge, y, z));
}

/* A point in steps of the last place around (.5, .5), against a line through (12, 12) and (24, 24): in
 * doubles, more than a tenth of the signs are wrong. */
static void lines_are_exact(void **state) {
    (void)state;
    v3 q = {12, 12, 0}, r = {24, 24, 0};
    size_t wrong = 0;
    for (int i = 0; i < 64; ++i)
        for (int j = 0; j < 64; ++j) {
            v3 p = {.5 + i * 0x1p-53, .5 + j * 0x1p-53, 0};
            int expected = (p.y > p.x) - (p.y < p.x);
            double plain = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
            wrong += (plain > 0) - (plain < 0) != expected;
            assert_int_equal(fct_orient_plane(2, q, r, p), expected);
            assert_int_equal(fct_orient_plane(2, p, q, r), expected);
            assert_int_equal(fct_orient_plane(2, r, q, p), -expected);
        }
    assert_true(wrong > 400);
}

/* ---- Meeting, in integers ---- */

typedef struct int3 {
    int64_t x, y, z;
} int3;

static int3 subtract(int3 a, int3 b) {
    return (int3){a.x - b.x, a.y - b.y, a.z - b.z};
}
static int3 cross(int3 a, int3 b) {
    return (int3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static int64_t dot(int3 a, int3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static bool is_apart_along(const int3 a[3], const int3 b[3], int3 axis) {
    int64_t low[2] = {INT64_MAX, INT64_MAX}, high[2] = {INT64_MIN, INT64_MIN};
    for (int i = 0; i < 3; ++i) {
        int64_t at[2] = {dot(axis, a[i]), dot(axis, b[i])};
        for (int k = 0; k < 2; ++k) {
            if (at[k] < low[k]) low[k] = at[k];
            if (at[k] > high[k]) high[k] = at[k];
        }
    }
    return high[0] < low[1] || high[1] < low[0];
}

/* Two triangles with area are apart exactly if they are apart along a normal, a product of two edges, or, in
 * one plane, along the normal of an edge in it. */
static bool meet_in_integers(const int3 a[3], const int3 b[3]) {
    int3 ea[3], eb[3];
    for (int i = 0; i < 3; ++i)
        ea[i] = subtract(a[(i + 1) % 3], a[i]), eb[i] = subtract(b[(i + 1) % 3], b[i]);
    int3 na = cross(ea[0], ea[1]), nb = cross(eb[0], eb[1]);
    if (dot(na, na) == 0 || dot(nb, nb) == 0) return false;
    if (is_apart_along(a, b, na) || is_apart_along(a, b, nb)) return false;
    for (int i = 0; i < 3; ++i) {
        if (is_apart_along(a, b, cross(na, ea[i])) || is_apart_along(a, b, cross(nb, eb[i]))) return false;
        for (int j = 0; j < 3; ++j)
            if (is_apart_along(a, b, cross(ea[i], eb[j]))) return false;
    }
    return true;
}

static void random_triangle(uint64_t *seed, int size, int3 p[3], v3 q[3]) {
    for (int i = 0; i < 3; ++i) {
        p[i] = (int3){random_int(seed, 0, size), random_int(seed, 0, size), random_int(seed, 0, size)};
        q[i] = v3_make((double)p[i].x, (double)p[i].y, (double)p[i].z);
    }
}

/* In a small grid, most triangles share corners, edges, planes or touch in points. */
static void meeting_is_exact(void **state) {
    (void)state;
    uint64_t seed = 2;
    size_t met = 0, total = 0;
    for (int size = 1; size <= 40; size += size < 5 ? 1 : 7)
        for (int i = 0; i < 60000; ++i) {
            int3 pa[3], pb[3];
            v3 a[3], b[3];
            random_triangle(&seed, size, pa, a);
            random_triangle(&seed, size, pb, b);
            if (i % 4 == 0) /* in one plane */
                for (int k = 0; k < 3; ++k) pa[k].z = pb[k].z = 1, a[k].z = b[k].z = 1;
            bool expected = meet_in_integers(pa, pb);
            assert_int_equal(fct_triangles_meet(a, b), expected);
            assert_int_equal(fct_triangles_meet(b, a), expected);
            v3 turned[3] = {b[1], b[0], b[2]};
            assert_int_equal(fct_triangles_meet(a, turned), expected);
            met += expected, ++total;
        }
    assert_in_range(met, total / 10, total * 9 / 10);
}

/* ---- Contacts ---- */

static bool lies_on(const v3 t[3], const double p[3], double within) {
    v3 at = {p[0], p[1], p[2]};
    return v3_norm(v3_sub(plain_closest(at, t), at)) <= within;
}

/* The ends lie on both triangles. Moved by slightly more than the depth, the triangles are apart; by slightly
 * less, they are not. */
static void contacts_are_shared(void **state) {
    (void)state;
    uint64_t seed = 3;
    size_t met = 0;
    for (int i = 0; i < 60000; ++i) {
        int3 pa[3], pb[3];
        v3 a[3], b[3], moved[3];
        random_triangle(&seed, 6, pa, a);
        random_triangle(&seed, 6, pb, b);
        fct_contact contact;
        if (fct_triangles_contact(a, b, &contact) != fct_triangles_meet(a, b)) fail();
        if (!fct_triangles_meet(a, b)) continue;
        ++met;
        assert_true(lies_on(a, contact.from, 1e-9) && lies_on(b, contact.from, 1e-9));
        assert_true(lies_on(a, contact.to, 1e-9) && lies_on(b, contact.to, 1e-9));
        v3 normal = {contact.normal[0], contact.normal[1], contact.normal[2]};
        assert_true(fabs(v3_norm(normal) - 1) < 1e-12 && contact.depth >= 0);
        for (int k = 0; k < 3; ++k) moved[k] = v3_mad(b[k], contact.depth + 1e-9, normal);
        assert_false(fct_triangles_meet(a, moved));
        /* No random direction is shorter. */
        for (int trial = 0; trial < 8; ++trial) {
            v3 direction = random_direction(&seed);
            for (int k = 0; k < 3; ++k) moved[k] = v3_mad(b[k], contact.depth * (1 - 1e-9) - 1e-9, direction);
            if (contact.depth > 1e-6) assert_true(fct_triangles_meet(a, moved));
        }
    }
    assert_true(met > 5000);
}

static void contact_of_a_cross(void **state) {
    (void)state;
    /* b pierces a from z = -1 to 3: the shared segment is y = 1 from x = 1 to 1.5; the shortest way out has
     * length 1. */
    v3 a[3] = {{0, 0, 0}, {8, 0, 0}, {0, 8, 0}}, b[3] = {{1, 1, -1}, {3, 1, 3}, {1, 1, 3}};
    fct_contact contact;
    assert_true(fct_triangles_contact(a, b, &contact));
    double x0 = fmin(contact.from[0], contact.to[0]), x1 = fmax(contact.from[0], contact.to[0]);
    assert_true(fabs(x0 - 1) < 1e-15 && fabs(x1 - 1.5) < 1e-15);
    assert_true(fabs(contact.from[1] - 1) < 1e-15 && fabs(contact.to[2]) < 1e-15);
    assert_true(fabs(contact.depth - 1) < 1e-15);
    assert_true(fabs(fabs(contact.normal[2]) - 1) < 1e-15 || fabs(fabs(contact.normal[1]) - 1) < 1e-15);
}

static void contacts_in_a_plane(void **state) {
    (void)state;
    v3 a[3] = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, b[3] = {{1, 1, 0}, {5, 1, 0}, {1, 5, 0}};
    fct_contact contact;
    assert_true(fct_triangles_contact(a, b, &contact));
    assert_true(contact.depth == 0);
    /* The common region is the triangle (1,1) (3,1) (1,3). */
    double length2 = 0;
    for (int k = 0; k < 3; ++k) length2 += pow(contact.from[k] - contact.to[k], 2);
    assert_true(fabs(length2 - 8) < 1e-12);
}

/* ---- Distance ---- */

static double distance_from(const v3 a[3], const v3 b[3], double u, double v) {
    v3 p = v3_mad(v3_mad(a[0], u, v3_sub(a[1], a[0])), v, v3_sub(a[2], a[0]));
    return v3_norm(v3_sub(plain_closest(p, b), p));
}

static double least_over_v(const v3 a[3], const v3 b[3], double u) {
    double low = 0, high = 1 - u;
    for (int i = 0; i < 70; ++i) {
        double x = low + (high - low) / 3, y = high - (high - low) / 3;
        if (distance_from(a, b, u, x) < distance_from(a, b, u, y))
            high = y;
        else
            low = x;
    }
    return distance_from(a, b, u, (low + high) / 2);
}

/* The distance to a convex set is a convex function of the point, so nested searches find the minimum. */
static double searched_distance(const v3 a[3], const v3 b[3]) {
    double low = 0, high = 1;
    for (int i = 0; i < 70; ++i) {
        double x = low + (high - low) / 3, y = high - (high - low) / 3;
        if (least_over_v(a, b, x) < least_over_v(a, b, y))
            high = y;
        else
            low = x;
    }
    return least_over_v(a, b, (low + high) / 2);
}

static void distances_are_least(void **state) {
    (void)state;
    uint64_t seed = 4;
    for (int i = 0; i < (SANITIZED ? 100 : 600); ++i) {
        v3 a[3], b[3], pa, pb;
        double apart = 2 * random_unit(&seed);
        v3 away = v3_scale(random_direction(&seed), apart);
        for (int k = 0; k < 3; ++k) {
            a[k] = random_direction(&seed);
            b[k] = v3_add(away, random_direction(&seed));
            if (i % 3 == 0) a[k].z *= .01, b[k].z *= .01; /* nearly parallel */
        }
        double expected = searched_distance(a, b), d = sqrt(fct_triangles_distance(a, b, &pa, &pb));
        assert_true(fabs(d - expected) < 2e-7);
        assert_true(fabs(v3_norm(v3_sub(pa, pb)) - d) < 1e-12);
        assert_true(v3_norm(v3_sub(plain_closest(pa, a), pa)) < 1e-9);
        assert_true(v3_norm(v3_sub(plain_closest(pb, b), pb)) < 1e-9);
        assert_true(fabs(sqrt(fct_triangles_distance(b, a, &pb, &pa)) - d) < 1e-12);
    }
}

/* Edges that cross at a tiny angle, just above each other. */
static void distances_of_nearly_parallel_edges(void **state) {
    (void)state;
    for (double angle = 1e-3; angle > 1e-12; angle /= 3) {
        double height = angle * 1e-3;
        v3 a[3] = {{-1, 0, 0}, {1, 0, 0}, {0, 0, -5}}, pa, pb;
        v3 b[3] = {{-1, -angle, height}, {1, angle, height}, {0, 0, 5}};
        assert_true(fabs(sqrt(fct_triangles_distance(a, b, &pa, &pb)) - height) <= 1e-15);
    }
}

static void distances_of_degenerate_triangles(void **state) {
    (void)state;
    v3 needle[3] = {{0, 0, 2}, {4, 0, 2}, {2, 0, 2}}, flat[3] = {{1, -1, 0}, {3, -1, 0}, {2, 3, 0}}, pa, pb;
    v3 point[3] = {{2, 0, 5}, {2, 0, 5}, {2, 0, 5}};
    assert_true(fabs(fct_triangles_distance(needle, flat, &pa, &pb) - 4) < 1e-12);
    assert_true(fabs(fct_triangles_distance(flat, point, &pa, &pb) - 25) < 1e-12);
    assert_true(fabs(fct_triangles_distance(point, needle, &pa, &pb) - 9) < 1e-12);
    /* A needle through a triangle has the distance 0, though it has no area to meet with. */
    v3 through[3] = {{2, 0, -1}, {2, 0, 3}, {2, 0, 1}};
    assert_false(fct_triangles_meet(through, flat));
    assert_true(fct_triangles_distance(through, flat, &pa, &pb) < 1e-20);
    assert_true(fct_triangles_distance(flat, through, &pa, &pb) < 1e-20);
    v3 beside[3] = {{2, 5, -1}, {2, 5, 3}, {2, 5, 1}};
    assert_true(fabs(fct_triangles_distance(flat, beside, &pa, &pb) - 4) < 1e-12);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planes_are_exact),
        cmocka_unit_test(planes_have_a_side),
        cmocka_unit_test(lines_are_exact),
        cmocka_unit_test(meeting_is_exact),
        cmocka_unit_test(contacts_are_shared),
        cmocka_unit_test(contact_of_a_cross),
        cmocka_unit_test(contacts_in_a_plane),
        cmocka_unit_test(distances_are_least),
        cmocka_unit_test(distances_of_nearly_parallel_edges),
        cmocka_unit_test(distances_of_degenerate_triangles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
