/* radiosity/surface/cover.c: see cover.h. */
#include "radiosity/surface/cover.h"

#include <math.h>

#include "base/env.h"
#include "radiosity/sample.h"

/* Rays of which every one must find a back. The first usually does not. */
enum { RAYS = 8 };

bool fct_point_is_covered(const fct_scene *scene, const float point[3], const float normal[3], float offset,
                          uint64_t seed, float *nearest, uint64_t *rays) {
    const fct_scene_view view = fct_scene_get(scene);
    v3 n = v3_load(normal);
    fct_ray ray = {.t_min = 0, .t_max = INFINITY};
    v3_store(ray.origin, v3_mad(v3_load(point), offset, n));
    if (nearest) *nearest = INFINITY;
    for (uint32_t k = 0; k < RAYS; ++k) {
        double plane[2];
        fct_plane_point(k, seed, plane);
        v3 d = fct_cosine_direction(n, plane[0], plane[1]);
        v3_store(ray.direction, d);
        fct_scene_hit hit;
        ++*rays;
        if (!fct_scene_closest_hit(scene, &ray, &hit, NULL)) return false;
        if (nearest) *nearest = fminf(*nearest, hit.t);
        if (view.materials[view.instances[hit.instance].material].two_sided) return false;
        if (v3_dot(d, v3_load(hit.normal)) <= 0) return false;
    }
    return true;
}
