/* mesh/glb/features.h: reports the features of a glTF file that are left out. */
#ifndef FCT_MESH_GLB_FEATURES_H
#define FCT_MESH_GLB_FEATURES_H

#include "mesh/glb/document/glb.h"

/* Sends one warning with a count for each feature that the document uses and the readers leave out: lights,
 * textures, transparency, instancing, animations, skins, morph targets, points and lines, other extensions.
 */
void fct_glb_report_features(const fct_glb *glb);
/* The same for what is lost when the triangles of the document are replaced. */
void fct_glb_report_losses(const fct_glb *glb);

#endif
