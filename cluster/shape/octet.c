/* cluster/shape/octet.c: describes eight clusters at once, one per lane.
 *
 * Three quarters of all clusters have two to four faces. One by one, each would wait for its own roots and
 * divisions and leave most lanes idle. The frame of a box is the PCA of the surface, turned in its plane to
 * the least area of eight angles. Extents are taken in double along the axes that fct_cluster_box expands
 * from the stored quaternion. So the box contains its points for these axes, and is as tight as they allow.
 */
#include "cluster/shape/octet.h"

#include <assert.h>
#include <float.h>
#include <stddef.h>
#include <string.h>

#include "base/math/eigen.h"
#include "base/math/simd_d8.h"
#include "cluster/shape/cone.h"

#define W3_LANES d8
#include "base/math/w3.h"

enum {
    SAMPLES = 64,
    AREA = offsetof(fct_cluster, area) / sizeof(float),
    VECTOR = offsetof(fct_cluster, area_vector) / sizeof(float),
    MOMENT = offsetof(fct_cluster, moment) / sizeof(float),
    CENTROID = offsetof(fct_cluster, centroid) / sizeof(float),
    CONE = offsetof(fct_cluster, cone_angle) / sizeof(float),
    PLANE = offsetof(fct_cluster, plane) / sizeof(float),
    CENTER = offsetof(fct_cluster, box_center) / sizeof(float),
    ROTATION = offsetof(fct_cluster, box_rotation) / sizeof(float),
    HALF = offsetof(fct_cluster, box_half) / sizeof(float)
};

static inline d8 negative(d8 a) {
    return d8_mul(a, d8_set(-1));
}

/* --- Sums, plane and frame --- */

/* The 20 doubles of each cluster's sums; s[i] holds number i of all eight. */
static inline void load_sums(const fct_sums *const sums[8], d8 s[20]) {
    for (int i = 0; i < 20; i += 4) {
        d4 low[4], high[4];
        for (int k = 0; k < 4; ++k) {
            low[k] = d4_load((const double *)sums[k] + i);
            high[k] = d4_load((const double *)sums[k + 4] + i);
        }
        d4_transpose(low), d4_transpose(high);
        for (int k = 0; k < 4; ++k) s[i + k] = (d8){low[k], high[k]};
    }
}

void fct_octet_sum(fct_octet *o, const fct_sums *const sums[8]) {
    const d8 none = d8_set(0), one = d8_set(1), limit = d8_set((double)FLT_MAX);
    d8 s[20], axes[3][3];
    load_sums(sums, s);
    const d8 area = s[0], weight = s[1], *moment = s + 2, *covariance = s + 8, *vector = s + 14,
             *center = s + 17;
    d8 factor = d8_if_lt(limit, area, d8_div(limit, area), one);
    d8_store_floats(o->words[AREA], d8_mul(area, factor));
    for (int i = 0; i < 3; ++i) d8_store_floats(o->words[VECTOR + i], d8_mul(vector[i], factor));
    for (int i = 0; i < 6; ++i) d8_store_floats(o->words[MOMENT + i], d8_mul(moment[i], factor));
    for (int i = 0; i < 3; ++i) d8_store_floats(o->words[CENTROID + i], center[i]);
    d8 spread = d8_add(d8_add(covariance[0], covariance[3]), covariance[5]);
    d8 radius = d8_sqrt(d8_div(spread, weight)); /* may be NaN */
    radius = d8_if_lt(none, radius, d8_if_lt(radius, limit, radius, one), one);
    d8_store_floats(o->shrink, d8_div(one, radius));
    fct_eigen3_eight(covariance, NULL, axes);
    d8 *n = axes[0], *u = axes[2], side = d8_if_lt(w3_dot_arrays(n, vector), none, d8_set(-1), one);
    for (int i = 0; i < 3; ++i) n[i] = d8_mul(n[i], side);
    d8 v[3] = {d8_sub(d8_mul(n[1], u[2]), d8_mul(n[2], u[1])), d8_sub(d8_mul(n[2], u[0]), d8_mul(n[0], u[2])),
               d8_sub(d8_mul(n[0], u[1]), d8_mul(n[1], u[0]))};
    for (int i = 0; i < 3; ++i) {
        d8_store(o->frame[0][i], u[i]), d8_store(o->frame[1][i], v[i]), d8_store(o->frame[2][i], n[i]);
        d8_store_floats(o->words[PLANE + i], n[i]);
    }
    d8 offset = negative(w3_dot_arrays(n, center));
    d8_store_floats(o->words[PLANE + 3], d8_max(d8_min(offset, limit), negative(limit)));
}

