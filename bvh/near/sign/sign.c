/* bvh/near/sign/sign.c: the public queries for winding numbers and signed distances.
 *
 * The sign only needs to know whether |w| is above .5. A ray tells this for a closed surface, unless the
 * point is very close to it. Otherwise the first sum uses moments of clusters that are close to the point. If
 * its result is not clear, a more precise sum follows, and then that of all faces.
 */
#include "base/parallel.h"
#include "bvh/near/points.h"
#include "bvh/near/sign/crossings.h"
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
enum { WORD_CHUNK = 4 }; /* of 64 points, per parallel task */

bool fct_winding_is_inside(const fct_bvh *bvh, v3 point, fct_visits *visits) {
    int64_t winding;
    if (fct_crossings_count(bvh, point, &winding, visits)) return winding != 0;
    double w = fabs(fct_winding_sum(bvh, point, SIGN_REACH, visits));
    if (fabs(w - .5) < SIGN_CLEAR) w = fabs(fct_winding_sum(bvh, point, NUMBER_REACH, visits));
    if (fabs(w - .5) < NUMBER_CLEAR) w = fabs(fct_winding_sum(bvh, point, INFINITY, visits));
    return w > .5;
}

static bool is_finite(v3 p) {
    return fabs(p.x) + fabs(p.y) + fabs(p.z) < INFINITY;
}

double fct_bvh_winding_number(const fct_bvh *bvh, const float point[3], fct_visits *visits) {
    v3 p = v3_load(point);
    if (!bvh->has_sign || !is_finite(p)) return NAN;
    return fct_winding_sum(bvh, p, NUMBER_REACH, visits);
}

bool fct_bvh_inside(const fct_bvh *bvh, const float point[3], fct_visits *visits) {
    v3 p = v3_load(point);
    return bvh->has_sign && is_finite(p) && fct_winding_is_inside(bvh, p, visits);
}

typedef struct inside_batch {
    const fct_bvh *bvh;
    size_t count;
    const float *points;
    uint64_t *inside;
} inside_batch;

/* Words [begin, end). */
static void find_inside(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const inside_batch *b = user;
    for (size_t word = begin; word < end; ++word) {
        uint64_t bits = 0;
        for (size_t i = 64 * word; i < b->count && i < 64 * word + 64; ++i)
            bits |= (uint64_t)fct_bvh_inside(b->bvh, b->points + 3 * i, NULL) << i % 64;
        b->inside[word] = bits;
    }
}

void fct_bvh_inside_points(const fct_bvh *bvh, size_t count, const float *points, uint64_t *inside) {
    inside_batch b = {bvh, count, points, inside};
    fct_parallel_for(bvh->env, count / 64 + (count % 64 > 0), WORD_CHUNK, find_inside, &b);
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
