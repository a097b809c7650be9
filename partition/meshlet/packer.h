/* partition/meshlet/packer.h: the state that the steps of making meshlets share. */
#ifndef FCT_PARTITION_PACKER_H
#define FCT_PARTITION_PACKER_H

#include "cluster/tree/node.h"
#include "facetree/partition.h"
#include "partition/meshlet/bounds.h"
#include "partition/sides.h"

/* Pieces of faces. Each piece lists its faces, its vertices, and for each vertex how many of its faces use
 * it. */
typedef struct fct_packer {
    const fct_tree *tree;
    const fct_tree_view *view; /* of the tree */
    fct_meshlet_def def;
    fct_sides sides;         /* by place */
    uint32_t *vertex_before; /* per corner: the previous face at its vertex, or FCT_NONE */
    float *reach;    /* per place: half the diagonal of the box of the largest subtree that fits a meshlet */
    uint32_t *home;  /* per place: equal numbers are near one another in the tree */
    uint32_t *owner; /* per place: its piece */
    uint32_t count;  /* pieces, with empty ones */
    uint32_t *faces; /* def.max_triangles places per piece */
    uint32_t *vertices;                    /* def.max_vertices tree vertices per piece */
    uint16_t *uses;                        /* per entry of vertices: faces of the piece that use it */
    uint16_t *face_counts, *vertex_counts; /* per piece; 0: empty */
} fct_packer;

/* Whether a face has the material of a piece. */
static inline bool fct_packer_material(const fct_packer *p, uint32_t face, uint32_t piece) {
    const uint32_t *materials = p->view->materials;
    return !materials || materials[face] == materials[p->faces[(size_t)piece * p->def.max_triangles]];
}

#endif
