/* The closed-form eigen solver against cyclic Jacobi rotations, on random, near-singular, equal-valued, huge
 * and tiny matrices. */
#include "support.h"

#include "base/math/eigen.h"
#include "base/math/simd_d8.h"

static double next(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0 * 2 - 1;
}

/* Jacobi's method: eigenvalues only, ascending. */
static void jacobi(const double m[6], double values[3]) {
    double a[3][3] = {{m[0], m[1], m[2]}, {m[1], m[3], m[4]}, {m[2], m[4], m[5]}};
    for (int sweep = 0; sweep < 40; ++sweep)
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (a[p][q] == 0) continue;
                double angle = 0.5 * atan2(2 * a[p][q], a[q][q] - a[p][p]), c = cos(angle), s = sin(angle);
                for (int k = 0; k < 3; ++k) {
                    double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y, a[k][q] = s * x + c * y;
                }
                for (int k = 0; k < 3; ++k) {
                    double x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y, a[q][k] = s * x + c * y;
                }
            }
    for (int i = 0; i < 3; ++i) values[i] = a[i][i];
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2 - i; ++j)
            if (values[j] > values[j + 1]) {
                double t = values[j];
                values[j] = values[j + 1], values[j + 1] = t;
            }
}

static void check(const double m[6], double tolerance) {
    double values[3], expected[3], norm = 0;
    v3 vectors[3];
    fct_eigen3(m, values, vectors);
    jacobi(m, expected);
    for (int i = 0; i < 6; ++i) norm = fmax(norm, fabs(m[i]));
    assert_true(values[0] <= values[1] && values[1] <= values[2]);
    for (int i = 0; i < 3; ++i) {
        assert_true(fabs(values[i] - expected[i]) <= tolerance * norm);
        v3 image = sym3_apply(m, vectors[i]);
        assert_true(v3_norm(v3_mad(image, -values[i], vectors[i])) <= tolerance * norm);
        for (int j = 0; j < 3; ++j) assert_true(fabs(v3_dot(vectors[i], vectors[j]) - (i == j)) <= 1e-14);
    }
    assert_true(v3_dot(v3_cross(vectors[0], vectors[1]), vectors[2]) > 0.99);
}

static void random_matrices(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int trial = 0; trial < 20000; ++trial) {
        double m[6];
        for (int i = 0; i < 6; ++i) m[i] = next(&seed);
        check(m, 1e-14);
    }
}

/* R diag(values) R^T with a random rotation. */
static void compose(double m[6], const double values[3], uint64_t *seed) {
    v3 a = v3_unit((v3){next(seed), next(seed), next(seed)}), b, c;
    v3_frame(a, &b, &c);
    memset(m, 0, 6 * sizeof *m);
    sym3_add_outer(m, values[0], a);
    sym3_add_outer(m, values[1], b);
    sym3_add_outer(m, values[2], c);
}

static void special_spectra(void **state) {
    (void)state;
    uint64_t seed = 7;
    const double spectra[][3] = {{0, 1, 1},         {0, 0, 1},          {1, 1, 1},
                                 {1, 1, 1 + 1e-13}, {0, 1e-9, 1},       {1e-16, 1, 2},
                                 {0, 0, 0},         {1, 1 + 1e-8, 1e6}, {-1, 0, 1}};
    for (size_t i = 0; i < sizeof spectra / sizeof *spectra; ++i)
        for (int trial = 0; trial < 500; ++trial) {
            double m[6];
            compose(m, spectra[i], &seed);
            check(m, 2e-14);
        }
}

static void huge_and_tiny(void **state) {
    (void)state;
    uint64_t seed = 3;
    const double scales[] = {1e-300, 1e-120, 1e120, 1e300};
    for (size_t s = 0; s < 4; ++s)
        for (int trial = 0; trial < 200; ++trial) {
            double m[6], values[3], expected[3];
            v3 vectors[3];
            for (int i = 0; i < 6; ++i) m[i] = next(&seed);
            jacobi(m, expected);
            for (int i = 0; i < 6; ++i) m[i] *= scales[s];
            fct_eigen3(m, values, vectors);
            for (int i = 0; i < 3; ++i) assert_true(fabs(values[i] / scales[s] - expected[i]) < 1e-13);
        }
}