/* --- Cone --- */

/* The unit area vectors; bit i of the result: lane i has none. */
static inline uint32_t find_axes(const fct_octet *o, float axis[3][8]) {
    d8 s[3];
    for (int i = 0; i < 3; ++i) s[i] = d8_load_floats(o->words[VECTOR + i]);
    d8 squared = w3_dot_arrays(s, s), invert = d8_div(d8_set(1), d8_sqrt(squared));
    for (int i = 0; i < 3; ++i) d8_store_floats(axis[i], d8_mul(s[i], invert));
    return 255 & ~d8_lt(d8_set(0), squared);
}

static inline f8 chords_to(const float *const rows[8], const f8 axis[3]) {
    f8 p[3];
    f8_load_columns(rows, p);
    for (int k = 0; k < 3; ++k) p[k] = f8_sub(p[k], axis[k]), p[k] = f8_mul(p[k], p[k]);
    return f8_add(f8_add(p[0], p[1]), p[2]);
}

void fct_octet_cone(fct_octet *o, const fct_octet_normals *n) {
    float axis[3][8], chords[8];
    const float *rows[8], *firsts[8];
    uint32_t lost = find_axes(o, axis), shortest = UINT32_MAX, longest = 0;
    const f8 a[3] = {f8_load(axis[0]), f8_load(axis[1]), f8_load(axis[2])};
    f8 widest = f8_set(0);
    for (int i = 0; i < 8; ++i) {
        firsts[i] = rows[i] = n->normals + 4 * (size_t)n->firsts[i];
        shortest = n->counts[i] < shortest ? n->counts[i] : shortest;
        longest = n->counts[i] > longest ? n->counts[i] : longest;
    }
    for (uint32_t j = 0; j < shortest; ++j) {
        widest = f8_max(chords_to(rows, a), widest); /* f8_max ignores NaN here */
        for (int i = 0; i < 8; ++i) rows[i] += 4;
    }
    for (uint32_t j = shortest; j < longest; ++j) {
        for (int i = 0; i < 8; ++i) rows[i] = firsts[i] + (j < n->counts[i] ? 4 * (size_t)j : 0);
        widest = f8_max(chords_to(rows, a), widest);
    }
    f8_store(chords, widest);
    for (int i = 0; lost >> i; ++i)
        if (lost >> i & 1) chords[i] = 4;
    fct_cone_angles(chords, o->words[CONE]);
}

/* --- Turn and rotation --- */

/* Points in the plane, relative to the first of each cluster, which is left out. */
typedef struct plane_points {
    float u[SAMPLES][8], v[SAMPLES][8];
    uint32_t count;
    f8 height;
} plane_points;

/* Projects up to SAMPLES points, evenly chosen, to the frame, in units of the cluster's radius. */
static void project_points(const fct_octet *o, const fct_octet_row *points, uint32_t count,
                           plane_points *out) {
    float frame[9][8];
    f8 f[9], shrink = f8_load(o->shrink), low = f8_set(0), high = low;
    f8 x0 = f8_load(points->x), y0 = f8_load(points->y), z0 = f8_load(points->z);
    for (int i = 0; i < 9; ++i) {
        d8_store_floats(frame[i], d8_load(o->frame[i / 3][i % 3]));
        f[i] = f8_load(frame[i]);
    }
    out->count = (count < SAMPLES ? count : SAMPLES) - 1;
    for (uint32_t j = 0; j < out->count; ++j) {
        const fct_octet_row *p = &points[count > SAMPLES ? (j + 1) * count / SAMPLES : j + 1];
        f8 x = f8_mul(f8_sub(f8_load(p->x), x0), shrink), y = f8_mul(f8_sub(f8_load(p->y), y0), shrink);
        f8 z = f8_mul(f8_sub(f8_load(p->z), z0), shrink);
        f8 w = f8_add(f8_add(f8_mul(x, f[6]), f8_mul(y, f[7])), f8_mul(z, f[8]));
        f8_store(out->u[j], f8_add(f8_add(f8_mul(x, f[0]), f8_mul(y, f[1])), f8_mul(z, f[2])));
        f8_store(out->v[j], f8_add(f8_add(f8_mul(x, f[3]), f8_mul(y, f[4])), f8_mul(z, f[5])));
        low = f8_min(w, low), high = f8_max(w, high);
    }
    out->height = f8_sub(high, low);
}

