/* Every operation on eight or four numbers does to each lane what it says, in either form of the header. */
#include "support.h"

#include "base/simd.h"

static const float a[8] = {1, -2, 0.5f, 1e30f, -0.0f, 7, 3, -1e-30f};
static const float b[8] = {2, -3, 0.5f, 1, 4, -7, 3, 1e-30f};

static void floats(void **state) {
    (void)state;
    float out[8];
    f8 x = f8_load(a), y = f8_load(b);
    f8_store(out, f8_if_lt(x, y, f8_set(1), f8_set(2)));
    for (int i = 0; i < 8; ++i) assert_true(out[i] == (a[i] < b[i] ? 1 : 2));
    f8_store(out, f8_sqrt(f8_abs(x)));
    for (int i = 0; i < 8; ++i) assert_true(out[i] == sqrtf(fabsf(a[i])));
    f8_store(out, f8_swap(x));
    for (int i = 0; i < 8; ++i) assert_true(out[i] == a[(i + 4) % 8]);
    f8_store(out, f8_max(f8_set(NAN), x)); /* the second where one is not a number */
    for (int i = 0; i < 8; ++i) assert_true(out[i] == a[i]);
}

static void transposing(void **state) {
    (void)state;
    float in[8][8], out[8];
    f8 rows[8];
    for (int i = 0; i < 8; ++i) {
        for (int k = 0; k < 8; ++k) in[i][k] = (float)(10 * i + k);
        rows[i] = f8_load(in[i]);
    }
    f8_transpose(rows);
    for (int i = 0; i < 8; ++i) {
        f8_store(out, rows[i]);
        for (int k = 0; k < 8; ++k) assert_true(out[k] == in[k][i]);
    }
}

static void integers(void **state) {
    (void)state;
    const uint32_t u[8] = {5, 0xFFFFFFFF, 3, 5, 0x80000000, 9, 0x7FFFFFFF, 5},
                   v[8] = {5, 1, 4, 6, 2, 9, 8, 1};
    uint32_t out[8];
    assert_int_equal(i8_eq(i8_load(u), i8_load(v)), 0x21);
    assert_int_equal(i8_least(i8_load(u)), 3);
    assert_int_equal(i8_least(i8_set(0xFFFFFFFE)), 0xFFFFFFFE);
    assert_int_equal(i8_lt(i8_load(v), i8_set(5)), 0x96);
    i8_store(out, i8_or(i8_shift_right(i8_load(u), 5), i8_set(1)));
    for (int i = 0; i < 8; ++i) assert_int_equal(out[i], u[i] >> 5 | 1);
    for (uint32_t at = 0; at < 20; ++at) {
        i8_store(out, i8_insert(i8_load(u), at, i8_set(77)));
        for (uint32_t i = 0; i < 8; ++i) assert_int_equal(out[i], i == at ? 77 : u[i]);
    }
}

static void truncating(void **state) {
    (void)state;
    const float in[8] = {0, 0.99f, 1, 15.5f, -0.5f, -3.99f, 16777216, 2e9f};
    uint32_t out[8];
    i8_store(out, i8_trunc(f8_load(in)));
    for (int i = 0; i < 8; ++i) assert_int_equal((int32_t)out[i], (int32_t)in[i]);
}

static void doubles(void **state) {
    (void)state;
    const double p[4] = {1, -2, 1e300, 0}, q[4] = {3, -4, 2, -0.5};
    double out[4];
    float narrow[4];
    d4 x = d4_load(p), y = d4_load(q);
    d4_store(out, d4_div(d4_sub(x, y), d4_add(d4_mul(y, y), d4_set(1))));
    for (int i = 0; i < 4; ++i) assert_true(out[i] == (p[i] - q[i]) / (q[i] * q[i] + 1));
    d4_store(out, d4_if_lt(x, y, d4_min(x, y), d4_max(x, y)));
    for (int i = 0; i < 4; ++i) assert_true(out[i] == p[i]);
    d4_store(out, d4_sqrt(d4_abs(y)));
    for (int i = 0; i < 4; ++i) assert_true(out[i] == sqrt(fabs(q[i])));
    d4_store_floats(narrow, d4_load_floats(a));
    for (int i = 0; i < 4; ++i) assert_true(narrow[i] == a[i]);
    float both[8];
    f8_store(both, f8_narrow(x, y));
    for (int i = 0; i < 8; ++i) assert_true(both[i] == (float)(i < 4 ? p[i] : q[i - 4]));
}

static void points(void **state) {
    (void)state;
    const float *const from[4] = {a + 5, a, a + 3, a + 1};
    d4 out[3];
    double row[4];
    d4_load_points(from, out);
    for (int k = 0; k < 3; ++k) {
        d4_store(row, out[k]);
        for (int i = 0; i < 4; ++i) assert_true(row[i] == (double)from[i][k]);
    }
}

static void upper_halves(void **state) {
    (void)state;
    uint64_t in[8];
    uint32_t out[8];
    for (uint32_t i = 0; i < 8; ++i) in[i] = (uint64_t)(0xFFFFFFF9u + i) << 32 | (i * 0x30000001u);
    i8_store(out, i8_load_upper(in));
    for (uint32_t i = 0; i < 8; ++i) assert_true(out[i] == in[i] >> 32);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(floats),      cmocka_unit_test(transposing),
                                       cmocka_unit_test(integers),    cmocka_unit_test(truncating),
                                       cmocka_unit_test(doubles),     cmocka_unit_test(points),
                                       cmocka_unit_test(upper_halves)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
