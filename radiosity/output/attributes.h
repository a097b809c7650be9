/* radiosity/output/attributes.h: the light of the output in other quantities than radiosity. */
#ifndef FCT_RADIOSITY_ATTRIBUTES_H
#define FCT_RADIOSITY_ATTRIBUTES_H

#include "facetree/radiosity.h"

/* Errors: DATA (the method does not know an output of the def). */
fct_result fct_attributes_check(const fct_env *env, const fct_bake_def *def);

/* Gives the mesh the arrays `outputs` (FCT_MESH_ bits). `direct` and `indirect` are the parts of the
 * irradiance (vertex_count x 3); `direct` may be NULL, then `indirect` holds all of it. Errors: MEMORY. */
fct_result fct_attributes_add(const fct_env *env, unsigned outputs, const float *direct,
                              const float *indirect, fct_mesh *mesh);

#endif