typedef struct turn {
    f8 area, cosine, sine;
} turn;

/* Takes this turn in the lanes where it makes a smaller box; x, y: the sides in the plane. */
static inline void offer_turn(turn *best, f8 x, f8 y, f8 height, float cosine, float sine) {
    f8 area = f8_add(f8_mul(x, y), f8_mul(height, f8_add(x, y)));
    best->cosine = f8_if_lt(area, best->area, f8_set(cosine), best->cosine);
    best->sine = f8_if_lt(area, best->area, f8_set(sine), best->sine);
    best->area = f8_min(area, best->area);
}

typedef struct range {
    f8 low, high;
} range;

static inline void widen_range(range *r, f8 x) {
    r->low = f8_min(x, r->low), r->high = f8_max(x, r->high);
}
static inline f8 width(range r) {
    return f8_sub(r.high, r.low);
}

/* Tries an angle below 45 degrees and its complement to 90. Coordinates are in units of the cosine, which
 * saves half of the products. */
static inline void try_pair(const plane_points *p, float cosine, float sine, turn *best) {
    f8 c = f8_set(cosine), tangent = f8_set(sine / cosine);
    range x = {f8_set(0), f8_set(0)}, y = x, other_x = x, other_y = x;
    for (uint32_t j = 0; j < p->count; ++j) {
        f8 u = f8_load(p->u[j]), v = f8_load(p->v[j]), tu = f8_mul(tangent, u), tv = f8_mul(tangent, v);
        widen_range(&x, f8_add(u, tv)), widen_range(&y, f8_sub(v, tu));
        widen_range(&other_x, f8_add(tu, v)), widen_range(&other_y, f8_sub(tv, u));
    }
    offer_turn(best, f8_mul(c, width(x)), f8_mul(c, width(y)), p->height, cosine, sine);
    offer_turn(best, f8_mul(c, width(other_x)), f8_mul(c, width(other_y)), p->height, sine, cosine);
}

/* Tries 0 and 45 degrees. */
static inline void try_ends(const plane_points *p, turn *best) {
    range x = {f8_set(0), f8_set(0)}, y = x, other_x = x, other_y = x;
    for (uint32_t j = 0; j < p->count; ++j) {
        f8 u = f8_load(p->u[j]), v = f8_load(p->v[j]);
        widen_range(&x, u), widen_range(&y, v);
        widen_range(&other_x, f8_add(u, v)), widen_range(&other_y, f8_sub(v, u));
    }
    const float half = 0.70710678f;
    offer_turn(best, width(x), width(y), p->height, 1, 0);
    offer_turn(best, f8_mul(f8_set(half), width(other_x)), f8_mul(f8_set(half), width(other_y)), p->height,
               half, half);
}

