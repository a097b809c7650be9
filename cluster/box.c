/* cluster/box.c: oriented boxes and normal cones over streams of corners and normals.
 *
 * Extents are taken in double along the very axes that fct_cluster_box expands from the stored quaternion.
 * The loops keep one extreme per lane and fold the lanes at the end: the compiler makes vectors of them and
 * the result does not depend on whether it does.
 */
#include "cluster/box.h"

#include <float.h>
#include <string.h>

enum { LANES = 8, SAMPLES = 64, TURNS = 8 };

/* fmax and fmin are calls here, for they must look out for NaN. */
static inline double greater(double a, double b) {
    return a > b ? a : b;
}
static inline double lesser(double a, double b) {
    return a < b ? a : b;
}

static void expand(const float q[4], float axes[3][3]) {
    double x = (double)q[0], y = (double)q[1], z = (double)q[2], w = (double)q[3];
    double s = 2 / (x * x + y * y + z * z + w * w);
    v3_store(axes[0], (v3){1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)});
    v3_store(axes[1], (v3){s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)});
    v3_store(axes[2], (v3){s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)});
}

void fct_cluster_box(const fct_cluster *cluster, fct_box *out) {
    for (int k = 0; k < 3; ++k) out->center[k] = cluster->box_center[k], out->half[k] = cluster->box_half[k];
    expand(cluster->box_rotation, out->axes);
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
    for (int i = 0; i < 4; ++i) rotation[i] = (float)(rows[most][i] / sqrt(length));
}

void fct_soup_face(const fct_soup *soup, size_t place, const float *positions, const uint32_t triangle[3]) {
    v3 p[3];
    for (size_t k = 0; k < 3; ++k) {
        const float *from = positions + 3 * (size_t)triangle[k];
        for (int i = 0; i < 3; ++i) soup->corner[i][3 * place + k] = from[i];
        p[k] = v3_load(from);
    }
    v3 normal = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    double length = v3_norm(normal);
    normal = length > 0 ? v3_scale(normal, 1 / length) : (v3){NAN, NAN, NAN};
    soup->normal[0][place] = (float)normal.x;
    soup->normal[1][place] = (float)normal.y;
    soup->normal[2][place] = (float)normal.z;
}

typedef struct lanes {
    double low[3][LANES], high[3][LANES];
} lanes;

static inline void widen(lanes *l, const float *x, const float *y, const float *z, const double a[3][3]) {
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < LANES; ++i) {
            double d = (double)x[i] * a[k][0] + (double)y[i] * a[k][1] + (double)z[i] * a[k][2];
            l->low[k][i] = d < l->low[k][i] ? d : l->low[k][i];
            l->high[k][i] = d > l->high[k][i] ? d : l->high[k][i];
        }
}

/* Least and greatest corner . axis of a run of corners. */
static void extents(const fct_soup *soup, size_t begin, size_t end, const float axes[3][3], double low[3],
                    double high[3]) {
    double a[3][3];
    lanes l;
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i) a[k][i] = (double)axes[k][i];
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < LANES; ++i) l.low[k][i] = INFINITY, l.high[k][i] = -INFINITY;
    const float *x = soup->corner[0], *y = soup->corner[1], *z = soup->corner[2];
    for (; begin + LANES <= end; begin += LANES) widen(&l, x + begin, y + begin, z + begin, a);
    if (begin < end) {
        float tail[3][LANES];
        for (size_t i = 0; i < LANES; ++i) {
            size_t from = begin + i < end ? begin + i : begin;
            tail[0][i] = x[from], tail[1][i] = y[from], tail[2][i] = z[from];
        }
        widen(&l, tail[0], tail[1], tail[2], a);
    }
    for (int k = 0; k < 3; ++k) {
        low[k] = l.low[k][0], high[k] = l.high[k][0];
        for (int i = 1; i < LANES; ++i)
            low[k] = lesser(low[k], l.low[k][i]), high[k] = greater(high[k], l.high[k][i]);
    }
}

/* False where its numbers leave the range of a float. */
static bool fit_along(const fct_soup *soup, size_t first, size_t count, fct_cluster *cluster) {
    float axes[3][3];
    expand(cluster->box_rotation, axes);
    double low[3], high[3], size = 0;
    bool within = true;
    extents(soup, 3 * first, 3 * (first + count), (const float(*)[3])axes, low, high);
    /* from a corner, for axes are orthonormal to float rounding only, and the model may be far from 0 */
    v3 origin = {(double)soup->corner[0][3 * first], (double)soup->corner[1][3 * first],
                 (double)soup->corner[2][3 * first]};
    v3 center = origin, a[3];
    for (int k = 0; k < 3; ++k) {
        a[k] = v3_load(axes[k]);
        center = v3_mad(center, 0.5 * (low[k] + high[k]) - v3_dot(origin, a[k]), a[k]);
        size = greater(size, greater(fabs(low[k]), fabs(high[k])));
    }
    v3_store(cluster->box_center, center);
    center = v3_load(cluster->box_center);
    for (int k = 0; k < 3; ++k) {
        double middle = v3_dot(center, a[k]), half = greater(high[k] - middle, middle - low[k]);
        half += 16 * DBL_EPSILON * size; /* whatever order of operations checks it */
        cluster->box_half[k] = nextafterf((float)half, INFINITY);
        within = within && isfinite(cluster->box_half[k]) && isfinite(cluster->box_center[k]);
    }
    return within;
}

