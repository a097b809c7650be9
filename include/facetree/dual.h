/* facetree/dual.h: the dual graph of a mesh (Garland 1999, section 8.2): a node per triangle, an edge per
 * pair of triangles that share a mesh edge, carrying the shared length.
 *
 * A mesh edge with k >= 3 faces connects them in a chain in order of face id (k - 1 dual edges). The border
 * of a face there is shared out between its connections, so that no perimeter of a union becomes negative:
 * each of the k - 1 carries half the edge's length. Faces of opposite orientation are neighbours. Faces that
 * share several mesh edges (duplicates) get one dual edge with the sum. Degenerate faces keep their sides; a
 * side from a vertex to itself has no length and connects nothing, and where two sides of one face lie on the
 * same edge they count as one place in the chain.
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
    uint32_t *edges;            /* edge_count x 2, face ids a < b, sorted by (a, b), no pair twice */
    float *lengths;             /* edge_count, border shared by the pair, in the mesh's unit */
    float *perimeters;          /* face_count, the sum of the face's sides */
    uint32_t boundary_edges;    /* mesh edges with one face */
    uint32_t nonmanifold_edges; /* mesh edges with three or more faces */
} fct_dual;

/* O(F), and O(v log v) at a vertex of valence v; parallel; same bits for every thread count. Errors: MEMORY,
 * CANCELLED. */
FCT_API fct_result fct_dual_build(const fct_env *env, const fct_mesh *mesh, fct_dual *out);
FCT_API void fct_dual_release(const fct_env *env, fct_dual *dual);

#ifdef __cplusplus
}
#endif
#endif
