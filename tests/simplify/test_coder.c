/* The adaptive range coder: the reader gets the values of the writer, the length is the entropy, and the
 * reader finds the end. */
#include "simplify/progressive/coder.h"
#include "support.h"

static fct_env env;

enum { COUNT = 20000 };

static uint32_t roll(uint32_t *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return *seed >> 8;
}

static uint32_t roll_below(uint32_t *seed, uint32_t total) {
    uint64_t high = roll(seed), low = roll(seed);
    return (uint32_t)((high << 16 ^ low) % total);
}

/* Bytes of COUNT bits that are 1 with the probability `ones`, with one model. *part: the part that is. */
static double code_bits(double ones, double *part) {
    bool bits[COUNT];
    uint32_t seed = 7;
    fct_model model;
    fct_coder coder = {.env = &env};
    fct_models_begin(&model, 1);
    fct_coder_begin_writing(&coder, &env);
    *part = 0;
    for (int i = 0; i < COUNT; ++i) {
        bits[i] = roll(&seed) < ones * (1 << 24);
        *part += (double)bits[i] / COUNT;
        assert_int_equal(fct_code_bit(&coder, &model, bits[i]), bits[i]);
    }
    assert_int_equal(fct_coder_end_writing(&coder), FCT_OK);
    fct_coder reader;
    fct_models_begin(&model, 1);
    fct_coder_begin_reading(&reader, coder.bytes, coder.count);
    for (int i = 0; i < COUNT; ++i) assert_int_equal(fct_code_bit(&reader, &model, false), bits[i]);
    assert_true(fct_coder_end_reading(&reader));
    double bytes = (double)coder.count;
    fct_coder_release(&coder);
    return bytes;
}

/* The entropy is n (-p log2 p - q log2 q) bits. A model that moves by 1/32 of the distance costs 1 to 5 %. */
static void bits_cost_their_entropy(void **state) {
    (void)state;
    for (double p = .05; p < .96; p += .15) {
        double q, bytes = code_bits(p, &q), entropy = COUNT / 8. * -(q * log2(q) + (1 - q) * log2(1 - q));
        assert_true(bytes > entropy && bytes < 1.06 * entropy);
    }
    double part;
    assert_true(code_bits(0, &part) < .015 * COUNT / 8 && code_bits(1, &part) < .015 * COUNT / 8);
}

static void uniform_values_cost_their_logarithm(void **state) {
    (void)state;
    static const uint32_t totals[] = {1, 2, 3, 10, 1000, 65535, 65536, 65537, 1000000, INT32_MAX, UINT32_MAX};
    for (size_t t = 0; t < FCT_LENGTH(totals); ++t) {
        uint32_t total = totals[t], seed = 3;
        fct_coder coder = {.env = &env}, reader;
        fct_coder_begin_writing(&coder, &env);
        for (int i = 0; i < COUNT; ++i) {
            uint32_t value = roll_below(&seed, total);
            fct_code_uniform(&coder, total, i == 0 ? 0 : i == 1 ? total - 1 : value);
        }
        assert_int_equal(fct_coder_end_writing(&coder), FCT_OK);
        double bits = COUNT * log2(total);
        assert_true(fabs(8 * (double)coder.count - bits) < .001 * bits + 40);
        seed = 3;
        fct_coder_begin_reading(&reader, coder.bytes, coder.count);
        for (int i = 0; i < COUNT; ++i) {
            uint32_t value = roll_below(&seed, total);
            assert_int_equal(fct_code_uniform(&reader, total, 0), i == 0 ? 0 : i == 1 ? total - 1 : value);
        }
        assert_true(fct_coder_end_reading(&reader));
        /* Without its last byte the stream is too short (but not if it has no values), with one more too
         * long. */
        for (int change = total > 1 ? -1 : 1; change < 2; change += 2) {
            size_t count = coder.count + (size_t)change;
            unsigned char *bytes = calloc(count, 1);
            memcpy(bytes, coder.bytes, count < coder.count ? count : coder.count);
            fct_coder_begin_reading(&reader, bytes, count);
            for (int i = 0; i < COUNT; ++i) fct_code_uniform(&reader, total, 0);
            assert_false(fct_coder_end_reading(&reader));
            free(bytes);
        }
        fct_coder_release(&coder);
    }
}

static void numbers_and_floats_come_back(void **state) {
    (void)state;
    static const uint32_t numbers[] = {0, 1, 2, 3, 4, 255, 256, 65535, 65536, 1u << 30, 1u << 31, UINT32_MAX};
    static const float floats[] = {0,     -0.0f,  1,        -1,        1e-45f,    -1e-45f,
                                   3e38f, -3e38f, INFINITY, -INFINITY, 1.0000001f};
    fct_number_models models;
    fct_coder coder = {.env = &env}, reader;
    fct_models_begin(models.classes, CODER_CLASSES);
    fct_coder_begin_writing(&coder, &env);
    for (size_t i = 0; i < FCT_LENGTH(numbers); ++i) fct_code_number(&coder, &models, numbers[i]);
    for (size_t i = 0; i < FCT_LENGTH(floats); ++i)
        for (size_t j = 0; j < FCT_LENGTH(floats); ++j) fct_code_float(&coder, &models, floats[i], floats[j]);
    assert_int_equal(fct_coder_end_writing(&coder), FCT_OK);
    fct_models_begin(models.classes, CODER_CLASSES);
    fct_coder_begin_reading(&reader, coder.bytes, coder.count);
    for (size_t i = 0; i < FCT_LENGTH(numbers); ++i)
        assert_int_equal(fct_code_number(&reader, &models, 0), numbers[i]);
    for (size_t i = 0; i < FCT_LENGTH(floats); ++i)
        for (size_t j = 0; j < FCT_LENGTH(floats); ++j) {
            float value = fct_code_float(&reader, &models, floats[i], 0);
            assert_memory_equal(&value, &floats[j], sizeof value);
        }
    assert_true(fct_coder_end_reading(&reader));
    fct_coder_release(&coder);
}

/* Any bytes give values in their range, also counts of bits above 32. */
static void garbage_stays_in_range(void **state) {
    (void)state;
    unsigned char bytes[400];
    uint32_t seed = 1, largest = 0;
    for (int run = 0; run < 50; ++run) {
        for (size_t i = 0; i < sizeof bytes; ++i) bytes[i] = (unsigned char)(run ? roll(&seed) >> 9 : 255);
        fct_coder reader;
        fct_coder_begin_reading(&reader, bytes, sizeof bytes);
        for (uint32_t i = 0; i < 300; ++i) {
            uint32_t total = i % 2 ? 3 + i * i * i : 3 + i;
            assert_true(fct_code_uniform(&reader, total, 0) < total);
        }
        /* Bytes of 255 begin with a count of 63 bits, which counts as 32. */
        fct_number_models models;
        fct_models_begin(models.classes, CODER_CLASSES);
        fct_coder_begin_reading(&reader, bytes, sizeof bytes);
        for (int i = 0; i < 50; ++i) {
            uint32_t number = fct_code_number(&reader, &models, 0);
            if (run == 0 && i == 0) assert_true(number >> 31);
            if (number > largest) largest = number;
        }
    }
    assert_true(largest > 1u << 31);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bits_cost_their_entropy), cmocka_unit_test(uniform_values_cost_their_logarithm),
        cmocka_unit_test(numbers_and_floats_come_back), cmocka_unit_test(garbage_stays_in_range)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
