/* bvh/bvh.h: the packed structure and what its files share.
 *
 * All geometry is scaled by a power of two so that the larger half extent of the model is in [1/2, 1):
 * models of any size meet the same arithmetic. Leaves are face clusters of at most 16 faces and 16 vertices;
 * above them stand nodes of eight children that hold either axis boxes or oriented boxes, the latter as
 * affine maps that take a box to [-1, 1]^3.
 */
#ifndef FCT_BVH_BVH_H
#define FCT_BVH_BVH_H

#include "base/env.h"
#include "base/math/vec.h"
#include "facetree/bvh.h"

/* Boxes are widened by more than float rounding can do, so that no triangle the triangle test would accept is
 * left out. With u = 2^-24, half extents below 1 and origins within FCT_REACH = 4 of the centre (farther ones
 * are moved along the ray first, see ray.h), vertices lie within D = 5 of an origin in each coordinate.
 * Moving a vertex to the origin and shearing it displaces it by at most 6 u D = 30 u across the ray; edge
 * functions then decide exactly. A slab's two distances err by 3 u D = 15 u each: 60 u in all, and the axis
 * boxes are widened by 64 u. A map adds the rounding of its rows, of the mapped origin (30 u of the box's
 * half extent in the model's unit) and direction (32 u over the length to the box) and of the divisions (26
 * u): about 120 u, and oriented boxes are widened by 256 u. */
#define FCT_AXIS_PAD      0x1p-18f
#define FCT_ORIENTED_PAD  0x1p-16f
#define FCT_REACH         4.0f
#define FCT_LEAF_FACES    16
#define FCT_LEAF_VERTICES 16
/* The top is at most this deep, see top.c; a traversal leaves at most 7 children waiting a level. */
#define FCT_TOP_DEPTH  80
#define FCT_STACK_SIZE (7 * FCT_TOP_DEPTH + 1)

/* A child: bit 31 for a leaf, bit 30 for an oriented node, the rest its place in units of 64 bytes. */
#define FCT_REF_LEAF     0x80000000u
#define FCT_REF_ORIENTED 0x40000000u
#define FCT_REF_UNIT     64

typedef struct fct_axis_node {
    float bounds[3][2][8]; /* axis, lower or upper, child */
    uint32_t child[8];
    uint32_t present; /* bit i: there is a child i */
    uint32_t unused[7];
} fct_axis_node;

typedef struct fct_oriented_node {
    float map[3][4][8]; /* row, (x y z 1), child: applied to positions relative to the centre */
    uint32_t child[8];
    uint32_t present; /* bit i: there is a child i */
    uint32_t unused[7];
} fct_oriented_node;

/* Followed by corner indices, 3 x 8 bytes for every octet of triangles, and coordinates, 3 rows of 8 floats
 * for every octet of vertices; filled up with vertex 0. */
