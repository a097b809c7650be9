/* base/math/simd.h: eight floats or four doubles at a time. The only file with intrinsics. The AVX2 variant
 * of a kernel file uses them; the baseline uses plain loops, which the compiler turns into what the target
 * has.
 *
 * Both forms round each operation separately (no fused multiply-add) and treat NaN alike: min(a, b) is
 * a < b ? a : b, and a comparison with NaN is false. So both variants of a kernel give the same bits.
 */
#ifndef FCT_BASE_SIMD_H
#define FCT_BASE_SIMD_H

#include <stdint.h>

#ifndef FCT_KERNEL_FILE
#error "this file is not compiled as a kernel file: see base/variant.h, then run cmake again"
#endif

#ifdef FCT_VARIANT_AVX2
#include <immintrin.h>

typedef __m256d d4;
typedef __m256 f8;
typedef __m256i i8;

static inline d4 d4_set(double a) {
    return _mm256_set1_pd(a);
}
static inline d4 d4_load_floats(const float *p) {
    return _mm256_cvtps_pd(_mm_loadu_ps(p));
}
static inline void d4_store(double *p, d4 a) {
    _mm256_storeu_pd(p, a);
}
static inline void d4_store_floats(float *p, d4 a) {
    _mm_storeu_ps(p, _mm256_cvtpd_ps(a));
}
static inline d4 d4_add(d4 a, d4 b) {
    return _mm256_add_pd(a, b);
}
static inline d4 d4_sub(d4 a, d4 b) {
    return _mm256_sub_pd(a, b);
}
static inline d4 d4_mul(d4 a, d4 b) {
    return _mm256_mul_pd(a, b);
}
static inline d4 d4_div(d4 a, d4 b) {
    return _mm256_div_pd(a, b);
}
static inline d4 d4_sqrt(d4 a) {
    return _mm256_sqrt_pd(a);
}
static inline d4 d4_abs(d4 a) {
    return _mm256_andnot_pd(_mm256_set1_pd(-0.0), a);
}
static inline d4 d4_load(const double *p) {
    return _mm256_loadu_pd(p);
}
/* a_i < b_i ? x_i : y_i */
static inline d4 d4_if_lt(d4 a, d4 b, d4 x, d4 y) {
    return _mm256_blendv_pd(y, x, _mm256_cmp_pd(a, b, _CMP_LT_OQ));
}
/* Bit i: a_i < b_i. */
static inline uint32_t d4_lt(d4 a, d4 b) {
    return (uint32_t)_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_LT_OQ));
}
static inline d4 d4_min(d4 a, d4 b) {
    return _mm256_min_pd(a, b);
}
static inline d4 d4_max(d4 a, d4 b) {
    return _mm256_max_pd(a, b);
}
/* The x, y and z of four points. */
static inline void d4_load_points(const float *const p[4], d4 out[3]) {
    __m128 ab = _mm_loadh_pi(_mm_loadl_pi(_mm_setzero_ps(), (const __m64 *)(const void *)p[0]),
                             (const __m64 *)(const void *)p[1]);
    __m128 cd = _mm_loadh_pi(_mm_loadl_pi(_mm_setzero_ps(), (const __m64 *)(const void *)p[2]),
                             (const __m64 *)(const void *)p[3]);
    out[0] = _mm256_cvtps_pd(_mm_shuffle_ps(ab, cd, 0x88));
    out[1] = _mm256_cvtps_pd(_mm_shuffle_ps(ab, cd, 0xDD));
    out[2] = _mm256_cvtps_pd(_mm_setr_ps(p[0][2], p[1][2], p[2][2], p[3][2]));
}
static inline f8 f8_set(float a) {
    return _mm256_set1_ps(a);
}
static inline f8 f8_load(const float *p) {
    return _mm256_loadu_ps(p);
}
static inline void f8_store(float *p, f8 a) {
    _mm256_storeu_ps(p, a);
}
/* Both fours as floats. */
static inline f8 f8_narrow(d4 low, d4 high) {
    return _mm256_set_m128(_mm256_cvtpd_ps(high), _mm256_cvtpd_ps(low));
}
static inline f8 f8_add(f8 a, f8 b) {
    return _mm256_add_ps(a, b);
}
static inline f8 f8_sub(f8 a, f8 b) {
    return _mm256_sub_ps(a, b);
}
static inline f8 f8_mul(f8 a, f8 b) {
    return _mm256_mul_ps(a, b);
}
static inline f8 f8_div(f8 a, f8 b) {
    return _mm256_div_ps(a, b);
}
static inline f8 f8_min(f8 a, f8 b) {
    return _mm256_min_ps(a, b);
}
static inline f8 f8_max(f8 a, f8 b) {
    return _mm256_max_ps(a, b);
}
static inline f8 f8_abs(f8 a) {
    return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a);
}
/* |a| with the sign of s */
static inline f8 f8_copysign(f8 a, f8 s) {
    f8 sign = _mm256_set1_ps(-0.0f);
    return _mm256_or_ps(_mm256_andnot_ps(sign, a), _mm256_and_ps(sign, s));
}
static inline f8 f8_sqrt(f8 a) {
    return _mm256_sqrt_ps(a);
}
/* a_i < b_i ? x_i : y_i */
static inline f8 f8_if_lt(f8 a, f8 b, f8 x, f8 y) {
    return _mm256_blendv_ps(y, x, _mm256_cmp_ps(a, b, _CMP_LT_OQ));
}
/* The lower four behind the upper four. */
static inline f8 f8_swap(f8 a) {
    return _mm256_permute2f128_ps(a, a, 1);
}
/* Rows to columns of an 8 x 8 matrix. */
static inline void f8_transpose(f8 m[8]) {
    f8 a[8], b[8];
    for (int i = 0; i < 8; i += 2) {
        a[i] = _mm256_unpacklo_ps(m[i], m[i + 1]);
        a[i + 1] = _mm256_unpackhi_ps(m[i], m[i + 1]);
    }
    for (int i = 0; i < 8; i += 4)
        for (int k = 0; k < 2; ++k) {
            b[i + 2 * k] = _mm256_shuffle_ps(a[i + k], a[i + 2 + k], 0x44);
            b[i + 2 * k + 1] = _mm256_shuffle_ps(a[i + k], a[i + 2 + k], 0xEE);
        }
    for (int i = 0; i < 4; ++i) {
        m[i] = _mm256_permute2f128_ps(b[i], b[i + 4], 0x20);
        m[i + 4] = _mm256_permute2f128_ps(b[i], b[i + 4], 0x31);
    }
}
/* Rows to columns of a 4 x 4 matrix. */
static inline void d4_transpose(d4 m[4]) {
    d4 a = _mm256_unpacklo_pd(m[0], m[1]), b = _mm256_unpackhi_pd(m[0], m[1]);
    d4 c = _mm256_unpacklo_pd(m[2], m[3]), d = _mm256_unpackhi_pd(m[2], m[3]);
    m[0] = _mm256_permute2f128_pd(a, c, 0x20), m[1] = _mm256_permute2f128_pd(b, d, 0x20);
    m[2] = _mm256_permute2f128_pd(a, c, 0x31), m[3] = _mm256_permute2f128_pd(b, d, 0x31);
}
/* Eight rows of four floats to three columns; the fourth is passed over. */
static inline void f8_load_columns(const float *const rows[8], f8 columns[3]) {
    f8 r[4];
    for (int i = 0; i < 4; ++i)
        r[i] =
            _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(rows[i])), _mm_loadu_ps(rows[i + 4]), 1);
    f8 low01 = _mm256_unpacklo_ps(r[0], r[1]), low23 = _mm256_unpacklo_ps(r[2], r[3]);
    f8 high01 = _mm256_unpackhi_ps(r[0], r[1]), high23 = _mm256_unpackhi_ps(r[2], r[3]);
    columns[0] = _mm256_shuffle_ps(low01, low23, 0x44);
    columns[1] = _mm256_shuffle_ps(low01, low23, 0xEE);
    columns[2] = _mm256_shuffle_ps(high01, high23, 0x44);
}
/* Bit i: a_i <= b_i. */
static inline uint32_t f8_le(f8 a, f8 b) {
    return (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_LE_OQ));
}
static inline uint32_t f8_lt(f8 a, f8 b) {
    return (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_LT_OQ));
}
static inline i8 i8_set(uint32_t a) {
    return _mm256_set1_epi32((int)a);
}
static inline i8 i8_load(const uint32_t *p) {
    return _mm256_loadu_si256((const __m256i *)(const void *)p);
}
static inline void i8_store(uint32_t *p, i8 a) {
    _mm256_storeu_si256((__m256i *)(void *)p, a);
}
/* The upper halves of eight numbers. */
static inline i8 i8_load_upper(const uint64_t *p) {
    f8 a = _mm256_loadu_ps((const float *)(const void *)p);
    f8 b = _mm256_loadu_ps((const float *)(const void *)(p + 4));
    return _mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(a, b, 0xDD)), 0xD8);
}
/* Rounded towards zero; each below 2^31 in size. */
static inline i8 i8_trunc(f8 a) {
    return _mm256_cvttps_epi32(a);
}
static inline i8 i8_shift_right(i8 a, int bits) {
    return _mm256_srli_epi32(a, bits);
}
static inline i8 i8_or(i8 a, i8 b) {
    return _mm256_or_si256(a, b);
}
/* Bit i: a_i == b_i. */
static inline uint32_t i8_eq(i8 a, i8 b) {
    return (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b)));
}
/* Bit i: a_i < b_i, both below 2^31. */
static inline uint32_t i8_lt(i8 a, i8 b) {
    return (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpgt_epi32(b, a)));
}
static inline i8 i8_add(i8 a, i8 b) {
    return _mm256_add_epi32(a, b);
}
static inline i8 i8_and(i8 a, i8 b) {
    return _mm256_and_si256(a, b);
}
static inline i8 i8_xor(i8 a, i8 b) {
    return _mm256_xor_si256(a, b);
}
/* The lower 32 bits of each product. */
static inline i8 i8_mul(i8 a, i8 b) {
    return _mm256_mullo_epi32(a, b);
}
/* The bits of eight floats. */
static inline i8 i8_bits(f8 a) {
    return _mm256_castps_si256(a);
}
/* Each as the nearest float, all below 2^31. */
static inline f8 f8_from(i8 a) {
    return _mm256_cvtepi32_ps(a);
}
/* a & ~b */
static inline i8 i8_without(i8 a, i8 b) {
    return _mm256_andnot_si256(b, a);
}
/* Lanes of all ones where a_i == b_i, else of 0. */
static inline i8 i8_same(i8 a, i8 b) {
    return _mm256_cmpeq_epi32(a, b);
}
/* Lanes of all ones where a_i < b_i, both below 2^31. */
static inline i8 i8_less(i8 a, i8 b) {
    return _mm256_cmpgt_epi32(b, a);
}
/* x where the lane of the mask is all ones, else 0. */
static inline f8 f8_only(f8 x, i8 mask) {
    return _mm256_and_ps(x, _mm256_castsi256_ps(mask));
}
/* a where the lane of the mask is all ones, b where it is 0. */
static inline i8 i8_if(i8 mask, i8 a, i8 b) {
    return _mm256_blendv_epi8(b, a, mask);
}
static inline f8 f8_if(i8 mask, f8 a, f8 b) {
    return _mm256_blendv_ps(b, a, _mm256_castsi256_ps(mask));
}
/* Bit i: a_i <= b_i as unsigned numbers. */
static inline uint32_t i8_no_more(i8 a, i8 b) {
    return (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_min_epu32(a, b), a)));
}
/* a[index_i]; the lowest three bits of the index count. */
static inline i8 i8_lookup8(i8 a, i8 index) {
    return _mm256_permutevar8x32_epi32(a, index);
}
/* table[index_i], each below 2^31 */
static inline i8 i8_gather(const uint32_t *table, i8 index) {
    return _mm256_i32gather_epi32((const int *)(const void *)table, index, 4);
}
/* By mask, the numbers of its bits, four bits each. */
static const uint32_t fct_lanes_of[256] = {
    0x0,      0x0,       0x1,      0x10,      0x2,       0x20,      0x21,     0x210,     0x3,      0x30,
    0x31,     0x310,     0x32,     0x320,     0x321,     0x3210,    0x4,      0x40,      0x41,     0x410,
    0x42,     0x420,     0x421,    0x4210,    0x43,      0x430,     0x431,    0x4310,    0x432,    0x4320,
    0x4321,   0x43210,   0x5,      0x50,      0x51,      0x510,     0x52,     0x520,     0x521,    0x5210,
    0x53,     0x530,     0x531,    0x5310,    0x532,     0x5320,    0x5321,   0x53210,   0x54,     0x540,
    0x541,    0x5410,    0x542,    0x5420,    0x5421,    0x54210,   0x543,    0x5430,    0x5431,   0x54310,
    0x5432,   0x54320,   0x54321,  0x543210,  0x6,       0x60,      0x61,     0x610,     0x62,     0x620,
    0x621,    0x6210,    0x63,     0x630,     0x631,     0x6310,    0x632,    0x6320,    0x6321,   0x63210,
    0x64,     0x640,     0x641,    0x6410,    0x642,     0x6420,    0x6421,   0x64210,   0x643,    0x6430,
    0x6431,   0x64310,   0x6432,   0x64320,   0x64321,   0x643210,  0x65,     0x650,     0x651,    0x6510,
    0x652,    0x6520,    0x6521,   0x65210,   0x653,     0x6530,    0x6531,   0x65310,   0x6532,   0x65320,
    0x65321,  0x653210,  0x654,    0x6540,    0x6541,    0x65410,   0x6542,   0x65420,   0x65421,  0x654210,
    0x6543,   0x65430,   0x65431,  0x654310,  0x65432,   0x654320,  0x654321, 0x6543210, 0x7,      0x70,
    0x71,     0x710,     0x72,     0x720,     0x721,     0x7210,    0x73,     0x730,     0x731,    0x7310,
    0x732,    0x7320,    0x7321,   0x73210,   0x74,      0x740,     0x741,    0x7410,    0x742,    0x7420,
    0x7421,   0x74210,   0x743,    0x7430,    0x7431,    0x74310,   0x7432,   0x74320,   0x74321,  0x743210,
    0x75,     0x750,     0x751,    0x7510,    0x752,     0x7520,    0x7521,   0x75210,   0x753,    0x7530,
    0x7531,   0x75310,   0x7532,   0x75320,   0x75321,   0x753210,  0x754,    0x7540,    0x7541,   0x75410,
    0x7542,   0x75420,   0x75421,  0x754210,  0x7543,    0x75430,   0x75431,  0x754310,  0x75432,  0x754320,
    0x754321, 0x7543210, 0x76,     0x760,     0x761,     0x7610,    0x762,    0x7620,    0x7621,   0x76210,
    0x763,    0x7630,    0x7631,   0x76310,   0x7632,    0x76320,   0x76321,  0x763210,  0x764,    0x7640,
    0x7641,   0x76410,   0x7642,   0x76420,   0x76421,   0x764210,  0x7643,   0x76430,   0x76431,  0x764310,
    0x76432,  0x764320,  0x764321, 0x7643210, 0x765,     0x7650,    0x7651,   0x76510,   0x7652,   0x76520,
    0x76521,  0x765210,  0x7653,   0x76530,   0x76531,   0x765310,  0x76532,  0x765320,  0x765321, 0x7653210,
    0x7654,   0x76540,   0x76541,  0x765410,  0x76542,   0x765420,  0x765421, 0x7654210, 0x76543,  0x765430,
    0x765431, 0x7654310, 0x765432, 0x7654320, 0x7654321, 0x76543210};
