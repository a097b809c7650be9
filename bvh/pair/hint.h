/* bvh/pair/hint.h: the front of a search as a hint for the next pose. */
#ifndef FCT_BVH_HINT_H
#define FCT_BVH_HINT_H

#include "bvh/pair/map.h"

/* A pair that is not known to be apart. */
static inline fct_front_pair fct_front_begin(const fct_pair_map *map, uint32_t box_a, uint32_t box_b) {
    bool leaves = fct_box_is_leaf(map->a, box_a) && fct_box_is_leaf(map->b, box_b);
    uint32_t side = !leaves && fct_opens_a(map, box_a, box_b) ? FCT_FRONT_OPENS_A : 0;
    return (fct_front_pair){box_a, box_b, FCT_FRONT_ALL | side, -1};
}

/* Takes the hint to the pose of the map. Forgets the front if it belongs to other models or to the other kind of
 * search (near: of faces within a distance), or if b has come so far that reaches lose digits. */
void fct_hint_move(const fct_pair_map *map, fct_pair_hint *hint, bool near);

#endif
