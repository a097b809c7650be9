/* scene/rays.h: rays of light. */
#ifndef FCT_SCENE_RAYS_H
#define FCT_SCENE_RAYS_H

#include "facetree/scene.h"

/* As fct_scene_closest_hit. But where surfaces coincide within rounding, a side that emits light covers the
 * others, in any order of the instances: a lamp in the plane of a ceiling shines. */
bool fct_scene_light_hit(const fct_scene *scene, const fct_ray *ray, fct_scene_hit *hit, fct_visits *visits);

#endif
