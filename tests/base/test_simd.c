/* Compares each operation on eight or four numbers with its scalar meaning, lane by lane, for both forms of
 * the header. */
#include "support.h"

#include "base/math/simd_d8.h"

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

static void small_matrices(void **state) {
    (void)state;
    double in[4][4], out[4];
    float rows[8][4], column[8];
    const float *starts[8];
    d4 m[4];
    f8 columns[3];
    for (int i = 0; i < 8; ++i) {
        for (int k = 0; k < 4; ++k) rows[i][k] = (float)(10 * i + k), in[i % 4][k] = 10 * (i % 4) + k;
        starts[i] = rows[i];
    }
    for (int i = 0; i < 4; ++i) m[i] = d4_load(in[i]);
    d4_transpose(m);
    for (int i = 0; i < 4; ++i) {
        d4_store(out, m[i]);
        for (int k = 0; k < 4; ++k) assert_true(out[k] == in[k][i]);
    }
    f8_load_columns(starts, columns);
    for (int k = 0; k < 3; ++k) {
        f8_store(column, columns[k]);
        for (int i = 0; i < 8; ++i) assert_true(column[i] == rows[i][k]);
    }
}

static void some_lanes(void **state) {
    (void)state;
    const uint32_t in[8] = {3, 1, 4, 1, 5, 9, 2, 6};
    for (uint32_t mask = 0; mask < 256; ++mask) {
        uint32_t out[9] = {0, 0, 0, 0, 0, 0, 0, 0, 77}, count = 0;
        i8_store_some(out, i8_load(in), mask);
        for (uint32_t i = 0; i < 8; ++i)
            if (mask >> i & 1) assert_int_equal(out[count++], in[i]);
        assert_int_equal(out[8], 77);
    }
}

static void integers(void **state) {
    (void)state;
    const uint32_t u[8] = {5, 0xFFFFFFFF, 3, 5, 0x80000000, 9, 0x7FFFFFFF, 5},
                   v[8] = {5, 1, 4, 6, 2, 9, 8, 1};
    uint32_t out[8];
    assert_int_equal(i8_eq(i8_load(u), i8_load(v)), 0x21);
    assert_int_equal(i8_no_more(i8_load(u), i8_load(v)), 0x2D);
    assert_int_equal(i8_lt(i8_load(v), i8_set(5)), 0x96);
    i8_store(out, i8_or(i8_shift_right(i8_load(u), 5), i8_set(1)));
    for (int i = 0; i < 8; ++i) assert_int_equal(out[i], u[i] >> 5 | 1);
}

/* Masks, and lanes that change places. */
static void choosing(void **state) {
    (void)state;
    const uint32_t u[8] = {5, 0xFFFFFFFF, 3, 6, 0, 9, 12, 5}, v[8] = {5, 1, 4, 6, 2, 9, 8, 1};
    const uint32_t order[8] = {7, 0, 1, 10, 3, 4, 5, 6}, places[8] = {3, 3, 0, 9, 1, 4, 2, 8};
    uint32_t table[10], out[8];
    float chosen[8];
    for (uint32_t i = 0; i < 10; ++i) table[i] = 0xF0000000u + i;
    i8 x = i8_load(u), y = i8_load(v), same = i8_same(x, y);
    i8_store(out, same);
    for (int i = 0; i < 8; ++i) assert_int_equal(out[i], u[i] == v[i] ? 0xFFFFFFFF : 0);
    i8_store(out, i8_less(y, i8_set(5)));
    for (int i = 0; i < 8; ++i) assert_int_equal(out[i], v[i] < 5 ? 0xFFFFFFFF : 0);
    i8_store(out, i8_if(same, i8_add(x, y), i8_without(x, y)));
    for (int i = 0; i < 8; ++i) assert_int_equal(out[i], u[i] == v[i] ? u[i] + v[i] : u[i] & ~v[i]);
    i8_store(out, i8_and(i8_lookup8(x, i8_load(order)), i8_set(7)));
    for (int i = 0; i < 8; ++i) assert_int_equal(out[i], u[order[i] & 7] & 7);
    i8_store(out, i8_gather(table, i8_load(places)));
    for (int i = 0; i < 8; ++i) assert_int_equal(out[i], table[places[i]]);
    i8_store(out, i8_xor(i8_mul(x, i8_set(0x10000001)), y));
    for (int i = 0; i < 8; ++i) assert_int_equal(out[i], (u[i] * 0x10000001u) ^ v[i]);
    i8_store(out, i8_shift_right(i8_bits(f8_from(i8_add(y, i8_set(8)))), 23));
    for (int i = 0; i < 8; ++i) assert_int_equal(out[i], v[i] < 8 ? 130 : 131);
    f8_store(chosen, f8_only(f8_load(a), same));
    for (int i = 0; i < 8; ++i) assert_true(chosen[i] == (u[i] == v[i] ? a[i] : 0));
    f8_store(chosen, f8_if(same, f8_load(a), f8_load(b)));
    for (int i = 0; i < 8; ++i) assert_true(chosen[i] == (u[i] == v[i] ? a[i] : b[i]));
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
    assert_int_equal(d4_lt(x, y), 1);
    assert_int_equal(d4_lt(y, x), 14);
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

static void double_fours(void **state) {
    (void)state;
    const double p[8] = {1, -2, 1e300, 0, 9, -7, 0.25, 5}, q[8] = {3, -4, 2, -0.5, 8, 7, 0.125, 5};
    double out[8];
    float narrow[8];
    d8 x = d8_load(p), y = d8_load(q);
    d8_store(out, d8_div(d8_sub(x, y), d8_add(d8_mul(y, y), d8_set(1))));
    for (int i = 0; i < 8; ++i) assert_true(out[i] == (p[i] - q[i]) / (q[i] * q[i] + 1));
    assert_int_equal(d8_lt(x, y), 0x21);
    assert_int_equal(d8_lt(y, x), 0x5E);
    d8_store(out, d8_if_lt(x, y, d8_min(x, y), d8_max(x, y)));
    for (int i = 0; i < 8; ++i) assert_true(out[i] == p[i]);
    d8_store(out, d8_sqrt(d8_abs(y)));
    for (int i = 0; i < 8; ++i) assert_true(out[i] == sqrt(fabs(q[i])));
    d8_store_floats(narrow, d8_load_floats(a));
    for (int i = 0; i < 8; ++i) assert_true(narrow[i] == a[i]);
}

int main(void) {
    skip_unless_variant_runs();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(floats),       cmocka_unit_test(transposing),  cmocka_unit_test(small_matrices),
        cmocka_unit_test(some_lanes),   cmocka_unit_test(integers),     cmocka_unit_test(choosing),
        cmocka_unit_test(doubles),      cmocka_unit_test(double_fours), cmocka_unit_test(points),
        cmocka_unit_test(upper_halves), cmocka_unit_test(truncating),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
