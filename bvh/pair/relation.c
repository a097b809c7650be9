/* bvh/pair/relation.c: whether two bodies are apart, touch, or hold one another.
 *
 * If no faces meet, a connected part lies inside the other surface or outside as a whole, so one vertex of
 * each part decides.
 */
#include "bvh/near/sign/winding.h"
#include "bvh/pair/map.h"
#include "bvh/pair/pose.h"

/* Whether a part of `inner` lies inside `outer`. */
static bool holds_part(const fct_bvh *outer, const fct_bvh *inner, const fct_pose *inner_to_outer,
                       fct_visits *visits) {
    if (!outer->has_sign) return false;
    for (uint32_t i = 0; i < inner->part_count; ++i) {
        v3 p = v3_load(inner->view.positions + 3 * (size_t)inner->parts[i]);
        if (fct_winding_is_inside(outer, fct_pose_apply(inner_to_outer, p), visits)) return true;
    }
    return false;
}

fct_relation fct_bvh_relation(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, fct_pair_hint *hint,
                              fct_visits *visits) {
    fct_pair_map map;
    if (!fct_pair_map_set(a, b, pose, &map)) return FCT_APART;
    if (fct_bvh_overlap(a, b, pose, hint, visits)) return FCT_TOUCHING;
    /* A flat b holds nothing. */
    fct_pose identity = fct_pose_identity(), back = fct_pose_relate(&map.pose, &identity);
    if (fct_determinant(map.pose.rotation) != 0 && holds_part(b, a, &back, visits)) return FCT_A_INSIDE;
    return holds_part(a, b, &map.pose, visits) ? FCT_B_INSIDE : FCT_APART;
}
