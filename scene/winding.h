/* scene/winding.h: models that are wound inwards. */
#ifndef FCT_SCENE_WINDING_H
#define FCT_SCENE_WINDING_H

#include "base/env.h"
#include "facetree/mesh.h"

/* *out is the mesh with triangles of its own, in which closed bodies are wound outwards, and without normals
 * and texture coordinates. The caller releases only out->triangles. Errors: MEMORY, CANCELLED; then that is
 * NULL. */
fct_result fct_scene_turn(const fct_env *env, const fct_mesh *mesh, fct_mesh *out);

#endif
