/* facetree/dual.h: the dual graph of a mesh (Garland 1999, section 8.2). A node is a triangle. An edge is a
 * pair of triangles that share a mesh edge, with the shared length.
 *
 * A mesh edge with k >= 3 faces connects them in a chain by face id, with k - 1 dual edges:
 *
 *     f0 ---- f1 ---- f2 ---- f3        each dual edge has half the length of the mesh edge
 *
 * A face inside the chain gives half of its side to either neighbour, so no perimeter of a union is negative.
 * The orientation of faces does not matter. Faces that share several mesh edges have one dual edge with the
 * sum. A side from a vertex to itself has length 0 and connects nothing. Two sides of one face on the same
 * mesh edge count as one place in the chain, with the length of both.
 */
#ifndef FACETREE_DUAL_H
#define FACETREE_DUAL_H

#include "facetree/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct fct_dual {
    uint32_t face_count;
    uint32_t edge_count;
    uint32_t *edges;            /* edge_count x 2, face ids a < b, sorted by (a, b), each pair once */
    float *lengths;             /* edge_count, shared length of the pair, in the unit of the mesh */
    float *perimeters;          /* face_count, sum of the three sides */
    uint32_t boundary_edges;    /* mesh edges with one face */
    uint32_t nonmanifold_edges; /* mesh edges with three or more faces */
} fct_dual;

/* O(F), plus O(v log v) per vertex of valence v. Parallel. Errors: MEMORY, CANCELLED. On failure *out is all
 * zero. */
FCT_API fct_result fct_dual_build(const fct_env *env, const fct_mesh *mesh, fct_dual *out);
FCT_API void fct_dual_release(const fct_env *env, fct_dual *dual);

/* Triangles in which vertices of equal position are one vertex. Files double vertices where normals, colours
 * or texture coordinates differ, or at every corner (a soup). The dual graph joins faces by vertices, so such
 * a mesh falls apart in it; with these triangles it does not. */
typedef struct fct_weld {
    uint32_t *triangles; /* face_count x 3; NULL if no vertex is replaced: those of the mesh are right */
    uint32_t joined;     /* vertices that another vertex replaces */
} fct_weld;

/* Only ends of open sides (sides that no other face has) are joined: each becomes the first of them with its
 * position. So closed bodies that touch stay apart. The mesh must be valid. O(V), plus a sort if several
 * vertices have one position. Errors: MEMORY, CANCELLED. On failure *out is all zero. */
FCT_API fct_result fct_weld_build(const fct_env *env, const fct_mesh *mesh, fct_weld *out);
FCT_API void fct_weld_release(const fct_env *env, fct_weld *weld);

/* Counts the closed bodies that are wound inwards: each side has two faces, in opposite directions and in
 * terms of welded vertices, and the volume is negative. A cavity, inside the bounds of a body that is wound
 * outwards, does not count (if that is one of the 64 largest). `faces` (face_count, or NULL) receives 1 for
 * the faces of these bodies, else 0. A closed room that is seen from inside counts too. Errors: MEMORY,
 * CANCELLED. */
FCT_API fct_result fct_inward_find(const fct_env *env, const fct_mesh *mesh, uint32_t *count, uint8_t *faces);
/* Turns these bodies: the last two corners of their faces change places, with texture coordinates, and
 * normals that then point inwards are negated. *count: the number of bodies. Errors: MEMORY, CANCELLED; the
 * mesh is then as it was. */
FCT_API fct_result fct_inward_flip(const fct_env *env, fct_mesh *mesh, uint32_t *count);

#ifdef __cplusplus
}
#endif
#endif
