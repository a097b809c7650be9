/* tests/mesh/test_triangulate.c: triangles of polygons cover them once: areas add up and none turns over. */
#include "base/math/vec.h"
#include "mesh/mesh_support.h"
#include "mesh/triangulate.h"

static v3 area_vector(const float *p, const uint32_t *corners, uint32_t count) {
    v3 sum = {0, 0, 0}, o = v3_load(p + 3 * (size_t)corners[0]);
    for (uint32_t i = 1; i + 1 < count; ++i)
        sum = v3_add(sum, v3_scale(v3_cross(v3_sub(v3_load(p + 3 * (size_t)corners[i]), o),
                                            v3_sub(v3_load(p + 3 * (size_t)corners[i + 1]), o)),
                                   .5));
    return sum;
}

/* Triangulates the polygon 0 .. count - 1; the sum of the triangles' areas, as a multiple of the polygon's.
 */
static double cover(const float *positions, uint32_t count, uint32_t *out) {
    double(*flat)[2] = malloc(count * sizeof *flat);
    uint32_t *next = malloc(count * 4), *previous = malloc(count * 4), *corners = malloc(count * 4);
    unsigned char *reflex = malloc(count);
    fct_polygon_scratch scratch = {flat, next, previous, reflex};
    uint64_t budget = 1 << 28;
    assert_true(count >= 3);
    corners[0] = 0;
    for (uint32_t i = 1; i < count; ++i) corners[i] = i;
    fct_triangulate(positions, corners, count, &scratch, &budget, out);
    v3 whole = area_vector(positions, corners, count);
    double sum = 0;
    for (uint32_t i = 0; i + 2 < count; ++i) {
        for (int k = 0; k < 3; ++k) assert_true(out[3 * i + k] < count);
        sum += v3_norm(area_vector(positions, out + 3 * i, 3));
    }
    free(flat), free(next), free(previous), free(corners), free(reflex);
    return sum / v3_norm(whole);
}

static void a_dart_is_cut_at_its_reflex_corner(void **state) {
    (void)state;
    /* 0 is opposite the reflex corner in the one, a neighbour of it in the other. */
    static const float dart[] = {0, 0, 0, 2, -1, 0, .5f, 0, 0, 2, 1, 0};
    uint32_t out[6];
    float turned[12];
    for (int first = 0; first < 4; ++first) {
        for (int i = 0; i < 4; ++i) memcpy(turned + 3 * i, dart + 3 * ((i + first) % 4), 12);
        assert_true(fabs(cover(turned, 4, out) - 1) < 1e-12);
    }
}

static void combs_and_spirals_are_covered_once(void **state) {
    (void)state;
    enum { N = 400 };
    float p[3 * N];
    static uint32_t out[3 * N];
    for (int i = 0; i < N; ++i) { /* a star with long rays, tilted in space */
        double a = 6.283185307179586 * i / N, r = i & 1 ? 1 : .1 + .05 * (i % 7);
        p[3 * i] = (float)(r * cos(a)), p[3 * i + 1] = (float)(r * sin(a)), p[3 * i + 2] = 2 * p[3 * i];
    }
    assert_true(fabs(cover(p, N, out) - 1) < 1e-5);
    for (int i = 0; i < N; ++i) { /* a spiral band: out along one side and back along the other */
        int j = i < N / 2 ? i : N - 1 - i;
        double a = .1 * j, r = 1 + a + (i < N / 2 ? 0 : 1.5);
        p[3 * i] = (float)(r * cos(a)), p[3 * i + 1] = (float)(-r * sin(a)), p[3 * i + 2] = 0;
    }
    assert_true(fabs(cover(p, N, out) - 1) < 1e-5);
    for (int i = 0; i < N; ++i) { /* convex */
        double a = 6.283185307179586 * i / N;
        p[3 * i] = (float)cos(a), p[3 * i + 1] = (float)sin(a), p[3 * i + 2] = 0;
    }
    assert_true(fabs(cover(p, N, out) - 1) < 1e-5);
}

