/* partition/meshlet/meshlet.h: what the steps of making meshlets share. */
#ifndef FCT_CLUSTER_MESHLET_H
#define FCT_CLUSTER_MESHLET_H

#include "cluster/tree/node.h"
#include "facetree/partition.h"
#include "partition/sides.h"

enum { FCT_MESHLET_VERTICES = 256, FCT_MESHLET_TRIANGLES = 512 }; /* the largest limits */

/* Faces in pieces: each piece lists its faces and the vertices they use with how many faces use each. */
typedef struct fct_packer {
    const fct_tree *tree;
    const fct_tree_view *view; /* of the tree */
    fct_meshlet_def def;
    fct_sides sides;         /* by place */
    uint32_t *vertex_before; /* per corner: place of the face before its own at its vertex, or FCT_NONE */
    float *reach;            /* by place: half the diagonal of the box of the subtree that would fit here */
    uint32_t *home;          /* by place: those with the same number are near one another in the tree */
    uint32_t *owner;         /* by place: its piece */
    uint32_t count;          /* of pieces, empty ones too */
    uint32_t *faces;         /* def.max_triangles places a piece */
    uint32_t *vertices;      /* def.max_vertices a piece, the tree's ids */
    uint16_t *uses;          /* beside vertices: faces of the piece */
    uint16_t *face_counts, *vertex_counts; /* by piece; 0: nothing is left of it */
} fct_packer;

/* Gives a face to a piece that has room for it. */
void fct_packer_add(fct_packer *packer, uint32_t piece, uint32_t face);

static inline bool fct_packer_material(const fct_packer *p, uint32_t face, uint32_t piece) {
    const uint32_t *materials = p->view->materials;
    return !materials || materials[face] == materials[p->faces[(size_t)piece * p->def.max_triangles]];
}

/* Puts every face into a piece: owner and count. The faces between two of the `bounds` (bound_count of them,
 * ascending places from 0 to the end) stay among themselves. Errors: MEMORY, CANCELLED. */
fct_result fct_meshlets_grow(const fct_env *env, fct_packer *packer, const uint32_t *bounds,
                             uint32_t bound_count);

/* Moves faces between pieces until fewer and fuller ones are left. Errors: MEMORY, CANCELLED. */
fct_result fct_meshlets_pack(const fct_env *env, fct_packer *packer);

/* Sphere, cone and boxes of the triangles that the local indices name. positions: vertex_count x 3. */
void fct_meshlet_bound(const float *positions, uint32_t vertex_count, const uint8_t *triangles,
                       uint32_t triangle_count, fct_meshlet_bounds *out);

#endif
