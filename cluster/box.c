/* cluster/box.c: oriented boxes of streams of points.
 *
 * Extents are taken in double along the very axes that fct_cluster_box expands from the stored quaternion, so
 * that a box holds its points for exactly these, and is as tight as they allow.
 */
#include "cluster/box.h"

#include <float.h>
#include <string.h>

#include "base/simd.h"

enum { SAMPLES = 64 };

/* fmax and fmin are calls here, for they must look out for NaN. */
static inline double greater(double a, double b) {
    return a > b ? a : b;
}
static inline double lesser(double a, double b) {
    return a < b ? a : b;
}

void fct_box_axes(const float q[4], float axes[3][3]) {
    double x = (double)q[0], y = (double)q[1], z = (double)q[2], w = (double)q[3];
    double s = 2 / (x * x + y * y + z * z + w * w);
    v3_store(axes[0], (v3){1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)});
    v3_store(axes[1], (v3){s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)});
    v3_store(axes[2], (v3){s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)});
}

void fct_cluster_box(const fct_cluster *cluster, fct_box *out) {
    for (int k = 0; k < 3; ++k) out->center[k] = cluster->box_center[k], out->half[k] = cluster->box_half[k];
    fct_box_axes(cluster->box_rotation, out->axes);
}

void fct_box_rotation(const v3 a[3], float rotation[4]) {
    double t[4] = {1 + a[0].x - a[1].y - a[2].z, 1 - a[0].x + a[1].y - a[2].z, 1 - a[0].x - a[1].y + a[2].z,
                   1 + a[0].x + a[1].y + a[2].z};
    double xy = a[0].y + a[1].x, xz = a[0].z + a[2].x, yz = a[1].z + a[2].y;
    double wx = a[1].z - a[2].y, wy = a[2].x - a[0].z, wz = a[0].y - a[1].x;
    int most = 0;
    for (int i = 1; i < 4; ++i)
        if (t[i] > t[most]) most = i;
    double rows[4][4] = {{t[0], xy, xz, wx}, {xy, t[1], yz, wy}, {xz, yz, t[2], wz}, {wx, wy, wz, t[3]}};
    double length = 0;
    for (int i = 0; i < 4; ++i) length += rows[most][i] * rows[most][i];
    length = 1 / sqrt(length);
    for (int i = 0; i < 4; ++i) rotation[i] = (float)(rows[most][i] * length);
}

typedef struct lanes {
    d4 low[3], high[3];
} lanes;

static inline void widen(lanes *l, const float *x, const float *y, const float *z, d4 a[3][3]) {
    d4 px = d4_load_floats(x), py = d4_load_floats(y), pz = d4_load_floats(z);
    for (int k = 0; k < 3; ++k) {
        d4 d = d4_add(d4_add(d4_mul(px, a[k][0]), d4_mul(py, a[k][1])), d4_mul(pz, a[k][2]));
        l->low[k] = d4_min(d, l->low[k]);
        l->high[k] = d4_max(d, l->high[k]);
    }
}

void fct_extents_add(fct_extents *extents, fct_points points, size_t begin, size_t end,
                     const float axes[3][3]) {
    if (begin >= end) return;
    d4 a[3][3];
    lanes l;
    for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < 3; ++i) a[k][i] = d4_set((double)axes[k][i]);
        l.low[k] = d4_set(extents->low[k]), l.high[k] = d4_set(extents->high[k]);
    }
    size_t i = begin;
    for (; i + 4 <= end; i += 4) widen(&l, points.x + i, points.y + i, points.z + i, a);
    if (i < end && end - begin >= 4) {
        widen(&l, points.x + end - 4, points.y + end - 4, points.z + end - 4, a);
    } else if (i < end) {
        float tail[3][4];
        for (size_t k = 0; k < 4; ++k) {
            size_t from = begin + k < end ? begin + k : begin;
            tail[0][k] = points.x[from], tail[1][k] = points.y[from], tail[2][k] = points.z[from];
        }
        widen(&l, tail[0], tail[1], tail[2], a);
    }
    for (int k = 0; k < 3; ++k) {
        double low[4], high[4];
        d4_store(low, l.low[k]);
        d4_store(high, l.high[k]);
        extents->low[k] = lesser(lesser(low[0], low[1]), lesser(low[2], low[3]));
        extents->high[k] = greater(greater(high[0], high[1]), greater(high[2], high[3]));
    }
}

/* The next float above one that is not below 0. */
static float above(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits += bits < 0x7F800000u;
    memcpy(&value, &bits, sizeof bits);
    return value;
}

bool fct_box_set(const fct_extents *e, const float axes[3][3], v3 point, fct_cluster *cluster) {
    /* from a point, for axes are orthonormal to float rounding only, and the model may be far from 0 */
    v3 center = point, a[3];
    double size = 0;
    bool within = true;
    for (int k = 0; k < 3; ++k) {
        a[k] = v3_load(axes[k]);
        center = v3_mad(center, 0.5 * (e->low[k] + e->high[k]) - v3_dot(point, a[k]), a[k]);
        size = greater(size, greater(fabs(e->low[k]), fabs(e->high[k])));
    }
    v3_store(cluster->box_center, center);
    center = v3_load(cluster->box_center);
    for (int k = 0; k < 3; ++k) {
        double middle = v3_dot(center, a[k]), half = greater(e->high[k] - middle, middle - e->low[k]);
        half += 16 * DBL_EPSILON * size; /* whatever order of operations checks it */
        cluster->box_half[k] = above((float)half);
        within = within && isfinite(cluster->box_half[k]) && isfinite(cluster->box_center[k]);
        cluster->box_half[k] = cluster->box_half[k] < FLT_MAX ? cluster->box_half[k] : FLT_MAX;
    }
    return within;
}

