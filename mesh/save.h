/* mesh/save.h: what writers of files share. */
#ifndef FCT_MESH_SAVE_H
#define FCT_MESH_SAVE_H

#include "facetree/mesh.h"

/* *out: the light of the mesh that makes the colours for display (fct_mesh_save_def.display); NULL if the
 * mesh has no colours. Errors: DATA (the mesh does not have it). */
fct_result fct_choose_display(const fct_env *env, const char *path, const fct_mesh *mesh, unsigned display,
                              float **out);

#endif
