/* radiosity/output/foothold.c: where a vertex looks for its light: normal, sample point and offset of the
 * rays, from the corners that meet there. */
#include "radiosity/output/surface_vertex.h"

#include <float.h>
#include <math.h>

#define MIN_FRONT       .02 /* least cosine between a normal and its faces' */
#define TURNS           64
#define FLAT_COSINE     (1 - 1e-5)
#define PULL            .15  /* of the way from a vertex on the rim to the centroid of a face */
#define EDGE_OFFSET     2e-4 /* of the local edge */
#define ROUNDING_OFFSET 8    /* units in the last place of the coordinates */

/* The corner itself and the two that follow it round the face. */
static void corner_points(const fct_corners *mesh, uint32_t corner, v3 p[3]) {
    const uint32_t *t = mesh->triangles + corner / 3 * (size_t)3;
    for (uint32_t k = 0; k < 3; ++k) p[k] = v3_load(mesh->positions + 3 * (size_t)t[(corner + k) % 3]);
}

/* Unit normal of a corner's face (zero when degenerate) and the angle at the corner. */
static v3 corner_normal(const v3 p[3], double *angle) {
    v3 a = v3_sub(p[1], p[0]), b = v3_sub(p[2], p[0]), cross = v3_cross(a, b);
    *angle = atan2(v3_norm(cross), v3_dot(a, b));
    return v3_unit(cross);
}

/* The face farthest behind the direction. */
static double least_cosine(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 direction,
                           v3 *worst) {
    double least = 1;
    for (size_t i = 0; i < count; ++i) {
        v3 p[3];
        double angle;
        corner_points(mesh, corners[i], p);
        v3 n = corner_normal(p, &angle);
        double cosine = v3_dot(n, direction);
        if (v3_norm2(n) > 0 && cosine < least) least = cosine, *worst = n;
    }
    return least;
}

bool fct_corner_front(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 direction) {
    v3 worst;
    return v3_norm2(direction) > 0 && least_cosine(mesh, corners, count, direction, &worst) >= MIN_FRONT;
}

bool fct_corner_normal(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 *normal) {
    v3 sum = {0, 0, 0}, worst = {0, 0, 0};
    for (size_t i = 0; i < count; ++i) {
        v3 p[3];
        double angle;
        corner_points(mesh, corners[i], p);
        v3 n = corner_normal(p, &angle);
        sum = v3_mad(sum, angle, n);
    }
    *normal = v3_unit(sum);
    v3 n = *normal;
    /* Perceptron steps: towards the face that is farthest behind. */
    for (int turn = 0; turn < TURNS; ++turn) {
        double least = least_cosine(mesh, corners, count, n, &worst);
        if (least >= MIN_FRONT) {
            *normal = n;
            return true;
        }
        n = v3_unit(v3_mad(n, 2 * MIN_FRONT - least, worst));
    }
    return false;
}

/* The face into which a vertex on the rim is pulled: the one that lies most in the corners' mean direction.
 */
static uint32_t inward_corner(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 mean,
                              v3 *centroid) {
    uint32_t best = corners[0];
    double highest = -INFINITY;
    for (size_t i = 0; i < count; ++i) {
        v3 p[3];
        double angle;
        corner_points(mesh, corners[i], p);
        v3 middle = v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1. / 3);
        corner_normal(p, &angle);
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
        corner_points(mesh, corners[i], p);
        v3 n = corner_normal(p, &angle), a = v3_sub(p[1], p[0]), b = v3_sub(p[2], p[0]);
        edges += .5 * (v3_norm(a) + v3_norm(b));
        mean = v3_mad(mean, angle, v3_unit(v3_add(a, b)));
        if (v3_norm2(n) == 0) continue;
        least = fmin(least, v3_dot(n, normal));
        if (angle > widest) widest = angle, out.face = corners[i] / 3;
    }
    corner_points(mesh, corners[0], p);
    out.sample = p[0];
    if (rim) {
        out.face = inward_corner(mesh, corners, count, mean, &centroid) / 3;
        out.sample = v3_mad(p[0], PULL, v3_sub(centroid, p[0]));
    }
    out.flat = out.flat && least >= FLAT_COSINE;
    double largest = fmax(fabs(p[0].x), fmax(fabs(p[0].y), fabs(p[0].z)));
    out.offset =
        (EDGE_OFFSET * edges / (double)count + ROUNDING_OFFSET * FLT_EPSILON * largest) / fmax(least, .05);
    return out;
}
