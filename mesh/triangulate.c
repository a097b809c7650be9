/* mesh/triangulate.c: see triangulate.h.
 *
 * Input: one polygon of any shape. Output: exactly count - 2 triangles over its corners. Repeated corners
 * give degenerate triangles. The corners are projected in double onto the plane of the polygon's vector area
 * (Newell). Cost: O(n) for convex polygons, O(n r) for r reflex corners.
 */
#include "mesh/triangulate.h"

#include "base/math/elementary.h"
#include "base/math/vec.h"

/* Twice the signed area of the triangle a b c. */
static double turn(const double a[2], const double b[2], const double c[2]) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Projects the polygon onto its plane, scaled to unit size. Returns 0 if its vector area vanishes. */
static int flatten_polygon(const float *positions, const uint32_t *corners, uint32_t count,
                           double (*flat)[2]) {
    v3 origin = v3_load(positions + 3 * (size_t)corners[0]);
    double extent = 0;
    for (uint32_t i = 1; i < count; ++i) {
        v3 p = v3_sub(v3_load(positions + 3 * (size_t)corners[i]), origin);
        extent = fmax(extent, fmax(fabs(p.x), fmax(fabs(p.y), fabs(p.z))));
    }
    if (!(extent > 0)) return 0;
    v3 area = {0, 0, 0}, before = {0, 0, 0};
    for (uint32_t i = 1; i < count; ++i) {
        v3 p = v3_scale(v3_sub(v3_load(positions + 3 * (size_t)corners[i]), origin), 1 / extent);
        area = v3_add(area, v3_cross(before, p));
        before = p;
    }
    if (!(v3_norm2(area) > 1e-24)) return 0;
    v3 t, b;
    v3_frame(v3_unit(area), &t, &b);
    for (uint32_t i = 0; i < count; ++i) {
        v3 p = v3_scale(v3_sub(v3_load(positions + 3 * (size_t)corners[i]), origin), 1 / extent);
        flat[i][0] = v3_dot(p, t), flat[i][1] = v3_dot(p, b);
    }
    return 1;
}

static uint32_t *write_fan(uint32_t apex, const uint32_t *next, uint32_t left, uint32_t *out) {
    uint32_t i = next[apex];
    for (uint32_t k = 0; k + 2 < left; ++k) {
        *out++ = apex, *out++ = i, *out++ = next[i];
        i = next[i];
    }
    return out;
}

/* Whether the corner is convex and no reflex corner lies in its triangle. Points equal to a corner of the
 * triangle do not count, because bridges to holes repeat corners. */
static int is_ear(const fct_polygon_scratch *s, uint32_t i, uint32_t left, uint64_t *budget) {
    uint32_t h = s->previous[i], j = s->next[i];
    const double *a = s->flat[h], *b = s->flat[i], *c = s->flat[j];
    if (!(turn(a, b, c) > 0)) return 0;
    uint32_t k = s->next[j];
    for (uint32_t n = 3; n < left; ++n, k = s->next[k]) {
        *budget -= *budget > 0;
        if (!s->reflex[k]) continue;
        const double *p = s->flat[k];
        if ((p[0] == a[0] && p[1] == a[1]) || (p[0] == b[0] && p[1] == b[1]) ||
            (p[0] == c[0] && p[1] == c[1]))
            continue;
        if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return 0;
    }
    return 1;
}

static void mark_reflex(const fct_polygon_scratch *s, uint32_t i) {
    s->reflex[i] = !(turn(s->flat[s->previous[i]], s->flat[i], s->flat[s->next[i]]) > 0);
}

static void clip_ears(const fct_polygon_scratch *s, uint32_t count, uint64_t *budget, uint32_t *out) {
    uint32_t left = count, i = 0, misses = 0;
    while (left > 3 && misses < left && *budget) {
        *budget -= *budget > 0;
        if (!is_ear(s, i, left, budget)) {
            i = s->next[i];
            ++misses;
            continue;
        }
        uint32_t h = s->previous[i], j = s->next[i];
        *out++ = h, *out++ = i, *out++ = j;
        s->next[h] = j, s->previous[j] = h;
        mark_reflex(s, h), mark_reflex(s, j);
        --left;
        misses = 0;
        i = s->next[j]; /* moves on, because slivers would otherwise collect at one corner */
    }
    write_fan(i, s->next, left, out);
}

/* Whether the fan about corner 0 covers the polygon once: all its triangles turn the same way, and their
 * angles at corner 0 sum to less than a full turn. */
static int fan_is_right(const fct_polygon_scratch *s, uint32_t count) {
    double turned = 0;
    for (uint32_t i = 1; i + 1 < count; ++i) {
        const double *o = s->flat[0], *a = s->flat[i], *b = s->flat[i + 1];
        double t = turn(o, a, b);
        if (!(t > 0)) return 0;
        if (count > 4) turned += fct_atan2(t, (a[0] - o[0]) * (b[0] - o[0]) + (a[1] - o[1]) * (b[1] - o[1]));
    }
    return turned < 6.28;
}

void fct_triangulate(const float *positions, const uint32_t *corners, uint32_t count,
                     const fct_polygon_scratch *s, uint64_t *budget, uint32_t *out) {
    if (count == 3) {
        out[0] = 0, out[1] = 1, out[2] = 2;
        return;
    }
    for (uint32_t i = 0; i < count; ++i) {
        s->next[i] = i + 1 < count ? i + 1 : 0;
        s->previous[i] = i ? i - 1 : count - 1;
    }
    int flat = flatten_polygon(positions, corners, count, s->flat);
    if (!flat || fan_is_right(s, count)) {
        write_fan(0, s->next, count, out);
        return;
    }
    for (uint32_t i = 0; i < count; ++i) mark_reflex(s, i);
    clip_ears(s, count, budget, out);
}
