/* v3_round and fct_round return the value of the float, also if gcc vectorises the code around them. Without
 * the barrier in base/math/round.h these tests fail under gcc 12 at -O2 and -O3. */
#include "support.h"

#include "base/math/round.h"

/* Rounds, stores the floats and continues with their values, as the code that computes bounds does. */
__attribute__((noinline)) static void round_scaled(const double *in, float *stored, double *held) {
    v3 a = v3_round((v3){in[0] * 3, in[1] * 5, in[2] * 7});
    v3_store(stored, a);
    held[0] = a.x, held[1] = a.y, held[2] = a.z;
}

static void a_rounded_vector_is_what_its_floats_hold(void **state) {
    (void)state;
    volatile double first = 0.1; /* nothing here is known when it is compiled */
    const double in[3] = {first, first + 0.61, first + 0.23};
    double held[3];
    float stored[3];
    round_scaled(in, stored, held);
    for (int k = 0; k < 3; ++k) {
        assert_true(held[k] == (double)stored[k]);
        assert_true(held[k] != in[k] * (3 + 2 * k));
        assert_true(fabs(held[k] / (in[k] * (3 + 2 * k)) - 1) <= 0x1p-24);
    }
}

__attribute__((noinline)) static void round_many(const double *in, float *stored, double *held) {
    for (int i = 0; i < 8; ++i) {
        held[i] = fct_round(in[i] * 3);
        stored[i] = (float)held[i];
    }
}

static void a_rounded_number_is_what_its_float_holds(void **state) {
    (void)state;
    double in[8], held[8];
    float stored[8];
    for (int i = 0; i < 8; ++i) in[i] = 0.1 * (i + 1);
    round_many(in, stored, held);
    for (int i = 0; i < 8; ++i) assert_true(held[i] == (double)stored[i] && fabs(held[i] / in[i] - 3) < 1e-6);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_rounded_vector_is_what_its_floats_hold),
        cmocka_unit_test(a_rounded_number_is_what_its_float_holds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
