/* partition/meshlet/bounds.c: sphere, cone and boxes for culling.
 *
 * Sphere: the smallest enclosing ball. Cone: its axis is the centre of the smallest ball around the unit
 * normals, or their mean if that is better. Its apex lies behind the planes of all triangles, so an eye in
 * the cone behind the apex is behind every triangle. Box: the least surface area among frames around the mean
 * normal and the principal axes, each turned to TURNS angles, and the axes of the world. Everything is
 * checked and widened on the floats as stored.
 */
#include "partition/meshlet/bounds.h"

#include <float.h>

#include "base/math/eigen.h"
#include "base/math/elementary.h"
#include "base/math/round.h"
#include "partition/meshlet/ball.h"

enum { TURNS = 8 };
static const double least_cosine = 0.1; /* of a normal to the axis; wider cones would cull almost nothing */
static const double slack = 1e-5;       /* margin of the cutoff for tests in floats */

typedef struct patch {
    uint32_t vertex_count, normal_count;
    v3 points[FCT_MESHLET_VERTICES];
    v3 normals[FCT_MESHLET_TRIANGLES], corners[FCT_MESHLET_TRIANGLES]; /* of triangles with an area */
    v3 vector;                                                         /* area vector */
} patch;

static void load_patch(const float *positions, uint32_t vertex_count, const uint8_t *triangles,
                       uint32_t triangle_count, patch *p) {
    p->vertex_count = vertex_count, p->normal_count = 0, p->vector = (v3){0, 0, 0};
    for (size_t v = 0; v < vertex_count; ++v) p->points[v] = v3_load(positions + 3 * v);
    for (size_t t = 0; t < triangle_count; ++t) {
        const uint8_t *i = triangles + 3 * t;
        v3 a = p->points[i[0]];
        v3 normal = v3_cross(v3_sub(p->points[i[1]], a), v3_sub(p->points[i[2]], a));
        if (!(v3_norm(normal) > 0)) continue;
        p->vector = v3_add(p->vector, normal);
        p->corners[p->normal_count] = a;
        p->normals[p->normal_count++] = v3_unit(normal);
    }
}

/* The next float above, at most FLT_MAX. */
static float round_up(double value) {
    float rounded = value < (double)FLT_MAX ? (float)value : FLT_MAX;
    return rounded < FLT_MAX ? nextafterf(rounded, INFINITY) : FLT_MAX;
}

static void bound_sphere(const patch *p, fct_meshlet_bounds *out) {
    v3 center;
    double radius = 0;
    fct_smallest_ball(p->points, p->vertex_count, &center, &radius);
    center = v3_round(center), radius = 0;
    v3_store(out->center, center);
    for (uint32_t v = 0; v < p->vertex_count; ++v)
        radius = fmax(radius, v3_norm(v3_sub(p->points[v], center)));
    out->radius = radius > 0 ? round_up(radius) : 0;
}

static double find_least_dot(const patch *p, v3 axis) {
    double least = INFINITY;
    for (uint32_t i = 0; i < p->normal_count; ++i) least = fmin(least, v3_dot(p->normals[i], axis));
    return least;
}

/* Moves the apex back until it is, as floats, behind all planes; false if rounding prevents that. */
static bool place_apex(const patch *p, v3 axis, double cosine, fct_meshlet_bounds *out) {
    v3 center = v3_load(out->center);
    double back = -INFINITY;
    for (uint32_t i = 0; i < p->normal_count; ++i)
        back = fmax(back, v3_dot(p->normals[i], v3_sub(center, p->corners[i])) / v3_dot(p->normals[i], axis));
    for (int attempt = 0; attempt < 16; ++attempt) {
        double front = -INFINITY;
        v3 apex = v3_round(v3_mad(center, -back, axis));
        v3_store(out->cone_apex, apex);
        if (!isfinite(apex.x) || !isfinite(apex.y) || !isfinite(apex.z)) return false;
        for (uint32_t i = 0; i < p->normal_count; ++i)
            front = fmax(front, v3_dot(p->normals[i], v3_sub(apex, p->corners[i])));
        if (front <= 0) return true;
        back += (1 << attempt) * front / cosine;
    }
    return false;
}

