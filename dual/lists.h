/* dual/lists.h: the dual graph as one list of neighbours per face, all in one array. */
#ifndef FCT_DUAL_LISTS_H
#define FCT_DUAL_LISTS_H

#include "base/env.h"
#include "base/variant.h"
#include "facetree/dual.h"

enum { FCT_LISTS_SLACK = 8 };

typedef struct fct_lists {
    uint32_t face_count, entry_count;
    uint32_t *starts,
        *counts; /* the entries of face f are [starts[f], starts[f] + counts[f]), each neighbour once */
    uint32_t *neighbors; /* entry_count, some of them unused; FCT_LISTS_SLACK more may be read */
    float *lengths;      /* entry_count, shared length */
    float *perimeters;   /* this and the counts: as in fct_dual */
    uint32_t boundary_edges, nonmanifold_edges;
} fct_lists;

/* Builds the dual graph. Each edge is in the lists of both faces. Lengths and perimeters are multiplied by
 * `scale`. Errors: MEMORY, CANCELLED. On failure *out is all zero. */
#define fct_lists_build FCT_KERNEL(fct_lists_build)
FCT_DECLARE_KERNEL(fct_result, fct_lists_build,
                   (const fct_env *env, const fct_mesh *mesh, double scale, fct_lists *out));
#define fct_lists_release FCT_KERNEL(fct_lists_release)
FCT_DECLARE_KERNEL(void, fct_lists_release, (const fct_env *env, fct_lists *lists));

#endif
