/* mesh/glb/features.h: reports the features of a glTF file that are left out. */
#ifndef FCT_MESH_GLB_FEATURES_H
#define FCT_MESH_GLB_FEATURES_H

#include "mesh/glb/document/glb.h"

/* Sends one warning with a count for each feature that the document uses and the readers leave out: lights,
 * textures, transparency, instancing, animations, skins, morph targets, points and lines, other extensions.
 * textured: base colour textures are not left out. */
void fct_glb_report_features(const fct_glb *glb, bool textured);
/* Sends one warning with a count for each feature that fct_gltf_save leaves out: instancing, animations,
 * skins, morph targets, points and lines, and attributes that fct_mesh has no place for. Errors: those of
 * fct_glb_array_of. */
fct_result fct_glb_report_losses(fct_glb *glb);

#endif