static void bound_cone(const patch *p, fct_meshlet_bounds *out) {
    for (int i = 0; i < 3; ++i) out->cone_apex[i] = out->center[i], out->cone_axis[i] = 0;
    out->cone_cutoff = 1;
    if (p->normal_count == 0) return;
    v3 middle;
    double radius;
    fct_smallest_ball(p->normals, p->normal_count, &middle, &radius);
    middle = v3_unit(middle);
    if (!(find_least_dot(p, middle) > least_cosine)) return;
    middle = v3_round(middle);
    double length = v3_norm(middle), cosine = fmin(find_least_dot(p, middle) / length, 1);
    if (!place_apex(p, middle, cosine, out)) {
        for (int i = 0; i < 3; ++i) out->cone_apex[i] = out->center[i];
        return;
    }
    v3_store(out->cone_axis, middle);
    out->cone_cutoff = round_up(length * sqrt(1 - cosine * cosine) + slack);
}

static void bound_world(const patch *p, fct_bounds *out) {
    for (int i = 0; i < 3; ++i) out->lower[i] = INFINITY, out->upper[i] = -INFINITY;
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        float x[3];
        v3_store(x, p->points[v]);
        for (int i = 0; i < 3; ++i)
            out->lower[i] = fminf(out->lower[i], x[i]), out->upper[i] = fmaxf(out->upper[i], x[i]);
    }
}

/* An eighth of the surface area of the box along a frame; its middle and half extents along the frame. */
static double measure_frame(const patch *p, const v3 frame[3], double middle[3], double half[3]) {
    v3 origin = p->points[0];
    for (int k = 0; k < 3; ++k) {
        double low = INFINITY, high = -INFINITY;
        for (uint32_t v = 0; v < p->vertex_count; ++v) {
            double d = v3_dot(v3_sub(p->points[v], origin), frame[k]);
            low = d < low ? d : low, high = d > high ? d : high;
        }
        middle[k] = 0.5 * (low + high), half[k] = 0.5 * (high - low);
    }
    return half[0] * half[1] + half[1] * half[2] + half[2] * half[0];
}

/* Tries all turns of the frame around `normal`; keeps the one with the least box so far. */
static void try_frames(const patch *p, v3 normal, double *least, v3 best[3]) {
    v3 t, b;
    if (!(v3_norm2(normal) > 0)) return;
    v3_frame(normal, &t, &b);
    for (int turn = 0; turn < TURNS; ++turn) {
        double angle = 0.5 * 3.14159265358979323846 * turn / TURNS, c = fct_cos(angle), s = fct_sin(angle);
        v3 frame[3] = {v3_mad(v3_scale(t, c), s, b), v3_mad(v3_scale(b, c), -s, t), normal};
        double middle[3], half[3], area = measure_frame(p, frame, middle, half);
        if (!(area < *least)) continue;
        *least = area;
        for (int k = 0; k < 3; ++k) best[k] = frame[k];
    }
}

static void bound_box(const patch *p, fct_box *out) {
    double covariance[6] = {0}, values[3], middle[3], half[3];
    v3 mean = {0, 0, 0}, axes[3], frame[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (uint32_t v = 0; v < p->vertex_count; ++v)
        mean = v3_mad(mean, 1.0 / p->vertex_count, v3_sub(p->points[v], p->points[0]));
    mean = v3_add(p->points[0], mean);
    for (uint32_t v = 0; v < p->vertex_count; ++v) sym3_add_outer(covariance, 1, v3_sub(p->points[v], mean));
    fct_eigen3(covariance, values, axes);
    double least = measure_frame(p, frame, middle, half);
    try_frames(p, axes[0], &least, frame);
    try_frames(p, v3_unit(p->vector), &least, frame);
    for (int k = 0; k < 3; ++k) {
        frame[k] = v3_round(frame[k]);
        v3_store(out->axes[k], frame[k]);
    }
    measure_frame(p, frame, middle, half);
    v3 center = p->points[0];
    for (int k = 0; k < 3; ++k) center = v3_mad(center, middle[k], frame[k]);
    center = v3_round(center);
    v3_store(out->center, center);
    for (int k = 0; k < 3; ++k) {
        double reach = 0, size = 0;
        for (uint32_t v = 0; v < p->vertex_count; ++v) {
            reach = fmax(reach, fabs(v3_dot(v3_sub(p->points[v], center), frame[k])));
            size = fmax(size, fabs(v3_dot(p->points[v], frame[k])));
        }
        out->half[k] = round_up(reach + 16 * DBL_EPSILON * size); /* for other orders of operations */
    }
}

void fct_meshlet_bound(const float *positions, uint32_t vertex_count, const uint8_t *triangles,
                       uint32_t triangle_count, fct_meshlet_bounds *out) {
    patch p;
    load_patch(positions, vertex_count, triangles, triangle_count, &p);
    bound_sphere(&p, out);
    bound_cone(&p, out);
    bound_world(&p, &out->bounds);
    bound_box(&p, &out->box);
}
