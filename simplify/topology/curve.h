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
    /* The last vertices of `mesh` were split from others (pinch.h): per such vertex that other one, in
     * ascending order. */
    uint32_t *copies;
    uint32_t copy_count;
} fct_sorted;

/* Sorts the vertices and faces of a valid mesh along the curve, and the locks of its vertices (NULL: none).
 * Errors: MEMORY, with nothing to release. */
fct_result fct_simplify_sort(const fct_env *env, const fct_mesh *mesh, const uint8_t *locks, fct_sorted *out);
void fct_simplify_release_sorted(const fct_env *env, fct_sorted *sorted);
/* The number of vertices of the input. */
static inline uint32_t sorted_inputs(const fct_sorted *sorted) {
    return sorted->mesh.vertex_count - sorted->copy_count;
}

#endif
