/* facetree/dual.h: the dual graph of a mesh (Garland 1999, section 8.2): a node per triangle, an edge per
 * pair of triangles that share a mesh edge, carrying the shared length.
 *
 * An edge with k >= 3 faces connects consecutive faces around it in order of face id (k - 1 dual edges), each
 * with the full length counted once per connection but never more than either face's own border there, so
 * that no perimeter of a union becomes negative. Faces of opposite orientation are neighbours. Degenerate
 * faces keep their sides.
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
    uint32_t *edges;   /* edge_count x 2, face ids a < b, sorted by (a, b), no pair twice */
    float *lengths;    /* edge_count, border shared by the pair, in the mesh's unit */
    float *perimeters; /* face_count, the sum of the face's sides */
    uint32_t boundary_edges;
    uint32_t nonmanifold_edges;
} fct_dual;

/* O(F log F) by sorting sides; parallel; same bits for every thread count. Errors: MEMORY, CANCELLED. */
FCT_API fct_result fct_dual_build(const fct_env *env, const fct_mesh *mesh, fct_dual *out);
FCT_API void fct_dual_release(const fct_env *env, fct_dual *dual);

#ifdef __cplusplus
}
#endif
#endif
