/* bvh/model.h: the packed structure of one model, and access to its parts.
 *
 * Every coordinate is multiplied by one power of two, so that the largest half extent of the model lies in
 * [1/2, 1). On each axis where the centre is then at least 2 FCT_REACH from zero, the centre is subtracted.
 * Both steps are exact for vertices, and for points within FCT_REACH of the centre: the difference of two
 * floats within a factor of two is a float (Sterbenz 1974). Tolerances below are absolute numbers in this
 * scaled space, so they hold for models of every size at every place.
 *
 *     node (8 children) -> node or leaf      nodes: axis boxes or oriented boxes, built over the leaves
 *     leaf -> up to 16 triangles             leaves: face clusters, their faces in the tree's order;
 *                                            other sets of faces if the model is dense, see leaves.c
 */
#ifndef FCT_BVH_MODEL_H
#define FCT_BVH_MODEL_H

#include "base/env.h"
#include "base/math/vec.h"
#include "facetree/bvh.h"

/* A box is wider than its vertices by more than float arithmetic can err, so a ray never misses the box of a
 * triangle that it hits. Error bounds, with u = 2^-24:
 *
 *   1. Half extents are below 1 and origins lie within FCT_REACH = 4 of the centre (ray.c moves farther
 *      origins along the ray). So a vertex lies at most D = 5 from the origin in each coordinate.
 *   2. The triangle test subtracts the origin from each vertex and shears it. Both move the vertex by at most
 *      6 u D = 30 u across the ray. The edge functions then decide exactly.
 *   3. Each of the two distances of an axis slab errs by 3 u D = 15 u. The sum of 2 and 3 is 60 u, so an axis
 *      box is wider by 64 u on each side.
 *   4. A map rounds its rows, the mapped origin (30 u of the half extent), the mapped direction (32 u over
 * the length to the box) and the divisions (26 u). The sum is about 120 u, so an oriented box is wider by 256
 * u on each side. */
#define FCT_AXIS_PAD     0x1p-18f
#define FCT_ORIENTED_PAD 0x1p-16f
#define FCT_REACH        4.0f

#define FCT_LEAF_FACES    16
#define FCT_LEAF_VERTICES 16

/* Depth limit of the binary top (top.c). A node has 8 children, so a traversal keeps at most 7 pending
 * children per level. */
#define FCT_TOP_DEPTH  80
#define FCT_STACK_SIZE (7 * FCT_TOP_DEPTH + 1)

/* Reference to a child: bit 31 marks a leaf, bit 30 an oriented node. The other bits are an offset into the
 * leaves or the nodes, in units of 64 bytes. */
#define FCT_REF_LEAF     0x80000000u
#define FCT_REF_ORIENTED 0x40000000u
#define FCT_REF_UNIT     64

typedef struct fct_axis_node {
    float bounds[3][2][8]; /* axis, lower or upper, child */
    uint32_t child[8];
    uint32_t present; /* bit i: child i exists */
    uint32_t unused[7];
} fct_axis_node;

/* Map i takes oriented box i to the cube [-1, 1]^3. */
typedef struct fct_oriented_node {
    float map[3][4][8]; /* row, (x y z 1), child; input: positions relative to fct_bvh.center */
    uint32_t child[8];
    uint32_t present; /* bit i: child i exists */
    uint32_t unused[7];
} fct_oriented_node;

/* Eight oriented boxes for queries on two models, relative to fct_bvh.center: the points
 * center + sum_k s_k half[k] axes[k], |s_k| <= 1. An empty slot has negative half extents. */
typedef struct fct_pair_node {
    float center[3][8];
    float half[3][8];
    float axes[3][3][8]; /* axis, coordinate, child */
    uint32_t child[8];   /* FCT_REF_LEAF and a leaf, a number of a node, or FCT_NONE */
} fct_pair_node;

/* A leaf in memory:
 *
 *     fct_leaf | corners: per 8 triangles, 3 rows of 8 bytes | vertices: rows x, y, z
 *                a0..a7 b0..b7 c0..c7 (a8..a15 ...)            8 or 16 floats per row
 *
 * Vertex 0 fills the unused end of each row. */
typedef struct fct_leaf {
    uint32_t first;        /* triangles in the leaves before it, see fct_leaf_place */
    uint16_t mask;         /* bit i: triangle i is not degenerate */
    uint8_t count;         /* triangles */
    uint8_t vertex_octets; /* 1 or 2 */
} fct_leaf;

