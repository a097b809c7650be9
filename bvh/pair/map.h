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
    double turn[3][3];         /* orthonormal to `skew` */
    double columns[3][4];      /* its columns */
    float columns_float[3][8]; /* the same, rounded */
    double factor, shift[4];
    float factor_float;
    double skew;                  /* a bound of | turn^T turn - 1 | */
    double blur;                  /* a bound of what double arithmetic errs, in the target's unit */
    double slack, slack_per_size; /* of a placed box: a constant, and per length of centre and half extents */
} fct_space_map;

typedef struct fct_pair_map {
    const fct_bvh *a, *b;
    fct_pose pose;
    fct_space_map to_a, to_b; /* of boxes of b into a, and of boxes of a into b */
    float volume_of_b;        /* volumes in b's scaled unit, times this, are in a's */
} fct_pair_map;

/* Returns false if a query cannot be answered: no FCT_BVH_PAIRS, or a pose that is not finite, or ratios of
 * lengths above 1e30. */
bool fct_pair_map_set(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, fct_pair_map *out);

/* The corners of a face of a, and of a face of b in the coordinates of a: collide.h says how they are
 * rounded. */
void fct_pair_triangle_a(const fct_pair_map *map, uint32_t place, v3 p[3]);
void fct_pair_triangle_b(const fct_pair_map *map, uint32_t place, v3 p[3]);

/* A box of one model in the space of the other. */
typedef struct fct_placed_box {
    uint32_t box;                         /* its name; FCT_NONE before the first use */
    float center[4], half[3], axes[3][8]; /* the first three of each row are used */
    float slack;
    double exact_center[4];
} fct_placed_box;

static inline float fct_round_up(double x) {
    return (float)(x * (1 + 0x1p-20)) + 1e-37f;
}

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
static inline bool fct_box_is_leaf(const fct_bvh *bvh, uint32_t box) {
    return fct_box_child(bvh, box) & FCT_REF_LEAF;
}
/* An eighth of the volume. */
static inline float fct_box_volume(const fct_bvh *bvh, uint32_t box) {
    const fct_pair_node *n = &bvh->pairs[box >> 3];
    return n->half[0][box & 7] * n->half[1][box & 7] * n->half[2][box & 7];
}
/* Whether a search opens box a rather than box b, which are not both leaves: the one of larger volume. (The
 * one of larger diagonal costs 4 to 8 % more nodes.) */
static inline bool fct_opens_a(const fct_pair_map *map, uint32_t box_a, uint32_t box_b) {
    if (fct_box_is_leaf(map->a, box_a) || fct_box_is_leaf(map->b, box_b))
        return fct_box_is_leaf(map->b, box_b);
    return fct_box_volume(map->a, box_a) >= map->volume_of_b * fct_box_volume(map->b, box_b);
}

#endif
