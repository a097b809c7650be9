/* The exact crossing of a line and a triangle, against integers of 128 bits. */
#include "models.h"

#include "bvh/ray/exact.h"

typedef __int128 wide;

static wide determinant(const long a[3], const long b[3], const long c[3]) {
    return (wide)a[0] * ((wide)b[1] * c[2] - (wide)b[2] * c[1]) +
           (wide)a[1] * ((wide)b[2] * c[0] - (wide)b[0] * c[2]) +
           (wide)a[2] * ((wide)b[0] * c[1] - (wide)b[1] * c[0]);
}

/* The side of the edge a b on which the line passes, 0 where it meets the edge. */
static int integer_side(const long o[3], const long d[3], const long a[3], const long b[3]) {
    long p[3], q[3];
    for (int k = 0; k < 3; ++k) p[k] = a[k] - o[k], q[k] = b[k] - o[k];
    wide w = determinant(d, p, q);
    return (w > 0) - (w < 0);
}

static v3 scaled(const long a[3], double unit) {
    return v3_make(unit * (double)a[0], unit * (double)a[1], unit * (double)a[2]);
}

static long random_coordinate(uint64_t *seed, uint32_t bits) {
    return (long)(random_next(seed) >> (64 - bits)) - (1L << (bits - 1));
}

static void random_vector(uint64_t *seed, uint32_t bits, long out[3]) {
    for (int k = 0; k < 3; ++k) out[k] = random_coordinate(seed, bits);
}

/* A line and an edge a b whose determinant is -1, 0 or 1, while its terms reach 2^60. With b = o + d + e and
 * a = o + n e + f, it is d . (f x e). False: another try is needed. */
static bool make_narrow_pass(uint64_t *seed, long o[3], long d[3], long a[3], long b[3]) {
    long e[3], f[3], n = random_coordinate(seed, 19), missed = random_coordinate(seed, 2);
    random_vector(seed, 3, e), random_vector(seed, 3, f);
    long c[3] = {f[1] * e[2] - f[2] * e[1], f[2] * e[0] - f[0] * e[2], f[0] * e[1] - f[1] * e[0]};
    if (labs(c[2]) != 1) return false;
    random_vector(seed, 22, o), random_vector(seed, 18, d);
    d[2] = c[2] * (missed - c[0] * d[0] - c[1] * d[1]);
    for (int k = 0; k < 3; ++k) a[k] = o[k] + n * e[k] + f[k], b[k] = o[k] + d[k] + e[k];
    return true;
}

static void sides_are_those_of_integers(void **state) {
    (void)state;
    uint64_t seed = 3;
    size_t crossed = 0, close = 0;
    for (int i = 0; i < 200000; ++i) {
        double unit = exp2((double)(random_next(&seed) % 400) - 200);
        long o[3], d[3], p[3][3];
        random_vector(&seed, 23, o), random_vector(&seed, 24, d);
        for (int c = 0; c < 3; ++c) random_vector(&seed, 23, p[c]);
        bool narrow = i % 2 && make_narrow_pass(&seed, o, d, p[0], p[1]);
        int side[3];
        for (int c = 0; c < 3; ++c) side[c] = integer_side(o, d, p[c], p[(c + 1) % 3]);
        if (!side[0] || !side[1] || !side[2]) continue;
        bool expected = side[0] == side[1] && side[1] == side[2];
        v3 corners[3] = {scaled(p[0], unit), scaled(p[1], unit), scaled(p[2], unit)};
        v3 direction = scaled(d, 0x1p-20);
        assert_int_equal(fct_line_crosses(scaled(o, unit), direction, corners), expected);
        crossed += expected, close += expected && narrow;
    }
    assert_true(crossed > 10000 && close > 1000);
}

/* A closed body of small integer coordinates: lines through vertices, along edges and in planes of faces
 * cross an even number of faces, and any line from the inside to the outside crosses an odd number of those
 * ahead. */
static void a_line_crosses_a_closed_surface_evenly(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_pebble(&env, 6, 4);
    for (uint32_t i = 0; i < 3 * mesh.vertex_count; ++i) mesh.positions[i] = rintf(4 * mesh.positions[i]);
    uint64_t seed = 8;
    size_t several = 0;
    for (int i = 0; i < 20000; ++i) {
        const float *a = mesh.positions + 3 * (random_next(&seed) % mesh.vertex_count);
        const float *b = mesh.positions + 3 * (random_next(&seed) % mesh.vertex_count);
        v3 origin = v3_load(a), direction = v3_sub(v3_load(b), origin);
        if (i % 3 == 0) direction = v3_make(i % 2, (i / 2) % 2, (i / 4) % 2);
        if (v3_norm(direction) == 0) continue;
        int crossings = 0;
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            v3 p[3];
            face_corners(&mesh, f, p);
            crossings += fct_line_crosses(origin, direction, p);
        }
        assert_int_equal(crossings % 2, 0);
        several += crossings > 0;
    }
    assert_true(several > 5000);
    fct_mesh_release(&env, &mesh);
}

static void a_triangle_seen_from_its_side_is_not_crossed(void **state) {
    (void)state;
    const v3 flat[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, point[3] = {{0, 0, 0}, {0, 0, 0}, {0, 1, 0}};
    assert_false(fct_line_crosses(v3_make(.25, .25, 0), v3_make(1, 0, 0), flat));
    assert_false(fct_line_crosses(v3_make(0, .5, 1), v3_make(0, 0, -1), point));
    assert_true(fct_line_crosses(v3_make(.25, .25, 0), v3_make(0, 0x1p-20, 0x1p-60), flat));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sides_are_those_of_integers),
        cmocka_unit_test(a_line_crosses_a_closed_surface_evenly),
        cmocka_unit_test(a_triangle_seen_from_its_side_is_not_crossed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