typedef struct fct_leaf {
    uint32_t first;        /* place of the first triangle */
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

typedef struct fct_embree fct_embree;

struct fct_bvh {
    const fct_env *env;
    const fct_tree *tree;
    fct_tree_view view;
    fct_backend backend;
    fct_bounds bounds;        /* of the vertices that faces use, unscaled */
    double scale;             /* a power of two */
    float center[3];          /* of the scaled bounds */
    float lower[3], upper[3]; /* scaled bounds, widened a little */
    /* FCT_BACKEND_OBB */
    char *nodes, *leaves;
    size_t node_bytes, leaf_bytes;
    uint32_t root; /* a child reference */
    /* FCT_BACKEND_EMBREE */
    fct_embree *embree;
};

static inline const fct_leaf *fct_bvh_leaf(const fct_bvh *bvh, uint32_t ref) {
    return (const fct_leaf *)(const void *)(bvh->leaves + (size_t)(ref & ~FCT_REF_LEAF) * FCT_REF_UNIT);
}
static inline const void *fct_bvh_node(const fct_bvh *bvh, uint32_t ref) {
    return bvh->nodes + (size_t)(ref & ~FCT_REF_ORIENTED) * FCT_REF_UNIT;
}

/* Corner c of the face at a place, scaled; exact but for numbers below the smallest float. */
static inline void fct_bvh_position(const fct_bvh *bvh, uint32_t vertex, float out[3]) {
    const float *p = bvh->view.positions + 3 * (size_t)vertex;
    for (int i = 0; i < 3; ++i) out[i] = (float)(bvh->scale * (double)p[i]);
}
/* No area at all: such a face is not hit by rays. */
bool fct_bvh_degenerate(const fct_bvh *bvh, uint32_t place);

/* The clusters that become leaves, packed in order of place. */
typedef struct fct_leaf_list {
    uint32_t count;
    uint32_t *nodes;   /* count, ids in the cluster tree */
    uint32_t *offsets; /* count, units of 64 bytes */
    float *bounds;     /* count x 6, lower then upper, scaled */
} fct_leaf_list;
/* Fills bvh->leaves. Errors: MEMORY. */
fct_result fct_leaves_build(fct_bvh *bvh, fct_leaf_list *out);
void fct_leaf_list_release(const fct_env *env, fct_leaf_list *list);

/* A binary tree over the leaves by surface-area cost. */
typedef struct fct_top_node {
    float bounds[6];      /* scaled */
    uint32_t left, right; /* FCT_NONE in a leaf, which has end == begin + 1 */
    uint32_t begin, end;  /* range of `order` */
} fct_top_node;
typedef struct fct_top {
    uint32_t node_count;
    fct_top_node *nodes; /* node 0 is the root */
    uint32_t *order;     /* leaf numbers */
} fct_top;
fct_result fct_top_build(const fct_env *env, const fct_leaf_list *leaves, fct_top *out);
void fct_top_release(const fct_env *env, fct_top *top);

/* Collapses the top to nodes of eight, chooses their kind and packs them: bvh->nodes, bvh->root. */
fct_result fct_nodes_build(fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top);

/* Embree behind the same queries (embree.c). */
struct fct_prepared_ray;
fct_result fct_embree_create(fct_bvh *bvh);
void fct_embree_destroy(const fct_env *env, fct_embree *embree);
size_t fct_embree_bytes(const fct_embree *embree);

/* A hit in scaled space. */
typedef struct fct_raw_hit {
    float t, u, v;
    uint32_t place; /* FCT_NONE: none */
    v3 normal;
} fct_raw_hit;
bool fct_embree_closest(const fct_bvh *bvh, const struct fct_prepared_ray *ray, fct_raw_hit *hit);
bool fct_embree_any(const fct_bvh *bvh, const struct fct_prepared_ray *ray);
bool fct_traverse_closest(const fct_bvh *bvh, const struct fct_prepared_ray *ray, fct_raw_hit *hit,
                          fct_visits *visits);
bool fct_traverse_any(const fct_bvh *bvh, const struct fct_prepared_ray *ray, fct_visits *visits);

/* Nearest point of the triangle a b c to p: barycentrics of b and c; degenerate triangles are their sides. */
v3 fct_triangle_closest(v3 p, v3 a, v3 b, v3 c, double *u, double *v);
/* fct_bvh_closest_point for a point in double; distance2 is squared and unscaled. */
typedef struct fct_near {
    v3 point;
    double distance2, u, v;
    uint32_t place;
} fct_near;
bool fct_bvh_near(const fct_bvh *bvh, v3 point, double max_distance, fct_near *out, fct_visits *visits);
/* Among all faces within max_distance, that whose normal is closest to `normal`, then the nearest, then the
 * lowest id. Faces without area agree with nothing. */
bool fct_bvh_facing(const fct_bvh *bvh, v3 point, v3 normal, double max_distance, fct_near *out);

#endif