/* Off the diagonal next to nothing, down to where its square is no longer a number with digits. */
static void nearly_diagonal(void **state) {
    (void)state;
    for (int power = -330; power < -10; power += 1)
        for (int which = 0; which < 8; ++which) {
            double m[6] = {which & 1 ? 1 : 0, 0, 0, 2, 0, which & 1 ? 1 : 0}, values[3];
            v3 vectors[3];
            double tiny = 3 * pow(10, power);
            m[1] = which & 2 ? tiny : 0, m[2] = which & 4 ? -tiny : tiny, m[4] = which & 4 ? tiny : 0;
            fct_eigen3(m, values, vectors);
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k <= i; ++k)
                    assert_true(fabs(v3_dot(vectors[i], vectors[k]) - (i == k)) < 1e-14);
        }
}

static void diagonal_gives_axes(void **state) {
    (void)state;
    const double identity[6] = {2, 0, 0, 2, 0, 2}, zero[6] = {0}, flat[6] = {3, 0, 0, 0, 0, 3};
    const double *matrices[] = {identity, zero};
    check((const double[6]){1, 1e-200, 0, 1, -1e-200, 1}, 1e-14);
    double values[3];
    v3 vectors[3];
    for (int i = 0; i < 2; ++i) {
        fct_eigen3(matrices[i], values, vectors);
        assert_true(vectors[0].x == 1 && vectors[1].y == 1 && vectors[2].z == 1);
    }
    fct_eigen3(flat, values, vectors);
    assert_true(values[0] == 0 && values[1] == 3 && values[2] == 3);
    assert_true(vectors[0].y == 1 && vectors[1].x == 1 && fabs(vectors[2].z) == 1);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            if (i != k) {
                double diagonal[3] = {2, 2, 2};
                diagonal[i] = 1, diagonal[k] = 3;
                check((const double[6]){diagonal[0], 0, 0, diagonal[1], 0, diagonal[2]}, 1e-15);
            }
}

/* Whatever stands in the other lanes. */
static void eight_are_each_as_one(void **state) {
    (void)state;
    uint64_t seed = 9;
    for (int trial = 0; trial < 500; ++trial) {
        double m[6][8], single[6], values[3], out[8];
        d8 matrices[6], all_values[3], all_vectors[3][3];
        v3 own[3];
        for (int k = 0; k < 6; ++k) {
            for (int i = 0; i < 8; ++i) m[k][i] = trial % 9 == i && (k % 5 > 0) && k != 3 ? 0 : next(&seed);
            matrices[k] = d8_load(m[k]);
        }
        fct_eigen3_eight((const d8 *)matrices, all_values, all_vectors);
        for (int i = 0; i < 8; ++i) {
            for (int k = 0; k < 6; ++k) single[k] = m[k][i];
            fct_eigen3(single, values, own);
            for (int k = 0; k < 3; ++k) {
                const double vector[3] = {own[k].x, own[k].y, own[k].z};
                d8_store(out, all_values[k]);
                assert_true(out[i] == values[k]);
                for (int j = 0; j < 3; ++j) {
                    d8_store(out, all_vectors[k][j]);
                    assert_true(out[i] == vector[j]);
                }
            }
        }
    }
}

/* Entries so small that their inverse is infinite. */
static void denormal_matrices_have_eigenvalues(void **state) {
    (void)state;
    const double s = 0x1p-1040, m[6] = {2 * s, s, 0, 2 * s, 0, 4 * s}, expected[3] = {1, 3, 4};
    double values[3];
    v3 vectors[3];
    fct_eigen3(m, values, vectors);
    for (int i = 0; i < 3; ++i) {
        assert_true(fabs(values[i] / s - expected[i]) < 1e-3);
        assert_true(fabs(v3_norm(vectors[i]) - 1) < 1e-12);
    }
}

int main(void) {
    skip_unless_variant_runs();
    const struct CMUnitTest tests[] = {cmocka_unit_test(denormal_matrices_have_eigenvalues),
                                       cmocka_unit_test(random_matrices),
                                       cmocka_unit_test(special_spectra),
                                       cmocka_unit_test(huge_and_tiny),
                                       cmocka_unit_test(nearly_diagonal),
                                       cmocka_unit_test(eight_are_each_as_one),
                                       cmocka_unit_test(diagonal_gives_axes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
