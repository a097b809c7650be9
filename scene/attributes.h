/* scene/attributes.h: the data of a mesh that its tree does not hold, in the order of the tree. */
#ifndef FCT_SCENE_ATTRIBUTES_H
#define FCT_SCENE_ATTRIBUTES_H

#include "scene/scene.h"

/* Copies texture coordinates and normals of the mesh from which the model's tree was built, as fct_model
 * describes them; NULL where the mesh has none, or only zeros as normals. The caller releases the model, also
 * after an error. Errors: DATA (a damaged tree, or one of another mesh), MEMORY. */
fct_result fct_attributes_copy(const fct_env *env, const fct_mesh *mesh, fct_scene_model *model);
/* Replaces v by 1 - v. Files other than glTF count v from the bottom of the image, models from the top. */
void fct_attributes_count_from_top(fct_mesh *mesh);

#endif
