/* simplify/view/deviation.h: what a mesh lacks if steps are not done.
 *
 * Each vertex of the finest level is a sample, and lies on a face: at first on one that has it as a corner.
 * When a contraction changes faces, their samples go to the nearest of the changed faces. So the samples of a
 * face depend only on the splits around it, and each is as far from the faces of any cut as one of the
 * contractions measured it. (As the deviations of Hoppe, "View-Dependent Refinement of Progressive Meshes",
 * SIGGRAPH 1997, section 4.2, but as scalars.)
 */
#ifndef FCT_SIMPLIFY_DEVIATION_H
#define FCT_SIMPLIFY_DEVIATION_H

#include "simplify/view/hierarchy.h"
#include "simplify/view/walk.h"

typedef struct fct_deviation fct_deviation;

/* Samples of the finest level, where the walk is. It fills in the bounds and turns of h, which must outlive
 * it. Errors: MEMORY. */
fct_result fct_deviation_begin(fct_walk *w, fct_hierarchy *h, fct_deviation **out);
/* Walks one step back. Cost: samples of the ring, times its faces. Errors: MEMORY. */
fct_result fct_deviation_contract(fct_deviation *d);
/* NULL is allowed. */
void fct_deviation_end(fct_deviation *d);

#endif
