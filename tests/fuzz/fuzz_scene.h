/* tests/fuzz/fuzz_scene.h: what holds for every scene that was read. */
#ifndef FCT_TESTS_FUZZ_SCENE_H
#define FCT_TESTS_FUZZ_SCENE_H

#include <math.h>

#include "facetree/scene.h"
#include "fuzz/fuzz.h"

static inline void fuzz_use_scene(const fct_scene *scene) {
    fct_scene_view view = fct_scene_get(scene);
    for (uint32_t i = 0; i < view.instance_count; ++i) {
        const fct_instance *instance = view.instances + i;
        fuzz_require(instance->model < view.model_count && instance->material < view.material_count,
                     "ids are in range");
        for (int k = 0; k < 12; ++k)
            fuzz_require(isfinite(instance->to_world[k]) && isfinite(instance->to_model[k]),
                         "transforms are finite");
    }
    for (uint32_t i = 0; i < view.material_count; ++i)
        for (int k = 0; k < 3; ++k) {
            fuzz_require(view.materials[i].reflectance[k] >= 0 && view.materials[i].reflectance[k] < 1,
                         "reflectance");
            fuzz_require(view.materials[i].emission[k] >= 0, "emission");
        }
    const float *lower = view.bounds.lower, *upper = view.bounds.upper;
    fct_ray ray = {.t_max = INFINITY};
    for (int k = 0; k < 3; ++k) ray.origin[k] = upper[k] + 1, ray.direction[k] = lower[k] - upper[k] - 2;
    fct_scene_hit hit;
    if (fct_scene_closest_hit(scene, &ray, &hit, NULL))
        fuzz_require(hit.instance < view.instance_count && fct_scene_any_hit(scene, &ray, NULL),
                     "both kinds of ray agree");
}

#endif
