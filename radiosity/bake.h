/* radiosity/bake.h: what the files of radiosity/ share about an fct_bake. */
#ifndef FCT_RADIOSITY_BAKE_H
#define FCT_RADIOSITY_BAKE_H

#include "radiosity/output/solution.h"

const fct_solution *fct_bake_solution(const fct_bake *bake);

/* Lights the sides of an instance, the brighter one first, each as a mesh with the origin of the scene.
 * back[k]: side k is the back. With def.keep there is one side, the surface of the model with the winding of
 * its front; else a back is turned over. Errors: MEMORY, CANCELLED; the sides are empty then. */
fct_result fct_bake_sides(fct_bake *bake, uint32_t instance, fct_mesh sides[2], bool back[2],
                          uint32_t *count);

#endif