void fct_box_fit(const fct_soup *soup, size_t first, size_t count, fct_cluster *cluster) {
    if (fit_along(soup, first, count, cluster)) return;
    /* Across more than half the range of floats a turned box may not have one: the world's axes do. */
    static const float world[4] = {0, 0, 0, 1};
    memcpy(cluster->box_rotation, world, sizeof world);
    if (fit_along(soup, first, count, cluster)) return;
    for (int k = 0; k < 3; ++k) cluster->box_half[k] = fminf(cluster->box_half[k], FLT_MAX);
}

void fct_box_turn(const fct_soup *soup, size_t first, size_t count, v3 frame[3]) {
    size_t corners = 3 * count, samples = corners < SAMPLES ? corners : SAMPLES;
    size_t padded = (samples + 15) & ~(size_t)15;
    float u[SAMPLES], v[SAMPLES], low_w = INFINITY, high_w = -INFINITY;
    size_t base = 3 * first;
    v3 origin = {(double)soup->corner[0][base], (double)soup->corner[1][base], (double)soup->corner[2][base]};
    double scale = 0;
    v3 offsets[SAMPLES];
    for (size_t i = 0; i < samples; ++i) {
        size_t at = base + i * corners / samples;
        offsets[i] = v3_sub(
            (v3){(double)soup->corner[0][at], (double)soup->corner[1][at], (double)soup->corner[2][at]},
            origin);
        scale = greater(scale, greater(fabs(offsets[i].x), greater(fabs(offsets[i].y), fabs(offsets[i].z))));
    }
    if (!(scale > 0)) return;
    for (size_t i = 0; i < padded; ++i) {
        v3 p = v3_scale(offsets[i < samples ? i : 0], 1 / scale);
        u[i] = (float)v3_dot(p, frame[0]);
        v[i] = (float)v3_dot(p, frame[1]);
        float w = (float)v3_dot(p, frame[2]);
        if (w < low_w) low_w = w;
        if (w > high_w) high_w = w;
    }
    static const float turns[TURNS][2] = {
        {1, 0},
        {0.98078528f, 0.19509032f},
        {0.92387953f, 0.38268343f},
        {0.83146961f, 0.55557023f},
        {0.70710678f, 0.70710678f},
        {0.55557023f, 0.83146961f},
        {0.38268343f, 0.92387953f},
        {0.19509032f, 0.98078528f},
    };
    float best = INFINITY, height = high_w - low_w;
    int best_turn = 0;
    for (int t = 0; t < TURNS; ++t) {
        float c = turns[t][0], s = turns[t][1], low[2][16], high[2][16];
        for (int i = 0; i < 16; ++i) low[0][i] = low[1][i] = INFINITY, high[0][i] = high[1][i] = -INFINITY;
        for (size_t from = 0; from < padded; from += 16)
            for (size_t i = 0; i < 16; ++i) {
                float a = c * u[from + i] + s * v[from + i], b = c * v[from + i] - s * u[from + i];
                low[0][i] = a < low[0][i] ? a : low[0][i], high[0][i] = a > high[0][i] ? a : high[0][i];
                low[1][i] = b < low[1][i] ? b : low[1][i], high[1][i] = b > high[1][i] ? b : high[1][i];
            }
        for (int i = 1; i < 16; ++i)
            for (int k = 0; k < 2; ++k) {
                if (low[k][i] < low[k][0]) low[k][0] = low[k][i];
                if (high[k][i] > high[k][0]) high[k][0] = high[k][i];
            }
        float x = high[0][0] - low[0][0], y = high[1][0] - low[1][0];
        float area = x * y + height * (x + y);
        if (area < best) best = area, best_turn = t;
    }
    v3 t = frame[0], b = frame[1];
    double c = (double)turns[best_turn][0], s = (double)turns[best_turn][1];
    frame[0] = v3_mad(v3_scale(t, c), s, b);
    frame[1] = v3_mad(v3_scale(b, c), -s, t);
}

double fct_box_area(const fct_cluster *cluster) {
    double x = (double)cluster->box_half[0], y = (double)cluster->box_half[1],
           z = (double)cluster->box_half[2];
    return x * y + y * z + z * x;
}

float fct_cone_angle(const fct_soup *soup, size_t first, size_t count, const float vector[3]) {
    v3 axis = v3_unit(v3_load(vector));
    if (v3_norm2(axis) == 0) return 3.14159274f;
    float s[3], widest[16] = {0};
    v3_store(s, axis);
    const float *x = soup->normal[0] + first, *y = soup->normal[1] + first, *z = soup->normal[2] + first;
    size_t i = 0;
    for (; i + 16 <= count; i += 16)
        for (size_t l = 0; l < 16; ++l) {
            float a = x[i + l] - s[0], b = y[i + l] - s[1], c = z[i + l] - s[2], d = a * a + b * b + c * c;
            widest[l] = d > widest[l] ? d : widest[l]; /* false for NaN */
        }
    for (; i < count; ++i) {
        float a = x[i] - s[0], b = y[i] - s[1], c = z[i] - s[2], d = a * a + b * b + c * c;
        widest[0] = d > widest[0] ? d : widest[0];
    }
    for (int l = 1; l < 16; ++l) widest[0] = widest[l] > widest[0] ? widest[l] : widest[0];
    /* by the chord, which keeps small angles that a cosine loses; the addition covers the floats' rounding */
    double chord = sqrt((double)widest[0]) + 5e-7;
    return chord < 2 ? nextafterf((float)(2 * asin(chord / 2)), 4) : 3.14159274f;
}