/* Writes the unit quaternion of the rotation whose rows are the axes a, a right-handed frame. */
static void write_rotation(fct_octet *o, const d8 a[3][3]) {
    const d8 one = d8_set(1);
    d8 x = a[0][0], y = a[1][1], z = a[2][2];
    d8 xy = d8_add(a[0][1], a[1][0]), xz = d8_add(a[0][2], a[2][0]), yz = d8_add(a[1][2], a[2][1]);
    d8 wx = d8_sub(a[1][2], a[2][1]), wy = d8_sub(a[2][0], a[0][2]), wz = d8_sub(a[0][1], a[1][0]);
    d8 rows[4][4] = {{d8_sub(d8_sub(d8_add(one, x), y), z), xy, xz, wx},
                     {xy, d8_sub(d8_add(d8_sub(one, x), y), z), yz, wy},
                     {xz, yz, d8_add(d8_sub(d8_sub(one, x), y), z), wz},
                     {wx, wy, wz, d8_add(d8_add(d8_add(one, x), y), z)}};
    d8 most = rows[0][0], *q = rows[0], squared = d8_set(0);
    for (int i = 1; i < 4; ++i) { /* take the row with the largest diagonal entry */
        d8 entry = rows[i][i];
        for (int k = 0; k < 4; ++k) q[k] = d8_if_lt(most, entry, rows[i][k], q[k]);
        most = d8_max(entry, most);
    }
    for (int k = 0; k < 4; ++k) squared = d8_mad(squared, q[k], q[k]);
    d8 invert = d8_div(one, d8_sqrt(squared));
    for (int k = 0; k < 4; ++k) d8_store_floats(o->words[ROTATION + k], d8_mul(q[k], invert));
}

void fct_octet_turn(fct_octet *o, const fct_octet_row *points, uint32_t count) {
    plane_points p;
    turn best = {f8_set(INFINITY), f8_set(1), f8_set(0)};
    float cosines[8], sines[8];
    d8 axes[3][3];
    project_points(o, points, count, &p);
    try_ends(&p, &best);
    try_pair(&p, 0.98078528f, 0.19509032f, &best);
    try_pair(&p, 0.92387953f, 0.38268343f, &best);
    try_pair(&p, 0.83146961f, 0.55557023f, &best);
    f8_store(cosines, best.cosine), f8_store(sines, best.sine);
    d8 c = d8_load_floats(cosines), s = d8_load_floats(sines);
    for (int i = 0; i < 3; ++i) {
        d8 u = d8_load(o->frame[0][i]), v = d8_load(o->frame[1][i]);
        axes[0][i] = d8_add(d8_mul(c, u), d8_mul(s, v));
        axes[1][i] = d8_sub(d8_mul(c, v), d8_mul(s, u));
        axes[2][i] = d8_load(o->frame[2][i]);
    }
    write_rotation(o, (const d8(*)[3])axes);
}

/* --- Box --- */

/* The same bits as fct_box_axes. */
static inline void expand_axes(const fct_octet *o, d8 axes[3][3]) {
    const d8 one = d8_set(1);
    d8 x = d8_load_floats(o->words[ROTATION]), y = d8_load_floats(o->words[ROTATION + 1]);
    d8 z = d8_load_floats(o->words[ROTATION + 2]), w = d8_load_floats(o->words[ROTATION + 3]);
    d8 xx = d8_mul(x, x), yy = d8_mul(y, y), zz = d8_mul(z, z), ww = d8_mul(w, w);
    d8 xy = d8_mul(x, y), xz = d8_mul(x, z), yz = d8_mul(y, z);
    d8 wx = d8_mul(w, x), wy = d8_mul(w, y), wz = d8_mul(w, z);
    d8 s = d8_div(d8_set(2), d8_add(d8_add(d8_add(xx, yy), zz), ww));
    d8 full[9] = {d8_sub(one, d8_mul(s, d8_add(yy, zz))),
                  d8_mul(s, d8_add(xy, wz)),
                  d8_mul(s, d8_sub(xz, wy)),
                  d8_mul(s, d8_sub(xy, wz)),
                  d8_sub(one, d8_mul(s, d8_add(xx, zz))),
                  d8_mul(s, d8_add(yz, wx)),
                  d8_mul(s, d8_add(xz, wy)),
                  d8_mul(s, d8_sub(yz, wx)),
                  d8_sub(one, d8_mul(s, d8_add(xx, yy)))};
    for (int i = 0; i < 9; ++i) axes[i / 3][i % 3] = d8_round(full[i]);
}

static inline void load_row(const fct_octet_row *row, d8 p[3]) {
    p[0] = d8_load_floats(row->x), p[1] = d8_load_floats(row->y), p[2] = d8_load_floats(row->z);
}

