/* radiosity/surface/foothold.c: see foothold.h. */
#include "radiosity/surface/foothold.h"

#include <float.h>
#include <math.h>

#include "base/math/elementary.h"

/* Least cosine between a vertex normal and the normals of its faces. With 0, rays along the normal's horizon
 * start inside the surface. */
#define MIN_FRONT .02
/* Steps of the search for a normal in front of all faces. */
#define TURNS 64
/* Part of the way from a vertex on the rim to the centroid of a face. With 0, a vertex in the corner of a
 * room sees into the neighbouring wall; larger values move the light visibly. */
#define PULL .15
/* Offset of ray origins: a share of the local edge, and units in the last place of the coordinates. Smaller
 * offsets let rays hit the vertex's own faces; larger ones let light pass under contacts. */
#define EDGE_OFFSET     2e-4
#define ROUNDING_OFFSET 8
/* On bent vertices the offset is divided by a cosine, which counts as at least this. */
#define LEAST_COSINE .05

/* Positions of the corner and of the two that follow it in its face. */
static void load_corner(const fct_corners *mesh, uint32_t corner, v3 p[3]) {
    const uint32_t *t = mesh->triangles + corner / 3 * (size_t)3;
    for (uint32_t k = 0; k < 3; ++k) p[k] = v3_load(mesh->positions + 3 * (size_t)t[(corner + k) % 3]);
}

/* Unit normal of a corner's face (zero if degenerate), and the angle at the corner in radians. */
static v3 measure_corner(const v3 p[3], double *angle) {
    v3 a = v3_sub(p[1], p[0]), b = v3_sub(p[2], p[0]), cross = v3_cross(a, b);
    *angle = fct_atan2(v3_norm(cross), v3_dot(a, b));
    return v3_unit(cross);
}

/* Least cosine between the direction and the faces' normals; *worst: the normal of that face. */
static double find_worst_face(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 direction,
                              v3 *worst) {
    double least = 1;
    for (size_t i = 0; i < count; ++i) {
        v3 p[3];
        double angle;
        load_corner(mesh, corners[i], p);
        v3 n = measure_corner(p, &angle);
        double cosine = v3_dot(n, direction);
        if (v3_norm2(n) > 0 && cosine < least) least = cosine, *worst = n;
    }
    return least;
}

bool fct_corner_front(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 direction) {
    v3 worst;
    return v3_norm2(direction) > 0 && find_worst_face(mesh, corners, count, direction, &worst) >= MIN_FRONT;
}

bool fct_corner_normal(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 *normal) {
    v3 sum = {0, 0, 0}, worst = {0, 0, 0};
    for (size_t i = 0; i < count; ++i) {
        v3 p[3];
        double angle;
        load_corner(mesh, corners[i], p);
        v3 n = measure_corner(p, &angle);
        sum = v3_mad(sum, angle, n);
    }
    *normal = v3_unit(sum);
    v3 n = *normal;
    /* Perceptron steps: turn towards the worst face until it is in front. */
    for (int turn = 0; turn < TURNS; ++turn) {
        double least = find_worst_face(mesh, corners, count, n, &worst);
        if (least >= MIN_FRONT) {
            *normal = n;
            return true;
        }
        n = v3_unit(v3_mad(n, 2 * MIN_FRONT - least, worst));
    }
    return false;
}

/* The corner whose face lies most in the mean direction of all faces; *centroid: of that face. */
static uint32_t find_inward_corner(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 mean,
                                   v3 *centroid) {
    uint32_t best = corners[0];
    double highest = -INFINITY;
    for (size_t i = 0; i < count; ++i) {
        v3 p[3];
        double angle;
        load_corner(mesh, corners[i], p);
        v3 middle = v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1. / 3);
        measure_corner(p, &angle);
        double score = angle > 0 ? v3_dot(v3_unit(v3_sub(middle, p[0])), mean) : -INFINITY;
        if (i == 0 || score > highest) highest = score, best = corners[i], *centroid = middle;
    }
    return best;
}

fct_foothold fct_corner_foothold(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 normal,
                                 bool rim) {
    fct_foothold out = {.normal = normal, .face = corners[0] / 3, .flat = v3_norm2(normal) > 0};
    v3 mean = {0, 0, 0}, centroid = {0, 0, 0}, p[3];
    double edges = 0, least = 1, widest = -1;
    for (size_t i = 0; i < count; ++i) {
        double angle;
        load_corner(mesh, corners[i], p);
        v3 n = measure_corner(p, &angle), a = v3_sub(p[1], p[0]), b = v3_sub(p[2], p[0]);
        edges += .5 * (v3_norm(a) + v3_norm(b));
        mean = v3_mad(mean, angle, v3_unit(v3_add(a, b)));
        if (v3_norm2(n) == 0) continue;
        least = fct_min(least, v3_dot(n, normal));
        if (angle > widest) widest = angle, out.face = corners[i] / 3;
    }
    load_corner(mesh, corners[0], p);
    out.sample = p[0];
    if (rim) {
        out.face = find_inward_corner(mesh, corners, count, mean, &centroid) / 3;
        out.sample = v3_mad(p[0], PULL, v3_sub(centroid, p[0]));
    }
    out.flat = out.flat && least >= FCT_FLAT_COSINE;
    double largest = fct_max(fabs(p[0].x), fct_max(fabs(p[0].y), fabs(p[0].z)));
    out.offset = (EDGE_OFFSET * edges / (double)count + ROUNDING_OFFSET * FLT_EPSILON * largest) /
                 fct_max(least, LEAST_COSINE);
    return out;
}
