/* bvh/near/sign/sign.c: the public queries for winding numbers and signed distances.
 *
 * The sign only needs to know whether |w| is above .5. So the first sum uses moments of clusters that are
 * close to the point. If its result is not clear, a more precise sum follows, and then that of all faces.
 */
#include "bvh/near/points.h"
#include "bvh/near/sign/winding.h"

/* The reach of fct_bvh_winding_number. The greatest errors measured are 2e-4 on scans, and 5e-4 on a sphere
 * whose vertices are moved by up to .4 of its radius; with 2.5 they are 7e-4 and 1.6e-3. */
#define NUMBER_REACH 3.5f
/* The first reach for a sign, and how far from .5 its sum must be. The error is at most .01 on scans. Flat
 * discs that surround the point, all at this reach, err by 12 % of their angles, so by .12 together. */
#define SIGN_REACH 1.5f
#define SIGN_CLEAR .15
/* The same for a sum with NUMBER_REACH, where such discs err by .004. */
#define NUMBER_CLEAR .01

bool fct_winding_is_inside(const fct_bvh *bvh, v3 point, fct_visits *visits) {
    double w = fabs(fct_winding_sum(bvh, point, SIGN_REACH, visits));
    if (fabs(w - .5) < SIGN_CLEAR) w = fabs(fct_winding_sum(bvh, point, NUMBER_REACH, visits));
    if (fabs(w - .5) < NUMBER_CLEAR) w = fabs(fct_winding_sum(bvh, point, INFINITY, visits));
    return w > .5;
}

double fct_bvh_winding_number(const fct_bvh *bvh, const float point[3], fct_visits *visits) {
    v3 p = v3_load(point);
    if (!bvh->has_sign || !(fabs(p.x) + fabs(p.y) + fabs(p.z) < INFINITY)) return NAN;
    return fct_winding_sum(bvh, p, NUMBER_REACH, visits);
}

static void set_sign(const fct_bvh *bvh, const float point[3], fct_closest *out, fct_visits *visits) {
    if (out->distance > 0 && fct_winding_is_inside(bvh, v3_load(point), visits))
        out->distance = -out->distance;
}

bool fct_bvh_signed_distance(const fct_bvh *bvh, const float point[3], float max_distance, fct_closest *out,
                             fct_visits *visits) {
    *out = (fct_closest){.distance = INFINITY, .face = FCT_NONE};
    if (!bvh->has_sign || !fct_bvh_closest_point(bvh, point, max_distance, out, visits)) return false;
    set_sign(bvh, point, out, visits);
    return true;
}

void fct_bvh_signed_distances(const fct_bvh *bvh, size_t count, const float *points, float max_distance,
                              fct_closest *out) {
    /* No face is within a negative distance. */
    fct_ask_points(bvh, count, points, bvh->has_sign ? max_distance : -1, out, set_sign);
}
