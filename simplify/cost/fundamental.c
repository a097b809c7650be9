/* simplify/cost/fundamental.c: see fundamental.h.
 *
 * Each face adds a third of its area times the quadric of its plane (3.10) to the point of each corner. If
 * attributes steer, it adds the same share of the quadric of its 2-plane in position and attributes,
 * (5.8)-(5.10), to the wedge of each corner.
 * Faces without area add nothing. Cost: linear in the corners.
 */
#include "simplify/cost/fundamental.h"

/* A corner gets a third of the area (3.4.1). */
static void add_plane(fct_simplifier *s, uint32_t f, v3 normal, double area) {
    double q[POSITION_QUADRIC] = {0};
    quadric_add_plane(q, normal, point_position(s, s->triangles[3 * f]), area / 3);
    q[10] = area / 3;
    for (uint32_t k = 0; k < 3; ++k) {
        double *to = point_at(s, s->triangles[3 * f + k])->quadric;
        for (uint32_t i = 0; i < POSITION_QUADRIC; ++i) to[i] += q[i];
    }
}

static void add_plane_of_attributes(fct_simplifier *s, uint32_t f, double area) {
    uint32_t m = s->steering;
    double q[MAX_QUADRIC], x[3][3 + SIMPLIFY_MAX_CHANNELS];
    for (uint32_t k = 0; k < 3; ++k) {
        v3 p = point_position(s, s->triangles[3 * f + k]);
        x[k][0] = p.x, x[k][1] = p.y, x[k][2] = p.z;
        const double *a = s->attributes + (size_t)s->channel_count * s->corner_wedges[3 * f + k];
        for (uint32_t i = 0; i < m; ++i) x[k][3 + i] = a[i];
    }
    fct_quadric_of_plane(q, m, x);
    for (uint32_t k = 0; k < 3; ++k) {
        double *to = wedge_quadric(s, s->corner_wedges[3 * f + k]);
        for (uint32_t i = 0; i < s->quadric_size; ++i) to[i] += area / 3 * q[i];
    }
}

fct_result fct_simplify_quadrics(fct_simplifier *s) {
    s->quadric_size = quadric_size(s->steering);
    if (s->steering) {
        s->quadrics = fct_allocate_zero(s->env, s->wedge_count, s->quadric_size * sizeof *s->quadrics);
        if (!s->quadrics) return fct_fail_memory(s->env, "quadrics");
    }
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        if (corner_dead(s, 3 * f)) continue;
        v3 p = point_position(s, s->triangles[3 * f]);
        v3 cross = v3_cross(v3_sub(point_position(s, s->triangles[3 * f + 1]), p),
                            v3_sub(point_position(s, s->triangles[3 * f + 2]), p));
        double twice = v3_norm(cross);
        if (!(twice > 0)) continue;
        add_plane(s, f, v3_scale(cross, 1 / twice), .5 * twice);
        if (s->steering) add_plane_of_attributes(s, f, .5 * twice);
    }
    return FCT_OK;
}