/* The first lanes receive the numbers of the set bits of the mask, the remaining lanes 0. */
static inline i8 i8_chosen(uint32_t mask) {
    __m256i numbers = _mm256_srlv_epi32(_mm256_set1_epi32((int)fct_lanes_of[mask]),
                                        _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28));
    return _mm256_and_si256(numbers, _mm256_set1_epi32(7));
}
static inline i8 i8_load_bytes(const uint8_t *p) {
    return _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(const void *)p));
}
/* table[index_i] of the eight floats `table`; indices 0 to 7 */
static inline f8 f8_lookup8(f8 table, i8 index) {
    return _mm256_permutevar8x32_ps(table, index);
}
/* table[index_i] of the sixteen floats low, high; indices 0 to 15 */
static inline f8 f8_lookup16(f8 low, f8 high, i8 index) {
    f8 pick = _mm256_castsi256_ps(_mm256_slli_epi32(index, 28));
    return _mm256_blendv_ps(_mm256_permutevar8x32_ps(low, index), _mm256_permutevar8x32_ps(high, index),
                            pick);
}

#else

typedef struct d4 {
    double v[4];
} d4;
typedef struct f8 {
    float v[8];
} f8;
typedef struct i8 {
    int32_t v[8];
} i8;

#define FCT_D4(expression)                                                                                   \
    d4 r;                                                                                                    \
    for (int i = 0; i < 4; ++i) r.v[i] = (expression);                                                       \
    return r