static inline uint32_t fct_leaf_octets(const fct_leaf *leaf) {
    return (leaf->count + 7u) / 8;
}
/* Bytes [octet][corner][triangle]. */
static inline const uint8_t *fct_leaf_corners(const fct_leaf *leaf) {
    return (const uint8_t *)(leaf + 1);
}
/* Rows x, y, z of 8 * vertex_octets floats. */
static inline const float *fct_leaf_vertices(const fct_leaf *leaf) {
    return (const float *)(const void *)(fct_leaf_corners(leaf) + 24 * (size_t)fct_leaf_octets(leaf));
}
static inline size_t fct_leaf_bytes(uint32_t count, uint32_t vertex_octets) {
    size_t bytes = sizeof(fct_leaf) + 24 * ((count + 7) / 8) + 96 * (size_t)vertex_octets;
    return (bytes + FCT_REF_UNIT - 1) & ~(size_t)(FCT_REF_UNIT - 1);
}
/* The corners of triangle `number`, scaled. */
static inline void fct_leaf_triangle(const fct_leaf *leaf, uint32_t number, v3 out[3]) {
    const float *rows = fct_leaf_vertices(leaf);
    const uint8_t *corners = fct_leaf_corners(leaf) + 24 * (number / 8) + number % 8;
    uint32_t stride = 8u * leaf->vertex_octets;
    for (int c = 0; c < 3; ++c) {
        uint32_t i = corners[8 * c];
        out[c] = v3_make((double)rows[i], (double)rows[stride + i], (double)rows[2 * stride + i]);
    }
}

struct fct_bvh {
    const fct_env *env;
    const fct_tree *tree;
    fct_tree_view view;
    fct_backend backend;
    fct_bounds bounds;        /* of the vertices that faces use, unscaled */
    double scale;             /* a power of two */
    float offset[3];          /* a scaled position is scale p - offset */
    float center[3];          /* of the scaled bounds */
    float lower[3], upper[3]; /* scaled bounds plus a margin, see fct_bvh_measure */
    float *moved;             /* after a refit: view.positions; else NULL */
    double built_cost;        /* after a refit: fct_bvh_cost of the structure that was built; else 0 */
    /* FCT_BACKEND_OBB */
    char *nodes, *leaves;
    size_t node_bytes, leaf_bytes;
    uint32_t *places; /* of the triangles of all leaves, leaf by leaf; NULL if they are 0, 1, 2, ... */
    uint32_t root;    /* reference */
    struct fct_moment_node *moments; /* with FCT_BVH_SIGN; NULL if the model is one leaf */
    size_t moment_bytes;
    bool has_sign;  /* winding numbers can be asked for */
    bool is_closed; /* with has_sign: see near/sign/crossings.h */
    /* FCT_BVH_PAIRS */
    fct_pair_node *pairs; /* pair_count; node 0 has one child, the root */
    uint32_t pair_count;
    uint64_t pair_stamp; /* of the pairs, the positions and the triangles; not 0 */
    uint32_t *parts;     /* part_count: one tree vertex of each connected part */
    uint32_t part_count;
    /* FCT_BACKEND_EMBREE */
    struct fct_embree *embree;
};

static inline const fct_leaf *fct_bvh_leaf(const fct_bvh *bvh, uint32_t ref) {
    return (const fct_leaf *)(const void *)(bvh->leaves + (size_t)(ref & ~FCT_REF_LEAF) * FCT_REF_UNIT);
}
static inline const void *fct_bvh_node(const fct_bvh *bvh, uint32_t ref) {
    return bvh->nodes + (size_t)(ref & ~FCT_REF_ORIENTED) * FCT_REF_UNIT;
}
/* The place of triangle `number` of a leaf. */
static inline uint32_t fct_leaf_place(const fct_bvh *bvh, const fct_leaf *leaf, uint32_t number) {
    uint32_t i = leaf->first + number;
    return bvh->places ? bvh->places[i] : i;
}
/* The references of the eight children of a node; bit i of *present: child i exists. */
static inline const uint32_t *fct_bvh_children(const fct_bvh *bvh, uint32_t ref, uint32_t *present) {
    if (ref & FCT_REF_ORIENTED) {
        const fct_oriented_node *node = fct_bvh_node(bvh, ref);
        *present = node->present;
        return node->child;
    }
    const fct_axis_node *node = fct_bvh_node(bvh, ref);
    *present = node->present;
    return node->child;
}
/* Adds `more` to *visits, which may be NULL. */
static inline void fct_visits_add(fct_visits *visits, const fct_visits *more) {
    if (!visits) return;
    visits->nodes += more->nodes;
    visits->boxes += more->boxes;
    visits->triangles += more->triangles;
}

/* A point in scaled space, and back. */
static inline v3 fct_bvh_to_scaled(const fct_bvh *bvh, v3 point) {
    return v3_sub(v3_scale(point, bvh->scale), v3_load(bvh->offset));
}
static inline v3 fct_bvh_from_scaled(const fct_bvh *bvh, v3 point) {
    return v3_scale(v3_add(point, v3_load(bvh->offset)), 1 / bvh->scale);
}
/* The vertex's position, scaled: exact unless the result is a denormal float. */
static inline void fct_bvh_position(const fct_bvh *bvh, uint32_t vertex, float out[3]) {
    v3_store(out, fct_bvh_to_scaled(bvh, v3_load(bvh->view.positions + 3 * (size_t)vertex)));
}
/* Whether the face at a place has exactly zero area. Rays never hit such a face. */
bool fct_bvh_degenerate(const fct_bvh *bvh, uint32_t place);

/* Sets bounds, scale, center, lower and upper from bvh->view. */
void fct_bvh_measure(fct_bvh *bvh);

#endif
