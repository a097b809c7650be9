/* radiosity/bake.h: what the files of radiosity/ share about an fct_bake. */
#ifndef FCT_RADIOSITY_BAKE_H
#define FCT_RADIOSITY_BAKE_H

#include "radiosity/output/solution.h"

const fct_solution *fct_bake_solution(const fct_bake *bake);

/* The instances [*first, *first + *count) of an object. */
void fct_bake_parts(const fct_scene_view *view, uint32_t object, uint32_t *first, uint32_t *count);
/* Joins the lit meshes of `count` parts, if `result` is OK, and releases them and their array. */
fct_result fct_bake_join(const fct_env *env, fct_mesh *parts, uint32_t count, fct_result result,
                         fct_mesh *out);
/* Releases the arrays that lead to the mesh as it was added. */
void fct_bake_drop_sources(const fct_env *env, fct_mesh *mesh);
/* Releases the normals unless they are an output. */
void fct_bake_drop_normals(const fct_solution *s, fct_mesh *mesh);

/* fct_bake_object, with normals in any case. */
fct_result fct_bake_lit_object(fct_bake *bake, uint32_t object, fct_mesh *out);

/* Lights the sides of an instance, the brighter one first, each as a mesh with the origin of the scene.
 * back[k]: side k is the back. With def.keep there is one side, the surface of the model with the winding of
 * its front; else a back is turned over. Errors: MEMORY, CANCELLED; the sides are empty then. */
fct_result fct_bake_sides(fct_bake *bake, uint32_t instance, fct_mesh sides[2], bool back[2],
                          uint32_t *count);

#endif