#define FCT_F8(expression)                                                                                   \
    f8 r;                                                                                                    \
    for (int i = 0; i < 8; ++i) r.v[i] = (expression);                                                       \
    return r
#define FCT_M8(expression)                                                                                   \
    uint32_t mask = 0;                                                                                       \
    for (int i = 0; i < 8; ++i) mask |= (uint32_t)(expression) << i;                                         \
    return mask

static inline d4 d4_set(double a) {
    FCT_D4(a);
}
static inline d4 d4_load_floats(const float *p) {
    FCT_D4((double)p[i]);
}
static inline void d4_store(double *p, d4 a) {
    for (int i = 0; i < 4; ++i) p[i] = a.v[i];
}
static inline void d4_store_floats(float *p, d4 a) {
    for (int i = 0; i < 4; ++i) p[i] = (float)a.v[i];
}
static inline d4 d4_add(d4 a, d4 b) {
    FCT_D4(a.v[i] + b.v[i]);
}
static inline d4 d4_sub(d4 a, d4 b) {
    FCT_D4(a.v[i] - b.v[i]);
}
static inline d4 d4_mul(d4 a, d4 b) {
    FCT_D4(a.v[i] * b.v[i]);
}
static inline d4 d4_div(d4 a, d4 b) {
    FCT_D4(a.v[i] / b.v[i]);
}
static inline d4 d4_sqrt(d4 a) {
    FCT_D4(__builtin_sqrt(a.v[i]));
}
static inline d4 d4_abs(d4 a) {
    FCT_D4(__builtin_fabs(a.v[i]));
}
static inline d4 d4_load(const double *p) {
    FCT_D4(p[i]);
}
static inline d4 d4_if_lt(d4 a, d4 b, d4 x, d4 y) {
    FCT_D4(a.v[i] < b.v[i] ? x.v[i] : y.v[i]);
}
static inline uint32_t d4_lt(d4 a, d4 b) {
    uint32_t mask = 0;
    for (int i = 0; i < 4; ++i) mask |= (uint32_t)(a.v[i] < b.v[i]) << i;
    return mask;
}
static inline d4 d4_min(d4 a, d4 b) {
    FCT_D4(a.v[i] < b.v[i] ? a.v[i] : b.v[i]);
}
static inline d4 d4_max(d4 a, d4 b) {
    FCT_D4(a.v[i] > b.v[i] ? a.v[i] : b.v[i]);
}
static inline void d4_load_points(const float *const p[4], d4 out[3]) {
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 4; ++i) out[k].v[i] = (double)p[i][k];
}
static inline f8 f8_set(float a) {
    FCT_F8(a);
}
static inline f8 f8_load(const float *p) {
    FCT_F8(p[i]);
}
static inline void f8_store(float *p, f8 a) {
    for (int i = 0; i < 8; ++i) p[i] = a.v[i];
}
static inline f8 f8_narrow(d4 low, d4 high) {
    FCT_F8((float)(i < 4 ? low.v[i] : high.v[i - 4]));
}
static inline f8 f8_add(f8 a, f8 b) {
    FCT_F8(a.v[i] + b.v[i]);
}
static inline f8 f8_sub(f8 a, f8 b) {
    FCT_F8(a.v[i] - b.v[i]);
}
static inline f8 f8_mul(f8 a, f8 b) {
    FCT_F8(a.v[i] * b.v[i]);
}
static inline f8 f8_div(f8 a, f8 b) {
    FCT_F8(a.v[i] / b.v[i]);
}
static inline f8 f8_min(f8 a, f8 b) {
    FCT_F8(a.v[i] < b.v[i] ? a.v[i] : b.v[i]);
}
static inline f8 f8_max(f8 a, f8 b) {
    FCT_F8(a.v[i] > b.v[i] ? a.v[i] : b.v[i]);
}
static inline f8 f8_abs(f8 a) {
    FCT_F8(__builtin_fabsf(a.v[i]));
}
static inline f8 f8_copysign(f8 a, f8 s) {
    FCT_F8(__builtin_copysignf(a.v[i], s.v[i]));
}
static inline f8 f8_sqrt(f8 a) {
    FCT_F8(__builtin_sqrtf(a.v[i]));
}
static inline f8 f8_if_lt(f8 a, f8 b, f8 x, f8 y) {
    FCT_F8(a.v[i] < b.v[i] ? x.v[i] : y.v[i]);
}
static inline f8 f8_swap(f8 a) {
    FCT_F8(a.v[(i + 4) & 7]);
}
static inline void f8_transpose(f8 m[8]) {
    for (int i = 0; i < 8; ++i)
        for (int k = 0; k < i; ++k) {
            float t = m[i].v[k];
            m[i].v[k] = m[k].v[i], m[k].v[i] = t;
        }
}
static inline void d4_transpose(d4 m[4]) {
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < i; ++k) {
            double t = m[i].v[k];
            m[i].v[k] = m[k].v[i], m[k].v[i] = t;
        }
}
static inline void f8_load_columns(const float *const rows[8], f8 columns[3]) {
    for (int i = 0; i < 8; ++i)
        for (int k = 0; k < 3; ++k) columns[k].v[i] = rows[i][k];
}
static inline uint32_t f8_le(f8 a, f8 b) {
    FCT_M8(a.v[i] <= b.v[i]);
}
static inline uint32_t f8_lt(f8 a, f8 b) {
    FCT_M8(a.v[i] < b.v[i]);
}
static inline i8 i8_set(uint32_t a) {
    i8 r;
    for (int i = 0; i < 8; ++i) r.v[i] = (int32_t)a;
    return r;
}
static inline i8 i8_load(const uint32_t *p) {
    i8 r;
    for (int i = 0; i < 8; ++i) r.v[i] = (int32_t)p[i];
    return r;
}
static inline void i8_store(uint32_t *p, i8 a) {
    for (int i = 0; i < 8; ++i) p[i] = (uint32_t)a.v[i];
}
static inline i8 i8_load_upper(const uint64_t *p) {
    i8 r;
    for (int i = 0; i < 8; ++i) r.v[i] = (int32_t)(p[i] >> 32);
    return r;
}
static inline i8 i8_trunc(f8 a) {
    i8 r;
    for (int i = 0; i < 8; ++i) r.v[i] = (int32_t)a.v[i];
    return r;
}
static inline i8 i8_shift_right(i8 a, int bits) {
    for (int i = 0; i < 8; ++i) a.v[i] = (int32_t)((uint32_t)a.v[i] >> bits);
    return a;
}
static inline i8 i8_or(i8 a, i8 b) {
    for (int i = 0; i < 8; ++i) a.v[i] |= b.v[i];
    return a;
}
static inline uint32_t i8_eq(i8 a, i8 b) {
    FCT_M8(a.v[i] == b.v[i]);
}
static inline uint32_t i8_lt(i8 a, i8 b) {
    FCT_M8(a.v[i] < b.v[i]);
}
static inline i8 i8_add(i8 a, i8 b) {
    for (int i = 0; i < 8; ++i) a.v[i] = (int32_t)((uint32_t)a.v[i] + (uint32_t)b.v[i]);
    return a;
}
static inline i8 i8_and(i8 a, i8 b) {
    for (int i = 0; i < 8; ++i) a.v[i] &= b.v[i];
    return a;
}
static inline i8 i8_xor(i8 a, i8 b) {
    for (int i = 0; i < 8; ++i) a.v[i] ^= b.v[i];
    return a;
}
static inline i8 i8_mul(i8 a, i8 b) {
    for (int i = 0; i < 8; ++i) a.v[i] = (int32_t)((uint32_t)a.v[i] * (uint32_t)b.v[i]);
    return a;
}
static inline i8 i8_bits(f8 a) {
    i8 r;
    for (int i = 0; i < 8; ++i) {
        union {
            float f;
            int32_t bits;
        } u = {a.v[i]};
        r.v[i] = u.bits;
    }
    return r;
}
static inline f8 f8_from(i8 a) {
    FCT_F8((float)a.v[i]);
}
static inline i8 i8_without(i8 a, i8 b) {
    for (int i = 0; i < 8; ++i) a.v[i] &= ~b.v[i];
    return a;
}
static inline i8 i8_same(i8 a, i8 b) {
    for (int i = 0; i < 8; ++i) a.v[i] = a.v[i] == b.v[i] ? -1 : 0;
    return a;
}
static inline i8 i8_less(i8 a, i8 b) {
    for (int i = 0; i < 8; ++i) a.v[i] = a.v[i] < b.v[i] ? -1 : 0;
    return a;
}
static inline f8 f8_only(f8 x, i8 mask) {
    FCT_F8(mask.v[i] ? x.v[i] : 0);
}
static inline i8 i8_if(i8 mask, i8 a, i8 b) {
    for (int i = 0; i < 8; ++i) a.v[i] = mask.v[i] ? a.v[i] : b.v[i];
    return a;
}
static inline f8 f8_if(i8 mask, f8 a, f8 b) {
    FCT_F8(mask.v[i] ? a.v[i] : b.v[i]);
}
static inline uint32_t i8_no_more(i8 a, i8 b) {
    FCT_M8((uint32_t)a.v[i] <= (uint32_t)b.v[i]);
}
static inline i8 i8_lookup8(i8 a, i8 index) {
    i8 r;
    for (int i = 0; i < 8; ++i) r.v[i] = a.v[index.v[i] & 7];
    return r;
}
static inline i8 i8_gather(const uint32_t *table, i8 index) {
    for (int i = 0; i < 8; ++i) index.v[i] = (int32_t)table[(uint32_t)index.v[i]];
    return index;
}
static inline i8 i8_chosen(uint32_t mask) {
    i8 r = {{0}};
    for (int i = 0, to = 0; i < 8; ++i)
        if (mask >> i & 1) r.v[to++] = i;
    return r;
}
static inline i8 i8_load_bytes(const uint8_t *p) {
    i8 r;
    for (int i = 0; i < 8; ++i) r.v[i] = p[i];
    return r;
}
static inline f8 f8_lookup8(f8 table, i8 index) {
    FCT_F8(table.v[index.v[i] & 7]);
}
static inline f8 f8_lookup16(f8 low, f8 high, i8 index) {
    FCT_F8(index.v[i] & 8 ? high.v[index.v[i] & 7] : low.v[index.v[i] & 7]);
}

#undef FCT_D4
#undef FCT_F8
#undef FCT_M8
#endif

/* Stores the lanes whose bit is set, one after the other; all eight places may be written. */
static inline void i8_store_some(uint32_t *p, i8 a, uint32_t mask) {
    i8_store(p, i8_lookup8(a, i8_chosen(mask)));
}

#endif
