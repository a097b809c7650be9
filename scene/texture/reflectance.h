/* scene/texture/reflectance.h: means of the reflectance of painted surfaces. */
#ifndef FCT_SCENE_REFLECTANCE_H
#define FCT_SCENE_REFLECTANCE_H

#include "scene/scene.h"

/* The mean reflectance over a triangle inside the face at `place` of a painted instance. `corners` are its
 * barycentrics (u, v). It takes at most `most_samples` samples, at least 4. */
void fct_reflectance_of_triangle(const fct_scene *scene, uint32_t instance, uint32_t place,
                                 const double corners[3][2], uint32_t most_samples, double out[3]);
/* The most samples per face of a model, so that all faces together take a few seconds at most. */
uint32_t fct_reflectance_samples(uint32_t face_count);
/* The mean reflectance of each node of the tree of a painted instance: (node_count + face_count) x 3. Means
 * of faces are weighted by their areas in the model. The caller releases *out. Errors: MEMORY, CANCELLED. */
fct_result fct_reflectance_of_nodes(const fct_env *env, const fct_scene *scene, uint32_t instance,
                                    float **out);

#endif
