/* bvh/pair/map.h: a pose as maps between the structures of two models.
 *
 * Boxes live in the scaled, centred space of their own model (model.h). A query places a box of one model in
 * the space of the other and tests it against eight boxes there. The centre is mapped in double, so that
 * errors are small beside the boxes also where one model is much larger. Float arithmetic errs by at most
 * `slack`.
 */
#ifndef FCT_BVH_MAP_H
#define FCT_BVH_MAP_H

#include "bvh/model.h"
#include "facetree/collide.h"

/* From the space of one model to that of the other: x -> factor turn x + shift. */
typedef struct fct_space_map {
    double turn[3][3];      /* orthonormal to `skew` */
    float turn_float[3][3]; /* the same, rounded */
    double factor, shift[3];
    double skew; /* a bound of | turn^T turn - 1 | */
    double blur; /* a bound of what double arithmetic errs, in the target's unit */
} fct_space_map;

typedef struct fct_pair_map {
    const fct_bvh *a, *b;
    fct_pose pose;
    fct_space_map to_a, to_b; /* of boxes of b into a, and of boxes of a into b */
} fct_pair_map;

/* Returns false if a query cannot be answered: no FCT_BVH_PAIRS, or a pose that is not finite, or too large
 * or too small for double arithmetic. */
bool fct_pair_map_set(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, fct_pair_map *out);

/* The corners of a face of a, and of a face of b in the coordinates of a: collide.h says how they are
 * rounded. */
void fct_pair_triangle_a(const fct_pair_map *map, uint32_t place, v3 p[3]);
void fct_pair_triangle_b(const fct_pair_map *map, uint32_t place, v3 p[3]);

/* A box of one model in the space of the other. */
typedef struct fct_placed_box {
    uint32_t box; /* its name; FCT_NONE before the first use */
    float center[3], half[3], axes[3][3];
    float slack;
    double exact_center[3];
} fct_placed_box;
/* Box `box` of `from`; does nothing if it is placed already. */
void fct_place_box(const fct_space_map *map, const fct_bvh *from, uint32_t box, fct_placed_box *out);

/* From the coordinates of a leaf to those of its box or of another leaf's: x -> turn (x - from) + shift. */
typedef struct fct_leaf_map {
    float turn[3][3], from[3], shift[3];
} fct_leaf_map;
/* Two leaves in the coordinates of a's box. */
typedef struct fct_leaf_maps {
    fct_leaf_map of_a, of_b;
    float half_a[3]; /* of a's box */
    float size;      /* the extent of both leaves together; at least, sum of coordinates */
    float slack;     /* float arithmetic moves a vertex by less */
} fct_leaf_maps;
void fct_leaf_maps_set(const fct_pair_map *map, uint32_t box_a, uint32_t box_b, fct_leaf_maps *out);

/* Names of boxes: the number of the node times 8, plus the slot. The root is box 0. */
static inline uint32_t fct_box_child(const fct_bvh *bvh, uint32_t box) {
    return bvh->pairs[box >> 3].child[box & 7];
}
/* The squared half diagonal. */
static inline float fct_box_size2(const fct_bvh *bvh, uint32_t box) {
    const fct_pair_node *n = &bvh->pairs[box >> 3];
    float x = n->half[0][box & 7], y = n->half[1][box & 7], z = n->half[2][box & 7];
    return x * x + y * y + z * z;
}

#endif
