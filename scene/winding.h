/* scene/winding.h: models that are wound inwards. */
#ifndef FCT_SCENE_WINDING_H
#define FCT_SCENE_WINDING_H

#include "base/env.h"
#include "facetree/mesh.h"

/* *out is the mesh with triangles, normals and texture coordinates of its own, in which closed bodies are
 * wound outwards. fct_scene_release_turned releases it, also after an error. Errors: MEMORY, CANCELLED. */
fct_result fct_scene_turn(const fct_env *env, const fct_mesh *mesh, fct_mesh *out);
void fct_scene_release_turned(const fct_env *env, fct_mesh *turned);

#endif
