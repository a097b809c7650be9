/* simplify/levels.h: runs a simplifier: its contractions, the refit and the output of each level. */
#ifndef FCT_SIMPLIFY_LEVELS_H
#define FCT_SIMPLIFY_LEVELS_H

#include "facetree/progressive.h"
#include "simplify/state.h"

/* The results that one run makes. */
typedef struct fct_wanted {
    const uint32_t *target_faces;
    uint32_t count;
    fct_mesh *out;
    fct_simplify_stats *stats;     /* may be NULL */
    fct_progressive **progressive; /* NULL: none; only with one result */
} fct_wanted;

/* Makes the results. Each level begins where the contractions of the level before ended, without its refit. s
 * is new; its options receive the targets. start: the stats so far. Errors: MEMORY, CANCELLED; results of
 * earlier levels then remain: release them. */
fct_result fct_simplify_run(fct_simplifier *s, const fct_wanted *w, const fct_simplify_stats *start);
/* Writes the mesh of a handle, with its refit, which is then undone. stats: NULL, or receives the errors of
 * the result. On failure *out may be filled in part. Errors: MEMORY, CANCELLED. */
fct_result fct_simplify_write(fct_simplifier *s, fct_mesh *out, fct_simplify_stats *stats);

#endif
