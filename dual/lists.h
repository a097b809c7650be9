/* dual/lists.h: the dual graph as one list of neighbours a face, in one flat array. */
#ifndef FCT_DUAL_LISTS_H
#define FCT_DUAL_LISTS_H

#include "base/env.h"
#include "base/variant.h"
#include "facetree/dual.h"

enum { FCT_LISTS_SLACK = 8 };

typedef struct fct_lists {
    uint32_t face_count, entry_count;
    uint32_t *starts,
        *counts;         /* face f has entries starts[f] to starts[f] + counts[f] - 1, no neighbour twice */
    uint32_t *neighbors; /* entry_count, some of them unused, and FCT_LISTS_SLACK more that may be read */
    float *lengths;      /* of the shared border */
    float *perimeters;   /* as in fct_dual, and what follows too */
    uint32_t boundary_edges, nonmanifold_edges;
} fct_lists;

/* As fct_dual_build, each edge once at either end; lengths and perimeters times `scale`. Errors: MEMORY,
 * CANCELLED; then *out is all zero. */
#define fct_lists_build FCT_KERNEL(fct_lists_build)
FCT_DECLARE_KERNEL(fct_result, fct_lists_build,
                   (const fct_env *env, const fct_mesh *mesh, double scale, fct_lists *out));
#define fct_lists_release FCT_KERNEL(fct_lists_release)
FCT_DECLARE_KERNEL(void, fct_lists_release, (const fct_env *env, fct_lists *lists));

#endif
