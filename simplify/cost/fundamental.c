/* simplify/cost/fundamental.c: see fundamental.h.
 *
 * Each face adds the quadric of its plane (3.10) to the point of each corner, times a third of its area, or
 * times a weight by angle or the same for all faces. If attributes steer, it adds the quadric of its 2-plane
 * in position and attributes, (5.8)-(5.10), with the same weight to the wedge of each corner. Faces without
 * area add nothing. Cost: linear in the corners.
 */
#include "simplify/cost/fundamental.h"

#include "base/math/elementary.h"

#define PI 3.14159265358979323846

/* Adds a plane through p to the points of a face's corners, with a weight each (3.4.1). */
static void add_plane(fct_simplifier *s, uint32_t f, v3 p, v3 normal, const double weights[3]) {
    double q[POSITION_QUADRIC] = {0};
    quadric_add_plane(q, normal, p, 1);
    q[10] = 1;
    for (uint32_t k = 0; k < 3; ++k) {
        double *to = point_at(s, s->triangles[3 * f + k])->quadric;
        for (uint32_t i = 0; i < POSITION_QUADRIC; ++i) to[i] += weights[k] * q[i];
    }
}

static void add_plane_of_attributes(fct_simplifier *s, uint32_t f, const double weights[3]) {
    uint32_t m = s->steering;
    double q[MAX_QUADRIC], x[3][3 + QUADRIC_MAX_ATTRIBUTES];
    for (uint32_t k = 0; k < 3; ++k) {
        v3 p = point_position(s, s->triangles[3 * f + k]);
        x[k][0] = p.x, x[k][1] = p.y, x[k][2] = p.z;
        const double *a = s->attributes + (size_t)s->channel_count * s->corner_wedges[3 * f + k];
        for (uint32_t i = 0; i < m; ++i) x[k][3 + i] = a[i];
    }
    fct_quadric_of_plane(q, m, x);
    for (uint32_t k = 0; k < 3; ++k) {
        double *to = wedge_quadric(s, s->corner_wedges[3 * f + k]);
        for (uint32_t i = 0; i < s->quadric_size; ++i) to[i] += weights[k] * q[i];
    }
}

static double find_area(const v3 p[3]) {
    return .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
}

static void find_corners(const fct_simplifier *s, uint32_t f, v3 p[3]) {
    for (uint32_t k = 0; k < 3; ++k) p[k] = point_position(s, s->triangles[3 * f + k]);
}

/* The mean area of the faces that have one. */
static double find_mean_area(const fct_simplifier *s) {
    double sum = 0;
    uint32_t count = 0;
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        if (corner_dead(s, 3 * f)) continue;
        v3 p[3];
        find_corners(s, f, p);
        double area = find_area(p);
        sum += area, count += area > 0;
    }
    return count ? sum / count : 0;
}

static double find_angle(v3 at, v3 x, v3 y) {
    v3 a = v3_sub(x, at), b = v3_sub(y, at);
    return fct_atan2(v3_norm(v3_cross(a, b)), v3_dot(a, b));
}

/* The weights of the corners. mean: of the faces' areas. */
static void find_weights(const fct_simplifier *s, const v3 p[3], double area, double mean,
                         double weights[3]) {
    for (int k = 0; k < 3; ++k)
        weights[k] = s->def->weighting == FCT_WEIGHT_ANGLE
                         ? mean * find_angle(p[k], p[(k + 1) % 3], p[(k + 2) % 3]) / PI
                     : s->def->weighting == FCT_WEIGHT_UNIFORM ? mean / 3
                                                               : area / 3;
}

fct_result fct_simplify_quadrics(fct_simplifier *s) {
    s->quadric_size = quadric_size(s->steering);
    if (s->steering) {
        s->quadrics = fct_allocate_zero(s->env, s->wedge_count, s->quadric_size * sizeof *s->quadrics);
        if (!s->quadrics) return fct_fail_memory(s->env, "quadrics");
    }
    double mean = s->def->weighting == FCT_WEIGHT_AREA ? 0 : find_mean_area(s);
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        if (corner_dead(s, 3 * f)) continue;
        v3 p[3];
        find_corners(s, f, p);
        v3 cross = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
        double twice = v3_norm(cross), weights[3];
        if (!(twice > 0)) continue;
        find_weights(s, p, .5 * twice, mean, weights);
        add_plane(s, f, p[0], v3_scale(cross, 1 / twice), weights);
        if (s->steering) add_plane_of_attributes(s, f, weights);
    }
    return FCT_OK;
}
