/* bvh/near/clip.c: see clip.h. A half-space adds at most one corner to a convex polygon. */
#include "bvh/near/clip.h"

enum { CORNERS = 3 + FCT_BVH_PLANES };

static double measure_height(const fct_half_space *h, v3 p) {
    return v3_dot(h->n, p) + h->d;
}

/* Clips `count` corners to *out and returns their number. */
static uint32_t clip_polygon(const v3 *corners, uint32_t count, const fct_half_space *h, v3 *out) {
    uint32_t kept = 0;
    v3 last = corners[count - 1];
    double last_height = measure_height(h, last);
    for (uint32_t i = 0; i < count; ++i) {
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
    v3 rooms[2][CORNERS + 1] = {{triangle[0], triangle[1], triangle[2]}};
    uint32_t count = 3, from = 0;
    for (; planes && count; planes &= planes - 1, from = !from)
        count = clip_polygon(rooms[from], count, &half_spaces[__builtin_ctz(planes)], rooms[!from]);
    return count > 0;
}
