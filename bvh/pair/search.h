/* bvh/pair/search.h: the searches through two trees. Kernels: overlap.c and distance.c. */
#ifndef FCT_BVH_SEARCH_H
#define FCT_BVH_SEARCH_H

#include "base/variant.h"
#include "bvh/pair/map.h"

/* Each step replaces an entry by at most eight, and goes down one level in one of the trees. Node 0 is one
 * more. */
#define FCT_PAIR_STACK (7 * 2 * (FCT_TOP_DEPTH + 1) + 1)

/* The pairs that meet, up to `limit`; writes the first `capacity` and returns their number. */
#define fct_overlap_search FCT_KERNEL(fct_overlap_search)
FCT_DECLARE_KERNEL(size_t, fct_overlap_search,
                   (const fct_pair_map *map, size_t limit, size_t capacity, fct_face_pair *pairs,
                    fct_visits *visits));

/* Whether any faces are within `distance`, or meet if that is negative: looks at the pairs of the front that
 * may not be apart by more, and updates the front. If so, hint->pair receives such a pair. The hint is at the
 * pose of the map. */
#define fct_front_search FCT_KERNEL(fct_front_search)
FCT_DECLARE_KERNEL(bool, fct_front_search,
                   (const fct_pair_map *map, fct_pair_hint *hint, double distance, fct_visits *visits));

/* The pairs of one model with itself that meet: pairs of faces without a common corner, each once. `map` is
 * the identity. */
#define fct_self_search FCT_KERNEL(fct_self_search)
FCT_DECLARE_KERNEL(size_t, fct_self_search,
                   (const fct_pair_map *map, size_t limit, size_t capacity, fct_face_pair *pairs,
                    fct_visits *visits));

typedef struct fct_near_pair {
    double distance2; /* unscaled, in a's unit */
    v3 point_a, point_b;
    uint32_t place_a, place_b;
} fct_near_pair;

/* The nearest faces. *best is a pair already known, or has places FCT_NONE and the square of the largest
 * distance that counts; a nearer pair replaces it. The result may exceed the least distance d by relative d +
 * absolute. Stops at once at a pair within `enough`. */
#define fct_distance_search FCT_KERNEL(fct_distance_search)
FCT_DECLARE_KERNEL(void, fct_distance_search,
                   (const fct_pair_map *map, double relative, double absolute, double enough,
                    fct_near_pair *best, fct_visits *visits));

#endif
