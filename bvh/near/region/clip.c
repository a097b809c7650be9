/* bvh/near/region/clip.c: see clip.h.
 *
 * A half-space adds at most one corner to a convex polygon. Corners that lie on a plane up to rounding count
 * as on it. So a plane that nearly repeats an earlier one does not cut its noise.
 */
#include "bvh/near/region/clip.h"

enum { CORNERS = 3 + FCT_BVH_PLANES + 1 };

/* Over the terms of a height. A clipped corner errs by less. */
#define ROUNDING 0x1p-48

static double measure_height(const fct_half_space *h, v3 p) {
    double height = v3_dot(h->n, p) + h->d;
    double terms = fabs(h->n.x * p.x) + fabs(h->n.y * p.y) + fabs(h->n.z * p.z) + fabs(h->d);
    return fabs(height) <= ROUNDING * terms ? 0 : height;
}

/* Clips `count` corners to *out and returns their number. */
static uint32_t clip_polygon(const v3 *corners, uint32_t count, const fct_half_space *h, v3 *out) {
    uint32_t kept = 0;
    v3 last = corners[count - 1];
    double last_height = measure_height(h, last);
    for (uint32_t i = 0; i < count && kept + 2 <= CORNERS; ++i) {
        v3 corner = corners[i];
        double height = measure_height(h, corner);
        /* The crossing, unless one of the ends lies on the plane: then that end is a corner already. */
        if ((height > 0 && last_height < 0) || (height < 0 && last_height > 0))
            out[kept++] = v3_mad(last, last_height / (last_height - height), v3_sub(corner, last));
        if (height >= 0) out[kept++] = corner;
        last = corner, last_height = height;
    }
    return kept;
}

bool fct_clip_touches(const v3 triangle[3], const fct_half_space *half_spaces, uint32_t planes) {
    v3 rooms[2][CORNERS] = {{triangle[0], triangle[1], triangle[2]}};
    uint32_t count = 3, from = 0;
    for (; planes && count; planes &= planes - 1, from = !from)
        count = clip_polygon(rooms[from], count, &half_spaces[__builtin_ctz(planes)], rooms[!from]);
    return count > 0;
}
