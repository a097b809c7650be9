/* bvh/near/faces.c: the public queries for the faces in a region. */
#include "bvh/near/region.h"

static bool is_finite(v3 a) {
    return fabs(a.x) < INFINITY && fabs(a.y) < INFINITY && fabs(a.z) < INFINITY;
}

uint32_t fct_bvh_faces_in_ball(const fct_bvh *bvh, const float center[3], float radius, uint32_t capacity,
                               uint32_t *faces, fct_visits *visits) {
    v3 p = v3_load(center);
    if (bvh->embree || !is_finite(p) || !(radius >= 0)) return 0;
    fct_face_list list = {faces, capacity, 0};
    fct_region_ball(bvh, p, (double)radius, &list, visits);
    fct_face_list_finish(&list);
    return list.count;
}

/* Multiplies a half-space by the power of two that brings its normal to about unit length. */
static fct_half_space balance_plane(const double plane[4]) {
    int power = -ilogb(fmax(fabs(plane[0]), fmax(fabs(plane[1]), fabs(plane[2]))));
    v3 n = {ldexp(plane[0], power), ldexp(plane[1], power), ldexp(plane[2], power)};
    return (fct_half_space){n, ldexp(plane[3], power)};
}

uint32_t fct_bvh_faces_in_planes(const fct_bvh *bvh, uint32_t count, const double *planes, uint32_t capacity,
                                 uint32_t *faces, fct_visits *visits) {
    fct_half_space half_spaces[FCT_BVH_PLANES];
    uint32_t kept = 0;
    if (bvh->embree || count > FCT_BVH_PLANES) return 0;
    for (uint32_t i = 0; i < count; ++i) {
        const double *plane = planes + 4 * (size_t)i;
        v3 n = {plane[0], plane[1], plane[2]};
        if (!is_finite(n) || !(fabs(plane[3]) < INFINITY)) return 0;
        /* Without a direction, it is all of space or nothing. */
        if (n.x == 0 && n.y == 0 && n.z == 0 && plane[3] >= 0) continue;
        if (n.x == 0 && n.y == 0 && n.z == 0) return 0;
        half_spaces[kept++] = balance_plane(plane);
    }
    fct_face_list list = {faces, capacity, 0};
    fct_region_planes(bvh, kept, half_spaces, &list, visits);
    fct_face_list_finish(&list);
    return list.count;
}
