/* simplify/topology/curve.h: sorts the input along a space-filling curve. Then neighbours are near in memory.
 */
#ifndef FCT_SIMPLIFY_CURVE_H
#define FCT_SIMPLIFY_CURVE_H

#include "base/env.h"
#include "facetree/mesh.h"

typedef struct fct_sorted {
    fct_mesh mesh;           /* borrows the material names */
    uint32_t *places;        /* per face of the input: its place in `mesh` */
    uint32_t *vertex_places; /* per vertex of the input */
    uint8_t *locks;          /* per vertex of `mesh`; NULL without locks */
} fct_sorted;

/* Sorts the vertices and faces of a valid mesh along the curve, and the locks of its vertices (NULL: none).
 * Errors: MEMORY, with nothing to release. */
fct_result fct_simplify_sort(const fct_env *env, const fct_mesh *mesh, const uint8_t *locks, fct_sorted *out);
void fct_simplify_release_sorted(const fct_env *env, fct_sorted *sorted);

#endif
