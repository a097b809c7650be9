/* radiosity/sample.h: deterministic sample points.
 *
 * Every number is a function of (seed, item, dimension), so results do not depend on the order of threads.
 * The plane sequence is the (0,2)-sequence of Sobol (van der Corput and its Pascal-matrix partner) under a
 * nested scramble: every aligned block of 2^k points has one point in each elementary interval of area 2^-k.
 * So the first 4, 16 and 64 points are stratified, and each set contains the smaller one.
 */
#ifndef FCT_RADIOSITY_SAMPLE_H
#define FCT_RADIOSITY_SAMPLE_H

#include <stdint.h>

#include "base/hash.h"
#include "base/math/elementary.h"
#include "base/math/vec.h"

#define FCT_PI 3.14159265358979323846

static inline uint64_t fct_hash2(uint64_t seed, uint64_t item) {
    return fct_hash(fct_hash(seed) ^ item);
}
static inline uint64_t fct_hash3(uint64_t seed, uint64_t item, uint64_t dimension) {
    return fct_hash(fct_hash2(seed, item) ^ dimension);
}
/* In [0, 1), from the upper 53 bits. */
static inline double fct_uniform(uint64_t hash) {
    return (double)(hash >> 11) * 0x1p-53;
}

/* A stream of uniform numbers in [0, 1), one stream per path. */
typedef struct fct_random {
    uint64_t state;
} fct_random;
static inline double fct_random_next(fct_random *random) {
    uint64_t value = fct_hash(random->state);
    random->state += 0x9e3779b97f4a7c15u;
    return fct_uniform(value);
}

static inline uint32_t fct_reverse_bits(uint32_t x) {
    x = __builtin_bswap32(x);
    x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
    x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
    return (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
}
/* Nested (Owen) scramble of a binary fraction: each bit flips or not by the bits above it. On the reversed
 * word each bit may then depend on lower bits only, as in sums and in products with even factors. */
static inline uint32_t fct_scramble(uint32_t x, uint32_t seed) {
    x = fct_reverse_bits(x) + seed;
    x ^= x * 0x9e6c63d0u;
    x ^= x * ((seed >> 16 | 1u) * 0xb5297a4cu);
    x += seed >> 3;
    x ^= x * 0x68e31da4u;
    x ^= x * 0x1b56c4e8u;
    return fct_reverse_bits(x);
}
/* The second dimension of the sequence: the radical inverse through Pascal's triangle modulo 2. */
static inline uint32_t fct_sobol(uint32_t index) {
    uint32_t x = 0;
    for (uint32_t column = 0x80000000u; index; index >>= 1, column ^= column >> 1)
        if (index & 1) x ^= column;
    return x;
}
/* Point `index` of the sequence scrambled by `seed`, in [0, 1)^2. */
static inline void fct_plane_point(uint32_t index, uint64_t seed, double point[2]) {
    point[0] = fct_scramble(fct_reverse_bits(index), (uint32_t)seed) * 0x1p-32;
    point[1] = fct_scramble(fct_sobol(index), (uint32_t)(seed >> 32)) * 0x1p-32;
}
/* A permutation of indices that maps aligned blocks to aligned blocks. It pairs two plane sequences without
 * correlation. */
static inline uint32_t fct_shuffle_index(uint32_t index, uint32_t seed) {
    return fct_scramble(index, seed);
}

/* Direction about the unit vector n with density cos / pi: Shirley and Chiu's concentric map of the square to
 * the disk, lifted to the hemisphere. */
static inline v3 fct_cosine_direction(v3 n, double u, double v) {
    double a = 2 * u - 1, b = 2 * v - 1, radius, angle;
    if (a * a > b * b) {
        radius = a, angle = FCT_PI / 4 * (b / a);
    } else {
        radius = b, angle = b != 0 ? FCT_PI / 2 - FCT_PI / 4 * (a / b) : 0;
    }
    double sine, cosine;
    fct_sine_cosine(angle, &sine, &cosine);
    double x = radius * cosine, y = radius * sine, z2 = 1 - radius * radius;
    v3 s, t;
    v3_frame(n, &s, &t);
    return v3_mad(v3_mad(v3_scale(n, sqrt(z2 > 0 ? z2 : 0)), x, s), y, t);
}
/* Barycentric weights of the second and third corner, uniform over the triangle. The map is continuous, so it
 * keeps the points' stratification. */
static inline void fct_triangle_point(double u, double v, double weights[2]) {
    double root = sqrt(u);
    weights[0] = root * (1 - v);
    weights[1] = root * v;
}

#endif
