/* scene/coarse.h: scenes of several resolutions (FCT_BACKEND_MULTIRES).
 *
 * Large models get a coarse form (cluster/tree/coarse.h) of as many patches as their share of
 * FCT_SCENE_PATCHES allows, so a solution reads and keeps no more of a model of ten million faces than of one
 * of a hundred thousand. The coarse scene is the scene with these forms in place of the models. The ray
 * structures of the models themselves are built by fct_scene_complete.
 *
 * Models keep their own form if they are small; if they emit light or have textures or vertex colours,
 * because these need single faces; and under transforms that change shapes, because then sums over faces do
 * not follow from the records.
 */
#ifndef FCT_SCENE_COARSE_H
#define FCT_SCENE_COARSE_H

#include "scene/scene.h"

/* Makes the coarse forms. For fct_scene_commit, before ray structures. Errors: DATA, MEMORY, CANCELLED. */
fct_result fct_scene_coarsen_models(fct_scene *scene);
/* Sets scene->coarse, if there are coarse forms. For fct_scene_commit, at its end. Errors: MEMORY. */
fct_result fct_scene_share_coarse(fct_scene *scene);

/* The coarse scene, or the scene itself if none of its models has a coarse form. The scene owns it. Only ray
 * queries work on it; places in their results are those of the coarse trees. */
const fct_scene *fct_scene_coarse(const fct_scene *scene);
/* The coarse form of a model in a coarse scene; NULL for a model that keeps its own form, or if the scene is
 * not coarse. */
const fct_coarse *fct_scene_coarse_model(const fct_scene *scene, uint32_t model);

#endif
