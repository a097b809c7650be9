/* tools/make/noise.c: seeded value noise without tables: a hash at each integer point, and smooth
 * interpolation. */
#include "tools/make/parts.h"

#include <math.h>

static uint64_t mix_bits(uint64_t h) {
    h ^= h >> 31;
    h *= 0x9e3779b97f4a7c15u;
    h ^= h >> 29;
    h *= 0xbf58476d1ce4e5b9u;
    return h ^ h >> 32;
}

double make_hash(int64_t x, int64_t y, int64_t z, uint64_t seed) {
    uint64_t h = mix_bits((uint64_t)x * 0x8da6b343u + (uint64_t)y * 0xd8163841u * 0x10001u +
                          (uint64_t)z * 0xcb1ab31fu * 0x100000001u + seed * 0x632be59bd9b4e019u);
    return (double)(h >> 11) * 0x1p-53;
}

double make_noise(make_point p, uint64_t seed) {
    double fx = floor(p.x), fy = floor(p.y), fz = floor(p.z);
    double x = p.x - fx, y = p.y - fy, z = p.z - fz, corner[8];
    for (int k = 0; k < 8; ++k)
        corner[k] =
            make_hash((int64_t)fx + (k & 1), (int64_t)fy + (k >> 1 & 1), (int64_t)fz + (k >> 2), seed);
    double u = x * x * (3 - 2 * x), v = y * y * (3 - 2 * y), w = z * z * (3 - 2 * z);
    double a = corner[0] + u * (corner[1] - corner[0]), b = corner[2] + u * (corner[3] - corner[2]),
           c = corner[4] + u * (corner[5] - corner[4]), d = corner[6] + u * (corner[7] - corner[6]);
    double e = a + v * (b - a), f = c + v * (d - c);
    return 2 * (e + w * (f - e)) - 1;
}