/* The corners run twice round the middle, so every triangle of the fan about corner 0 turns the same way, but
 * the fan's angles sum to 3 pi. The polygon is not convex, so it is cut by ears. It crosses itself, so some
 * triangles turn over; their signed areas still sum to the polygon's. */
static void a_double_spiral_is_no_fan(void **state) {
    (void)state;
    enum { N = 60 };
    float p[3 * N];
    uint32_t out[3 * N], corners[N], at_first_corner = 0;
    for (uint32_t i = 0; i < N; ++i) {
        double a = 2 * 6.283185307179586 * i / N, r = 1 + .5 * i / N;
        p[3 * i] = (float)(r * cos(a)), p[3 * i + 1] = (float)(r * sin(a)), p[3 * i + 2] = 0;
        corners[i] = i;
    }
    double area = 0, whole = area_vector(p, corners, N).z;
    assert_true(cover(p, N, out) > 1 - 1e-5);
    for (int i = 0; i < N - 2; ++i) {
        at_first_corner += !out[3 * i] || !out[3 * i + 1] || !out[3 * i + 2];
        area += area_vector(p, out + 3 * i, 3).z;
    }
    assert_true(fabs(area / whole - 1) < 1e-6);
    assert_true(at_first_corner < N / 2);
}

/*        4,5
 *   2,5   |     The spike at (2, 5) folds back over the corner (2, 3). That corner is flat to the spike, and
 *    |    |     becomes convex when its neighbour is cut off. From then on it must not block other ears.
 * ---2,3  |
 *    2,2  |
 *        4,0
 */
static void a_corner_cut_convex_blocks_no_ear(void **state) {
    (void)state;
    static const float spike[] = {0, 3, 0, 2, 3, 0, 2, 5, 0, 2, 2, 0, 4, 0, 0, 4, 5, 0};
    uint32_t out[12];
    assert_true(fabs(cover(spike, 6, out) - 1) < 1e-12);
}

static void tiny_and_huge_extents_make_no_difference(void **state) {
    (void)state;
    static const float dart[] = {0, 0, 0, 2, -1, 0, .5f, 0, 0, 2, 1, 0};
    uint32_t expected[6], out[6];
    cover(dart, 4, expected);
    static const float factors[] = {1e-30f, 1e30f};
    for (int i = 0; i < 2; ++i) {
        float p[12];
        for (int k = 0; k < 12; ++k) p[k] = factors[i] * dart[k];
        cover(p, 4, out);
        assert_memory_equal(out, expected, sizeof out);
    }
}

static void degenerate_polygons_still_give_all_triangles(void **state) {
    (void)state;
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(
        parse_text(&r, "obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 1 1 1 1\nf 1 2 3 2\nf 1 2 2 3 1\n", &m),
        FCT_OK);
    assert_int_equal(m.face_count, 3 + 2 + 3);
    assert_int_equal(m.source_faces[7], 2);
    release(&r, &m);
}

/* A comb of 10^5 corners would take 10^10 steps unbounded. */
static void giants_end(void **state) {
    (void)state;
    enum { N = 100000 };
    char *text = malloc((size_t)N * 40);
    size_t size = 0;
    for (int i = 0; i < N; ++i)
        size += (size_t)sprintf(text + size, "v %d %g 0\n", i,
                                i == 0 || i == N - 1 ? -1e6 : (i & 1) * (double)(i % 89));
    size += (size_t)sprintf(text + size, "f");
    for (int i = 1; i <= N; ++i) size += (size_t)sprintf(text + size, " %d", i);
    recorder r = {0};
    fct_mesh m;
    assert_int_equal(parse_bytes(&r, "obj", text, size, &m), FCT_OK);
    assert_int_equal(m.face_count, N - 2);
    free(text);
    release(&r, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_dart_is_cut_at_its_reflex_corner),
        cmocka_unit_test(combs_and_spirals_are_covered_once),
        cmocka_unit_test(a_double_spiral_is_no_fan),
        cmocka_unit_test(a_corner_cut_convex_blocks_no_ear),
        cmocka_unit_test(tiny_and_huge_extents_make_no_difference),
        cmocka_unit_test(degenerate_polygons_still_give_all_triangles),
        cmocka_unit_test(giants_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