static inline void sample4(const float *x, const float *y, const float *z, const d4 origin[4], d4 f[3][3],
                           float (*out)[SAMPLES + 4], size_t to) {
    d4 p[3] = {d4_mul(d4_sub(d4_load_floats(x), origin[0]), origin[3]),
               d4_mul(d4_sub(d4_load_floats(y), origin[1]), origin[3]),
               d4_mul(d4_sub(d4_load_floats(z), origin[2]), origin[3])};
    for (int k = 0; k < 3; ++k) {
        d4 d = d4_add(d4_mul(p[0], f[k][0]), d4_mul(p[1], f[k][1]));
        d4_store_floats(out[k] + to, d4_add(d, d4_mul(p[2], f[k][2])));
    }
}

/* Points along the frame's axes, from the first of them, over the size; returns how many. What is left of
 * fours is made up for by points that are there already. */
static size_t sample(fct_points p, size_t begin, size_t end, double size, const v3 frame[3],
                     float (*out)[SAMPLES + 4]) {
    d4 f[3][3], origin[4] = {d4_set((double)p.x[begin]), d4_set((double)p.y[begin]),
                             d4_set((double)p.z[begin]), d4_set(1 / size)};
    for (int k = 0; k < 3; ++k)
        f[k][0] = d4_set(frame[k].x), f[k][1] = d4_set(frame[k].y), f[k][2] = d4_set(frame[k].z);
    size_t count = end - begin, to = 0;
    if (count >= 4 && count <= SAMPLES) {
        for (; to + 4 <= count; to += 4)
            sample4(p.x + begin + to, p.y + begin + to, p.z + begin + to, origin, f, out, to);
        if (to < count) sample4(p.x + end - 4, p.y + end - 4, p.z + end - 4, origin, f, out, to), to += 4;
        return to;
    }
    size_t taken = count < SAMPLES ? 4 : SAMPLES;
    for (; to < taken; to += 4) {
        float x[4], y[4], z[4];
        for (size_t i = 0; i < 4; ++i) {
            size_t at = begin + (count < SAMPLES ? (i < count ? i : 0) : (to + i) * count / SAMPLES);
            x[i] = p.x[at], y[i] = p.y[at], z[i] = p.z[at];
        }
        sample4(x, y, z, origin, f, out, to);
    }
    return to;
}

void fct_box_turn(fct_points points, size_t begin, size_t end, double size, v3 frame[3]) {
    static const float cosines[8] = {1,           0.98078528f, 0.92387953f, 0.83146961f,
                                     0.70710678f, 0.55557023f, 0.38268343f, 0.19509032f};
    static const float sines[8] = {0,           0.19509032f, 0.38268343f, 0.55557023f,
                                   0.70710678f, 0.83146961f, 0.92387953f, 0.98078528f};
    float w[3][SAMPLES + 4], areas[8], low_w = INFINITY, high_w = -INFINITY;
    size_t count = sample(points, begin, end, size, frame, w);
    f8 c = f8_load(cosines), s = f8_load(sines), low = f8_set(INFINITY), high = f8_set(-INFINITY);
    f8 low_a = low, high_a = high, low_b = low, high_b = high;
    for (size_t i = 0; i < count; ++i) {
        f8 u = f8_set(w[0][i]), v = f8_set(w[1][i]);
        f8 a = f8_add(f8_mul(c, u), f8_mul(s, v)), b = f8_sub(f8_mul(c, v), f8_mul(s, u));
        low_a = f8_min(a, low_a), high_a = f8_max(a, high_a);
        low_b = f8_min(b, low_b), high_b = f8_max(b, high_b);
        low_w = w[2][i] < low_w ? w[2][i] : low_w, high_w = w[2][i] > high_w ? w[2][i] : high_w;
    }
    f8 x = f8_sub(high_a, low_a), y = f8_sub(high_b, low_b), height = f8_set(high_w - low_w);
    f8_store(areas, f8_add(f8_mul(x, y), f8_mul(height, f8_add(x, y))));
    int best = 0;
    for (int i = 1; i < 8; ++i)
        if (areas[i] < areas[best]) best = i;
    if (best == 0) return;
    v3 t = frame[0], b = frame[1];
    frame[0] = v3_mad(v3_scale(t, (double)cosines[best]), (double)sines[best], b);
    frame[1] = v3_mad(v3_scale(b, (double)cosines[best]), -(double)sines[best], t);
}

double fct_box_area(const fct_extents *e) {
    double x = e->high[0] - e->low[0], y = e->high[1] - e->low[1], z = e->high[2] - e->low[2];
    return x * y + y * z + z * x;
}
