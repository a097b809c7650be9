/* bvh/pair/hint.h: the front of a search as a hint for the next pose. */
#ifndef FCT_BVH_HINT_H
#define FCT_BVH_HINT_H

#include "bvh/pair/map.h"

/* The boxes of a pair of a front: all children of the node that is opened, or a pair of leaves. */
#define FCT_FRONT_ALL     0xffu
#define FCT_FRONT_OPENS_A 0x100u

static inline bool fct_front_is_leaves(const fct_pair_map *map, const fct_front_pair *pair) {
    return fct_box_is_leaf(map->a, pair->box_a) && fct_box_is_leaf(map->b, pair->box_b);
}
/* A pair that is not known to be apart. */
static inline fct_front_pair fct_front_begin(const fct_pair_map *map, uint32_t box_a, uint32_t box_b) {
    fct_front_pair pair = {box_a, box_b, FCT_FRONT_ALL, -1};
    if (!fct_front_is_leaves(map, &pair) && fct_opens_a(map, box_a, box_b)) pair.lanes |= FCT_FRONT_OPENS_A;
    return pair;
}

/* Takes the hint to the pose of the map. Forgets the front if it belongs to other models or to the other kind
 * of search (near: of faces within a distance), or if b has come so far that reaches lose digits. */
void fct_hint_move(const fct_pair_map *map, fct_pair_hint *hint, bool near);

#endif