static void fit_boxes(fct_octet *o, const fct_octet_row *points, uint32_t count) {
    d8 a[3][3], low[3], high[3], first[3], along[3], center[3], size = d8_set(0);
    expand_axes(o, a);
    load_row(points, first);
    for (int k = 0; k < 3; ++k) along[k] = low[k] = high[k] = w3_dot_arrays(first, a[k]);
    for (uint32_t j = 1; j < count; ++j) {
        d8 p[3];
        load_row(points + j, p);
        for (int k = 0; k < 3; ++k) {
            d8 x = w3_dot_arrays(p, a[k]);
            low[k] = d8_min(x, low[k]), high[k] = d8_max(x, high[k]);
        }
    }
    /* from a point, because the axes are orthonormal only to float rounding and the model may be far from 0
     */
    for (int i = 0; i < 3; ++i) center[i] = first[i];
    for (int k = 0; k < 3; ++k) {
        d8 way = d8_sub(d8_mul(d8_set(0.5), d8_add(low[k], high[k])), along[k]);
        for (int i = 0; i < 3; ++i) center[i] = d8_mad(center[i], way, a[k][i]);
        size = d8_max(size, d8_max(d8_abs(low[k]), d8_abs(high[k])));
    }
    for (int i = 0; i < 3; ++i) {
        center[i] = d8_round(center[i]);
        d8_store_floats(o->words[CENTER + i], center[i]);
    }
    d8 slack = d8_mul(d8_set(16 * DBL_EPSILON), size); /* for any order of operations in a check */
    for (int k = 0; k < 3; ++k) {
        d8 middle = w3_dot_arrays(center, a[k]),
           half = d8_max(d8_sub(high[k], middle), d8_sub(middle, low[k]));
        half = d8_add(half, slack);
        /* rounding to float does not make it smaller */
        half = d8_add(d8_mul(half, d8_set(1 + 0x1p-23)), d8_set(0x1p-149));
        d8_store_floats(o->words[HALF + k], half);
    }
}

void fct_octet_fit(fct_octet *o, const fct_octet_row *points, uint32_t count) {
    const f8 limit = f8_set(FLT_MAX);
    uint32_t within = 255;
    fit_boxes(o, points, count);
    for (int k = 0; k < 3; ++k) {
        within &= f8_le(f8_load(o->words[HALF + k]), limit);
        within &= f8_le(f8_abs(f8_load(o->words[CENTER + k])), limit);
    }
    if (within == 255) return;
    /* A model wider than half the range of a float: a rotated box may not fit into floats. */
    for (int i = 0; i < 8; ++i)
        for (int k = 0; k < 4 && !(within >> i & 1); ++k) o->words[ROTATION + k][i] = k < 3 ? 0 : 1;
    fit_boxes(o, points, count);
    for (int k = 0; k < 3; ++k) f8_store(o->words[HALF + k], f8_min(f8_load(o->words[HALF + k]), limit));
}

/* --- All --- */

void fct_octet_store(const fct_octet *o, uint32_t lane, fct_cluster *out) {
    float words[FCT_OCTET_WORDS];
    for (int i = 0; i < FCT_OCTET_WORDS; ++i) words[i] = o->words[i][lane];
    memcpy(out, words, sizeof words);
}

void fct_octet_store_all(const fct_octet *o, fct_cluster *const out[8]) {
    static_assert(offsetof(fct_cluster, cost) == FCT_OCTET_WORDS * sizeof(float),
                  "all words before the cost");
    float turned[8][FCT_OCTET_WORDS];
    for (int from = 0; from < 24; from += 8) {
        f8 m[8];
        for (int i = 0; i < 8; ++i) m[i] = f8_load(o->words[from + i]);
        f8_transpose(m);
        for (int i = 0; i < 8; ++i) f8_store(turned[i] + from, m[i]);
    }
    for (int i = 0; i < 8; ++i)
        for (int k = 24; k < FCT_OCTET_WORDS; ++k) turned[i][k] = o->words[k][i];
    for (int i = 0; i < 8; ++i) memcpy(out[i], turned[i], sizeof turned[i]);
}
